"""Samples that are missing in a recording, and samples that are in it twice.

An interval that is nearer to two usual ones, or more, than to one is a gap; what is less is jitter. As many samples are
missing as bring the pieces on either side into one line, each by the mean of its times. Stamps that are rounded to a
unit give intervals of two lengths, one unit apart. So an interval that is longer by less than `UNITS` units is a gap
only if the rate that is given says so; without a rate, unless there are `MANY` of them, spread as evenly as rounding
does. A sample is repeated if it has the time and the count of the sample before. The rules:

- `refuse`: either is an error.
- `hold`: a gap is filled with the count before it, as a controller sees it; repeated samples are taken out.
- `split`: the recording is cut at its gaps, and the longest piece counts; repeated samples are taken out.

A sensor, or its reading, that stood and then jumped is a gap without missing rows: `hold` takes it as it is, `split`
cuts behind it. See `steps`.
"""

from typing import NamedTuple

import numpy as np

from .error import RecordingError
from .recording import SAMPLES_MAX
from .stamps import Times

RULES = ("refuse", "hold", "split")
UNITS = 2
"""By how many units of a time stamp a gap is longer than the usual interval, beyond doubt."""
MANY = 8
"""How many longer intervals can be told from lost samples by how evenly they are spread."""


class Grid(NamedTuple):
    """Which samples of a file count, and when they were taken.

    Attributes:
        rows: the rows that count, in their order.
        numbers: for each, the number of its sample since the first; consecutive where none is missing.
        notes: what was done.
    """

    rows: np.ndarray
    numbers: np.ndarray
    notes: list[str]

    @property
    def passed(self) -> np.ndarray:
        """How many intervals of a sample it is from every row to the next: more than 1 where samples are missing."""
        return np.diff(self.numbers)


def whole(length: int) -> Grid:
    """Return the grid of a recording in which nothing is missing."""
    rows = np.arange(length)
    return Grid(rows, rows, [])


def passed_in(steps: np.ndarray, unit: float, rate_hz: float | None) -> np.ndarray:
    """Return how many intervals of a sample the intervals between times take: more than 1 where samples are missing.

    Args:
        steps: the intervals, all of them positive.
        unit: the resolution of a time.
        rate_hz: the sample rate, in samples a unit of the intervals; None if it is not known.
    """
    usual = float(np.median(steps))
    longer = np.rint(steps / usual) > 1
    # A little less than so many units, for the rounding of the intervals.
    certain = longer & (steps - usual >= (UNITS - 1e-3) * unit)
    fewest, doubtful = _whole(steps, certain, rate_hz), np.count_nonzero(longer & ~certain)
    if not doubtful:
        return fewest
    most = _whole(steps, longer, rate_hz)
    if rate_hz is not None:
        return most if _fits(steps, most, unit, rate_hz) else fewest
    return fewest if doubtful >= MANY and _fits(steps, fewest, unit, None) else most


def _whole(steps: np.ndarray, lacking: np.ndarray, rate_hz: float | None) -> np.ndarray:
    """Return how many intervals of a sample each takes, if samples are missing in some of them."""
    interval = float(steps[~lacking].mean()) if rate_hz is None else 1 / rate_hz
    passed, gaps = np.ones(len(steps)), np.flatnonzero(lacking)
    begins = np.append(0, gaps + 1)
    late = np.append(0.0, np.cumsum(steps)) - np.arange(len(steps) + 1) * interval
    means = np.add.reduceat(late, begins) / np.diff(begins, append=len(late))
    passed[gaps] += np.maximum(np.rint(np.diff(means) / interval), 0.0)
    return passed


def _fits(steps: np.ndarray, passed: np.ndarray, unit: float, rate_hz: float | None) -> bool:
    """Return whether all times are within a unit of the times of a rate, or of the line from the first to the last."""
    since, numbers = np.cumsum(steps), np.cumsum(passed)
    interval = since[-1] / numbers[-1] if rate_hz is None else 1 / rate_hz
    return bool((np.abs(since - numbers * interval) < unit * (1 - 1e-6)).all())


def grid_of(name: str, times: Times, counts: np.ndarray, rule: str, rate_hz: float | None) -> Grid:
    """Return the grid of a recording by its times.

    Args:
        name: the file, for a message.
        times: the time of every row.
        counts: the count of every row.
        rule: one of `RULES`.
        rate_hz: the sample rate that is given; None for none.

    Raises:
        RecordingError: if more samples are missing than a recording may have.
    """
    since = times.since
    if rule == "refuse" or len(since) < 3:
        return whole(len(since))
    twice = np.concatenate([[False], (np.diff(since) == 0) & (np.diff(counts) == 0)])
    rows = np.flatnonzero(~twice)
    notes = [f"{np.count_nonzero(twice)} repeated samples taken out"] if twice.any() else []
    steps = np.diff(since[rows])
    if not len(steps) or (steps <= 0).any():
        return Grid(rows, np.arange(len(rows)), notes)
    passed = passed_in(steps, times.resolution, rate_hz)
    if passed.sum() >= SAMPLES_MAX:
        raise RecordingError(
            f"{name}: must have at most {SAMPLES_MAX} samples, missing ones included, not {passed.sum() + 1:.0f}: "
            "give --gaps split"
        )
    numbers = np.concatenate([[0], np.cumsum(passed.astype(np.int64))])
    if rule == "split":
        return _longest(Grid(rows, numbers, notes))
    missing = int(numbers[-1]) + 1 - len(rows)
    held = f"{missing} missing samples in {np.count_nonzero(passed > 1)} gaps held"
    return Grid(rows, numbers, [*notes, held] if missing else notes)


def _longest(grid: Grid) -> Grid:
    """Return the longest piece of a grid between two gaps."""
    return piece(grid, np.flatnonzero(grid.passed > 1) + 1)


def piece(grid: Grid, cuts: np.ndarray) -> Grid:
    """Return the longest piece of a grid that is cut before some of its samples."""
    if not len(cuts):
        return grid
    ends = np.concatenate([[0], cuts, [len(grid.rows)]])
    longest = int(np.argmax(np.diff(ends)))
    part = slice(ends[longest], ends[longest + 1])
    numbers = grid.numbers[part]
    said = f"the longest of {len(ends) - 1} pieces, samples {ends[longest]} to {ends[longest + 1] - 1}"
    return Grid(grid.rows[part], numbers - numbers[0], [*grid.notes, said])


def held(counts: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return a count for every sample, of the rows at some numbers: a missing one has the count before it."""
    return np.repeat(counts, np.diff(numbers, append=numbers[-1] + 1))
