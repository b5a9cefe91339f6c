"""The steps of recorded counts: wraps of a counter are undone, and steps that are no motion are refused.

A handle does not reach a speed and lose it again within one sample. So a step is held against the `BESIDE` steps on
either side of it. With the median of these and their spread, the largest less the smallest, a step is no motion if

    |step - median| > JUMP * max(spread, FLOOR * (the smallest step of the recording that is not 0))

Where the speed itself jumps, at an impact, the spread is that jump, and the step lies within it. At the ends of a
recording, where one side is missing, the largest of the other steps stands for the spread. A single wrong sample makes
two opposite steps, which do not support each other. Where samples are missing, a step may be any.

The range of the counter. If its width or its range is given, every step is taken modulo this range. If it is not, steps
are taken modulo 2**`SPAN_BITS`. The range may be smaller if this leaves a step that is no motion, or the fastest step
is over missing samples. For angles that span no more it is then one turn. For others it is the least power of two that
holds all counts, 8 to 31 bits, provided that

- every step across the end of the range, once unwrapped, is close to the median of its neighbours: within their spread,
  or `CLOSE` times the number that divides all steps; over missing samples it is no faster than the other steps; and
- no step is longer than a quarter of the range, so that its direction is beyond doubt.

If a file does not meet both, its fault is no wrapped counter, and it is refused. Of a range that is given, a step
across the end may differ by `JUMP` times the spread. Other ranges than powers of two are not found. If a step goes from
one end of all counts to the other, the message says which range would fit.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .counter import BITS, MODULI, Counter
from .error import RecordingError, plain
from .table import Table

SPAN_BITS = 32
BESIDE = 3
JUMP, FLOOR = 4, 8
"""How often the spread a step may be off, and the least spread in smallest steps: single counts are no jump."""
CLOSE = 2
"""How often the number that divides all steps a step across the end of a range may be off."""
WRAP_BITS = range(8, SPAN_BITS)
"""The widths of counters that are found, and that a message knows."""
LARGEST = 1 << 61
CHUNK = 1 << 16
ROUND = 100
"""Ranges of counters are often multiples of this number."""


class Unwrapped(NamedTuple):
    """Counts without wraps.

    Attributes:
        counts: the counts, int64.
        cuts: the samples to which a stuck sensor jumps.
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
        passed: for every step, how many intervals of a sample it takes: more than 1 where samples are missing.
        turn: counts of one turn, of angles; None for other values. Angles that span more have not wrapped at a turn.
    """

    def __init__(
        self,
        table: Table,
        column: str,
        lines: Sequence[int],
        counts: np.ndarray,
        passed: np.ndarray,
        turn: int | None = None,
    ):
        self._table, self._column, self._lines, self._counts = table, column, lines, counts
        self._passed = passed
        # A difference of two int64 that is not negative is exact as an unsigned number modulo 2**64.
        self._spread = np.maximum.accumulate(counts).view(np.uint64) - np.minimum.accumulate(counts).view(np.uint64)
        self._turn = turn if turn is not None and self._spread[-1] <= turn else None

    def _where(self, sample: int) -> str:
        return f"{self._table.at(self._lines[sample])}, column {plain(self._column)}"

    def unwrapped(self, counter: Counter | None, may_stand: bool) -> Unwrapped:
        """Return the counts without wraps.

        Args:
            counter: the counter; None to find it.
            may_stand: whether a sensor may stand and then jump.

        Raises:
            RecordingError: if the counts span too much, or a step is no motion.
        """
        self._check_span(counter)
        size = counter.size if counter else 1 << SPAN_BITS
        steps, notes = _modulo(self._counts, size), []
        found = self._found(steps) if counter is None else None
        if found is not None:
            size, steps = found, _modulo(self._counts, found)
        wraps = steps != _modulo(self._counts, 1 << BITS[1])
        if wraps.any() or counter or found:
            what = "an angle" if found and found == self._turn else str(counter or Counter(size, "--counter-bits"))
            notes.append(f"{what} that wrapped {np.count_nonzero(wraps)} times")
        if counter is not None:
            self._check_range(counter, steps, wraps)
        cuts = self._check(steps, may_stand)
        if np.abs(np.cumsum(steps, dtype=np.float64)).max() >= LARGEST:
            raise RecordingError(f"{self._where(0)}: counts must stay within 2**61 of the first, unwrapped")
        counts, first = np.concatenate([[0], np.cumsum(steps)]), int(self._counts[0])
        if first + int(counts.min()) >= -LARGEST and first + int(counts.max()) < LARGEST:
            counts += first
        else:
            notes.append(f"counted from the first, {first}")
        return Unwrapped(counts, cuts, notes)

    def _check_span(self, counter: Counter | None) -> None:
        """Raise RecordingError if the counts do not fit the counter."""
        size, range_of = (counter.size, counter.range) if counter else (1 << SPAN_BITS, f"2**{SPAN_BITS}")
        if size >> BITS[1]:
            return
        wide = np.flatnonzero(self._spread >= np.uint64(size))
        if len(wide):
            cure = f": give a larger {counter.option}" if counter else ""
            raise RecordingError(
                f"{self._where(wide[0])}: counts must span less than {range_of}, not {self._spread[wide[0]]} "
                f"up to here{cure}"
            )

    def _found(self, steps: np.ndarray) -> int | None:
        """Return the range of a counter that wrapped where a step is no motion; None if none explains it."""
        if next(_jumps(steps, self._gaps), None) is None and not self._too_fast(steps).any():
            return None
        span = int(self._spread[-1])
        sizes = [] if self._turn is None else [self._turn]
        sizes += [1 << span.bit_length()] if span.bit_length() in WRAP_BITS else []
        return next((size for size in sizes if self._explains(size, steps)), None)

    def _explains(self, size: int, steps: np.ndarray) -> bool:
        """Return whether a counter of a range wrapped where some steps of the recording are no motion."""
        within = _modulo(self._counts, size)
        wraps = within != steps
        if not wraps.any() or np.abs(within).max() > size // 4 or self._too_fast(within)[wraps].any():
            return False
        return not self._misfits(within, wraps, 1).size

    def _misfits(self, within: np.ndarray, wraps: np.ndarray, spreads: int) -> np.ndarray:
        """Return the steps across the end of a range that differ from their neighbours: by more than so many spreads,
        and `CLOSE` times the number that divides all steps."""
        places = np.flatnonzero(wraps & ~self._gaps)
        if len(within) <= 2 * BESIDE or not len(places):
            return places[:0]
        usual, spread = _around(within, places)
        near = np.maximum(spreads * spread, CLOSE * float(np.gcd.reduce(within)))
        return places[np.abs(within[places] - usual) > near]

    def _check_range(self, counter: Counter, steps: np.ndarray, wraps: np.ndarray) -> None:
        """Raise RecordingError if a given range makes misfitting steps across its end."""
        wrong = self._misfits(steps, wraps, JUMP)
        if len(wrong):
            usual, _ = _around(steps, wrong[:1])
            raise RecordingError(
                f"{self._where(wrong[0] + 1)}: the count must not go by {steps[wrong[0]]}, as {counter} "
                f"that wrapped there, where {usual[0]:g} is usual beside it: correct {counter.option}, or leave it out"
            )

    @cached_property
    def _gaps(self) -> np.ndarray:
        """For every step, whether samples are missing there, so that it may be any."""
        return self._passed > 1

    def _too_fast(self, steps: np.ndarray) -> np.ndarray:
        """Return for every step whether it goes over missing samples, and faster than all steps that do not."""
        if self._gaps.all():
            return ~self._gaps
        return self._gaps & (np.abs(steps) > self._passed * np.abs(steps[~self._gaps]).max())

    def _check(self, steps: np.ndarray, may_stand: bool) -> np.ndarray:
        """Return the samples to which a stuck sensor jumps; raise RecordingError if another step is no motion."""
        cuts, held = [], _held(steps)
        for place, usual, spread in _jumps(steps, self._gaps):
            if may_stand and held[place] > BESIDE:
                cuts.append(place + 1)
                continue
            raise RecordingError(
                f"{self._where(place + 1)}: the count must not go by {steps[place]} in one "
                f"sample where {usual:g} is usual beside it, for no motion does that: "
                f"{self._cure(steps, place, steps[place] - usual, spread, int(held[place]))}"
            )
        return np.array(cuts, np.int64)

    def _cure(self, steps: np.ndarray, place: int, off: float, spread: float, held: int) -> str:
        """Return the probable cause of a step that is `off` by so much, and the remedy."""
        count, cut, least = int(self._counts[place + 1]), "cut the recording at this line", _smallest(steps)
        close = max(spread, CLOSE * float(np.gcd.reduce(steps)))
        if self._turn is not None and abs(abs(off) - self._turn) <= close:
            return "if the angle wrapped at a turn, unwrap it before: it is too fast here to tell its direction"
        bits = next((bits for bits in WRAP_BITS if abs(abs(off) - 2.0**bits) <= close), None)
        if bits is not None:
            return f"if a counter of {bits} bits wrapped, give --counter-bits {bits}"
        cures = [self._modulus_cure(steps, abs(off), close)]
        if abs(count) <= max(spread, FLOOR * least):
            cures.append(f"if the counter was set to 0, add {-round(off)} in this line and all after it, or {cut}")
        if any(cures):
            return "; ".join(filter(None, cures))
        if held > BESIDE:
            return (
                f"if the sensor or its reading stood, for {held} samples before it, take it so (--gaps hold), or keep "
                "the longest piece (--gaps split)"
            )
        return f"correct this line, or {cut}"

    def _modulus_cure(self, steps: np.ndarray, off: float, close: float) -> str:
        """Return what to say of a step off by as much as all counts span, which another counter may have made; empty
        for another step."""
        least, reach = int(self._spread[-1]) + 1, close + float(np.median(np.abs(steps)))
        jumps = [abs(steps[place] - usual) for place, usual, _ in _jumps(steps, self._gaps)]
        likely = max(float(np.mean([each for each in jumps if abs(each - off) <= reach])), least)
        if abs(off - least) > reach or not MODULI[0] <= likely <= MODULI[1]:
            return ""
        near = round(likely / ROUND) * ROUND
        modulus = near if near >= least and abs(near - likely) <= close else round(likely)
        return f"if a counter of about {modulus} counts wrapped, give the exact number, as --counter-modulus {modulus}"


def _modulo(counts: np.ndarray, size: int) -> np.ndarray:
    """Return the steps of counts of a counter of a range, each the shortest way."""
    with np.errstate(over="ignore"):
        steps = np.diff(counts)
        if size == 1 << BITS[1]:
            return steps
        half = np.int64(size // 2)
        if size & (size - 1):
            return (steps + half) % np.int64(size) - half
        return ((steps + half) & (half - 1 + half)) - half


def _smallest(steps: np.ndarray) -> float:
    """Return the smallest magnitude of the steps that are not 0; 1 if all are."""
    moved = np.abs(steps[steps != 0])
    return float(moved.min()) if len(moved) else 1.0


def _held(steps: np.ndarray) -> np.ndarray:
    """Return for every step how many samples the count did not move before it."""
    place = np.arange(len(steps))
    moved = np.maximum.accumulate(np.where(steps != 0, place, -1))
    return place - 1 - np.concatenate([[-1], moved[:-1]])


def _jumps(steps: np.ndarray, gaps: np.ndarray) -> Iterator[tuple[int, float, float]]:
    """Yield the number of every step that is no motion, and the median and the spread of the steps beside it; nothing
    if there are too few steps to tell.

    Args:
        steps: the steps.
        gaps: for every step, whether it may be any.
    """
    if len(steps) <= 2 * BESIDE or not steps.any():
        return
    least = FLOOR * _smallest(steps)
    # A jump differs from both its neighbours by nearly all that it is off: most steps are not looked at again.
    changes = np.abs(np.diff(steps))
    beside = np.concatenate([changes[:1], np.minimum(changes[1:], changes[:-1]), changes[-1:]])
    suspects = np.flatnonzero((beside > JUMP * least // 2) & ~gaps)
    for first in range(0, len(suspects), CHUNK):
        places = suspects[first : first + CHUNK]
        usual, spread = _around(steps, places)
        near = JUMP * np.maximum(spread, least)
        for found in np.flatnonzero(np.abs(steps[places] - usual) > near):
            yield int(places[found]), float(usual[found]), float(spread[found])


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
