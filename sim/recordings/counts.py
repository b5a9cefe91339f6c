"""Cells as counts: whole numbers, or angles and lengths that are multiples of the size of a count.

A value in another unit than counts is divided by the size of a count. The first value is subtracted before, so an
origin between two counts does no harm. The quotient must be within `OFF_MAX` of a whole number.
"""

import math
import re
from collections.abc import Sequence

import numpy as np

from ...model.checks import shown
from .error import RecordingError, plain
from .stamps import decimal_of
from .steps import SPAN_BITS
from .table import Cells, Table

COUNT_BITS = 62
"""The bits of a count with its sign: neither unwrapping nor a model of it leaves int64."""
WHOLE_COUNT = f"a count must be a whole number of -2**{COUNT_BITS - 1} to 2**{COUNT_BITS - 1} - 1"
UNITS = ("counts", "rad", "deg", "turns", "m")
TURN = {"rad": math.tau, "deg": 360.0, "turns": 1.0}
OFF_MAX = 0.1
"""How far a value may be from a whole number of counts, in counts."""
_WHOLE = re.compile(r"(?:[+-]?[0-9]{1,18}\n)*[+-]?[0-9]{1,18}")
_SIZE = re.compile(r"(?P<number>[0-9.]+(?:e[+-]?[0-9]+)?)?\s*\*?\s*(?P<pi>pi)?(?:\s*/\s*(?P<parts>[0-9.]+))?", re.I)


def size_of(text: str) -> float | None:
    """Return the size of a count, written as a number, a fraction such as `360/40000`, or `2pi/2048`; None if it is
    none of these, or not positive."""
    match = _SIZE.fullmatch(text.strip())
    if not match or not (match["number"] or match["pi"]):
        return None
    try:
        size = float(match["number"] or 1) * (math.pi if match["pi"] else 1.0) / float(match["parts"] or 1)
    except (ValueError, ZeroDivisionError):
        return None
    return size if 0 < size < math.inf else None


def turn_of(unit: str, size: float | None) -> int | None:
    """Return the counts of one turn; None for a unit without turns, or a size that does not divide a turn."""
    if unit not in TURN or size is None:
        return None
    parts = TURN[unit] / size
    whole = parts < 1 << SPAN_BITS and abs(parts - round(parts)) <= OFF_MAX
    return round(parts) if whole and round(parts) > 1 else None


