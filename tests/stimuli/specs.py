"""Axes for tests: the founding paper's device at two rates, and formats at their extremes."""

import math
from functools import cache

from hardwall.model.estimators import levant
from hardwall.model.spec import AxisSpec

ADJUSTED = levant.Gains(500 * math.sqrt(1e-3), 50.0)

PAPER = {
    "clock_hz": 12_000_000,
    "sample_hz": 10_000,
    "actuation_hz": 1_000,
    "count_m": 1e-6,
    "travel_m": 0.15,
    "speed_max_m_per_s": 2.0,
    "acceleration_max_m_per_s2": 12.0,
    "force_max_n": 40.0,
    "force_resolution_n": 1e-3,
    "stiffness_max_n_per_m": 200e3,
    "damping_max_n_s_per_m": 400.0,
}
MHZ = {**PAPER, "clock_hz": 50_000_000, "sample_hz": 1_000_000, "actuation_hz": 1_000_000}
# A few counts of travel and a coarse force: every word is a few bits wide, and everything saturates and wraps.
NARROW = {
    **MHZ,
    "sample_hz": 500_000,
    "actuation_hz": 250_000,
    "travel_m": 3e-6,
    "speed_max_m_per_s": 0.5,
    "force_max_n": 1.0,
    "force_resolution_n": 0.1,
}
WIDE = {**PAPER, "travel_m": 500.0, "speed_max_m_per_s": 50.0, "force_max_n": 400.0, "force_resolution_n": 1e-4}

SPECS = {
    "paper": {**PAPER, "gains": ADJUSTED},
    "proposed": PAPER,
    "mhz": {**MHZ, "gains": ADJUSTED},
    "narrow": NARROW,
    "wide": WIDE,
}


@cache
def spec(name: str, estimator: str = "levant") -> AxisSpec:
    """Return the axis of that name, with gains only where the estimator has them."""
    fields = dict(SPECS[name])
    if estimator != "levant":
        fields.pop("gains", None)
    return AxisSpec(**fields, estimator=estimator)
