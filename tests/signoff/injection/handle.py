"""The plant beside the board: a handle that a hand pushes, exact between steps, and the wires of its encoder."""

from collections.abc import Callable

from hardwall.model.stamped import room_for
from hardwall.sim.world.advance import Interval, Moment, advance
from hardwall.sim.world.encoder import Encoder, level, locate
from hardwall.sim.world.rigid import Handle, Motion, Rigid, span

from .scene import CLOCK_HZ, MARK, MASS_KG, PUSH_N, SPEC, START, STEP_CLOCKS, VISCOUS_N_S_PER_M

ENCODER = Encoder(SPEC.count_m, float(CLOCK_HZ))
PLANT = Rigid(Handle(MASS_KG, VISCOUS_N_S_PER_M), None)
INTERVAL = Interval(span(PLANT.handle, STEP_CLOCKS / CLOCK_HZ), 0, STEP_CLOCKS)
EDGES_MAX = STEP_CLOCKS
Wires = dict[str, int]


def wires(number: int) -> Wires:
    """Return the levels of all wires of a sound encoder in a cell; the index is a count wide."""
    a, b = level(number) & 1, level(number) >> 1
    return {
        "encoder_a": a,
        "encoder_b": b,
        "encoder_z": int(number == MARK),
        "encoder_a_n": 1 - a,
        "encoder_b_n": 1 - b,
    }


def sound(levels: Wires) -> Wires:
    """Return the levels as they are: the fault of a sound encoder."""
    return levels


class Grasped:
    """The handle and its encoder, step by step.

    Attributes:
        push_n: the force of the hand.
        held: the count to which the hand moves the handle, whatever the drive; None: the hand pushes, and the handle
            moves freely.
        pace: the most counts in a step with which the hand does so.
        slipped: counts by which the scale has slipped on the handle.
        fault: what becomes of the levels of the encoder's wires on the way.
    """

    def __init__(self):
        self.push_n, self.held, self.pace, self.slipped = PUSH_N, START, 1, 0
        self.fault: Callable[[Wires], Wires] = sound
        self._moment = Moment(self._middle(START), locate(ENCODER, (START + 0.5) * SPEC.count_m), 0)
        self._edges = room_for(EDGES_MAX)

    @staticmethod
    def _middle(number: int) -> Motion:
        return Motion((number + 0.5) * SPEC.count_m, 0.0)

    @property
    def number(self) -> int:
        """The count of the handle."""
        return int(self._moment.cell.number)

    @property
    def speed_m_per_s(self) -> float:
        return float(self._moment.motion.velocity_m_per_s)

    def levels(self, number: int) -> Wires:
        """Return the levels of the wires, as the board sees them, with the handle at a count."""
        return self.fault(wires(number + self.slipped))

    def step(self, drive_n: float) -> list[tuple[int, int]]:
        """Advance by a step under a drive; return the clocks (1 to the last of the step) and counts of its edges."""
        before = self.number
        if self.held is not None:
            return self._held_step(before)
        moment = advance(PLANT, ENCODER, self._moment, self.push_n + drive_n, INTERVAL, self._edges)
        if moment.n_edges < 0:
            raise OverflowError("the handle has more edges in a step than clocks")
        self._moment = moment._replace(n_edges=0)
        return self._numbered(before, moment.n_edges)

    def _held_step(self, before: int) -> list[tuple[int, int]]:
        """Move towards the held count by edges at equal distances."""
        way = min(max(self.held - before, -self.pace), self.pace)
        number, side = before + way, 1 if way > 0 else -1
        self._moment = Moment(self._middle(number), locate(ENCODER, (number + 0.5) * SPEC.count_m), 0)
        return [(1 + k * STEP_CLOCKS // abs(way), before + side * (k + 1)) for k in range(abs(way))]

    def _numbered(self, before: int, count: int) -> list[tuple[int, int]]:
        """Return the edges of a step with the counts that they lead to, by the levels of their pins."""
        edges, number = [], before
        for clock, after in zip(self._edges.clocks[:count], self._edges.levels[:count], strict=True):
            number += 1 if level(number + 1) == after else -1
            edges.append((int(clock), number))
        return edges
