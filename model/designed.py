"""The requirements of an axis with the choice of its estimator: all that its formats, words and flags follow from."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .design import Design
from .estimators.estimate import EstimatorGains
from .requirements import EDGE_ERROR_COUNTS, AxisRequirements

USUAL_BOUNDS = {"jerk_max_m_per_s3": None, "edge_error_max_counts": EDGE_ERROR_COUNTS}
"""Bounds that are no facts of an axis unless they are others than these."""


@dataclass(frozen=True, kw_only=True)
class DesignedAxis(AxisRequirements):
    """The requirements of one axis, alone (`spec.AxisSpec`) or one of several (`axes.AxesSpec`), and its estimator.

    Attributes:
        estimator: name of the velocity estimator.
        gains: that estimator's `Gains`, or None for its default ones.

    The other attributes, and the errors, are those of `requirements.AxisRequirements`.
    """

    estimator: str = "levant"
    gains: EstimatorGains | None = None

    @cached_property
    def design(self) -> Design:
        """Every derived format, word and flag, and the latency of an axis that is alone."""
        return Design(self, self.estimator, self.gains)

    @property
    def facts(self) -> dict[str, Any]:
        """Every field by name, with the gains that are in use; without bounds that are the usual ones."""
        facts = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        for name, usual in USUAL_BOUNDS.items():
            if facts[name] == usual:
                del facts[name]
        return facts | {"gains": self.design.gains}
