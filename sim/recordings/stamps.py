"""The times of samples as a file gives them, exactly: decimal numbers, the float64 of an array, or ISO timestamps.

A decimal time is kept as a whole number and a power of ten, so differences of times have no rounding but their last. A
text of 17 or more digits that is a rounded float64 was printed in full. It counts as the shortest decimal of that
float64. Other texts keep all the digits that int64 holds.
"""

import math
import re
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from decimal import ROUND_HALF_EVEN, Context, Decimal, InvalidOperation
from functools import lru_cache

import numpy as np

from ...model.checks import shown
from .dialect import ISO
from .error import RecordingError, plain
from .table import CHUNK, Cells, Table

UNITS = {"s": 0, "ms": -3, "us": -6, "ns": -9}
"""The units of times, as powers of ten of a second."""
TIME_MAX_S, TIME_MAX = 1e12, 9e18
"""The largest time stamp, either way: tens of thousands of years, and what int64 has, which is less in nanoseconds."""
DIGITS_MAX, DIGITS_OF_FLOAT = 19, 17
"""The most digits of a whole number in int64, and the digits that distinguish every float64."""
LEAST_POWER = -400
"""The least power of ten of a time: what is smaller is 0, as in float64."""


def decimal_of(text: str) -> Decimal | None:
    """Return the number that a cell has; None if it has none."""
    try:
        return Decimal(text) if text.isascii() and "_" not in text else None
    except InvalidOperation:
        return None


def _shortest(number: Decimal) -> Decimal:
    """Return the shortest decimal of the float64 that a number is in full; the number itself if it is none."""
    _, digits, power = number.as_tuple()
    if len(digits) < DIGITS_OF_FLOAT or power >= 0:
        return number
    value = float(number)
    off = abs(Context(60).subtract(Decimal(value), number))
    return Decimal(repr(value)) if off <= Decimal(1).scaleb(power) else number


def _alike(cells: list[str]) -> tuple[np.ndarray | None, int]:
    """Return the whole numbers and the power of ten of texts that all have as many decimals; (None, 0) for others."""
    joined, (_, point, decimals) = "\n".join(cells), cells[0].partition(".")
    whole = (DIGITS_OF_FLOAT if point else DIGITS_MAX) - 1 - len(decimals)
    if whole < 1 or joined.count("\n") >= len(cells) or not joined.isascii():
        return None, 0
    form = rf"[+-]?\d{{1,{whole}}}" + (rf"\.\d{{{len(decimals)}}}" if point else "")
    if not re.fullmatch(rf"(?:{form}\n)*{form}", joined):
        return None, 0
    return np.fromstring(joined.replace(".", ""), np.int64, sep="\n"), -len(decimals)


