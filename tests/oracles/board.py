"""The board as its models say it is, clock for clock."""

import dataclasses

import numpy as np
from amaranth.hdl import Cat, Module, Shape
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from hardwall.hdl.axis.board import Board
from hardwall.hdl.axis.supervised import LOOPS, SHOWN
from hardwall.hdl.board.lead_out import lead_out
from hardwall.hdl.link.link import Link
from hardwall.model.axis import capture
from hardwall.model.axis.capture import RECORD_REGISTERS
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervisor import ARMED
from hardwall.model.drive import dac, pdm, pwm
from hardwall.model.drive.stage import Amplifier, Stage
from hardwall.model.register import VALUE_BITS
from hardwall.testing.packing import Packing
from stimuli.specs import spec

from .axis import AxisTwin
from .on_a_line import BAUD, CLOCK_HZ
from .supervised import Follower

IDLE = (*LOOPS, "encoder_a_n", "encoder_b_n")
"""Pins that are high while the handle rests at its origin and all is well."""
SEEN = (
    "sampled", "actuated", "stepped", "edge_kind", "edge_down", "indexed", "estimated", "saturated", "strobe_busy",
    "illegal", "overspeed", "wrapped", "count", "velocity", "drive", "stamp", "index_latched", *SHOWN, "referenced",
    "a_channel_idle", "drive_inverted",
)  # fmt: skip
"""Ports of the axis inside that the models are fed with or held to."""
RUNNING = "alive", "outputs_enable"
"""Pins beside those of the drive."""
AT_PIN = "pin_"
"""How the name of a pin begins among the ports inside, which may have the same name."""

RECORDS = 16
"""Records of the capture memory: a host reads as many in a few samples."""
AMPLIFIER = Amplifier(unit="V", newtons_per_unit=2.0, full_scale=24.0)
STAGES: dict[str, Stage] = {
    "pdm": pdm.USUAL,
    "pdm scaled": pdm.Stage(amplifier=AMPLIFIER),
    "pwm": pwm.Stage(amplifier=AMPLIFIER, pwm_hz=100_000, dead_time_s=200e-9),
    "dac": dac.Stage(
        amplifier=AMPLIFIER, bits=16, serial_hz=6_000_000, header_bits=8, header=3, mode=1, setup=(0x0F0000, 0x040268)
    ),
}
"""Drive stages that the axes with 40 N may have at this clock."""
CAPTURED = tuple(name for name in capture.Inputs._fields if name.startswith("capture_"))
"""Inputs of the capture memory that come from the host."""
KERNELS = {"pdm": pdm, "pwm": pwm, "dac": dac}


def board_of(name: str, estimator: str, records: int = RECORDS, stage: str = "pdm") -> Board:
    """Return a board with a quick serial line, so that a host gets through a conversation in a few samples."""
    rates = {"clock_hz": CLOCK_HZ, "sample_hz": 200_000, "actuation_hz": 100_000}
    axis = dataclasses.replace(spec(name, estimator), **rates, stage=STAGES[stage])
    return Board(axis, Link(RegisterMap(axis, RECORD_REGISTERS * records), BAUD))


def make(name: str, estimator: str, stage: str = "pdm") -> "Watched":
    return Watched(board_of(name, estimator, stage=stage))


class Watched(wiring.Component):
    """A board with its pins, and in two words what its axis is asked by the link and what the axis shows.

    Attributes:
        board: the board.
        asked: how the inputs of the axis and the capture memory that come from the link lie in `asking`.
        shown: how `SEEN`, and the pins of drive and `RUNNING`, lie in `showing`.
    """

    def __init__(self, board: Board):
        self.board, registers = board, board.registers
        asked = (each.name for each in (*registers.words, *registers.live, *registers.pulses))
        theirs = {name: board.axis if name in board.axis.signature.members else board.capture for name in asked}
        self._asked = {name: getattr(block, name) for name, block in theirs.items()}
        pins = *board.spec.drive.pins, *RUNNING
        self._shown = {name: getattr(board.axis, name) for name in SEEN}
        self._shown |= {AT_PIN + name: getattr(board, name) for name in pins}
        self.asked, self.shown = (
            Packing({name: Shape.cast(port.shape()) for name, port in ports.items()})
            for ports in (self._asked, self._shown)
        )
        inside = {"asking": Out(self.asked.width), "showing": Out(self.shown.width)}
        super().__init__({**board.signature.members, **inside})

    def elaborate(self, platform):
        m = Module()
        m.submodules.board = self.board
        m.d.comb += lead_out(self.board, self, self.board.signature.members)
        m.d.comb += [self.asking.eq(Cat(self._asked.values())), self.showing.eq(Cat(self._shown.values()))]
        return m


