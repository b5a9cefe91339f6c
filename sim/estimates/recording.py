"""Recordings of encoder counts: one column of a CSV file, and the rate at which it was sampled.

The file is UTF-8 text: a header line that names the columns, then one sample a line, cells separated by commas. Counts
are whole numbers (`1908.0` and `19e2` are whole). A recording spans less than 2**32 counts, and its counter is assumed
to have at most 32 bits: every step between samples is taken modulo 2**32, so a counter that wrapped is unwrapped.

The rate comes from the column `time_s`, in seconds, if the file has that column. The resolution of a time stamp is

    unit = the coarsest of: its last printed decimal place, the spacing of float64 there, 1e-12 of the whole time

and a stamp that was rounded to nearest is off by at most half a unit. So if the samples are equally spaced

- against a given rate, stamps are off by less than one unit, counted from the first stamp;
- against the line through the first and the last stamp, also by less than one unit: half for the stamp itself and half
  for the ends of the line.

Stamps that are further off are not uniform. A lost sample shifts all later stamps by a whole interval, and the line by
half an interval on either side: it shows where the interval is 2 units or more. Where the interval is less, and no rate
is given, all intervals must be printed alike.
"""

import csv
import io
import math
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

TIME_COLUMN = "time_s"
RATE_MIN_HZ = 1e-6
RATE_MAX_HZ = 1e9
SPAN_BITS = 32
ACCEPTED = "a CSV file: UTF-8 text, a header line with the columns' names, one sample a line"
WHOLE_COUNT = "a count must be a whole number of -2**63 to 2**63 - 1"


class RecordingError(ValueError):
    """A recording that is refused: one line that names the file, the place in it, and what is accepted."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Counts at equally spaced times.

    Attributes:
        file, column: source of the counts.
        counts: int64, unwrapped.
        rate_hz: sample rate.
        start_s: time of the first sample; 0 without a column `time_s`.
    """

    file: str
    column: str
    counts: np.ndarray
    rate_hz: float
    start_s: float = 0.0

    @property
    def time_s(self) -> np.ndarray:
        """The time of every sample, s."""
        return self.start_s + np.arange(len(self.counts)) / self.rate_hz


def load(path: str | Path, column: str, rate_hz: float | None = None) -> Recording:
    """Return the recording in a column of a CSV file.

    Args:
        path: the file.
        column: name of the column of counts.
        rate_hz: sample rate, required if the file has no column `time_s`; if it has that column, the two must agree.

    Raises:
        RecordingError: in one line, what is wrong, where, and what is accepted.
    """
    if rate_hz is not None and not (isinstance(rate_hz, int | float) and RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ):
        raise RecordingError(f"{path}: the rate must be {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not {rate_hz!r}")
    header, rows = _rows(path)
    place = _place(path, header, column)
    time_place = _place(path, header, TIME_COLUMN) if TIME_COLUMN in header else None
    if time_place is None and rate_hz is None:
        raise RecordingError(f"{path}: there is no column {TIME_COLUMN}, so the rate in Hz must be given (--rate)")

    lines, counts, stamps = [], [], []
    for line, cells in rows:
        if len(cells) != len(header):
            raise RecordingError(f"{path}, line {line}: must have {len(header)} cells as the header, not {len(cells)}")
        lines.append(line)
        counts.append(_count(path, line, column, cells[place].strip()))
        if time_place is not None:
            stamps.append(_stamp(path, line, cells[time_place].strip()))
    if len(counts) < 2:
        raise RecordingError(f"{path}: must have at least 2 samples (data lines), not {len(counts)}")

    counts = _unwrapped(path, column, lines, np.array(counts, np.int64))
    if time_place is None:
        return Recording(str(path), column, counts, float(rate_hz))
    return Recording(str(path), column, counts, _rate(path, lines, stamps, rate_hz), float(stamps[0]))


