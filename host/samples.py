"""Samples of an axis at a given rate, for any time. A missed sample is counted where it is missing."""

import heapq
import math
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, NamedTuple, Protocol

from ..model.checks import check_number, check_range
from .durations import check_seconds
from .errors import SilentError
from .status import Status

RATE_HZ, RATE_LEAST_HZ, RATE_MOST_HZ = 20.0, 1e-3, 1e3
"""The default rate and its limits, Hz. A board can be read some hundreds of times a second."""
GAPS = 5
"""The gaps that are remembered, the longest ones."""
COLUMNS = (
    *("time_s", "unix_s", "stamp_s", "state", "position_m", "velocity_m_per_s", "acceleration_m_per_s2"),
    *("wall_force_n", "force_n", "live", "ready", "referenced", "a_channel_idle", "flags", "causes", "missed"),
)
"""The columns of a sample's row."""


class Board(Protocol):
    """The part of `hardwall.host.axis.Axis` that samples need."""

    @property
    def status(self) -> Status: ...


class Sample(NamedTuple):
    """A look at an axis.

    Attributes:
        time_s: when it was asked for, s since the first one, by a clock of this computer that never jumps.
        unix_s: the same moment, s since 1970 began, UTC.
        status: what the axis did; None if the board did not answer.
        missed: the number of samples missing between the one before and this one, including this one if it has no
            status.
    """

    time_s: float
    unix_s: float
    status: Status | None
    missed: int

    @property
    def row(self) -> dict[str, Any]:
        """The values by `COLUMNS`, as JSON takes them. Without a status its values are None. A board without an
        acceleration has None in its column."""
        row = dict.fromkeys(COLUMNS) | {"time_s": round(self.time_s, 6), "unix_s": round(self.unix_s, 6)}
        if status := self.status:
            row |= {name: getattr(status, name) for name in COLUMNS if hasattr(status, name)}
            causes = status.trip.causes if status.trip else ()
            row |= {"state": status.state.name, "flags": list(status.flags), "causes": list(causes)}
        return row | {"missed": self.missed}


class Gap(NamedTuple):
    """A run of missing samples: how many, and the time of the first one, s since the first sample."""

    missed: int
    time_s: float


class Samples(Iterator[Sample]):
    """Samples of an axis. They are due at whole multiples of the period.

    A sample is missed if the next one is due before the board could be asked for it, or if the board did not answer.
    Every due sample is either yielded with a status, or counted in `missed` of the next one yielded.

    Nothing is written, so no lease is renewed: a program that has armed must call `axis.renew()` in its loop.

    Args:
        axis: the axis.
        rate_hz: samples a second.
        seconds: the time in which samples are due, s; None: for ever.

    Attributes:
        rate_hz: as given.
        taken: how many were yielded with a status; missed: how many are missing.

    Raises:
        TypeError: if an argument is not a number.
        FieldError: if the rate is not 0.001 Hz to 1 kHz, or the time not finite, or negative.
        HostError: as the next sample is taken, if the port is gone. A board without an answer is no error.
    """

    def __init__(self, axis: Board, rate_hz: float = RATE_HZ, seconds: float | None = None):
        check_number("rate_hz", rate_hz)
        check_range("rate_hz", rate_hz, RATE_LEAST_HZ, RATE_MOST_HZ)
        if seconds is not None:
            check_seconds("seconds", seconds)
        self.rate_hz, self.taken, self.missed = rate_hz, 0, 0
        self._axis, self._due = axis, 0
        self._end = math.inf if seconds is None else math.ceil(seconds * rate_hz)
        self._began_s: float | None = None
        # The gap under way, and the longest ones of before.
        self._gap, self._gaps = Gap(0, 0.0), list[Gap]()

    def __iter__(self) -> "Samples":
        return self

    def __next__(self) -> Sample:
        """Wait until the next sample is due, and take it."""
        if self._began_s is None:
            self._began_s = time.monotonic()
        first = self._due
        if first >= self._end:
            raise StopIteration
        if (left_s := self._began_s + first / self.rate_hz - time.monotonic()) > 0:
            time.sleep(left_s)
        time_s = time.monotonic() - self._began_s
        number = min(max(int(time_s * self.rate_hz), first), self._end)
        unix_s, status = time.time(), None
        if number < self._end:
            with suppress(SilentError):
                status = self._axis.status
            self._due = int(number) + 1
        else:
            # The time was over before the board could be asked again.
            self._due = int(self._end)
        missed = self._due - first - (status is not None)
        self._count(missed, first / self.rate_hz, status is not None)
        return Sample(time_s, unix_s, status, missed)

    def _count(self, missed: int, from_s: float, answered: bool) -> None:
        """Count the samples missing from a time on; an answered sample ends the gap."""
        self.taken += answered
        self.missed += missed
        if missed:
            self._gap = Gap(self._gap.missed + missed, self._gap.time_s if self._gap.missed else from_s)
        if answered and self._gap.missed:
            heapq.heappush(self._gaps, self._gap)
            self._gap = Gap(0, 0.0)
            if len(self._gaps) > GAPS:
                heapq.heappop(self._gaps)

    @property
    def gaps(self) -> list[Gap]:
        """The longest gaps, at most `GAPS`, in the order of time."""
        gaps = [*self._gaps, *([self._gap] if self._gap.missed else [])]
        return sorted(heapq.nlargest(GAPS, gaps), key=lambda gap: gap.time_s)

    def __str__(self) -> str:
        """The numbers of samples taken and missed, and the times of the gaps, in one line."""
        said = f"{self.taken} samples at {self.rate_hz:g} Hz, {self.missed} missed"
        gaps = self.gaps
        if not gaps:
            return said
        shown = ", ".join(f"{gap.missed} from {gap.time_s:.3f} s on" for gap in gaps)
        left = self.missed - sum(gap.missed for gap in gaps)
        return f"{said}: {shown}" + (f", and {left} in shorter gaps" if left else "")
