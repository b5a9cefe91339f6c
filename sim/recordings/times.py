"""The sample rate of a recording: from its column of times, or as it is given and its times allow.

The resolution of a time stamp is

    unit = the coarsest of: its last printed decimal place, the spacing of floating point there, 1e-12 of the whole time

and a stamp that was rounded to nearest is off by at most half a unit. So if the samples are equally spaced

- against a given rate, stamps are off by less than one unit, counted from the first stamp;
- against the line through the first and the last stamp, also by less than one unit: half for the stamp itself and half
  for the ends of the line.

Stamps that are further off are not uniform. A lost sample shifts all later stamps by a whole interval, and the line by
half an interval on either side: it shows where the interval is 2 units or more. Where the interval is less, and no rate
is given, all intervals must be printed alike.

Whole numbers that are 1 or more apart in a column `time_s` may be seconds, or milliseconds, microseconds or
nanoseconds: a rate or `--time-unit` must be given with them. If a rate is given beside a column of times that nobody
asked for, the rate must be the column's mean rate, within `MEAN`. The rate of floating-point times is the roundest
number within their resolution.
"""

from collections.abc import Sequence

import numpy as np

from .error import RecordingError
from .gaps import passed_in
from .recording import RATE_MAX_HZ, RATE_MIN_HZ
from .stamps import UNITS, Times
from .table import Table
from .time_column import TIME_COLUMN, TimeColumn, place_of

MEAN = 0.01
"""How far the mean rate of a column of another name may be from the rate that is given, as a part of it."""
FLOAT_DIGITS = 17
"""The digits that tell every float64 apart."""


def check_mean(name: str, column: str, unit: str | None, mean: float, rate_hz: float) -> None:
    """Raise RecordingError if the times of a column of another name contradict a rate.

    Args:
        name: the file.
        column: the column.
        unit: its unit; None if it may be any.
        mean: the mean interval, in the unit.
        rate_hz: the rate.
    """
    units = [unit] if unit else list(UNITS)
    if not any(abs(mean * 10.0 ** UNITS[each] * rate_hz - 1) <= MEAN for each in units):
        said = f"{mean:g} {units[0] if unit else 's, ms, us or ns'} a sample"
        raise RecordingError(
            f"{place_of(name, column)}: times must agree with the rate {rate_hz:g} Hz within {MEAN:.0%}, not go "
            f"by {said}: correct the rate, or give --time none if it is no time"
        )


