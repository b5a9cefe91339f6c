"""The specification of one axis: its requirements and its estimator. The design follows from both."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .axis.designed import DesignedAxis
from .checks import FieldError, shown
from .drive import registry
from .drive.pdm import USUAL
from .drive.stage import Stage, StageDesign


@dataclass(frozen=True, kw_only=True)
class AxisSpec(DesignedAxis):
    """The requirements of one axis and its estimator; the RTL, the model and the host's conversions are built from it.

    Attributes:
        stage: the drive stage, a `Stage` from `drive.registry`, which turns the drive word into pins.

    The other attributes are in `designed.DesignedAxis`, the errors in `requirements.AxisRequirements`.
    """

    stage: Stage = USUAL

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.stage, Stage):
            raise TypeError(f"stage must be a drive stage, not {shown(self.stage)}")
        if self.design.interval > self.clocks_per_sample:
            fastest = self.clock_hz // self.design.interval
            raise FieldError(
                "sample_hz",
                f"must leave {self.design.interval} clocks from a sample to the next, so at most {fastest} "
                f"at clock_hz {self.clock_hz}, not {self.sample_hz!r}",
            )
        _ = self.drive

    @cached_property
    def drive(self) -> StageDesign:
        """The design of the drive stage."""
        return registry.design_of(self, self.stage)

    @property
    def facts(self) -> dict[str, Any]:
        """Every field by name, with the gains in use; the stage is left out if it is the usual one."""
        facts = super().facts
        if self.stage == USUAL:
            del facts["stage"]
        return facts
