"""The sample rate of a recording: from its column of times, or as it is given and its times allow.

The resolution of a time stamp is

    unit = the coarsest of: its last printed decimal place, the spacing of float64 there, 1e-12 of the whole time

and a stamp that was rounded to nearest is off by at most half a unit. So if the samples are equally spaced

- against a given rate, stamps are off by less than one unit, counted from the first stamp;
- against the line through the first and the last stamp, also by less than one unit: half for the stamp itself and half
  for the ends of the line.

Stamps that are further off are not uniform. A lost sample shifts all later stamps by a whole interval, and the line by
half an interval on either side: it shows where the interval is 2 units or more. Where the interval is less, and no rate
is given, all intervals must be printed alike.

Whole numbers that are 1 or more apart may be seconds, or milliseconds, microseconds or nanoseconds: a rate must be
given with them. A column with another name that tells of time is not read for the rate, but a rate that is given must
be its mean rate, within `MEAN`.
"""

import re
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation

import numpy as np

from ...model.checks import shown
from ...model.requirements import RATES_HZ
from .recording_error import RecordingError, plain

TIME_COLUMN = "time_s"
RATE_MIN_HZ = 0.1
RATE_MAX_HZ = float(RATES_HZ[1])
TIME_MAX_S = 1e12
"""The largest time stamp, either way: tens of thousands of years."""
UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""The units of times, s."""
OTHER_NAME = re.compile(r"(?:t|time|time_?stamps?|stamp|clock)(?:[ _.-]*[(\[]?(s|ms|us|ns)[)\]]?)?", re.IGNORECASE)
"""The names of columns that tell of time, and their units."""
MEAN = 0.01
"""How far the mean rate of a column of another name may be from the rate that is given, as a part of it."""
USUAL = 1.5
"""From how many usual intervals on one may lack a sample; what is less is jitter."""


def stamp_of(name: str, line: int, text: str) -> Decimal:
    """Return the time (s) in a cell of the column `TIME_COLUMN`.

    Raises:
        RecordingError: if there is none.
    """
    number = decimal_of(text)
    if number is None or not number.is_finite() or not abs(number) <= TIME_MAX_S:
        raise RecordingError(
            f"{name}, line {line}, column {TIME_COLUMN}: a time must be a number of seconds of {-TIME_MAX_S:g} to "
            f"{TIME_MAX_S:g}, not {shown(text)}"
        )
    return number


def decimal_of(text: str) -> Decimal | None:
    """Return the number that a cell has; None if it has none."""
    try:
        return Decimal(text) if text.isascii() and "_" not in text else None
    except InvalidOperation:
        return None


def other_of(header: Sequence[str], column: str) -> str | None:
    """Return the name of a column of times that is not `TIME_COLUMN`; None if there is none, or that one is there."""
    if TIME_COLUMN in header:
        return None
    return next((each for each in header if each != column and OTHER_NAME.fullmatch(each)), None)


def check_other(name: str, column: str, first: str, last: str, intervals: int, rate_hz: float) -> None:
    """Raise RecordingError if the times of a column of another name contradict a rate.

    Args:
        name: the file.
        column: the column.
        first, last: its first and its last cell; cells that are no numbers contradict nothing.
        intervals: the number of samples between them.
        rate_hz: the rate.
    """
    ends = decimal_of(first), decimal_of(last)
    if not all(end is not None and end.is_finite() and abs(end) <= 10**30 for end in ends):
        return
    unit, whole = OTHER_NAME.fullmatch(column)[1], float(ends[1] - ends[0])
    units = [unit.lower()] if unit else list(UNITS_S)
    if not any(abs(whole * UNITS_S[each] * rate_hz / intervals - 1) <= MEAN for each in units):
        mean = f"{whole / intervals:g} {units[0] if unit else 's, ms, us or ns'} a sample"
        raise RecordingError(
            f"{name}, column {plain(column)}: times must agree with the rate {rate_hz:g} Hz within {MEAN:.0%}, not go "
            f"by {mean}: correct the rate, or take the column out if it is no time"
        )


def rate_of(name: str, lines: Sequence[int], stamps: list[Decimal], given_hz: float | None) -> float:
    """Return the rate of uniform stamps: the given rate, or the rate between the first and the last stamp.

    Args:
        name: the file, for a message.
        lines: the line of every stamp in the file.
        stamps: the times, s.
        given_hz: the rate that is given; None for none.

    Raises:
        RecordingError: if the times are not uniform, do not agree with the rate, or may be of another unit.
    """
    where = f"column {TIME_COLUMN}: times must"
    decimals = max(-stamp.as_tuple().exponent for stamp in stamps)
    since = np.array([float(stamp - stamps[0]) for stamp in stamps])
    steps = np.diff(since)
    if (steps <= 0).any():
        line = lines[int(np.flatnonzero(steps <= 0)[0]) + 1]
        raise RecordingError(
            f"{name}, line {line}, {where} increase, not go by {steps.min():g} s: cut the recording at this line"
        )
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
                f"{since[off[0]]:g} s after the first at sample {off[0]} (over all: {1 / mean_s:g} Hz): "
                f"{_cure(steps, given_hz)}"
            )
        return float(given_hz)

    # In decimal arithmetic, 0.001 s a sample is exactly 1000 Hz.
    rate_hz = (len(stamps) - 1) / (stamps[-1] - stamps[0])
    if not RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ:
        raise RecordingError(
            f"{name}, {where} be those of a rate of {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not of {rate_hz:.6g} Hz: "
            "write them in seconds"
        )
    if decimals <= 0 and mean_s >= 1:
        raise RecordingError(
            f"{name}, {where} be in seconds, and whole ones, {mean_s:g} apart, may be of another unit: if they are "
            f"seconds, write them with a decimal point or give the rate (--rate {1 / mean_s:g})"
        )
    _check_uniform(name, lines, steps, np.abs(since - samples * mean_s), unit)
    return float(rate_hz)


def _check_uniform(name: str, lines: Sequence[int], steps: np.ndarray, off: np.ndarray, unit: float) -> None:
    """Raise RecordingError unless stamps are uniform within a unit, with what helps.

    Args:
        name, lines: as for `rate_of`.
        steps: the intervals, s.
        off: how far every stamp is from the line through the first and the last, s.
        unit: the resolution of a stamp, s.
    """
    usual_s, mean_s = float(np.median(steps)), float(np.mean(steps))
    uneven = np.abs(steps - usual_s)
    if not (off >= unit * (1 - 1e-6)).any() and not (mean_s < 2 * unit and (uneven > unit / 2).any()):
        return
    worst = int(np.argmax(uneven))
    raise RecordingError(
        f"{name}, line {lines[worst + 1]}, column {TIME_COLUMN}: times must be uniform within {unit:g} s, not go by "
        f"{steps[worst]:g} s where {usual_s:g} s is usual: {_cure(steps, 1 / mean_s)}"
    )


def _cure(steps: np.ndarray, rate_hz: float) -> str:
    """Return what helps against intervals (s) that are not those of a rate."""
    usual_s, mean_s = float(np.median(steps)), float(np.mean(steps))
    if steps.max() >= USUAL * usual_s:
        return "if samples are missing there, cut the recording at this line, or fill them in"
    if abs(mean_s * rate_hz - 1) > MEAN:
        return "correct the rate"
    return f"if only the stamps jitter, take the column out and give --rate {rate_hz:.6g}, or write them evenly"
