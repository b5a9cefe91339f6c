"""The column of a file with the times, and its unit.

The column is `--time`, or `NAME.time` for counts in a column `NAME`, or `time_s`. Else it is the first one with one of
these names: `t`, `time`, `timestamp`, `stamp`, `clock` and `elapsed`, with or without a unit at the end; or a unit
alone, such as `seconds`. A file without names has none but `--time`.

The unit is `--time-unit`, or the one in the name. Without either, timestamps are ISO.
Numbers then get their unit from their rate: only one of `s`, `ms`, `us` and `ns` makes it one of `USUAL_HZ`, the rates
of logs.
"""

import re
from typing import NamedTuple

from .error import RecordingError, plain
from .recording import Reading
from .stamps import UNITS
from .table import Table

TIME_COLUMN = "time_s"
NO_TIME = "none"
"""The column of times for none."""
USUAL_HZ = 5.0, 50e3
"""The least rate of a log without a unit, and the end of the range."""
_UNIT = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "µs", "μs", "usec", "micros", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanosecond", "nanoseconds"), "ns"),
}
_WORDS = "|".join(sorted(_UNIT, key=len, reverse=True))
_NAME = re.compile(
    rf"(?:t|time|time_?stamps?|stamp|clock|elapsed)(?:[ _.-]*[(\[]?({_WORDS})[)\]]?)?|(\w{{2,}})", re.IGNORECASE
)


class TimeColumn(NamedTuple):
    """A column of times.

    Attributes:
        place: its place in the table.
        name: its name, for messages.
        unit: its unit, or `iso`; None if only the numbers can tell.
        meant: whether it was asked for, or has the name of `TIME_COLUMN`: then all its times must be valid and agree
            with a rate that is given. Of another column, only the mean rate must agree with it.
    """

    place: int
    name: str
    unit: str | None
    meant: bool


def unit_of(name: str) -> tuple[bool, str | None]:
    """Return whether a name is one of a column of times, and the unit that it has."""
    match = _NAME.fullmatch(name)
    if not match:
        return False, None
    if match[2] is not None:
        unit = _UNIT.get(match[2].lower())
        return unit is not None and len(match[2]) > 2, unit
    return True, _UNIT[match[1].lower()] if match[1] else None


def time_column_of(table: Table, reading: Reading, other_than: set[int]) -> TimeColumn | None:
    """Return the column of times of a table; None if it has none, or is to have none.

    Args:
        table: the table.
        reading: what the user says of it.
        other_than: places of columns that have the counts.

    Raises:
        RecordingError: if the column that is asked for is not there.
    """
    if reading.time == NO_TIME:
        return None
    if reading.time is not None:
        place = table.place(reading.time)
        name = table.called(place)
        return TimeColumn(place, name, reading.time_unit or unit_of(name)[1], True)
    for place in other_than:
        if (name := f"{table.called(place)}.time") in table.names:
            return TimeColumn(table.place(name), name, reading.time_unit, True)
    if TIME_COLUMN in table.names:
        return TimeColumn(table.place(TIME_COLUMN), TIME_COLUMN, reading.time_unit or "s", True)
    for place, name in enumerate(table.names):
        known, unit = unit_of(name)
        if known and place not in other_than:
            return TimeColumn(table.place(name), name, reading.time_unit or unit, False)
    return None


def unit_by_rate(where: str, mean: float) -> str:
    """Return the unit of times with this spacing, by the rate that it would give.

    Args:
        where: the file and the column, for a message.
        mean: the mean interval.

    Raises:
        RecordingError: if none of the units, or more than one, makes a usual rate.
    """
    rates = {unit: 1 / (mean * 10.0**power) for unit, power in UNITS.items()} if mean > 0 else {}
    usual = [unit for unit, rate in rates.items() if USUAL_HZ[0] <= rate < USUAL_HZ[1]]
    if len(usual) == 1:
        return usual[0]
    made = " or ".join(f"{rates[unit]:g} Hz ({unit})" for unit in usual or rates)
    raise RecordingError(
        f"{where}: the unit of times that are {mean:g} apart must be given (--time-unit {', '.join(UNITS)}): they may "
        f"be those of {made}"
    )


def place_of(name: str, column: str) -> str:
    """Return a file and a column of times, for the beginning of a message."""
    return f"{name}, column {plain(column)}"
