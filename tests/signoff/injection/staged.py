"""The drive stages that faults are injected with: the axis and board of each, and when its pins act."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property

from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.axis.board import Board
from hardwall.hdl.link.link import Link
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.registers import AxesMap
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.drive import dac
from hardwall.model.spec import AxisSpec
from hardwall.sim.rtl.board_library import of_dac
from oracles.board import STAGES

from .scene import AXES, BAUD, PUSH_N, SPEC, STEP_CLOCKS, TREMOR_N

LIVE = ("supervisor_force_limit", "supervisor_ramp", "supervisor_watchdog")
"""Live words that have a range, between the link and the axis."""
INSIDE = ("strobe_busy",)
"""Outputs of the bare axis that no motion and no host can make high."""
OF_AXES = ("supervisor_watchdog", "word_value")
"""What several axes have of the link: the live word that they share, and each word of one of them as it is written."""


@dataclass(frozen=True)
class Staged:
    """A drive stage under fault.

    Attributes:
        name: the stage's.
        acts: a port, and its level while the stage acts.
        moments: the moments at which a fault may do the most, in words, and the clocks to them since the stage acts;
            the first one is in the middle.
        resting: while the stage does not act, in words.
        brief: an act lasts a clock.
    """

    name: str
    acts: tuple[str, int]
    moments: dict[str, int]
    resting: str
    brief: bool = False

    @property
    def axes(self) -> int:
        """The number of axes."""
        return 1

    @property
    def upsets(self) -> tuple[str, ...]:
        """What can be made wrong inside."""
        return (*LIVE, *INSIDE)

    @property
    def acting(self) -> str:
        """The first moment, in words."""
        return next(iter(self.moments))

    @cached_property
    def spec(self) -> AxisSpec:
        return dataclasses.replace(SPEC, stage=STAGES[self.name])

    @cached_property
    def registers(self) -> RegisterMap:
        """The registers of the board; of several axes, those of each in its bank."""
        return RegisterMap(self.spec)

    def board(self) -> Board:
        """Return a board with the stage."""
        return Board(self.spec, Link(self.registers, BAUD))

    @property
    def has_codes(self) -> bool:
        """Whether the amplifier has a step for each code of the drive; otherwise it has one, of the full scale."""
        return isinstance(self.spec.drive, dac.Design)

    @property
    def step_n(self) -> float:
        """The force of a step of the amplifier."""
        return self.spec.drive.full_scale_n / (self.spec.drive.steps if self.has_codes else 1)

    @property
    def parameters(self) -> tuple[tuple[str, str, int], ...]:
        """What the amplifier in simulation is to know of the stage, for an instance of it."""
        return tuple(("p", name.removeprefix("DAC_"), value) for name, value in of_dac(self.spec).items())

    def stuck_n(self, drive_n: float = PUSH_N + TREMOR_N) -> float:
        """Return the largest force of pins that stay as they are, at a drive: a DAC keeps it, a pulse is full scale."""
        return drive_n if self.has_codes else self.spec.drive.full_scale_n

    @property
    def pins_latency(self) -> int:
        """Clock edges from a drive of zero to the edge that can see its last pulse."""
        return self.board().safe_latency - 1


class StagedAxes(Staged):
    """Several axes under fault, each with a stage of pulses."""

    @property
    def axes(self) -> int:
        return self.spec.axes

    @property
    def upsets(self) -> tuple[str, ...]:
        return OF_AXES

    @cached_property
    def spec(self) -> AxesSpec:
        shared = {each.name for each in dataclasses.fields(AxesSpec)} - {"axes"}
        return AxesSpec(axes=AXES, **{name: getattr(SPEC, name) for name in shared})

    @cached_property
    def registers(self) -> AxesMap:
        return AxesMap(self.spec, 0)

    def board(self) -> AxesBoard:
        return AxesBoard(self.spec, BAUD, self.registers.capture_registers)


PULSES = (("drive_pdm", 1), {"while the drive's pin is high": 0}, "while the drive's pin is low", True)
STAGED = {
    each.name: each
    for each in (
        Staged("pdm", *PULSES),
        # The force of the contact is negative.
        Staged("pwm", ("steps", -1), {"within a pulse": STEP_CLOCKS // 12}, "between two pulses"),
        # A frame of 24 bits, two clocks each: the last bit is taken one clock before the chip select rises.
        Staged(
            "dac",
            ("dac_cs_n", 0),
            {"within a frame": 24, "behind the last bit of a frame": 48},
            "between two frames",
        ),
    )
}
"""The stages by their names."""
SEVERAL = StagedAxes("pdm", *PULSES)
DEVICES: dict[str, Staged] = {**STAGED, f"{AXES} axes": SEVERAL}
"""What faults are injected into: an axis with each of the stages, and several axes."""
