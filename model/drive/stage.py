"""The base of every drive stage: the amplifier after it, in SI units, and the design that follows.

A drive stage is the last arrow of the path of data: from the drive that the supervisor lets out to the pins. To add
one, write `hdl/drive/NAME.py`, `model/drive/NAME.py` and `tests/drive/test_NAME.py`, and add a line to each `registry`.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

from ..arithmetic.fixed import UQ
from ..checks import NUMBERS, FieldError, check_number, check_range, shown
from ..requirements import AxisRequirements

Unit = Literal["V", "A"]
UNITS: tuple[Unit, ...] = get_args(Unit)


@dataclass(frozen=True, kw_only=True)
class Amplifier:
    """The amplifier between a stage's pins and the force on the handle.

    Attributes:
        unit: V if the stage sets volts, A if the amplifier makes amperes of them.
        newtons_per_unit: force on the handle of a volt, or an ampere.
        full_scale: volts or amperes at the stage's full scale, either way.
        offset: volts or amperes at which there is no force.
        inverted: whether a positive output pushes the handle the negative way.

    Raises:
        TypeError: if a field is of the wrong type.
        ValueError: if a value is impossible; the message names the field, as `stage.` and its name here.
    """

    unit: Unit
    newtons_per_unit: float
    full_scale: float
    offset: float = 0.0
    inverted: bool = False

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise FieldError("stage.unit", f"must be one of {', '.join(UNITS)}, not {shown(self.unit)}")
        for name in ("newtons_per_unit", "full_scale"):
            check_number(f"stage.{name}", getattr(self, name))
            check_range(f"stage.{name}", getattr(self, name), *NUMBERS)
        check_number("stage.offset", self.offset)
        check_range("stage.offset", self.offset, -self.full_scale, self.full_scale)
        if not isinstance(self.inverted, bool):
            raise TypeError(f"stage.inverted must be a bool, not {shown(self.inverted)}")

    @property
    def full_scale_n(self) -> float:
        """Force at the stage's full scale, N."""
        return self.newtons_per_unit * self.full_scale


@dataclass(frozen=True, kw_only=True)
class Stage(ABC):
    """The specification of an axis's drive stage.

    Attributes:
        amplifier: what is behind it.
    """

    name: ClassVar[str]
    amplifier: Amplifier | None

    @property
    def inverted(self) -> bool:
        """Whether a positive output pushes the handle the negative way."""
        return self.amplifier is not None and self.amplifier.inverted


class StageDesign(ABC):
    """Formats, numbers and latency of a drive stage for an axis.

    Attributes of the class:
        stage_class: the stage's `Stage`; its name is the stage's name in scenes.
        pins: the names of its pins, all of them outputs.
        safe: the safe level of the pins, in words.
        safe_latency: clocks from an axis that is not ARMED to safe pins.

    Attributes:
        stage: as given.
        magnitude: format of the drive's magnitude, force LSB.
        full_scale_n: force of the full scale, either way, N.
        steps: steps of the output from zero to the full scale.
        most: the most steps that it makes.
        latency: the most clocks from a changed drive to the pins that follow it.

    Raises:
        TypeError: if `stage` is of another class.
        ValueError: if the axis and the stage do not fit; the message names the field, of the stage as `stage.NAME`.
    """

    stage_class: ClassVar[type[Stage]]
    pins: ClassVar[tuple[str, ...]]
    safe: ClassVar[str]
    safe_latency: ClassVar[int] = 1
    full_scale_n: float
    steps: int
    most: int

    def __init__(self, axis: AxisRequirements, stage: Any):
        kind = self.stage_class
        if not isinstance(stage, kind):
            raise TypeError(f"stage must be a {kind.__module__.rpartition('.')[2]}.Stage, not {shown(stage)}")
        self.stage = stage
        self.magnitude = UQ(axis.force.width - 2, 0)
        if stage.amplifier is not None and not isinstance(stage.amplifier, Amplifier):
            raise TypeError(f"stage.amplifier must be an Amplifier, not {shown(stage.amplifier)}")

    @property
    @abstractmethod
    def latency(self) -> int:
        """The most clocks from a changed drive to the pins that follow it."""

    @property
    def highest(self) -> int:
        """The most steps of a positive force."""
        return self.most

    @property
    def step_n(self) -> float:
        """Force of a step, N."""
        return self.full_scale_n / self.steps

    def check_deliverable(self, axis: AxisRequirements, most_n: float) -> None:
        """Raise FieldError if the largest drive of the axis is more than the stage gives."""
        if axis.force_max_n > most_n * (1 + 1e-12):
            raise FieldError(
                "force_max_n",
                f"must be at most {most_n:g} N, all that the drive stage gives, not {axis.force_max_n!r}",
            )