class Stamps:
    """The times of samples, which are added chunk by chunk.

    Args:
        table: the file, for a message.
        column: name of the column, for a message.
        unit: unit of the times, if it is known before they are read; `iso` for timestamps.
    """

    def __init__(self, table: Table, column: str, unit: str | None):
        self._table, self._column, self.unit = table, column, unit
        self._parts: list[tuple[np.ndarray, np.ndarray | int]] = []
        self._floats: list[np.ndarray] = []

    def add(self, lines: Sequence[int], cells: Cells) -> None:
        """Add the times of some rows.

        Raises:
            RecordingError: if a cell has no time.
        """
        if isinstance(cells, np.ndarray):
            self._add_numbers(lines, cells)
            return
        if self.unit is None and not self._parts and ISO.fullmatch(cells[0]):
            self.unit = "iso"
        if self.unit == "iso":
            self._add_each(lines, cells, _of_iso)
            return
        numbers, power = _alike(cells)
        if numbers is not None and float(np.abs(numbers).max()) * 10.0**power <= self._most:
            self._parts.append((numbers, power))
        else:
            self._add_each(lines, cells, self._of_text)

    @property
    def _most(self) -> float:
        """The largest time, in the unit, or in the smallest one."""
        return min(TIME_MAX_S * 10.0 ** -UNITS.get(self.unit or "ns", 0), TIME_MAX)

    def _add_numbers(self, lines: Sequence[int], cells: np.ndarray) -> None:
        if cells.dtype.kind in "Mm":
            self.unit = "iso" if cells.dtype.kind == "M" else "s"
            exact = cells.astype(f"{cells.dtype.kind}8[ns]")
            wrong = np.isnat(cells) | (exact.astype(cells.dtype) != cells)
            self._parts.append((exact.view(np.int64).copy(), -9))
        elif self.unit == "iso":
            wrong = np.ones(len(cells), bool)
        elif cells.dtype.kind == "f":
            wrong = ~(np.abs(cells.astype(np.float64)) <= self._most)
            self._floats.append(cells)
        else:
            wrong = np.abs(cells.astype(np.float64)) > self._most
            self._parts.append((cells.astype(np.int64), 0))
        if wrong.any():
            place = int(np.argmax(wrong))
            self._refuse(lines[place], str(cells[place]))

    def _add_each(self, lines: Sequence[int], cells: list[str], of: Callable) -> None:
        numbers, powers = np.empty(len(cells), np.int64), np.empty(len(cells), np.int32)
        for place, cell in enumerate(cells):
            found = of(cell)
            if found is None:
                self._refuse(lines[place], cell)
            numbers[place], powers[place] = found
        self._parts.append((numbers, powers))

    def _of_text(self, text: str) -> tuple[int, int] | None:
        """Return the whole number and the power of ten of a time; None if the text has none."""
        number = decimal_of(text)
        if number is None or not number.is_finite() or not number.copy_abs() <= self._most:
            return None
        number = _shortest(number)
        if number.adjusted() < LEAST_POWER:
            return 0, max(int(number.as_tuple().exponent), LEAST_POWER)
        sign, digits, power = Context(DIGITS_MAX, ROUND_HALF_EVEN).plus(number).as_tuple()
        whole = int("".join(map(str, digits)))
        if whole >> 62:
            sign, digits, power = Context(DIGITS_MAX - 1, ROUND_HALF_EVEN).plus(number).as_tuple()
            whole = int("".join(map(str, digits)))
        if power > 0:
            whole, power = whole * 10**power, 0
        return (-whole if sign else whole), power

    def _refuse(self, line: int, text: str) -> None:
        where = f"{self._table.at(line)}, column {plain(self._column)}"
        if self.unit == "iso":
            raise RecordingError(f"{where}: a time must be as 2024-05-01T12:00:00.123, not {shown(text)}")
        unit = {"s": "seconds", None: "one unit"}.get(self.unit, self.unit)
        raise RecordingError(
            f"{where}: a time must be a number of {unit} of {-self._most:g} to {self._most:g}, not {shown(text)}"
        )

    def check_unit(self, given: str | None) -> None:
        """Raise RecordingError if another unit is given for times that have their own unit (NumPy's)."""
        if given is not None and self.unit != given:
            where = f"{self._table.name}, column {plain(self._column)}"
            raise RecordingError(f"{where}: its times have a unit, so --time-unit must be absent, not {given}")

    def whole(self) -> "Times":
        """Return all the times."""
        if self._floats:
            stored = np.concatenate(self._floats)
            values = stored.astype(np.float64)
            first, last = (Decimal(repr(float(values[place]))) for place in (0, -1))
            return Times(values - values[0], None, first, last, float(np.spacing(np.abs(stored).max())))
        decimals = max(-int(np.min(powers)) for _, powers in self._parts)
        first, last = _decimal(*self._parts[0], 0), _decimal(*self._parts[-1], -1)
        since = np.concatenate([_since(*part, first) for part in self._parts])
        return Times(since, decimals, first, last)