class Counts:
    """The counts of samples, which are added chunk by chunk.

    Args:
        table: the file, for a message.
        column: name of the column, for a message.
        unit: one of `UNITS`.
        wide: whether a counter of 64 bits is read, whose counts may be unsigned.
    """

    def __init__(self, table: Table, column: str, unit: str, wide: bool):
        self._table, self._column, self._unit, self._wide = table, column, unit, wide
        self._parts: list[np.ndarray] = []

    def add(self, lines: Sequence[int], cells: Cells) -> None:
        """Add the cells of some rows.

        Raises:
            RecordingError: if a cell is no count, or no number.
        """
        if isinstance(cells, np.ndarray) and cells.dtype.kind in "Mm":
            what = "counts" if self._unit == "counts" else f"values in {self._unit}"
            raise RecordingError(f"{self._table.name}, column {plain(self._column)}: must have {what}, not times")
        if self._unit == "counts":
            self._parts.append(self._counts(lines, cells))
            return
        values = np.empty(len(cells))
        if isinstance(cells, np.ndarray):
            values[:] = cells.astype(np.float64)
        else:
            for place, cell in enumerate(cells):
                number = decimal_of(cell)
                values[place] = math.nan if number is None else float(number)
        wrong = ~np.isfinite(values)
        if wrong.any():
            place = int(np.argmax(wrong))
            raise RecordingError(
                f"{self._where(lines[place])}: a value must be a number ({self._unit}), not {shown(str(cells[place]))}"
            )
        self._parts.append(values)

    def _where(self, line: int) -> str:
        return f"{self._table.at(line)}, column {plain(self._column)}"

    def _counts(self, lines: Sequence[int], cells: Cells) -> np.ndarray:
        end = 1 << (COUNT_BITS - 1)
        if isinstance(cells, np.ndarray):
            if cells.dtype == np.uint64 and self._wide:
                return cells.view(np.int64)
            wrong = ~(np.floor(cells) == cells) | ~(np.abs(cells.astype(np.float64)) < end)
            if wrong.any() and not (self._wide and cells.dtype.kind in "iu"):
                place = int(np.argmax(wrong))
                raise self._refused(lines[place], str(cells[place]))
            return cells.astype(np.int64)
        joined = "\n".join(cells)
        if joined.count("\n") < len(cells) and _WHOLE.fullmatch(joined):
            return np.fromstring(joined, np.int64, sep="\n")
        return np.array([self._count(line, cell) for line, cell in zip(lines, cells, strict=True)], np.int64)

    def _count(self, line: int, text: str) -> int:
        number = decimal_of(text)
        # The exponent is checked first: 1e999999 as an integer would fill the memory.
        if (
            number is not None
            and number.is_finite()
            and number.adjusted() < 20
            and number == number.to_integral_value()
        ):
            count, end = int(number), 1 << (COUNT_BITS - 1)
            if self._wide and -(1 << 63) <= count < 1 << 64:
                return (count + (1 << 63)) % (1 << 64) - (1 << 63)
            if -end <= count < end:
                return count
        raise self._refused(line, text)

    def _refused(self, line: int, text: str) -> RecordingError:
        """Return the error of a cell that is no count, with what helps."""
        number = decimal_of(text)
        cure = ""
        if number is not None and number.is_finite() and number != 0:
            if number.adjusted() < 18:
                cure = ": for an angle or a length, say its unit and the size of a count (--unit, --count)"
            elif number.adjusted() < 20 and not self._wide:
                cure = ": for a counter of 64 bits, say so (--counter-bits 64)"
        return RecordingError(f"{self._where(line)}: {WHOLE_COUNT}, not {shown(text)}{cure}")

    def whole(self, lines: Sequence[int], size: float | None) -> tuple[np.ndarray, list[str]]:
        """Return all the counts, int64, and what was understood of them.

        Args:
            lines: the number of every row.
            size: the size of a count in the unit; None for counts.

        Raises:
            RecordingError: if values are no multiples of the size, or it is not given.
        """
        values = np.concatenate(self._parts)
        if self._unit == "counts":
            return values, []
        if size is None:
            self._ask(values)
        quotient = (values - values[0]) / size
        counts = np.rint(quotient)
        off = np.abs(quotient - counts)
        wrong = (off > OFF_MAX) | (np.abs(counts) >= 1 << (COUNT_BITS - 1))
        if wrong.any():
            place = int(np.argmax(wrong))
            raise RecordingError(
                f"{self._where(lines[place])}: values must be multiples of {size:g} {self._unit} (--count), counted "
                f"from the first, within {OFF_MAX:g} of it, not {quotient[place]:.6g} of it: correct --count, or --unit"
            )
        origin = values[0] / size
        counts = counts.astype(np.int64) + (round(origin) if abs(origin) < 1 << (COUNT_BITS - 2) else 0)
        said = [f"{self._unit}, {size:g} a count, within {max(float(off.max()), 1e-9):.1g} counts"]
        step = int(np.gcd.reduce(counts - counts[0]))
        if step > 1:
            said.append(f"every count is a multiple of {step}, so a count may be {step} times larger")
        return counts, said

    def _ask(self, values: np.ndarray) -> None:
        """Raise RecordingError for a missing size of a count; the message has the size that the values suggest."""
        steps = np.abs(np.diff(values))
        steps = steps[steps > 1e-9 * np.abs(values).max()]
        hint = ""
        if len(steps):
            least = float(steps.min())
            turn = TURN.get(self._unit)
            parts = round(turn / least) if turn else 0
            name = {"rad": "2pi", "deg": "360", "turns": "1"}.get(self._unit)
            fits = parts and abs(turn / parts / least - 1) < 1e-3
            hint = f": the smallest step is {least:.6g}" + (f", as --count {name}/{parts} would be" if fits else "")
        raise RecordingError(
            f"{self._table.name}, column {plain(self._column)}: values in {self._unit} need the size of "
            f"a count in {self._unit} (--count){hint}"
        )