def _rows(path: str | Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the header, and (line number, cells) of every data line."""
    try:
        data = Path(path).read_bytes()
        text = data.decode("utf-8-sig")
    except FileNotFoundError:
        raise RecordingError(f"{path}: there is no such file; must be {ACCEPTED}") from None
    except (OSError, ValueError) as error:
        if not isinstance(error, UnicodeDecodeError):
            raise RecordingError(f"{path}: cannot be read ({error}); must be {ACCEPTED}") from None
        line = data.count(b"\n", 0, error.start) + 1
        raise RecordingError(f"{path}, line {line}: is not UTF-8 text; must be {ACCEPTED}") from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RecordingError(f"{path}, line {line}: is binary data; must be {ACCEPTED}")
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows = []
    try:
        rows.extend((reader.line_num, cells) for cells in reader)
    except csv.Error as error:
        raise RecordingError(f"{path}, line {reader.line_num}: is not CSV ({error}); must be {ACCEPTED}") from None
    while rows and not any(cell.strip() for cell in rows[-1][1]) and len(rows[-1][1]) <= 1:
        rows.pop()  # blank lines at the end
    if not rows:
        raise RecordingError(f"{path}: is empty; must be {ACCEPTED}")
    (_, header), *rest = rows
    return [name.strip() for name in header], rest


def _place(path: str | Path, header: list[str], column: str) -> int:
    occurrences = header.count(column)
    if occurrences == 0:
        raise RecordingError(f"{path}, line 1: column must be one of {', '.join(map(_shown, header))}, not {column!r}")
    if occurrences > 1:
        raise RecordingError(f"{path}, line 1: column {column!r} must be there once, not {occurrences} times")
    return header.index(column)


def _shown(text: str) -> str:
    """Return a text shortened for a message: printable, on one line, at most 40 characters."""
    plain = text if text.isprintable() and text else repr(text)
    return plain if len(plain) <= 40 else plain[:37] + "..."


def _count(path: str | Path, line: int, column: str, text: str) -> int:
    digits = text[1:] if text[:1] in ("+", "-") else text
    if digits.isascii() and digits.isdigit() and len(digits) < 19:
        return int(text)
    number = _decimal(text)
    # The exponent is checked first: 1e999999 as an integer would fill the memory.
    if number is not None and number.is_finite() and number.adjusted() < 19 and number == number.to_integral_value():
        count = int(number)
        if -(2**63) <= count < 2**63:
            return count
    raise RecordingError(f"{path}, line {line}, column {column}: {WHOLE_COUNT}, not {_shown(repr(text))}")


def _stamp(path: str | Path, line: int, text: str) -> Decimal:
    number = _decimal(text)
    if number is None or not number.is_finite() or not math.isfinite(number):
        raise RecordingError(
            f"{path}, line {line}, column {TIME_COLUMN}: a time must be a finite number of seconds, "
            f"not {_shown(repr(text))}"
        )
    return number


def _decimal(text: str) -> Decimal | None:
    try:
        return Decimal(text) if text.isascii() and "_" not in text else None
    except InvalidOperation:
        return None


def _unwrapped(path: str | Path, column: str, lines: list[int], counts: np.ndarray) -> np.ndarray:
    """Return the counts with every step taken modulo 2**SPAN_BITS."""
    # A difference of two int64 that is not negative is exact as an unsigned number modulo 2**64.
    spread = np.maximum.accumulate(counts).view(np.uint64) - np.minimum.accumulate(counts).view(np.uint64)
    wide = np.flatnonzero(spread >> np.uint64(SPAN_BITS))
    if len(wide):
        raise RecordingError(
            f"{path}, line {lines[wide[0]]}, column {column}: counts must span less than 2**{SPAN_BITS}, "
            f"not {spread[wide[0]]} up to here"
        )
    half = 1 << (SPAN_BITS - 1)
    steps = ((np.diff(counts) + half) & (2 * half - 1)) - half
    return counts[0] + np.concatenate([[0], np.cumsum(steps)])


def _rate(path: str | Path, lines: list[int], stamps: list[Decimal], given_hz: float | None) -> float:
    """Return the rate of uniform stamps: the given rate, or the rate between the first and the last stamp."""
    where = f"column {TIME_COLUMN}: times must"
    decimals = max(-stamp.as_tuple().exponent for stamp in stamps)
    since = np.array([float(stamp - stamps[0]) for stamp in stamps])
    steps = np.diff(since)
    if (steps <= 0).any():
        line = lines[int(np.flatnonzero(steps <= 0)[0]) + 1]
        raise RecordingError(f"{path}, line {line}, {where} increase, not go by {steps.min():g} s")
    largest = max(abs(float(stamps[0])), abs(float(stamps[-1])))
    unit = max(10.0**-decimals, float(np.spacing(largest)), 1e-12 * since[-1])

    samples = np.arange(len(since))
    mean_s = since[-1] / samples[-1]
    if given_hz is not None:
        # The tolerance is a little under one unit, for the rounding of this computation.
        off = np.flatnonzero(np.abs(since - samples / given_hz) >= unit * (1 - 1e-6))
        if len(off):
            raise RecordingError(
                f"{path}, line {lines[off[0]]}, {where} agree with the rate {given_hz:g} Hz within {unit:g} s, not be "
                f"{since[off[0]]:g} s after the first at sample {off[0]} (over all: {1 / mean_s:g} Hz)"
            )
        return float(given_hz)

    usual_s = float(np.median(steps))
    uneven = np.abs(steps - usual_s)
    astray = np.abs(since - samples * mean_s) >= unit * (1 - 1e-6)
    if astray.any() or (mean_s < 2 * unit and (uneven > unit / 2).any()):
        worst = int(np.argmax(uneven))
        raise RecordingError(
            f"{path}, line {lines[worst + 1]}, {where} be uniform within {unit:g} s, "
            f"not go by {steps[worst]:g} s where {usual_s:g} s is usual"
        )
    # In decimal arithmetic, 0.001 s a sample is exactly 1000 Hz.
    return float((len(stamps) - 1) / (stamps[-1] - stamps[0]))