class Times:
    """The times of all samples in one unit.

    Attributes:
        since: float64: the time of every sample after the first.
        decimals: how many decimal places the times have; None for floating point.
        first, last: the first and the last time, exactly.
        spacing: the spacing of the floating-point numbers that hold the times, at the largest; 0 for decimals.
    """

    def __init__(self, since: np.ndarray, decimals: int | None, first: Decimal, last: Decimal, spacing: float = 0.0):
        self.since, self.decimals, self.first, self.last, self.spacing = since, decimals, first, last, spacing

    @property
    def rounding(self) -> float:
        """The precision of times in floating point: their own spacing, the spacing of float64, or 1e-12 of the whole
        time."""
        largest = max(abs(float(self.first)), abs(float(self.last)))
        return max(self.spacing, float(np.spacing(largest)), 1e-12 * float(self.since[-1]))

    @property
    def resolution(self) -> float:
        """The resolution of a time: its last decimal place, or its rounding, whichever is coarser."""
        return self.rounding if self.decimals is None else max(10.0**-self.decimals, self.rounding)

    def scaled(self, power: int) -> "Times":
        """Return the times in a unit that is 10**-power times as large."""
        decimals = None if self.decimals is None else self.decimals - power
        since, spacing = (
            each * 10.0**power if power >= 0 else each / 10.0**-power for each in (self.since, self.spacing)
        )
        return Times(since, decimals, self.first.scaleb(power), self.last.scaleb(power), spacing)

    def some(self, rows: np.ndarray | slice) -> "Times":
        """Return the times of some samples, in their order; the first one stays the origin of `since`."""
        since = self.since[rows]
        if len(since) == len(self.since):
            return self
        first, last = (self.first + _nearest(each, self.decimals) for each in (since[0], since[-1]))
        return Times(since - since[0], self.decimals, first, last, self.spacing)


def _nearest(value: float, decimals: int | None) -> Decimal:
    """Return a float64 as the nearest number of so many decimal places."""
    number = Decimal(float(value))
    return number if decimals is None else number.quantize(Decimal(1).scaleb(-decimals), context=Context(60))


def _decimal(numbers: np.ndarray, powers: np.ndarray | int, place: int) -> Decimal:
    power = powers if isinstance(powers, int) else int(powers[place])
    return Decimal(int(numbers[place])).scaleb(power, Context(60))


def _since(numbers: np.ndarray, powers: np.ndarray | int, first: Decimal) -> np.ndarray:
    """Return the float64 of the differences of times, (numbers) 10**powers, to the first one."""
    sign, digits, power = first.as_tuple()
    origin = int("".join(map(str, digits))) * (-1 if sign else 1)
    least = min(int(np.min(powers)), int(power))
    raised = np.asarray(powers) - least
    most = int(np.abs(numbers).max()) * 10 ** int(np.max(raised)), abs(origin) * 10 ** (int(power) - least)
    if sum(most) < 1 << 62:
        whole = numbers * 10 ** raised.astype(np.int64) - origin * 10 ** (int(power) - least)
        return whole / 10.0**-least if -least <= 22 else whole * 10.0**least
    exact = [float(_decimal(numbers, powers, place) - first) for place in range(len(numbers))]
    return np.array(exact)


@lru_cache(maxsize=CHUNK)
def _second(text: str) -> int | None:
    """Return the time of a timestamp without fractions, s since 1970; a timestamp without a zone is of UTC."""
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        return None
    return math.floor((when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp())


def _of_iso(text: str) -> tuple[int, int] | None:
    """Return the whole number and the power of ten of a timestamp, s; None if it is none."""
    if not ISO.fullmatch(text):
        return None
    head, point, tail = text.replace(",", ".").partition(".")
    digits = re.match(r"\d*", tail)[0]
    second = _second(head + tail[len(digits) :])
    if second is None:
        return None
    digits = digits[:9] if point else ""
    return second * 10 ** len(digits) + int(digits or 0), -len(digits)
