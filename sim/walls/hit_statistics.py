"""The statistics of a hit, sample by sample, and what they say of the wall.

The wall is judged over windows of `measure_s`; the first one begins at the settling mark:

- *stable* if the RMS distance of the position from its least-squares line over a window is under the threshold, and
  the wall holds the handle;
- *unstable* if it is not under the threshold, and is more than `FALLING` times the window before; or if the wall does
  not hold the handle: its line, continued for `longest_s`, leaves the device's travel;
- else it still falls: the run goes on with another window, and is *undecided* if no other ends within `longest_s`.

A heavy handle bounces so slowly that a window has few swings. Their RMS says nothing: it depends on where in a swing
the window begins, by 1 / (pi n) of itself for n swings. So the last windows that together hold `ENOUGH` swings are
taken as one. So are the windows before them, back to the first one that begins after a swing. For most handles these
are the last window and the one before. Where there are not enough, the run goes on as well.

The first window has one before it too, which ends at the settling mark. A handle that creeps, or comes to rest in
another place, is not unstable for that. Beside the verdict the report has the *drift* and the *offset*: from the mean
over `mean_s` before the mark to the mean of the judged window.

The founding paper's protocol, `verdict = "literal"`, has one window, and takes the RMS distance from the mean before
the mark. Its square is the sum of three squares: the distance from the line, the offset, and the spread by the drift.
"""

import hashlib
import math

import numpy as np

from ..scene.schema import Scene
from .swings import Swings, swung
from .window import Room, Window

FALLING = 0.9
"""An RMS below this fraction of the one before is falling."""
ENOUGH = 8
"""Fewest swings that are compared with others. A swing is as long as the threshold at least."""
STABLE, UNSTABLE, UNDECIDED = "stable", "unstable", "undecided"


