"""Captures as text, of Saleae Logic, sigrok and Digilent WaveForms: a column of times, and one of 0 and 1 a channel.

A row is a sample or a change of levels. Without times, rows are samples at the rate that a comment of the file states.
"""

import math
from collections.abc import Sequence

import numpy as np

from .capture import Capture, Changes, changed
from .error import RecordingError, plain
from .recording import Reading
from .stamps import UNITS, Stamps
from .table import Cells, Table
from .time_column import place_of, time_column_of

DECIMALS_MAX = 12
"""The most decimal places of a second that are kept: picoseconds."""
TICK_DIGITS = 18
"""The digits of a tick, which fit int64."""


class LogicTable(Capture):
    """A capture in a table.

    Args:
        table: the table.
        reading: what the user says of it.

    Raises:
        RecordingError: if it has neither times nor a rate.
    """

    otherwise = "; for counts, name their column (--column)"

    def __init__(self, table: Table, reading: Reading):
        self.name, self.form, self._table = table.name, f"levels as {table.form}", table
        named = [table.place(each) for each in reading.channels if each in table.names]
        self._time = time_column_of(table, reading, set(named))
        if self._time is None and table.rate_hz is None:
            raise RecordingError(
                f"{table.name}: a capture must have times (--time COLUMN), or state its sample rate{self.otherwise}"
            )
        if self._time is None:
            reading.refuse(table.name, "is read without times", "time_unit")
        self._given = reading.time_unit
        self._places = [place for place in range(table.width) if self._time is None or place != self._time.place]
        self.channels = [table.called(place) for place in self._places]

    def changes(self, places: Sequence[int]) -> Changes:
        wanted = [self._places[place] for place in places]
        if self._time is not None:
            wanted.append(self._time.place)
            stamps = Stamps(self._table, self._time.name, self._time.unit)
        rows, levels, start, before, last, total = [], [], 0, -1, None, 0
        for lines, columns in self._table.chunks(wanted):
            now = self._levels(lines, columns[: len(places)], wanted)
            if before < 0:
                start = before = int(now[0])
                at = np.concatenate([[0], changed(before, now)])
            else:
                at = changed(before, now)
            rows.append(total + at)
            levels.append(now[at])
            self.check_number(sum(map(len, rows)))
            before, total = int(now[-1]), total + len(lines)
            if self._time is not None:
                times = columns[-1]
                if len(at):
                    stamps.add([lines[place] for place in at], _some(times, at))
                last = [lines[-1]], times[-1:]
        if total < 2:
            raise RecordingError(f"{self.name}: must have at least 2 rows of levels, not {total}")
        levels = np.concatenate(levels).astype(np.int64)[1:]
        if self._time is None:
            return Changes(self._table.rate_hz, np.concatenate(rows)[1:], levels, start, total - 1)
        stamps.add(*last)
        return self._timed(stamps, levels, start)

    def _levels(self, lines: Sequence[int], columns: list[Cells], places: list[int]) -> np.ndarray:
        """Return the levels of some rows as words."""
        now = np.zeros(len(lines), np.int8)
        for bit, cells in enumerate(columns):
            texts = np.asarray(cells)
            if texts.dtype.kind in "iufb":
                high, valid = texts == 1, (texts == 0) | (texts == 1)
            else:
                high = np.isin(texts, ("1", "1.0", "true", "True", "TRUE"))
                valid = high | np.isin(texts, ("0", "0.0", "false", "False", "FALSE"))
            if not valid.all():
                place = int(np.argmin(valid))
                raise RecordingError(
                    f"{self._table.at(lines[place])}, column {plain(self._table.called(places[bit]))}: a level must "
                    f"be 0 or 1, not {str(texts[place])[:20]!r}: name the channels (--channels){self.otherwise}"
                )
            now |= high.astype(np.int8) << np.int8(bit)
        return now

    def _timed(self, stamps: Stamps, levels: np.ndarray, start: int) -> Changes:
        """Return the changes with their times; the first and the last time are the first and the last row's."""
        times, where = stamps.whole(), place_of(self.name, self._time.name)
        stamps.check_unit(self._given)
        unit = stamps.unit if stamps.unit != "iso" else "s"
        if unit is None and times.decimals is not None and times.decimals > 0:
            unit = "s"
        if unit is None:
            raise RecordingError(f"{where}: the unit of the times must be given (--time-unit {', '.join(UNITS)})")
        times = times.scaled(UNITS[unit])
        if (np.diff(times.since[:-1]) <= 0).any() or times.since[-1] < times.since[-2]:
            raise RecordingError(f"{where}: times must increase from one change of levels to the next")
        decimals = DECIMALS_MAX if times.decimals is None else min(max(times.decimals, 0), DECIMALS_MAX)
        # Ticks of a long capture must fit int64; a float64 has fewer digits than that.
        decimals = min(decimals, TICK_DIGITS - math.ceil(math.log10(max(times.since[-1], 1.0))))
        ticks = np.rint(times.since * 10.0**decimals).astype(np.int64)
        return Changes(10.0**decimals, ticks[1:-1], levels, start, int(ticks[-1]), float(times.first))


def _some(cells: Cells, at: np.ndarray) -> Cells:
    return cells[at] if isinstance(cells, np.ndarray) else [cells[place] for place in at]
