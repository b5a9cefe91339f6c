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

A file has at most `BYTES_MAX` bytes and `SAMPLES_MAX` samples.

Stamps that are further off are not uniform. A lost sample shifts all later stamps by a whole interval, and the line by
half an interval on either side: it shows where the interval is 2 units or more. Where the interval is less, and no rate
is given, all intervals must be printed alike.
"""

import csv
import hashlib
import io
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from ...model.checks import shown
from ...model.requirements import RATES_HZ
from ..jobs.regular_file import content_of

TIME_COLUMN = "time_s"
RATE_MIN_HZ = 1e-6
RATE_MAX_HZ = float(RATES_HZ[1])
TIME_MAX_S = 1e12
"""The largest time stamp, either way: tens of thousands of years."""
BYTES_MAX = 256 * 10**6
SAMPLES_MAX = 10**7
SPAN_BITS = 32
NAMES_SHOWN, NAME_MAX = 8, 200
"""The most names of columns in a message, and the most characters of the name of a column or of a file."""
ACCEPTED = "a CSV file: UTF-8 text, a header line with the columns' names, one sample a line"
COUNT_BITS = 62
"""The bits of a count with its sign: neither unwrapping nor a model of it leaves int64."""
WHOLE_COUNT = f"a count must be a whole number of -2**{COUNT_BITS - 1} to 2**{COUNT_BITS - 1} - 1"


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
        content: digest of the bytes from which the counts were taken; empty for counts of no file.
    """

    file: str
    column: str
    counts: np.ndarray
    rate_hz: float
    start_s: float = 0.0
    content: str = ""

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
    name = _plain(str(path))
    if rate_hz is not None and not (isinstance(rate_hz, int | float) and RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ):
        raise RecordingError(f"{name}: the rate must be {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not {shown(rate_hz)}")
    content = _content(name, path)
    rows, digest = _rows(name, content), hashlib.sha256(content).hexdigest()
    header = [cell.strip() for cell in next(rows)[1]]
    place = _place(name, header, column)
    time_place = _place(name, header, TIME_COLUMN) if TIME_COLUMN in header else None
    if time_place is None and rate_hz is None:
        raise RecordingError(f"{name}: there is no column {TIME_COLUMN}, so the rate in Hz must be given (--rate)")

    lines, counts, stamps = array("q"), array("q"), []
    for line, cells in rows:
        if len(cells) != len(header):
            raise RecordingError(f"{name}, line {line}: must have {len(header)} cells as the header, not {len(cells)}")
        if len(counts) == SAMPLES_MAX:
            raise RecordingError(f"{name}, line {line}: must have at most {SAMPLES_MAX} samples (data lines)")
        lines.append(line)
        counts.append(_count(name, line, column, cells[place].strip()))
        if time_place is not None:
            stamps.append(_stamp(name, line, cells[time_place].strip()))
    if len(counts) < 2:
        raise RecordingError(f"{name}: must have at least 2 samples (data lines), not {len(counts)}")

    counts = _unwrapped(name, column, lines, np.array(counts))
    if time_place is None:
        return Recording(str(path), column, counts, float(rate_hz), content=digest)
    return Recording(str(path), column, counts, _rate(name, lines, stamps, rate_hz), float(stamps[0]), digest)


def _content(name: str, path: str | Path) -> bytes:
    """Return the content of a file of UTF-8 text."""
    try:
        content = content_of(path, BYTES_MAX)
        content.decode("utf-8-sig")
    except FileNotFoundError:
        raise RecordingError(f"{name}: there is no such file; must be {ACCEPTED}") from None
    except OSError as error:
        raise RecordingError(f"{name}: cannot be read ({error.strerror}); must be {ACCEPTED}") from None
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise RecordingError(f"{name}, line {line}: is not UTF-8 text; must be {ACCEPTED}") from None
    if b"\0" in content:
        line = content.count(b"\n", 0, content.index(b"\0")) + 1
        raise RecordingError(f"{name}, line {line}: is binary data; must be {ACCEPTED}")
    return content


