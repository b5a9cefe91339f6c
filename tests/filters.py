"""What the tests of the linear filters share: the paper's signal, whole records through a kernel, impulse responses."""

import numpy as np
from specs import PAPER

from hardwall.model.compiled import compiled
from hardwall.model.estimators import estimate
from hardwall.model.quadrature import seen_count
from hardwall.model.spec import AxisSpec

BOUND = 1.6785
"""C of the paper's signal, m/s^2."""
RATES = {1e3: 5.0, 1e4: 5.0, 1e5: 2.0, 1e6: 1.25, 1e7: 0.5}
"""Sampling rates, Hz, and how much of the signal is run there, s; it is judged from a fifth on."""


def axis_at(sample_hz: float, estimator: str, gains=None) -> AxisSpec:
    """Return the paper's device at a sampling rate, for its signal."""
    fields = {**PAPER, "clock_hz": 50_000_000 if sample_hz <= 1e6 else 10**9, "acceleration_max_m_per_s2": BOUND}
    rates = {"sample_hz": int(sample_hz), "actuation_hz": int(sample_hz)}
    return AxisSpec(**{**fields, **rates}, estimator=estimator, gains=gains)


def paper_signal(sample_hz: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return counts and true velocity, m/s, of f(t) = 50 exp(-t) sin(2 pi t) mm on counts of 1 um."""
    t = np.arange(round(sample_hz * seconds) + 1) / sample_hz
    swing, turn = np.sin(2 * np.pi * t), 2 * np.pi * np.cos(2 * np.pi * t)
    decay = 0.05 * np.exp(-t)
    return np.floor(decay * swing / 1e-6).astype(np.int64), decay * (turn - swing)


@compiled
def _run(params, state, counts, velocity, flags):
    for k in range(len(counts)):
        state, velocity[k], flags[k] = estimate(params, state, seen_count(counts[k]), 0)
    return state


def run(params, state, counts: np.ndarray):
    """Return (state, velocity, flags) of a record through a kernel, from `state`; counts wrap."""
    width = params.count_width
    half = 1 << (width - 1)
    wrapped = ((np.asarray(counts, np.int64) + half) & (2 * half - 1)) - half
    velocity = np.zeros(len(wrapped), np.float64 if type(params).__name__ == "FloatParams" else np.int64)
    flags = np.zeros(len(wrapped), np.int64)
    return _run(params, state, wrapped, velocity, flags), velocity, flags


def impulse(a: np.ndarray, b, samples: int) -> np.ndarray:
    """Return the states b, a b, a^2 b, ... of a linear system, one a column, at least `samples` of them."""
    states, power = np.array(b, float).reshape(-1, 1), np.array(a, float)
    while states.shape[1] < samples:
        states, power = np.concatenate([states, power @ states], 1), power @ power
    return states


def norms(a: np.ndarray, b, samples: int) -> np.ndarray:
    """Return the sum of absolute values of each state's impulse response."""
    return np.abs(impulse(a, b, samples)).sum(1)


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))
