"""Reading of recordings: a file of any accepted form becomes a `Recording`, with notes of what was understood."""

from array import array
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...model.checks import shown
from . import gaps
from .counter import BITS
from .counts import Counts, turn_of
from .decoded import recording_of
from .error import RecordingError, plain
from .forms import source_of
from .logic_text import LogicTable
from .recording import RATE_MAX_HZ, RATE_MIN_HZ, SAMPLES_MAX, Reading, Recording
from .stamps import UNITS, Stamps, Times
from .steps import Steps, Unwrapped
from .table import Table
from .time_column import TIME_COLUMN, TimeColumn, place_of, time_column_of, unit_by_rate, unit_of
from .times import Sampled, check_mean

NOTHING_SAID = Reading()


def load(
    path: str | Path,
    column: str | None = None,
    rate_hz: float | None = None,
    reading: Reading = NOTHING_SAID,
    progress: Callable[[int], None] | None = None,
) -> Recording:
    """Return the recording in a file.

    Args:
        path: the file.
        column: name or number of the column of counts; None for the only one beside the times, or a capture of edges.
        rate_hz: sample rate, required of a capture and of a file without times; if a file has times, the two must
            agree.
        reading: what else a user says of the file.
        progress: function called with the number of bytes that are read.

    Raises:
        RecordingError: in one line, what is wrong, where, and what is accepted.
        ModuleNotFoundError: if the form of the file needs an extra that is not installed.
    """
    name = plain(str(path))
    if rate_hz is not None and not (isinstance(rate_hz, int | float) and RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ):
        raise RecordingError(f"{name}: the rate must be {RATE_MIN_HZ:g} to {RATE_MAX_HZ:g} Hz, not {shown(rate_hz)}")
    source = source_of(name, path, progress)
    if isinstance(source, Table):
        column = _only(source, reading) if column is None else column
        if column is not None:
            return _Counted(source, str(path), column, rate_hz, reading).recording()
        source = LogicTable(source, reading)
    elif column is not None:
        raise RecordingError(f"{name}: is a capture of edges, which has no column: name its channels (--channels)")
    else:
        reading.refuse(name, "is a capture with times of its own", "time", "time_unit")
    reading.refuse(name, "is a capture of edges", "unit", "count", "counter_bits", "counter_modulus", "gaps")
    return recording_of(source, str(path), reading.channels, rate_hz)


def _only(table: Table, reading: Reading) -> str | None:
    """Return the only column of a table beside its times, which can be no capture; None if there are more.

    Raises:
        RecordingError: if there is none.
    """
    if reading.channels or table.rate_hz is not None:
        return None
    times = [time_column_of(table, reading, {place}) for place in range(table.width)]
    beside = {
        place for place, time in enumerate(times) if table.width == 1 + (time is not None and time.place != place)
    }
    counts = [place for place in beside if not unit_of(table.called(place))[0]]
    if beside and not counts:
        raise RecordingError(f"{table.name}: must have a column of counts beside its times")
    return table.called(counts[0]) if len(counts) == 1 else None


