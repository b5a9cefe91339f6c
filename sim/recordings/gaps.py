"""Samples that are missing in a recording, and samples that are in it twice.

An interval of `USUAL` usual ones or more is a gap: as many samples are missing as make the interval whole. A sample is
repeated if its time and its count are those of the sample before. The rules:

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

RULES = ("refuse", "hold", "split")
USUAL = 1.5
"""From how many usual intervals on one may lack a sample; what is less is jitter."""


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


def grid_of(name: str, since: np.ndarray, counts: np.ndarray, rule: str) -> Grid:
    """Return the grid of a recording by its times.

    Args:
        name: the file, for a message.
        since: the time of every row after the first.
        counts: the count of every row.
        rule: one of `RULES`.

    Raises:
        RecordingError: if more samples are missing than a recording may have.
    """
    if rule == "refuse" or len(since) < 3:
        return whole(len(since))
    twice = np.concatenate([[False], (np.diff(since) == 0) & (np.diff(counts) == 0)])
    rows = np.flatnonzero(~twice)
    notes = [f"{np.count_nonzero(twice)} repeated samples taken out"] if twice.any() else []
    steps = np.diff(since[rows])
    usual = float(np.median(steps)) if len(steps) else 0.0
    if usual <= 0 or (steps <= 0).any():
        return Grid(rows, np.arange(len(rows)), notes)
    passed = np.where(steps >= USUAL * usual, np.rint(steps / usual), 1.0)
    if passed.sum() >= SAMPLES_MAX:
        raise RecordingError(
            f"{name}: must have at most {SAMPLES_MAX} samples with those that are missing, not {passed.sum() + 1:.0f}: "
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
