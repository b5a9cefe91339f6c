"""A sum of sines fitted to a record: smooth enough to be differentiated twice.

    f(t) = sum_i a_i sin(w_i t) + b_i cos(w_i t)

For given w_i the a_i and b_i follow from linear least squares, so only the w_i are searched (variable projection). The
sines are found one after the other; the search for a sine begins where the spectrum of the residual of the previous
sines is strongest.

Two sines of one frequency that cancel fit a little better the larger they are, without an end. The last bit of a sum
would then choose where the search stops. So an amplitude costs something, and the derivatives by w are exact.
"""

from dataclasses import dataclass

import numpy as np
import scipy

AMPLITUDE_COSTS = 1e-3
"""An amplitude costs as much as a residual of this part of it at every value: one of 10 mm as 10 um, of the some 100 um
that a hit's fit leaves. Two sines that cancel stay as small as the record."""
CLOSE = 1e-12
"""The relative change at which the search for the frequencies ends."""


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
    """Return a row for every time and one for what every amplitude costs, a column for every amplitude."""
    phase = np.multiply.outer(times_s, rad_per_s)
    costs = AMPLITUDE_COSTS * np.sqrt(len(times_s)) * np.eye(2 * len(rad_per_s))
    return np.vstack([np.hstack([np.sin(phase), np.cos(phase)]), costs])


def _amplitudes(times_s: np.ndarray, values: np.ndarray, rad_per_s: np.ndarray) -> np.ndarray:
    """Return the best a, then b, for given frequencies."""
    basis = _basis(times_s, rad_per_s)
    return np.linalg.lstsq(basis, np.pad(values, (0, basis.shape[1])), rcond=None)[0]


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
    omegas, rest = np.empty(0), values
    for _ in range(count):
        turn = np.exp(-1j * np.multiply.outer(candidates, times_s))
        free = np.array([np.min(np.abs(new - omegas), initial=np.inf) > slowest / 2 for new in candidates])
        omegas = np.append(omegas, candidates[free][np.argmax(np.abs(turn[free] @ rest))])
        omegas = np.sort(_searched(times_s, values, omegas, slowest, fastest))
        amplitudes = _amplitudes(times_s, values, omegas)
        found = Sines(omegas, *np.split(amplitudes, 2))
        rest = values - found.derivative(times_s)
    return found


def _searched(times_s, values, start, slowest, fastest) -> np.ndarray:
    """Return the frequencies near `start` with the least squared residual."""

    def residual(rad_per_s):
        basis = _basis(times_s, rad_per_s)
        return basis @ _amplitudes(times_s, values, rad_per_s) - np.pad(values, (0, basis.shape[1]))

    def derivatives(rad_per_s):
        # The gradient of the residual outside the span of the basis; the part inside contributes nothing (Kaufman
        # 1975).
        basis, sines = _basis(times_s, rad_per_s), len(rad_per_s)
        sine, cosine = np.split(_amplitudes(times_s, values, rad_per_s), 2)
        slopes = times_s[:, None] * (basis[: len(times_s), sines:] * sine - basis[: len(times_s), :sines] * cosine)
        slopes = np.pad(slopes, ((0, 2 * sines), (0, 0)))
        across, _ = np.linalg.qr(basis)
        return slopes - across @ (across.T @ slopes)

    scale = np.full(len(start), slowest)
    limits = np.full(len(start), slowest / 4), np.full(len(start), fastest)
    ends = dict.fromkeys(("ftol", "xtol", "gtol"), CLOSE)
    return scipy.optimize.least_squares(
        residual, start, derivatives, bounds=limits, x_scale=scale, max_nfev=500, **ends
    ).x
