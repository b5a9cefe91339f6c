"""The error figures of a velocity estimate, compared with the true velocity sample by sample.

With v the true velocity and w the estimate, over the judged samples:

- `rms`, `largest`: the RMS and the largest magnitude of w - v;
- `chatter`: the RMS of w - v less its mean over each 10 ms: the part that a damper turns into noise;
- `delay_s`: the delay d with the best correlation of v(t - d) and w(t). None if v does not vary, w is zero, or the best
  d is beyond the limits.

The correlation is over means of blocks, at most `DELAY_POINTS` of them; within a block v must be nearly straight.
"""

import math
from collections.abc import Callable

import numpy as np
import scipy

CHATTER_S = 0.01
DELAY_POINTS = 1 << 15
DELAY_STEPS = 400


def _inner(one: np.ndarray, other: np.ndarray) -> float:
    """Return the inner product of two arrays.

    BLAS spreads a product over threads. For arrays of this size this is ten times slower, and the last digits depend on
    the number of cores.
    """
    return float(np.sum(one * other))


class _Means:
    """Means over blocks of `size` samples, of values that arrive in chunks."""

    def __init__(self, samples: int, size: int):
        self._size = size
        self._sums = np.zeros(-(-samples // size))
        ends = np.minimum(np.arange(1, len(self._sums) + 1) * size, samples)
        self.lengths = np.diff(ends, prepend=0)
        self.middles = ends - (self.lengths + 1) / 2

    def add(self, first: int, values: np.ndarray) -> None:
        blocks = np.arange(first, first + len(values)) // self._size
        np.add.at(self._sums, blocks, values)

    @property
    def values(self) -> np.ndarray:
        return self._sums / self.lengths


class Judge:
    """The error figures of one estimate, which arrives in chunks.

    Args:
        samples: number of samples that will be judged.
        sample_hz: sample rate.
    """

    def __init__(self, samples: int, sample_hz: float):
        self._samples, self._sample_hz = samples, sample_hz
        self._slow = _Means(samples, max(1, round(CHATTER_S * sample_hz)))
        self._shape = _Means(samples, -(-samples // DELAY_POINTS))
        self._squares = 0.0
        self.largest = 0.0

    def add(self, first: int, estimate: np.ndarray, exact: np.ndarray) -> None:
        """Add the samples of a chunk; `first` is the number of its first sample."""
        error = estimate - exact
        self._squares += _inner(error, error)
        self.largest = max(self.largest, float(np.abs(error).max(initial=0.0)))
        self._slow.add(first, error)
        self._shape.add(first, estimate)

    @property
    def rms(self) -> float:
        return math.sqrt(self._squares / self._samples)

    @property
    def chatter(self) -> float:
        slow = float(np.average(self._slow.values**2, weights=self._slow.lengths))
        return math.sqrt(max(self._squares / self._samples - slow, 0.0))

    def delay_s(self, exact_at: Callable[[np.ndarray], np.ndarray], within_s: float) -> float | None:
        """Return the delay of the estimate, in seconds; None where no delay can be told.

        Args:
            exact_at: returns the true velocity at times in seconds since the first sample.
            within_s: the largest delay, of either sign, that is tried; less than half a period of a periodic motion.
        """
        times, estimate = self._shape.middles / self._sample_hz, self._shape.values
        if np.ptp(exact_at(times)) < 1e-9 or not estimate.any():
            return None

        def mismatch(delay_s: float) -> float:
            exact = exact_at(times - delay_s)
            return -_inner(estimate, exact) / math.sqrt(_inner(exact, exact))

        tried = np.linspace(-within_s, within_s, DELAY_STEPS + 1)
        number = int(np.argmin([mismatch(delay_s) for delay_s in tried]))
        if number in (0, DELAY_STEPS):
            return None
        best, step = tried[number], tried[1] - tried[0]
        bounds = best - step, best + step
        found = scipy.optimize.minimize_scalar(mismatch, bounds=bounds, method="bounded", options={"xatol": 1e-9})
        return float(found.x)