class _Counted:
    """The reading of one column of counts of a table."""

    def __init__(self, table: Table, path: str, column: str, rate_hz: float | None, reading: Reading):
        self._table, self._path, self._column, self._given, self._reading = table, path, column, rate_hz, reading
        self._place = table.place(column)
        self._time = time_column_of(table, reading, {self._place})
        reading.refuse(table.name, "is read as counts (--column)", "channels")
        if self._time is None:
            reading.refuse(table.name, "is read without times", "time_unit")
        # If nobody asked for a column of times, its times only have to agree with a given rate, unless they must tell
        # where samples are missing.
        asked = reading.gaps != "refuse" or (self._time is not None and self._time.meant)
        self._loose = rate_hz is not None and self._time is not None and not asked
        if self._time is None and rate_hz is None:
            raise RecordingError(
                f"{table.name}: there is no column {TIME_COLUMN}, so the rate in Hz must be given (--rate), "
                "or a column of times (--time)"
            )

    def recording(self) -> Recording:
        """Return the recording."""
        reading, table = self._reading, self._table
        lines, cells, stamps = self._read()
        counts, said = cells.whole(lines, reading.count)
        grid, times, unit = gaps.whole(len(counts)), None, None
        if stamps is not None:
            times, unit = self._seconds(stamps)
            grid = gaps.grid_of(table.name, times, counts, reading.gaps, self._given)
        # A lost sample is an uneven time and a jump of the count: the time says which it is.
        rate_hz, start_s = self._rate(lines, grid, times)
        unwrapped = self._unwrapped(lines, counts, grid)
        counts = unwrapped.counts
        if reading.gaps == "split" and len(unwrapped.cuts):
            longest = gaps.piece(grid, unwrapped.cuts)
            counts = counts[np.searchsorted(grid.rows, longest.rows)]
            grid = longest
            rate_hz, start_s = self._rate(lines, grid, times)
        counts = gaps.held(counts, grid.numbers)
        notes = [table.form, *said, *self._said(rate_hz, unit), *unwrapped.notes, *grid.notes]
        column = table.called(self._place)
        return Recording(self._path, column, counts, rate_hz, start_s, notes=tuple(notes))

    def _unwrapped(self, lines: np.ndarray, counts: np.ndarray, grid: gaps.Grid) -> Unwrapped:
        reading, turn = self._reading, turn_of(self._reading.unit, self._reading.count)
        steps = Steps(self._table, self._column, lines[grid.rows], counts[grid.rows], grid.passed, turn)
        return steps.unwrapped(reading.counter, reading.gaps != "refuse")

    def _read(self) -> tuple[np.ndarray, Counts, Stamps | None]:
        """Return the lines, the counts and the times of all rows."""
        table, reading, time = self._table, self._reading, self._time
        cells = Counts(table, self._column, reading.unit, reading.counter_bits == BITS[1])
        stamps = Stamps(table, time.name, time.unit) if time is not None and not self._loose else None
        lines, ends = array("q"), []
        for chunk in table.chunks([self._place] if time is None else [self._place, time.place]):
            if len(lines) + len(chunk.lines) > SAMPLES_MAX:
                at = table.at(chunk.lines[SAMPLES_MAX - len(lines)])
                raise RecordingError(f"{at}: must have at most {SAMPLES_MAX} samples (data lines)")
            lines.extend(chunk.lines)
            cells.add(chunk.lines, chunk.columns[0])
            if stamps is not None:
                stamps.add(chunk.lines, chunk.columns[1])
            elif time is not None:
                ends = [*ends[:1], chunk.columns[1][-1]] if ends else [chunk.columns[1][0], chunk.columns[1][-1]]
        if len(lines) < 2:
            raise RecordingError(f"{table.name}: must have at least 2 samples (data lines), not {len(lines)}")
        if ends:
            self._check_loosely(time, ends, len(lines) - 1)
        return np.frombuffer(lines, np.int64), cells, stamps

    def _check_loosely(self, time: TimeColumn, ends: list, intervals: int) -> None:
        """Raise RecordingError if the mean rate of times is not the rate that is given; ends that are no times
        contradict nothing."""
        try:
            stamps = Stamps(self._table, time.name, time.unit)
            for end in ends:
                stamps.add([0], np.array([end]) if isinstance(end, np.generic) else [end])
        except RecordingError:
            return
        unit = "s" if stamps.unit == "iso" else stamps.unit
        mean = float(stamps.whole().since[-1]) / intervals
        check_mean(self._table.name, time.name, unit, mean, self._given)

    def _seconds(self, stamps: Stamps) -> tuple[Times, str]:
        """Return the times in seconds, and their unit."""
        times = stamps.whole()
        stamps.check_unit(self._reading.time_unit)
        if stamps.unit == "iso":
            return times, "ISO timestamps"
        where = place_of(self._table.name, self._time.name)
        unit = stamps.unit
        if unit is None:
            mean = float(np.median(np.diff(times.since)))
            if self._given is not None:
                unit = next((each for each in UNITS if abs(mean * 10.0 ** UNITS[each] * self._given - 1) <= 0.5), None)
            unit = unit or unit_by_rate(where, mean)
        return times.scaled(UNITS[unit]), unit

    def _rate(self, lines: np.ndarray, grid: gaps.Grid, times: Times | None) -> tuple[float, float]:
        """Return the sample rate, and the time of the first sample."""
        if len(grid.rows) < 2:
            raise RecordingError(f"{self._table.name}: must have at least 2 samples between gaps, not {len(grid.rows)}")
        if times is None:
            return float(self._given), 0.0
        kept = times.some(grid.rows)
        sampled = Sampled(self._table, self._time, lines[grid.rows], kept, grid.numbers)
        in_doubt = self._time.name == TIME_COLUMN and self._reading.time_unit is None
        return sampled.rate_hz(self._given, in_doubt), float(kept.first)

    def _said(self, rate_hz: float, unit: str | None) -> list[str]:
        """Return what was understood of the times."""
        if unit is None:
            return [f"{rate_hz:g} Hz as given"]
        return [f"times in column {plain(self._time.name)} ({unit}), {rate_hz:g} Hz"]
