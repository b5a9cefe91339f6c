"""The times of an encoder's edges: since the first, in samples and in clocks.

Times are float64 and rounded: a time of k / rate is slightly off. `unsure_s` is by how much: two units in the last
place of the largest time. A time that is so little behind a sample, or behind a clock, is at it.
"""

import numpy as np
from numpy.typing import ArrayLike

from .checks import shown

SAMPLES_MAX = 10**8
"""The most samples of a record of edges."""


def since_first(times_s: ArrayLike, counts: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the times of edges since the first, s, float64, and how unsure they are, s.

    Args:
        times_s: as of `records.velocity_of_edges`.
        counts: int64, the counts.

    Raises:
        TypeError: if the times are not numbers.
        ValueError: if they are not finite, do not increase, or have another shape than the counts, or if a count
            changes by another number than 1.
    """
    times = np.asarray(times_s)
    if times.dtype.kind not in "fiuM":
        raise TypeError(f"times_s must be numbers, not {times.dtype}")
    if times.ndim != 1 or times.shape != counts.shape or len(times) < 2:
        raise ValueError(
            f"times_s and counts must have one shape (edges,) of 2 or more, not {times.shape} and {counts.shape}"
        )
    if (wrong := np.flatnonzero(~np.isfinite(times))).size:
        raise ValueError(f"times_s must be finite, not {times[wrong[0]]} at element {wrong[0]}")
    if (wrong := np.flatnonzero(times[1:] <= times[:-1])).size:
        before, after = (times[wrong[0] + n].item() for n in (0, 1))
        raise ValueError(f"times_s must increase, not from {shown(before)} to {shown(after)} at element {wrong[0] + 1}")
    steps = np.diff(counts)
    if (wrong := np.flatnonzero(np.abs(steps) != 1)).size:
        raise ValueError(f"counts must change by 1 at an edge, not by {steps[wrong[0]]} at element {wrong[0] + 1}")
    if times.dtype.kind == "M":
        since = (times - times[0]) / np.timedelta64(1, "s")
    else:
        since = (times - times[0]).astype(np.float64)
    exact = times.dtype.kind != "f"
    largest = since[-1] if exact else np.abs(times[[0, -1]]).max()
    return since, 2 * float(np.spacing(largest))


def samples_of(since_s: np.ndarray, counts: np.ndarray, sample_hz: float, unsure_s: float) -> np.ndarray:
    """Return the counts at the samples, from the start to the last sample before or at the last edge.

    Raises:
        ValueError: if there is no sample after the start, or there are more than `SAMPLES_MAX`.
    """
    lasts = since_s[-1]
    samples = np.floor((lasts + unsure_s) * sample_hz)
    if samples < 1:
        raise ValueError(f"times_s must last a sample of {1 / sample_hz:g} s or more, not {lasts:g} s")
    if samples > SAMPLES_MAX:
        raise ValueError(
            f"times_s must last at most {SAMPLES_MAX:g} samples at {sample_hz:g} Hz, not {samples:g} in {lasts:g} s: "
            f"are they in seconds?"
        )
    first_of = np.ceil((since_s - unsure_s) * sample_hz).astype(np.int64)
    return counts[np.searchsorted(first_of, np.arange(int(samples) + 1), side="right") - 1]


def clocks_of(since_s: np.ndarray, clock_hz: float, unsure_s: float) -> np.ndarray:
    """Return the clocks of edges, int64, the first at 0: their times, rounded up.

    Raises:
        ValueError: if two edges have the same clock.
    """
    clocks = np.ceil((since_s - unsure_s) * clock_hz).astype(np.int64)
    clocks[0] = 0
    if (close := np.flatnonzero(np.diff(clocks) < 1)).size:
        apart = since_s[close[0] + 1] - since_s[close[0]]
        raise ValueError(
            f"times_s must be a clock of {1 / clock_hz:g} s apart or more, not {apart:g} s at element {close[0] + 1}; "
            f"clock_hz gives a faster clock"
        )
    return clocks
