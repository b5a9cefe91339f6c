"""A sum of sines fitted to a record: smooth enough to be differentiated twice.

    f(t) = sum_i a_i sin(w_i t) + b_i cos(w_i t)

For given w_i the a_i and b_i are linear least squares, so only the w_i are searched (variable projection). The search
begins where the record's own spectrum is strongest, one sine after the other, each on what the ones before have left.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares


@dataclass(frozen=True)
class Sines:
    """A fit.

    Attributes:
        rad_per_s: w, ascending.
        sine, cosine: amplitudes a and b, in the unit of the record.
    """

    rad_per_s: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray

    def derivative(self, times_s: np.ndarray, order: int = 0) -> np.ndarray:
        """Return the fit, or its derivative of any order, at times (s)."""
        phase, factor = np.multiply.outer(times_s, self.rad_per_s) + order * np.pi / 2, self.rad_per_s**order
        return np.sin(phase) @ (self.sine * factor) + np.cos(phase) @ (self.cosine * factor)


def _basis(times_s: np.ndarray, rad_per_s: np.ndarray) -> np.ndarray:
    phase = np.multiply.outer(times_s, rad_per_s)
    return np.hstack([np.sin(phase), np.cos(phase)])


def _amplitudes(times_s: np.ndarray, values: np.ndarray, rad_per_s: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(_basis(times_s, rad_per_s), values, rcond=None)[0]


def fit(times_s: np.ndarray, values: np.ndarray, count: int = 7) -> Sines:
    """Return the sum of `count` sines that fits a record best, near where its spectrum is strongest.

    Args:
        times_s: evenly spaced, s.
        values: the record, at least four times as many as sines.
        count: of sines.

    Raises:
        ValueError: if the record is too short.
    """
    if len(values) < 4 * count:
        raise ValueError(f"values must be at least {4 * count} for {count} sines, not {len(values)}")
    span_s = times_s[-1] - times_s[0]
    # A quarter of a turn in the record at least: slower ones are one another's equal.
    slowest, fastest = np.pi / 2 / span_s, np.pi / np.diff(times_s).mean()
    candidates = slowest * np.arange(1, min(8 * len(values) // 2, 2000))
    candidates = candidates[candidates < fastest]
    found = np.empty(0)
    for _ in range(count):
        rest = values - _basis(times_s, found) @ _amplitudes(times_s, values, found) if len(found) else values
        turn = np.exp(-1j * np.multiply.outer(candidates, times_s))
        free = np.array([np.min(np.abs(each - found), initial=np.inf) > slowest / 2 for each in candidates])
        found = np.append(found, candidates[free][np.argmax(np.abs(turn[free] @ rest))])
        found = _searched(times_s, values, found, slowest, fastest)
    found = np.sort(found)
    amplitudes = _amplitudes(times_s, values, found)
    return Sines(found, amplitudes[:count], amplitudes[count:])


def _searched(times_s, values, start, slowest, fastest) -> np.ndarray:
    """Return the frequencies near `start` with which least squares leave least."""

    def residual(rad_per_s):
        return _basis(times_s, rad_per_s) @ _amplitudes(times_s, values, rad_per_s) - values

    scale = np.full(len(start), slowest)
    limits = np.full(len(start), slowest / 4), np.full(len(start), fastest)
    return least_squares(residual, start, bounds=limits, x_scale=scale, max_nfev=60).x
