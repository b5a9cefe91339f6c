"""The steps of recorded counts: a counter that wrapped is unwrapped, and a step that is no motion is refused.

A handle does not reach a speed and lose it again within one sample. So a step is held against the `BESIDE` steps on
either side of it. With the median of these and their spread, the largest less the smallest, a step is no motion if

    |step - median| > JUMP * max(spread, FLOOR * (the smallest step of the recording that is not 0))

Where the speed itself jumps, at an impact, the spread is that jump, and the step lies within it. At the ends of a
recording, where one side is missing, the largest of the other steps stands for the spread. A single wrong sample makes
two opposite steps, which do not support each other.

The width of the counter. If it is given, every step is taken modulo its range. If it is not, steps are taken modulo
2**`SPAN_BITS`; where that leaves a step that is no motion, the counter may be narrower. Its width is then the least
whose range holds all counts, of 8 to 31 bits, provided that

- every step across the end of the range, once unwrapped, differs from the median of the steps beside it by no more than
  their spread, or `CLOSE` of the smallest steps; and
- no step is longer than a quarter of the range, so that its direction is beyond doubt.

A file that does not meet both has another fault than a counter that wrapped, and is refused.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .error import RecordingError, plain
from .table import Table

SPAN_BITS = 32
BESIDE = 3
JUMP, FLOOR = 4, 8
"""How often the spread a step may be off, and the least spread in smallest steps: single counts are no jump."""
CLOSE = 2
"""How many smallest steps a step across the end of a range may be off."""
WRAP_BITS = range(8, SPAN_BITS)
"""The widths of counters that are found, and that a message knows."""
COUNTER_BITS = 8, 64
"""The widths of counters that can be given."""
LARGEST = 1 << 61
CHUNK = 1 << 16


class Unwrapped(NamedTuple):
    """Counts without wraps.

    Attributes:
        counts: the counts, int64.
        cuts: the samples that a sensor that stood jumps to.
        notes: what was understood.
    """

    counts: np.ndarray
    cuts: np.ndarray
    notes: list[str]


class Steps:
    """The steps between the samples of a recording.

    Args:
        table: the file, for a message.
        column: the column of the counts.
        lines: the line of every count in the file.
        counts: the counts as they are in the file, int64.
        gaps: for every step, whether samples are missing there, so that it may be any.
    """

    def __init__(self, table: Table, column: str, lines: Sequence[int], counts: np.ndarray, gaps: np.ndarray):
        self._table, self._column, self._lines, self._counts, self._gaps = table, column, lines, counts, gaps
        # A difference of two int64 that is not negative is exact as an unsigned number modulo 2**64.
        self._spread = np.maximum.accumulate(counts).view(np.uint64) - np.minimum.accumulate(counts).view(np.uint64)

    def _where(self, sample: int) -> str:
        return f"{self._table.at(self._lines[sample])}, column {plain(self._column)}"

    def unwrapped(self, bits: int | None, may_stand: bool) -> Unwrapped:
        """Return the counts without wraps.

        Args:
            bits: width of the counter; None to find it.
            may_stand: whether a sensor may stand and then jump.

        Raises:
            RecordingError: if the counts span too much, or a step is no motion.
        """
        self._check_span(bits)
        steps, notes = _modulo(self._counts, bits or SPAN_BITS), []
        if bits is None and (bits := self._found(steps)) is not None:
            steps = _modulo(self._counts, bits)
        wraps = np.count_nonzero(steps != _modulo(self._counts, COUNTER_BITS[1]))
        if wraps or bits:
            notes.append(f"a counter of {bits or SPAN_BITS} bits that wrapped {wraps} times")
        cuts = self._check(steps, may_stand)
        first = int(self._counts[0])
        counts = np.concatenate([[0], np.cumsum(steps)]) + (first if abs(first) <= LARGEST else 0)
        if abs(float(np.sum(steps, dtype=np.float64))) >= LARGEST or np.abs(counts).max() > 2 * LARGEST:
            raise RecordingError(f"{self._where(0)}: counts must stay within 2**61 of the first, unwrapped")
        return Unwrapped(counts, cuts, notes)

    def _check_span(self, bits: int | None) -> None:
        """Raise RecordingError if the counts do not fit the counter."""
        if bits == COUNTER_BITS[1]:
            return
        wide = np.flatnonzero(self._spread >> np.uint64(bits or SPAN_BITS))
        if len(wide):
            cure = ": give a larger --counter-bits" if bits else ""
            raise RecordingError(
                f"{self._where(wide[0])}: counts must span less than 2**{bits or SPAN_BITS}, "
                f"not {self._spread[wide[0]]} up to here{cure}"
            )

    def _found(self, steps: np.ndarray) -> int | None:
        """Return the width of a counter that wrapped where a step is no motion; None if none explains it."""
        if next(_jumps(steps, self._gaps), None) is None:
            return None
        bits = int(self._spread[-1]).bit_length()
        if bits not in WRAP_BITS:
            return None
        within = _modulo(self._counts, bits)
        wraps = np.flatnonzero(within != steps)
        if not len(wraps) or np.abs(within).max() > 1 << (bits - 2):
            return None
        usual, spread = _around(within, wraps)
        near = np.maximum(spread, CLOSE * np.abs(within[within != 0]).min())
        return bits if (np.abs(within[wraps] - usual) <= near).all() else None

    def _check(self, steps: np.ndarray, may_stand: bool) -> np.ndarray:
        """Return the samples that a sensor that stood jumps to; raise RecordingError if another step is no motion."""
        cuts = []
        for place, usual, near in _jumps(steps, self._gaps):
            stood = _stood(steps, place) > BESIDE
            if may_stand and stood:
                cuts.append(place + 1)
                continue
            cure = _cure(self._counts, steps, place, steps[place] - usual, near)
            raise RecordingError(
                f"{self._where(place + 1)}: the count must not go by {steps[place]} in one "
                f"sample where {usual:g} is usual beside it, for no motion does that: {cure}"
            )
        return np.array(cuts, np.int64)


def _modulo(counts: np.ndarray, bits: int) -> np.ndarray:
    """Return the steps of counts of a counter of so many bits, each the shortest way."""
    with np.errstate(over="ignore"):
        steps = np.diff(counts)
        if bits == COUNTER_BITS[1]:
            return steps
        half = np.int64(1 << (bits - 1))
        return ((steps + half) & (half - 1 + half)) - half


def _stood(steps: np.ndarray, place: int) -> int:
    """Return how many samples the count did not move before a step."""
    moved = np.flatnonzero(steps[:place])
    return place - (int(moved[-1]) + 1 if len(moved) else 0)


def _jumps(steps: np.ndarray, gaps: np.ndarray) -> Iterator[tuple[int, float, float]]:
    """Yield the number of every step that is no motion, the median of the steps beside it, and how much a step may be
    off; nothing if there are too few steps to tell.

    Args:
        steps: the steps.
        gaps: for every step, whether it may be any.
    """
    if len(steps) <= 2 * BESIDE or not steps.any():
        return
    least = FLOOR * float(np.abs(steps[steps != 0]).min())
    # A jump differs from both its neighbours by nearly all that it is off: most steps are not looked at again.
    changes = np.abs(np.diff(steps))
    beside = np.concatenate([changes[:1], np.minimum(changes[1:], changes[:-1]), changes[-1:]])
    suspects = np.flatnonzero((beside > JUMP * least // 2) & ~gaps)
    for first in range(0, len(suspects), CHUNK):
        places = suspects[first : first + CHUNK]
        usual, spread = _around(steps, places)
        near = JUMP * np.maximum(spread, least)
        for found in np.flatnonzero(np.abs(steps[places] - usual) > near):
            yield int(places[found]), float(usual[found]), float(near[found])


def _around(steps: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the median and the spread of the steps beside those at `places`."""
    first = np.clip(places - BESIDE, 0, len(steps) - 2 * BESIDE - 1)
    window = first[:, None] + np.arange(2 * BESIDE + 1)
    others = window[window != places[:, None]].reshape(len(places), -1)
    values = steps[others].astype(np.float64)
    usual = np.median(values, axis=1)
    off = steps[places] - usual
    # The way back from a single wrong sample is none of what is usual.
    next_to = np.abs(others - places[:, None]) == 1
    back = next_to & (np.abs((values - usual[:, None]) + off[:, None]) < np.abs(off[:, None]) / 2)
    values = np.where(back, usual[:, None], values)
    at_an_end = first != places - BESIDE
    spread = np.where(at_an_end, np.abs(values).max(axis=1), values.max(axis=1) - values.min(axis=1))
    return usual, spread


def _cure(counts: np.ndarray, steps: np.ndarray, place: int, off: float, near: float) -> str:
    """Return what has probably happened at a step that is `off` by so much, and what helps."""
    count, cut = int(counts[place + 1]), "cut the recording at this line"
    bits = next((bits for bits in WRAP_BITS if abs(abs(off) - 2.0**bits) <= near / JUMP), None)
    if bits is not None:
        return f"if a counter of {bits} bits wrapped, give --counter-bits {bits}"
    if abs(count) <= near / JUMP:
        return f"if the counter was set to 0, add {-round(off)} in this line and all after it, or {cut}"
    held = _stood(steps, place)
    if held > BESIDE:
        return (
            f"if the sensor or its reading stood, for {held} samples before it, take it so (--gaps hold), or keep the "
            "longest piece (--gaps split)"
        )
    return f"correct this line, or {cut}"
