"""A virtual board: the Verilated `board` with the scene's plant beside it, in simulated time.

The compiled loop closes it like an axis: the handle makes edges, and the board takes them through its pins. The
amplifier's mean of a sample is the force on the handle during the next one. What is behind the board's serial line are
bytes. The wall, and whether there is a drive at all, is for a host to say.
"""

from dataclasses import dataclass

import numpy as np

from ...model.stamped import room_for
from ..loop import loop
from ..loop.values import EDGE_CAPACITY, Memory
from ..rtl.board_library import BoardHardware
from ..scene.build import start_of, world_of
from ..scene.errors import SceneError
from ..scene.schema import Scene
from ..world.encoder import level, numbers_from
from ..world.lines import waiting

TURN_M = 4e-3
"""The distance of two pulses of the encoder's index."""
HOLD_PER_S = 30.0
"""How fast a hand brings the handle to where it holds it: the rate of a critically damped spring."""
GRASP_S = 1e-3
"""The time in which the hand's force is constant, s; much shorter than 1 / `HOLD_PER_S`."""


@dataclass
class Hand:
    """The hand: it holds the handle somewhere, or pushes it, or both.

    Attributes:
        held_m: where it holds the handle; None: it does not.
        push_n: its steady force, positive into the wall.
    """

    held_m: float | None
    push_n: float = 0.0

    def force_n(self, mass_kg: float, position_m: float, velocity_m_per_s: float) -> float:
        """Return the hand's force on a handle of a mass."""
        if self.held_m is None:
            return self.push_n
        spring_n = mass_kg * HOLD_PER_S**2 * (self.held_m - position_m)
        return self.push_n + spring_n - 2 * mass_kg * HOLD_PER_S * velocity_m_per_s


@dataclass(frozen=True)
class Handle:
    """The handle now: its position, velocity and the force of the amplifier on it."""

    time_s: float
    position_m: float
    velocity_m_per_s: float
    force_n: float


class VirtualBoard:
    """A board and its plant; a context manager that frees it.

    Args:
        scene: the scene; its wall and gains are the host's to write.
        baud: the rate of the serial line; None for the board's own.
        family: the family of FPGAs whose netlist is the board, one of `FAMILIES`; None for the board's Verilog.

    Attributes:
        hardware: the board's wires and loops.
        hand: what the hand does; at first it holds the handle where the scene starts.
        reversed: whether the motor's wires are swapped.
        positions_m: where the handle was at the strobes of the last `run`.

    Raises:
        SceneError: if the scene has an `[output]`: a board's output is its drive stage.
        BuildError: if the hardware cannot be built.
        SynthesisError: if its netlist cannot be made.
    """

    def __init__(self, scene: Scene, baud: int | None = None, family: str | None = None):
        if scene.output is not None:
            raise SceneError(f"{scene.name}: output must be absent, because the drive stage of the board is its output")
        # The board's own stage makes the steps of its force.
        self.scene, self._world = scene, world_of(scene)._replace(converter=None)
        self._progress = start_of(scene, self._world)
        turn_counts = max(round(TURN_M / scene.encoder.count_m), 4)
        self.hardware = BoardHardware(scene.spec, self._progress.moment.cell.number, turn_counts, baud, family)
        self.hand, self.reversed = Hand(scene.protocol.start_m), False
        self._edges, self._push_n = room_for(EDGE_CAPACITY), 0.0
        self._cell, self.positions_m = self._progress.moment.cell, np.zeros(0)
        self._number = self._cell.number
        self._waiting = waiting(self._world.encoder.lines, int(level(self._number)), self._edges)

    def __enter__(self) -> "VirtualBoard":
        self.hardware.__enter__()
        self._state = self.hardware.start
        return self

    def __exit__(self, *error: object) -> None:
        self.hardware.__exit__(*error)

    def run(self) -> bool:
        """Let `GRASP_S` pass, or a sample; return whether the encoder could follow the handle."""
        samples = max(round(self.scene.spec.sample_hz * GRASP_S), 1)
        motion, self._cell = self._progress.moment.motion, self._progress.moment.cell
        room = np.zeros(samples), np.zeros(samples, np.int64)
        self._push_n = self.hand.force_n(self.scene.handle.mass_kg, motion[0], motion[1])
        given_n = -self.hardware.given_n if self.reversed else self.hardware.given_n
        world = self._world._replace(push_n=self._push_n, force_lsb_n=given_n)
        memory = Memory(self._edges, None, None, None, *room, self._waiting)
        until = self._progress.sample + samples
        controller = self.hardware.controller
        self._state, self._progress = loop.run(world, controller, self._state, self._progress, memory, until)
        self.positions_m = memory.positions
        return self._progress.sample == until

    @property
    def counts(self) -> np.ndarray:
        """The counts of the encoder at the strobes of the last `run`; the board has each a few clocks later.

        They are the counts of its scale; effects of its lines on edges reach only the board.
        """
        return numbers_from(self._world.encoder, self._cell, self.positions_m) - self._number

    @property
    def handle(self) -> Handle:
        """The handle now."""
        motion, rate = self._progress.moment.motion, self.scene.spec.sample_hz
        return Handle(self._progress.sample / rate, motion[0], motion[1], self._progress.force_n - self._push_n)