class Sampled:
    """The times of the samples of a recording, in seconds, and what messages say of them.

    Args:
        table: the file.
        column: the column of the times.
        lines: the line of every sample in the file.
        times: the times, s.
        numbers: for every sample its number since the first: see `gaps.Grid`.
    """

    def __init__(self, table: Table, column: TimeColumn, lines: Sequence[int], times: Times, numbers: np.ndarray):
        self._table, self._lines, self._times, self._numbers = table, lines, times, numbers
        self._column = column
        self._steps = np.diff(times.since)

    @property
    def _where(self) -> str:
        return f"{place_of(self._table.name, self._column.name)}: times must"

    def _at(self, sample: int) -> str:
        return f"{place_of(self._table.at(self._lines[sample]), self._column.name)}: times must"

    def rate_hz(self, given_hz: float | None, in_doubt: bool) -> float:
        """Return the rate of uniform stamps: the given rate, or the rate between the first and the last stamp.

        Args:
            given_hz: the rate that is given; None for none.
            in_doubt: whether whole numbers may be of another unit than seconds.

        Raises:
            RecordingError: if the times are not uniform, do not agree with the rate, or may be of another unit.
        """
        times, since, steps, samples = self._times, self._times.since, self._steps, self._numbers
        if (steps <= 0).any():
            at = self._at(int(np.flatnonzero(steps <= 0)[0]) + 1)
            raise RecordingError(
                f"{at} increase, not go by {steps.min():g} s: cut the recording at this line{self._twice()}"
            )
        unit = times.resolution
        mean_s = since[-1] / samples[-1]
        if given_hz is not None:
            self._check_given(given_hz, unit, 1 / mean_s)
            return float(given_hz)
        # In decimal arithmetic, 0.001 s a sample is exactly 1000 Hz.
        rate_hz = int(samples[-1]) / (times.last - times.first)
        if not RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ:
            unit_in_doubt = self._column.name == TIME_COLUMN
            cure = "write them in seconds" if unit_in_doubt else "correct --time-unit"
            raise RecordingError(
                f"{self._where} be those of a rate of {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not of {rate_hz:.6g} Hz: "
                f"{cure}"
            )
        if in_doubt:
            self._check_seconds(mean_s)
        self._check_uniform(np.abs(since - samples * mean_s), unit)
        floating = times.decimals is None or 10.0**-times.decimals < times.rounding
        return _roundest(float(rate_hz), times.rounding / float(since[-1])) if floating else float(rate_hz)

    def _check_seconds(self, mean_s: float) -> None:
        """Raise RecordingError for whole numbers that may be of another unit than seconds."""
        if self._times.decimals is not None and self._times.decimals <= 0 and mean_s >= 1:
            raise RecordingError(
                f"{self._where} be in seconds, and whole ones, {mean_s:g} apart, may be of another unit: if they are "
                f"seconds, write them with a decimal point or give the rate (--rate {1 / mean_s:g}); else give "
                "--time-unit"
            )

    def _twice(self) -> str:
        """Return the remedy for a repeated time."""
        zero = bool((self._steps == 0).any())
        return ", or take repeated samples out (--gaps hold)" if zero else ""

    def _check_given(self, given_hz: float, unit: float, mean_hz: float) -> None:
        """Raise RecordingError unless stamps agree with a rate within a unit, s."""
        since, samples = self._times.since, self._numbers
        # The tolerance is a little under one unit, for the rounding of this computation.
        off = np.flatnonzero(np.abs(since - samples / given_hz) >= unit * (1 - 1e-6))
        if len(off):
            raise RecordingError(
                f"{self._at(off[0])} agree with the rate {given_hz:g} Hz within {unit:g} s, not be "
                f"{since[off[0]]:g} s after the first at sample {samples[off[0]]} (over all: {mean_hz:g} Hz): "
                f"{self._cure(given_hz, True)}"
            )

    def _check_uniform(self, off: np.ndarray, unit: float) -> None:
        """Raise RecordingError unless stamps are uniform within a unit, with what helps.

        Args:
            off: how far every stamp is from the line through the first and the last, s.
            unit: the resolution of a stamp, s.
        """
        steps = self._steps / np.diff(self._numbers)
        usual_s, mean_s = float(np.median(steps)), float(np.mean(steps))
        uneven = np.abs(steps - usual_s)
        if not (off >= unit * (1 - 1e-6)).any() and not (mean_s < 2 * unit and (uneven > unit / 2).any()):
            return
        worst = int(np.argmax(uneven))
        raise RecordingError(
            f"{self._at(worst + 1)} be uniform within {unit:g} s, not go by "
            f"{self._steps[worst]:g} s where {usual_s:g} s is usual: {self._cure(1 / mean_s, False)}"
        )

    def _cure(self, rate_hz: float, given: bool) -> str:
        """Return the remedy for intervals that do not fit a rate."""
        unit, steps = self._times.resolution, self._steps / np.diff(self._numbers)
        if (passed_in(steps, unit, rate_hz if given else None) > 1).any():
            return (
                "if samples are missing there, fill them with the count before (--gaps hold), or keep the longest "
                "piece (--gaps split)"
            )
        mean_s = float(np.mean(steps))
        if abs(mean_s * rate_hz - 1) > MEAN:
            return "correct the rate"
        if mean_s < 2 * unit and not given:
            return f"give the rate (--rate {rate_hz:.6g}), because such coarse stamps do not give it"
        return f"if only the stamps jitter, give --time none --rate {rate_hz:.6g}, or write them evenly"


def _roundest(value: float, part: float) -> float:
    """Return the number with the fewest digits that differs from a value by no more than a part of it."""
    rounded = (float(f"{value:.{digits}g}") for digits in range(1, FLOAT_DIGITS))
    return next((each for each in rounded if abs(each - value) <= part * value), value)
