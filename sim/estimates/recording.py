"""Recordings of encoder counts: one column of a CSV file, and the rate at which it was sampled.

The file is UTF-8 text: a header line that names the columns, then one sample a line, cells separated by commas. Counts
are whole numbers (`1908.0` and `19e2` are whole). A recording spans less than 2**32 counts, and its counter is assumed
to have at most 32 bits: every step between samples is taken modulo 2**32, so a counter that wrapped is unwrapped.

The rate comes from the column `time_s`, in seconds, if the file has that column: see `recording_times`. A step that no
motion makes is refused: see `recording_steps`.

A file has at most `BYTES_MAX` bytes and `SAMPLES_MAX` samples.
"""

import csv
import hashlib
import io
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...model.checks import shown
from ..jobs.regular_file import content_of
from .recording_error import RecordingError, plain
from .recording_steps import unwrapped
from .recording_times import (
    RATE_MAX_HZ,
    RATE_MIN_HZ,
    TIME_COLUMN,
    check_other,
    decimal_of,
    other_of,
    rate_of,
    stamp_of,
)

BYTES_MAX = 256 * 10**6
SAMPLES_MAX = 10**7
NAMES_SHOWN = 8
"""The most names of columns in a message."""
ACCEPTED = "a CSV file: UTF-8 text, a header line with the columns' names, one sample a line"
COUNT_BITS = 62
"""The bits of a count with its sign: neither unwrapping nor a model of it leaves int64."""
WHOLE_COUNT = f"a count must be a whole number of -2**{COUNT_BITS - 1} to 2**{COUNT_BITS - 1} - 1"


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
        rate_hz: sample rate, required if the file has no column `time_s`; if it has that column, or another column of
            times, the two must agree.

    Raises:
        RecordingError: in one line, what is wrong, where, and what is accepted.
    """
    name = plain(str(path))
    if rate_hz is not None and not (isinstance(rate_hz, int | float) and RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ):
        raise RecordingError(f"{name}: the rate must be {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not {shown(rate_hz)}")
    content = _content(name, path)
    rows, digest = _rows(name, content), hashlib.sha256(content).hexdigest()
    header = [cell.strip() for cell in next(rows)[1]]
    place = _place(name, header, column)
    time_place = _place(name, header, TIME_COLUMN) if TIME_COLUMN in header else None
    other = other_of(header, column)
    if time_place is None and rate_hz is None:
        known = f"; {plain(other)} would count if it had that name, and seconds" if other else ""
        raise RecordingError(
            f"{name}: there is no column {TIME_COLUMN}, so the rate in Hz must be given (--rate){known}"
        )

    other_place = _place(name, header, other) if other else None
    lines, counts, stamps, ends = array("q"), array("q"), [], ["", ""]
    for line, cells in rows:
        if len(cells) != len(header):
            raise RecordingError(f"{name}, line {line}: must have {len(header)} cells as the header, not {len(cells)}")
        if len(counts) == SAMPLES_MAX:
            raise RecordingError(f"{name}, line {line}: must have at most {SAMPLES_MAX} samples (data lines)")
        lines.append(line)
        counts.append(_count(name, line, column, cells[place].strip()))
        if time_place is not None:
            stamps.append(stamp_of(name, line, cells[time_place].strip()))
        elif other_place is not None:
            ends = [ends[0] if len(counts) > 1 else cells[other_place].strip(), cells[other_place].strip()]
    if len(counts) < 2:
        raise RecordingError(f"{name}: must have at least 2 samples (data lines), not {len(counts)}")

    counts = unwrapped(name, column, lines, np.array(counts))
    if other:
        check_other(name, other, *ends, len(counts) - 1, float(rate_hz))
    if time_place is None:
        return Recording(str(path), column, counts, float(rate_hz), content=digest)
    return Recording(str(path), column, counts, rate_of(name, lines, stamps, rate_hz), float(stamps[0]), digest)


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
        names = [plain(column) for column in header[:NAMES_SHOWN]]
        names += [f"{len(header) - NAMES_SHOWN} more"] if len(header) > NAMES_SHOWN else []
        raise RecordingError(f"{name}, line 1: column must be one of {', '.join(names)}, not {shown(column)}")
    if occurrences > 1:
        raise RecordingError(f"{name}, line 1: column {shown(column)} must be there once, not {occurrences} times")
    return header.index(column)


def _count(name: str, line: int, column: str, text: str) -> int:
    digits = text[1:] if text[:1] in ("+", "-") else text
    if digits.isascii() and digits.isdigit() and len(digits) < 19:  # less than 2**61
        return int(text)
    number = decimal_of(text)
    # The exponent is checked first: 1e999999 as an integer would fill the memory.
    if number is not None and number.is_finite() and number.adjusted() < 19 and number == number.to_integral_value():
        count, count_end = int(number), 1 << (COUNT_BITS - 1)
        if -count_end <= count < count_end:
            return count
    raise RecordingError(f"{name}, line {line}, column {plain(column)}: {WHOLE_COUNT}, not {shown(text)}")
