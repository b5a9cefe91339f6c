"""The founding paper's Figure-2 signal at any rate: f(t) = 50 exp(-t) sin(2 pi t) mm, rounded down to 1 um."""

import numpy as np
from specs import PAPER

from hardwall.model.spec import AxisSpec

RATES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
BOUND_M_PER_S2 = 1.6785
"""Largest |f''| of it."""


def figure_2(estimator: str, rate_hz: int, from_s: float = 1.0) -> tuple[AxisSpec, np.ndarray, np.ndarray]:
    """Return the axis, the counts from `from_s` on, and the exact velocity, m/s: 0.5 s, or 0.2 s at 10 MHz."""
    fast = rate_hz > 1_000_000
    rates = {"clock_hz": 1_000_000_000 if fast else 50_000_000, "sample_hz": rate_hz, "actuation_hz": rate_hz}
    axis = AxisSpec(**PAPER | rates | {"acceleration_max_m_per_s2": BOUND_M_PER_S2}, estimator=estimator)
    t = from_s + np.arange(round((0.2 if fast else 0.5) * rate_hz)) / rate_hz
    turn = 2 * np.pi
    position = 50e-3 * np.exp(-t) * np.sin(turn * t)
    velocity = 50e-3 * np.exp(-t) * (turn * np.cos(turn * t) - np.sin(turn * t))
    return axis, np.floor(position / axis.count_m).astype(np.int64), velocity
