"""The requirements of an axis with the choice of its estimator: all that its formats, words and flags follow from."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..checks import NUMBERS, check_number, check_range, shown
from ..estimators.estimate import EstimatorGains
from ..requirements import EDGE_ERROR_COUNTS, AxisRequirements
from . import virtual_mass
from .design import Design

USUAL = {
    "jerk_max_m_per_s3": None,
    "edge_error_max_counts": EDGE_ERROR_COUNTS,
    "passivity": False,
    "coupling": False,
    virtual_mass.FIELD: None,
}
"""Fields that are facts of an axis only if they differ from these defaults."""


@dataclass(frozen=True, kw_only=True)
class DesignedAxis(AxisRequirements):
    """The requirements of one axis, alone (`spec.AxisSpec`) or one of several (`axes.AxesSpec`), and its estimator.

    Attributes:
        estimator: name of the velocity estimator.
        gains: that estimator's `Gains`, or None for its default ones.
        passivity: whether a passivity observer and controller follow the wall: see `passivity`.
        coupling: whether the wall can be a virtual coupling, whose surface moves and holds on both sides: see `wall`.
        virtual_mass_max_kg: the largest virtual mass, kg, less than the handle's: see `virtual_mass`. The estimator
            must have an acceleration. None for an axis without one.

    The other attributes and the errors are in `requirements.AxisRequirements`.
    """

    estimator: str = "levant"
    gains: EstimatorGains | None = None
    passivity: bool = False
    coupling: bool = False
    virtual_mass_max_kg: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("passivity", "coupling"):
            value = getattr(self, name)
            if not isinstance(value, bool):
                raise TypeError(f"{name} must be a bool, not {shown(value)}")
        if self.virtual_mass_max_kg is not None:
            check_number(virtual_mass.FIELD, self.virtual_mass_max_kg)
            check_range(virtual_mass.FIELD, self.virtual_mass_max_kg, *NUMBERS)

    @cached_property
    def design(self) -> Design:
        """Every derived format, word and flag, and the latency of an axis that is alone."""
        return Design(self, self.estimator, self.gains, self.passivity, self.coupling, self.virtual_mass_max_kg)

    @property
    def facts(self) -> dict[str, Any]:
        """Every field by name, with the gains in use; optional fields with their default are left out."""
        facts = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        for name, usual in USUAL.items():
            if facts[name] == usual:
                del facts[name]
        return facts | {"gains": self.design.gains}
