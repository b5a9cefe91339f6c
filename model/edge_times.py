"""The times of an encoder's edges: since the start of their record, in samples and in clocks.

Times of float64 are rounded, so a time that is k / rate is a little off. `Times.unsure_s` says by how much: two units
in the last place of a time, or of the start if that is larger. A time that is so little behind a sample, or behind a
clock, is at it. Each time depends on the times before it only, so a record may come in pieces.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .checks import integers

SAMPLES_MAX = 10**8
"""The most samples of a record of edges, or of a piece of it."""
UNIT = "are they in seconds? Times in ms, us or ns may be datetime64 of that unit"
"""What to ask where times last too long, or not long enough."""
CLOCKS_MAX = 2.0**62
"""The most clocks of a record of edges."""


class Times(NamedTuple):
    """Times of edges since the start of their record.

    Attributes:
        since_s: the times, s, float64.
        unsure_s: by how much each may be off, s, float64.
    """

    since_s: np.ndarray
    unsure_s: np.ndarray


def times_of(times_s: ArrayLike, like: np.ndarray | None = None, name: str = "times_s") -> np.ndarray:
    """Return times as an array of float64, int64 or datetime64.

    Args:
        times_s: as of `records.velocity_of_edges`.
        like: the times before them; None for none. Datetimes are then in the unit of these.
        name: what to call them in a message.

    Raises:
        TypeError: if they are neither numbers nor datetime64, or others than the times before.
        ValueError: if one is not finite.
    """
    times = np.asarray(times_s)
    if not times.size:
        return np.zeros(times.shape, np.float64 if like is None else like.dtype)
    if times.dtype.kind not in "fiuM":
        cure = ": divide them by np.timedelta64(1, 's')" if times.dtype.kind == "m" else ""
        raise TypeError(f"{name} must be numbers or datetime64, not {times.dtype}{cure}")
    if times.dtype.kind == "M" and np.datetime_data(times.dtype)[0] in "YM":
        raise TypeError(f"{name} must be datetime64 in days or a finer unit, not {times.dtype}")
    if not (finite := np.isfinite(times)).all():
        place = tuple(int(index) for index in np.unravel_index(np.argmin(finite), times.shape))
        where = f" at element {', '.join(map(str, place))}" if place else ""
        raise ValueError(f"{name} must be finite, not {times[place]}{where}")
    dates = times.dtype.kind == "M"
    if like is not None and (dates or like.dtype.kind == "M"):
        same = times.astype(like.dtype) if dates and np.can_cast(times.dtype, like.dtype) else None
        if same is None or (same.astype(times.dtype) != times).any():
            raise TypeError(f"{name} must be {like.dtype} as the times before, not {times.dtype}")
        return same
    if dates:
        return times
    return times.astype(np.float64) if times.dtype.kind == "f" else integers(name, times)


def check_edges(times: np.ndarray, counts: np.ndarray, before: int = 0) -> None:
    """Raise ValueError unless times increase, and counts change by 1.

    Args:
        times: what `times_of` returns, shape (edges,).
        counts: int64, the same shape.
        before: how many of the first elements are of an earlier piece.
    """
    if (wrong := np.flatnonzero(times[1:] <= times[:-1])).size:
        earlier, later = (times[wrong[0] + n] for n in (0, 1))
        same, cure = np.count_nonzero(times[1:] == times[:-1]), ""
        if earlier == later:
            cure = f"; {same} of {len(times) - 1} are as the one before: give times fine enough to tell edges apart"
        place = wrong[0] + 1 - before
        raise ValueError(f"times_s must increase, not from {earlier} to {later} at element {place}{cure}")
    steps = np.diff(counts)
    if (wrong := np.flatnonzero(np.abs(steps) != 1)).size:
        place = wrong[0] + 1 - before
        raise ValueError(f"counts must change by 1 at an edge, not by {steps[wrong[0]]} at element {place}")


def since(start: np.ndarray, times: np.ndarray) -> Times:
    """Return times since the start of their record; integers and datetime64 are subtracted exactly.

    Args:
        start: the time of the start, what `times_of` returns, shape ().
        times: the times, what `times_of` returns; they increase.

    Raises:
        ValueError: if a difference of datetime64 exceeds int64.
    """
    if times.dtype.kind == "M":
        passed = times - start
        # A difference beyond int64 is negative, or no time.
        if passed.size and not passed[-1] >= np.timedelta64(0):
            unit = np.datetime_data(times.dtype)[0]
            raise ValueError(f"times_s must last less than 2**63 {unit}: give {times.dtype} in a coarser unit")
        since_s = passed / np.timedelta64(1, "s")
    else:
        since_s = (times - start).astype(np.float64)
    exact = "f" not in (times.dtype.kind, start.dtype.kind)
    largest = since_s if exact else np.maximum(np.abs(times), np.abs(start))
    return Times(since_s, 2 * np.spacing(largest))


def sample_of(times: Times, sample_hz: float) -> np.ndarray:
    """Return the last sample at or before every time, float64; sample 0 is at the start."""
    return np.floor((times.since_s + times.unsure_s) * sample_hz)


def samples_of(times: Times, counts: np.ndarray, sample_hz: float) -> np.ndarray:
    """Return the counts at the samples, from the start to the last sample before or at the last edge.

    Raises:
        ValueError: if there is no sample after the start, or there are more than `SAMPLES_MAX`.
    """
    lasts = times.since_s[-1]
    samples = float(sample_of(times, sample_hz)[-1])
    if samples < 1:
        raise ValueError(f"times_s must last a sample of {1 / sample_hz:g} s or more, not {lasts:g} s: {UNIT}")
    check_length(samples, sample_hz)
    firsts = np.ceil((times.since_s - times.unsure_s) * sample_hz).astype(np.int64)
    firsts[0] = 0
    return np.repeat(counts, np.diff(np.maximum.accumulate(firsts), append=int(samples) + 1))


def check_length(samples: float, sample_hz: float) -> None:
    """Raise ValueError if times last more than `SAMPLES_MAX` samples."""
    if samples > SAMPLES_MAX:
        raise ValueError(
            f"times_s must last at most {SAMPLES_MAX:g} samples at {sample_hz:g} Hz, not {samples:g} in "
            f"{samples / sample_hz:g} s: {UNIT}"
        )


def clocks_of(times: Times, sample_hz: float, clocks_per_sample: int, first: int = 0, before: int = 0) -> np.ndarray:
    """Return the clocks of edges since the start, int64: their times, rounded up.

    A time that may be at a sample is at it. A time that may be behind the clock of the edge before it is there: so
    edges keep their order where a time is less certain than a clock.

    Args:
        times: the times, the first of them with a known clock.
        sample_hz: sample rate, Hz.
        clocks_per_sample: clocks of a sample.
        first: the clock of the first time.
        before: as of `check_edges`.

    Raises:
        ValueError: if two edges have the same clock, or there are more than `CLOCKS_MAX` clocks.
    """
    clock_hz = sample_hz * clocks_per_sample
    latest = (times.since_s + times.unsure_s) * clock_hz
    if latest[-1] >= CLOCKS_MAX:
        raise ValueError(
            f"times_s must last less than {CLOCKS_MAX:g} clocks of {1 / clock_hz:g} s, not {times.since_s[-1]:g} s; "
            f"clock_hz gives a slower clock"
        )
    wanted = np.ceil((times.since_s - times.unsure_s) * clock_hz).astype(np.int64)
    # Times that are off by less than a clock, with the rounding of these products, need no move: skipped for speed.
    if 4 * times.unsure_s[-1] * clock_hz >= 1:
        wanted = np.maximum(wanted, sample_of(times, sample_hz).astype(np.int64) * clocks_per_sample)
    wanted[0] = first
    if (np.diff(wanted) >= 1).all():
        return wanted
    order = np.arange(len(wanted))
    clocks = np.maximum.accumulate(wanted - order) + order
    if (close := np.flatnonzero((clocks > wanted) & (clocks > latest))).size:
        apart, place = times.since_s[close[0]] - times.since_s[close[0] - 1], close[0] - before
        raise ValueError(
            f"times_s must be a clock of {1 / clock_hz:g} s apart or more, not {apart:g} s at element {place}; "
            f"clock_hz gives a faster clock"
        )
    return clocks