def _rows(name: str, content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield (line number, cells) of the header, and then of every data line, without blank lines at the end."""
    reader = csv.reader(io.TextIOWrapper(io.BytesIO(content), "utf-8-sig", newline=""), strict=True)
    empty, waiting = True, []  # blank lines wait for a line that is not blank
    try:
        for cells in reader:
            waiting.append((reader.line_num, cells))
            if len(cells) > 1 or any(cell.strip() for cell in cells):
                yield from waiting
                empty, waiting = False, []
    except csv.Error as error:
        raise RecordingError(f"{name}, line {reader.line_num}: is not CSV ({error}); must be {ACCEPTED}") from None
    if empty:
        raise RecordingError(f"{name}: is empty; must be {ACCEPTED}")


def _place(name: str, header: list[str], column: str) -> int:
    occurrences = header.count(column)
    if occurrences == 0:
        names = [_plain(column) for column in header[:NAMES_SHOWN]]
        names += [f"{len(header) - NAMES_SHOWN} more"] if len(header) > NAMES_SHOWN else []
        raise RecordingError(f"{name}, line 1: column must be one of {', '.join(names)}, not {shown(column)}")
    if occurrences > 1:
        raise RecordingError(f"{name}, line 1: column {shown(column)} must be there once, not {occurrences} times")
    return header.index(column)


def _plain(text: str) -> str:
    """Return the name of a file or of a column for a message, without quotes where none are needed."""
    return text if text.isprintable() and 0 < len(text) <= NAME_MAX else shown(text)


def _count(name: str, line: int, column: str, text: str) -> int:
    digits = text[1:] if text[:1] in ("+", "-") else text
    if digits.isascii() and digits.isdigit() and len(digits) < 19:  # less than 2**61
        return int(text)
    number = _decimal(text)
    # The exponent is checked first: 1e999999 as an integer would fill the memory.
    if number is not None and number.is_finite() and number.adjusted() < 19 and number == number.to_integral_value():
        count, count_end = int(number), 1 << (COUNT_BITS - 1)
        if -count_end <= count < count_end:
            return count
    raise RecordingError(f"{name}, line {line}, column {_plain(column)}: {WHOLE_COUNT}, not {shown(text)}")


def _stamp(name: str, line: int, text: str) -> Decimal:
    number = _decimal(text)
    if number is None or not number.is_finite() or not abs(number) <= TIME_MAX_S:
        raise RecordingError(
            f"{name}, line {line}, column {TIME_COLUMN}: a time must be a number of seconds of {-TIME_MAX_S:g} to "
            f"{TIME_MAX_S:g}, not {shown(text)}"
        )
    return number


def _decimal(text: str) -> Decimal | None:
    try:
        return Decimal(text) if text.isascii() and "_" not in text else None
    except InvalidOperation:
        return None


def _unwrapped(name: str, column: str, lines: Sequence[int], counts: np.ndarray) -> np.ndarray:
    """Return the counts with every step taken modulo 2**SPAN_BITS."""
    # A difference of two int64 that is not negative is exact as an unsigned number modulo 2**64.
    spread = np.maximum.accumulate(counts).view(np.uint64) - np.minimum.accumulate(counts).view(np.uint64)
    wide = np.flatnonzero(spread >> np.uint64(SPAN_BITS))
    if len(wide):
        raise RecordingError(
            f"{name}, line {lines[wide[0]]}, column {_plain(column)}: counts must span less than 2**{SPAN_BITS}, "
            f"not {spread[wide[0]]} up to here"
        )
    half = 1 << (SPAN_BITS - 1)
    steps = ((np.diff(counts) + half) & (2 * half - 1)) - half
    return counts[0] + np.concatenate([[0], np.cumsum(steps)])


def _rate(name: str, lines: Sequence[int], stamps: list[Decimal], given_hz: float | None) -> float:
    """Return the rate of uniform stamps: the given rate, or the rate between the first and the last stamp."""
    where = f"column {TIME_COLUMN}: times must"
    decimals = max(-stamp.as_tuple().exponent for stamp in stamps)
    since = np.array([float(stamp - stamps[0]) for stamp in stamps])
    steps = np.diff(since)
    if (steps <= 0).any():
        line = lines[int(np.flatnonzero(steps <= 0)[0]) + 1]
        raise RecordingError(f"{name}, line {line}, {where} increase, not go by {steps.min():g} s")
    largest = max(abs(float(stamps[0])), abs(float(stamps[-1])))
    unit = max(10.0**-decimals, float(np.spacing(largest)), 1e-12 * since[-1])

    samples = np.arange(len(since))
    mean_s = since[-1] / samples[-1]
    if given_hz is not None:
        # The tolerance is a little under one unit, for the rounding of this computation.
        off = np.flatnonzero(np.abs(since - samples / given_hz) >= unit * (1 - 1e-6))
        if len(off):
            raise RecordingError(
                f"{name}, line {lines[off[0]]}, {where} agree with the rate {given_hz:g} Hz within {unit:g} s, not be "
                f"{since[off[0]]:g} s after the first at sample {off[0]} (over all: {1 / mean_s:g} Hz)"
            )
        return float(given_hz)

    usual_s = float(np.median(steps))
    uneven = np.abs(steps - usual_s)
    astray = np.abs(since - samples * mean_s) >= unit * (1 - 1e-6)
    if astray.any() or (mean_s < 2 * unit and (uneven > unit / 2).any()):
        worst = int(np.argmax(uneven))
        raise RecordingError(
            f"{name}, line {lines[worst + 1]}, {where} be uniform within {unit:g} s, "
            f"not go by {steps[worst]:g} s where {usual_s:g} s is usual"
        )
    # In decimal arithmetic, 0.001 s a sample is exactly 1000 Hz.
    rate_hz = (len(stamps) - 1) / (stamps[-1] - stamps[0])
    if not RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ:
        raise RecordingError(
            f"{name}, {where} be those of a rate of {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not of {rate_hz:.6g} Hz"
        )
    return float(rate_hz)
