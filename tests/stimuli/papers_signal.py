"""The founding paper's signal, 50 exp(-t) sin(2 pi t) mm in counts of 1 um, and its device at any rate."""

from functools import cache, lru_cache

import numpy as np

from hardwall.model.spec import AxisSpec
from stimuli.specs import PAPER

RATES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
BOUND = 1.6785
"""The signal's largest acceleration C, m/s^2."""


@cache
def axis_at(estimator: str, sample_hz: int, bound: float = BOUND, gains=None) -> AxisSpec:
    """Return the device at a rate, with the given gains or those that follow from a bound on the acceleration."""
    rates = {"clock_hz": 10**9 if sample_hz > 10**6 else 50_000_000, "sample_hz": sample_hz, "actuation_hz": sample_hz}
    fields = PAPER | rates | {"acceleration_max_m_per_s2": bound}
    return AxisSpec(**fields, estimator=estimator, gains=gains)


@lru_cache(maxsize=1)
def _motion(sample_hz: int, seconds: float, from_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return exact position, in counts, and exact velocity, m/s."""
    t = from_s + np.arange(round(seconds * sample_hz)) / sample_hz
    sine, cosine, decay = np.sin(2 * np.pi * t), np.cos(2 * np.pi * t), 50e-3 * np.exp(-t)
    return decay * sine / PAPER["count_m"], decay * (2 * np.pi * cosine - sine)


def swing(sample_hz: int, seconds: float, from_s: float = 0.0, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return counts and exact velocity, m/s; `phase` shifts the encoder's scale, in counts."""
    position, velocity = _motion(sample_hz, seconds, from_s)
    return np.floor(position + phase).astype(np.int64), velocity


def piece(sample_hz: int) -> tuple[np.ndarray, np.ndarray]:
    """Return half a second of counts and exact velocity from 1 s on; above 1 MHz, a fifth of a second."""
    return swing(sample_hz, 0.2 if sample_hz > 10**6 else 0.5, from_s=1.0)
