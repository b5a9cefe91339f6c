"""One axis, specified: its requirements, the estimator that it has, and the design that follows from both."""

from dataclasses import dataclass
from functools import cached_property

from .checks import FieldError
from .design import Design
from .estimators.estimate import EstimatorGains
from .requirements import AxisRequirements


@dataclass(frozen=True, kw_only=True)
class AxisSpec(AxisRequirements):
    """The requirements of one axis and its estimator; the RTL, the model and the host's conversions are built from it.

    Attributes:
        estimator: name of the velocity estimator.
        gains: that estimator's `Gains`, or None for its default ones.

    The other attributes, and the errors, are those of `requirements.AxisRequirements`.
    """

    estimator: str = "levant"
    gains: EstimatorGains | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.design.latency_to_drive > self.clocks_per_sample:
            fastest = self.clock_hz // self.design.latency_to_drive
            raise FieldError(
                "sample_hz",
                f"must leave {self.design.latency_to_drive} clocks for the force path, so at most {fastest} "
                f"at clock_hz {self.clock_hz}, not {self.sample_hz!r}",
            )

    @cached_property
    def design(self) -> Design:
        """Every derived format, word and latency."""
        return Design(self, self.estimator, self.gains)