class Twin(AxisTwin):
    """The state of the board's axis, its drive stage and its capture memory, clock for clock, from the models alone.

    When the link asks for something, and what the axis shows to its monitors, is taken from the board.
    """

    def __init__(self, board: Board):
        super().__init__(board.axis.design)
        self.board, self.stage = board, KERNELS[self.spec.stage.name]
        self.asked: dict[str, int] = {}
        self.follower = Follower(board.axis.design, IDLE)
        self.staged, self.actuated = self.spec.drive.start, 0
        self.captures = board.registers.capture
        self.captured, self.memory = capture.START, self.captures.memory()

    def shown(self) -> tuple:
        """Return what the status registers are made from, as a snapshot at the next edge takes it."""
        own = self.drive, self.velocity, self.wall_force, self.flags
        return self.decoder, own, self.follower.wanted(), self.captured

    def status(self, shown: tuple) -> dict[str, int]:
        """Return the words of every status register from what `shown` has returned."""
        decoder, own, wanted, captured = shown
        wanted = wanted | {
            name: getattr(captured, name) for name in ("capture_state", "capture_place", "capture_stamp")
        }
        named = dict(zip(("drive", "velocity", "wall_force", "flags"), own, strict=True)) | wanted
        named |= {f"counts_{k}": wanted["counts"] >> VALUE_BITS * k & 0xFFFFFFFF for k in range(2)}
        status = {}
        for register in self.board.registers.status:
            value = named[register.name] if register.name in named else getattr(decoder, register.name)
            if register.name == "velocity":
                value >>= self.design.estimator.velocity.width - register.format.width
            status[register.name] = value
        return status

    def edge(self, pins: dict[str, int], asked: dict[str, int], seen: dict[str, int]) -> None:
        """Advance by one clock edge, with the pins, what the link asks, and what the axis shows just before it."""
        supervisor = self.follower.supervisor
        self._capture(asked, seen["sampled"])
        staging = {
            "strobe": self.actuated,
            "magnitude": supervisor.magnitude,
            "negative": supervisor.negative ^ self.follower.inverted,
            "armed": int(supervisor.state == ARMED),
        }
        kinds = self.stage.Inputs
        inputs = kinds(**{name: staging[name] for name in kinds._fields})
        self.staged = self.stage.step(self.spec.drive.params, self.staged, inputs)
        self.actuated = seen["actuated"]

        enabled = self.follower.level("drive_enable")
        # The clock runs.
        given = pins | asked | {"slip": 0}
        slip = self.follower.slip(given)
        self.follower.edge(given, seen)
        if self.strobe and self.pending:
            assert self.asked.items() <= asked.items(), "words moved before the axis had them"
        self.advance(given | {"slip": slip}, enabled)
        if asked["commit"]:
            self.asked = {name: asked[name] for name in self.words if name in asked}

    def pins(self, permitted: int) -> dict[str, int]:
        """Return the levels of the pins of a board whose clock runs, by name."""
        stage = self.stage.pins(self.spec.drive, self.staged, permitted)
        alive = self.follower.supervisor.alive
        return {AT_PIN + name: level for name, level in (*stage.items(), *zip(RUNNING, (alive, 1), strict=True))}

    def _capture(self, asked: dict[str, int], sampled: int) -> None:
        """Advance the capture memory by one clock edge."""
        narrowed = self.design.estimator.velocity.width - self.captures.velocity.width
        supervisor = self.follower.supervisor
        taken = capture.Inputs(
            **{name: asked[name] for name in CAPTURED if name in asked},
            acceleration=self.acceleration,
            count=self.sampled_count,
            velocity=self.velocity >> narrowed,
            wall_force=self.wall_force,
            sampled=sampled,
            flags=self.flags,
            stamp=self.decoder.stamp,
            driven=supervisor.driven,
            state=supervisor.state,
            live=supervisor.live,
        )
        self.captured = capture.step(self.captures.params, self.memory, self.captured, taken)

    def window(self) -> list[int]:
        """Return the registers of the frozen ring, the oldest record first."""
        return np.roll(self.memory, -self.captured.ring, axis=0).ravel().tolist()