class Tally:
    """Position, largest force and force words of a run, chunk by chunk, and the verdict.

    Args:
        scene: the scene of the run.
        exact: whether the drives are the hardware's words, which have a digest.

    Attributes:
        largest_drive: the largest magnitude of the drive, force LSB.
        farthest_m: the largest position.
        still_from: number of the first sample since which the position has not changed.
        verdict: what is said of the wall; None until then.
        rms_m: the RMS on which the verdict rests; until then the RMS of the last window, infinite before the first one.
    """

    def __init__(self, scene: Scene, exact: bool):
        spec, protocol = scene.spec, scene.protocol
        self._literal, self._threshold_m = protocol.verdict == "literal", protocol.threshold_mm * 1e-3
        self._hopeless = scene.measured * self._threshold_m**2
        self._settled, self._measured, self._most = scene.settled, scene.measured, scene.most_samples
        self._rate, self._travel_m = spec.sample_hz, spec.travel_m
        self._mean_from = self._settled - round(protocol.mean_s * spec.sample_hz)
        self._decimation = spec.samples_per_actuation
        self._digest = hashlib.sha256() if exact else None
        self._sum = self._squares = 0.0
        self._counted = 0
        self._position_m = math.nan
        self._window_from = max(self._settled - self._measured, 0)
        self._room = Room()
        self._window = Window(self._settled - self._window_from, self._room)
        self._swings, self._turns_before = Swings(), 0
        self._swung: list[tuple[Window, int]] = []
        self._judged: Window | None = None
        self.largest_drive, self.farthest_m, self.still_from = 0, -math.inf, 0
        self.verdict: str | None = None
        self.rms_m = math.inf

    @property
    def _mark_m(self) -> float:
        """The mean position before the settling mark, over the samples added."""
        return self._sum / (self._settled - self._mean_from)

    @property
    def mean_m(self) -> float:
        """The mean position of the judged window; in the literal protocol, the mean before the settling mark."""
        return self._mark_m if self._literal or self._judged is None else self._judged.mean_m

    @property
    def offset_m(self) -> float:
        """The distance from the mean before the settling mark to the mean of the judged window; 0 without one."""
        return self._judged.mean_m - self._mark_m if self._judged else 0.0

    @property
    def drift_m_per_s(self) -> float:
        """The slope of the position over the window that was judged; 0 without one."""
        return self._judged.drift_m * self._rate if self._judged else 0.0

    @property
    def window_end(self) -> int:
        """Number of the sample at which the present window ends."""
        return self._window_from + self._window.samples

    @property
    def sure_unstable(self) -> bool:
        """Whether a run of the literal protocol is unstable whatever its rest: its sum of squares is at the limit."""
        return self._literal and self._squares >= self._hopeless

    @property
    def force_sha256(self) -> str | None:
        """Digest of the drives of all actuations, little-endian int32; None without the hardware's words."""
        return self._digest and self._digest.hexdigest()

    def add(self, first: int, positions: np.ndarray, drives: np.ndarray) -> None:
        """Add samples from number `first` on."""

        def part(start: int, stop: int) -> np.ndarray:
            return positions[max(start - first, 0) : max(stop - first, 0)]

        self._sum += float(part(self._mean_from, self._settled).sum())
        end = first + len(positions)
        rest = part(self._settled, end)
        if self._literal and len(rest):
            _, off, squares = self._room.of(len(rest))
            np.subtract(rest, self._mark_m, out=off)
            self._squares += float(np.square(off, out=squares).sum())
            self._counted += len(rest)
            self.rms_m = (self._squares / self._counted) ** 0.5
        self._note_rest(first, positions)
        self.largest_drive = max(self.largest_drive, float(drives.max()), -float(drives.min()))
        self.farthest_m = max(self.farthest_m, float(positions.max()))
        if self._digest:
            self._digest.update(drives[-first % self._decimation :: self._decimation].astype("<i4").tobytes())
        self._swing(part(first, self._window_from))
        while self.window_end <= end:
            self._take(part(max(first, self._window_from), self.window_end))
            self._judge(self.window_end)
        self._take(part(max(first, self._window_from), end))

    def _swing(self, positions: np.ndarray) -> None:
        self._swings = swung(self._swings, positions, self._threshold_m)

    def _take(self, positions: np.ndarray) -> None:
        """Add the next positions of the window that is under way."""
        if not self._window.added:
            self._turns_before = self._swings.turns
        self._window.add(positions)
        self._swing(positions)

    def _note_rest(self, first: int, positions: np.ndarray) -> None:
        """Note since when the position has not changed, with samples from number `first` on."""
        last = positions[-1]
        if len(positions) > 1 and positions[-2] != last:  # which tells it of a handle that moves, at once
            self.still_from = first + len(positions) - 1
        else:
            moved = np.flatnonzero(positions != last)
            if len(moved):
                self.still_from = first + int(moved[-1]) + 1
            elif last != self._position_m:
                self.still_from = first
        self._position_m = float(last)

    def _judge(self, end: int) -> None:
        """Judge the window that ends at a sample, and begin the next one."""
        window = self._window
        self._window, self._window_from = Window(self._measured, self._room), end
        if self._turns_before:
            self._swung.append((window, self._swings.turns - self._turns_before))
        if end > self._settled:
            self._judged = window
            if self._literal:
                self.verdict = STABLE if self.rms_m < self._threshold_m else UNSTABLE
                return
            self.rms_m = window.rms_m
            if self.rms_m < self._threshold_m:
                self.verdict = self._verdict_of(window)
            elif self._goes_on():
                self.verdict = UNSTABLE
            elif end + self._measured > self._most:
                self.verdict = UNDECIDED

    def _goes_on(self) -> bool:
        """Return whether the handle swings on as it did before."""
        windows = list(self._swung)
        last, before = _of_enough(windows), _of_enough(windows)
        return last is not None and before is not None and last.rms_m >= FALLING * before.rms_m

    def _verdict_of(self, still: Window) -> str:
        """Return the verdict on a wall whose handle does not oscillate: stable if the wall holds it.

        A handle that nothing holds soon has a constant speed, and is on its line, too.
        """
        return STABLE if abs(still.mean_m + still.drift_m * self._most) <= self._travel_m else UNSTABLE

    def rest(self) -> None:
        """Judge a handle that stays at rest where it is: see `repetition`."""
        self._judged = Window(1, self._room)
        self._judged.add(np.array([self._position_m]))
        self._sum = self._position_m * (self._settled - self._mean_from)
        self.rms_m, self.verdict = 0.0, self._verdict_of(self._judged)


def _of_enough(windows: list[tuple[Window, int]]) -> Window | None:
    """Take the last windows that hold enough swings, and return them as one; None if there are too few."""
    if not windows:
        return None
    whole, swings = windows.pop()
    while swings < ENOUGH and windows:
        before, more = windows.pop()
        whole, swings = before.joined(whole), swings + more
    return whole if swings >= ENOUGH else None
