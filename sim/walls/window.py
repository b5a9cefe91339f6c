"""The position of a handle over a window of time: its mean, its drift, and its RMS distance from the line of both."""

import numpy as np


class Window:
    """The least-squares line through samples at equal distances, and how far they are from it, piece by piece.

    Sums are of distances from the first position, because positions are far larger than what they differ by.

    Args:
        samples: number of samples of the whole window, at least 1.

    Attributes:
        samples: that number.
        added: number of samples so far.
    """

    def __init__(self, samples: int):
        self.samples, self.added = samples, 0
        self._first_m = self._sum = self._moment = self._squares = 0.0

    def add(self, positions: np.ndarray) -> None:
        """Add the next positions (m)."""
        if not len(positions):
            return
        if not self.added:
            self._first_m = float(positions[0])
        off = positions - self._first_m
        places = np.arange(self.added, self.added + len(off)) - (self.samples - 1) / 2
        self._sum += float(off.sum())
        self._moment += float(places @ off)
        self._squares += float(off @ off)
        self.added += len(off)

    @property
    def mean_m(self) -> float:
        """The mean position of the whole window, m."""
        return self._first_m + self._sum / self.samples

    @property
    def drift_m(self) -> float:
        """The slope of the line, m a sample; 0 for a single one."""
        spread = self.samples * (self.samples**2 - 1) / 12
        return self._moment / spread if spread else 0.0

    @property
    def rms_m(self) -> float:
        """The RMS distance from the line, m."""
        beyond = self._squares - self._sum**2 / self.samples - self._moment * self.drift_m
        return (max(beyond, 0.0) / self.samples) ** 0.5
