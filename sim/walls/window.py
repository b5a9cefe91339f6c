"""The position of a handle over a window of time: its mean, its drift, and its RMS distance from the line of both."""

import numpy as np


class Room:
    """Arrays for what is computed of a piece, kept from one piece to the next: new memory costs more than the sums."""

    def __init__(self) -> None:
        self._ramp = self._values = self._places = np.empty(0)

    def of(self, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the numbers from 0 on, and two arrays to write to, of so many samples."""
        if samples > len(self._ramp):
            self._ramp = np.arange(float(samples))
            self._values, self._places = np.empty(samples), np.empty(samples)
        return self._ramp[:samples], self._values[:samples], self._places[:samples]


class Window:
    """The least-squares line through samples at equal distances, and how far they are from it, piece by piece.

    Sums are of distances from the first position, because positions are far larger than what they differ by.

    Args:
        samples: number of samples of the whole window, at least 1.
        room: what one window after the other may use.

    Attributes:
        samples: that number.
        added: number of samples so far.
    """

    def __init__(self, samples: int, room: Room):
        self.samples, self.added = samples, 0
        self._room = room
        self._first_m = self._sum = self._moment = self._squares = 0.0

    def add(self, positions: np.ndarray) -> None:
        """Add the next positions (m)."""
        if not len(positions):
            return
        if not self.added:
            self._first_m = float(positions[0])
        ramp, off, places = self._room.of(len(positions))
        np.subtract(positions, self._first_m, out=off)
        np.add(ramp, self.added - (self.samples - 1) / 2, out=places)
        # No BLAS: its threads would wait for each other, and the last digits would depend on how many there are.
        self._sum += float(off.sum())
        self._moment += float(np.multiply(places, off, out=places).sum())
        self._squares += float(np.square(off, out=off).sum())
        self.added += len(off)

    def joined(self, after: "Window") -> "Window":
        """Return one window of the samples of this window and of the next one."""
        both, way = Window(self.samples + after.samples, self._room), after._first_m - self._first_m
        moved = after._sum + after.samples * way
        both.added, both._first_m, both._sum = both.samples, self._first_m, self._sum + moved
        both._moment = self._moment + after._moment + (self.samples * moved - after.samples * self._sum) / 2
        both._squares = self._squares + after._squares + way * (after._sum + moved)
        return both

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
