"""A sum of sines fitted to a record: smooth enough to be differentiated twice.

    f(t) = sum_i a_i sin(w_i t) + b_i cos(w_i t)

For given w_i the a_i and b_i follow from linear least squares, so only the w_i are searched (variable projection). The
sines are found one after the other; the search for a sine begins where the spectrum of the residual of the previous
sines is strongest.
"""

from dataclasses import dataclass

import numpy as np
import scipy


@dataclass(frozen=True)
class Sines:
    """A sum of sines.

    Attributes:
        rad_per_s: angular frequencies w, ascending.
        sine, cosine: amplitudes a and b, in the unit of the record.
    """

    rad_per_s: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray

    def derivative(self, times_s: np.ndarray, order: int = 0) -> np.ndarray:
        """Return the sum, or its derivative of any order, at the given times (s)."""
        phase, factor = np.multiply.outer(times_s, self.rad_per_s) + order * np.pi / 2, self.rad_per_s**order
        return np.sin(phase) @ (self.sine * factor) + np.cos(phase) @ (self.cosine * factor)


def _basis(times_s: np.ndarray, rad_per_s: np.ndarray) -> np.ndarray:
    phase = np.multiply.outer(times_s, rad_per_s)
    return np.hstack([np.sin(phase), np.cos(phase)])


def _amplitudes(times_s: np.ndarray, values: np.ndarray, rad_per_s: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(_basis(times_s, rad_per_s), values, rcond=None)[0]


def fit(times_s: np.ndarray, values: np.ndarray, count: int = 7) -> Sines:
    """Return the sum of `count` sines that fits a record best near the peaks of its spectrum.

    Args:
        times_s: evenly spaced times, s.
        values: the record, with at least four values for every sine.
        count: number of sines.

    Raises:
        ValueError: if the record is too short.
    """
    if len(values) < 4 * count:
        raise ValueError(f"values must be at least {4 * count} for {count} sines, not {len(values)}")
    span_s = times_s[-1] - times_s[0]
    # A sine has at least a quarter of a turn in the record; slower sines cannot be told apart.
    slowest, fastest = np.pi / 2 / span_s, np.pi / np.diff(times_s).mean()
    candidates = slowest * np.arange(1, min(8 * len(values) // 2, 2000))
    candidates = candidates[candidates < fastest]
    omegas = np.empty(0)
    for _ in range(count):
        rest = values - _basis(times_s, omegas) @ _amplitudes(times_s, values, omegas) if len(omegas) else values
        turn = np.exp(-1j * np.multiply.outer(candidates, times_s))
        free = np.array([np.min(np.abs(new - omegas), initial=np.inf) > slowest / 2 for new in candidates])
        omegas = np.append(omegas, candidates[free][np.argmax(np.abs(turn[free] @ rest))])
        omegas = _searched(times_s, values, omegas, slowest, fastest)
    omegas = np.sort(omegas)
    amplitudes = _amplitudes(times_s, values, omegas)
    return Sines(omegas, amplitudes[:count], amplitudes[count:])


def _searched(times_s, values, start, slowest, fastest) -> np.ndarray:
    """Return the frequencies near `start` with the least squared residual."""

    def residual(rad_per_s):
        return _basis(times_s, rad_per_s) @ _amplitudes(times_s, values, rad_per_s) - values

    scale = np.full(len(start), slowest)
    limits = np.full(len(start), slowest / 4), np.full(len(start), fastest)
    return scipy.optimize.least_squares(residual, start, bounds=limits, x_scale=scale, max_nfev=60).x
