"""A capture as a page asks for it: begun, watched, and read in parts between the looks at the board."""

import math
import time
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any

from ...model.axis.capture import DONE, SOURCES, STATES
from ...model.checks import FieldError, check_range
from ..axis import Axis
from ..capture import Captured

NOW = "now"
"""The trigger that a person gives."""
TRIGGERS = (*SOURCES, NOW)
IDLE, READING = "IDLE", "READING"
"""The states of a recorder besides the memory's: idle, and reading it."""
STATE_S = 0.05
"""The time between two looks at the state of the memory."""


@dataclass(frozen=True)
class Wish:
    """A capture that is wanted.

    Attributes:
        trigger: one of `TRIGGERS`.
        span_s: the time from the first record to the last, at least; the memory decides which are possible.
        before: the share of it before the trigger, 0 to 1.
        level_m: the position of the triggers `rise` and `fall`, m.
        acceleration: whether records have the acceleration in place of the velocity.

    Raises:
        FieldError: if a value is out of its range.
    """

    trigger: str = SOURCES[0]
    span_s: float = 0.0
    before: float = 0.25
    level_m: float = 0.0
    acceleration: bool = False

    def __post_init__(self) -> None:
        if self.trigger not in TRIGGERS:
            raise FieldError("trigger", f"must be one of {', '.join(TRIGGERS)}, not {self.trigger!r}")
        check_range("before", self.before, 0.0, 1.0)


@dataclass(frozen=True)
class Recording:
    """The state of a capture.

    Attributes:
        state: the state of the memory, or `READING`.
        read: the share of it that is read, 0 to 1.
        captured: the last capture that was read; None before the first. `number` counts them.
    """

    state: str = IDLE
    read: float = 0.0
    captured: Captured | None = None
    number: int = 0


class Recorder:
    """The one user of a board's capture memory.

    Attributes:
        recording: what is known of it.
    """

    def __init__(self) -> None:
        self.recording = Recording()
        self._reading: Generator[int, None, Captured] | None = None
        self._by_hand, self._looked_s = False, 0.0

    def spans_s(self, axis: Axis) -> tuple[float, float]:
        """Return the shortest and the longest time that the memory spans, s; zeros for a board without one."""
        if not axis.capture.records:
            return 0.0, 0.0
        decimation = axis.device.registers["capture_decimation"]
        shortest = axis.capture.records * axis.device.clocks_per_sample / axis.device.clock_hz
        return decimation.low * shortest, decimation.high * shortest

    def begin(self, axis: Axis, wish: Wish) -> None:
        """Begin a capture, whatever was before. Errors: see `Capture.start`."""
        least_s, most_s = self.spans_s(axis)
        check_range("span_s", wish.span_s, 0.0, most_s)
        records = axis.capture.records
        self._reading, self._by_hand = None, wish.trigger == NOW
        axis.capture.start(
            () if self._by_hand else (wish.trigger,),
            before=min(round(wish.before * records), records - 1),
            decimation=max(math.ceil(wish.span_s / least_s), 1),
            level_m=wish.level_m,
            acceleration=wish.acceleration,
        )
        self._say(state="FILLING", read=0.0)

    def leave(self) -> None:
        """Forget a capture that is not read: its board is gone."""
        self._reading = None
        self._say(state=IDLE, read=0.0)

    def leave_trigger(self) -> None:
        """Leave a capture whose trigger is a person's, unless it was given: now it would be late."""
        if self._by_hand and self.recording.state in ("FILLING", "WAITING"):
            self.leave()

    def step(self, axis: Axis) -> None:
        """Do what a look at the board has time for: ask for the state of the memory, or for a part of it.

        Raises:
            HostError: if the board is not reached, or its records do not follow each other.
        """
        if self.recording.state == IDLE:
            return
        if self._reading is None:
            self._watch(axis)
            return
        try:
            done = next(self._reading)
        except StopIteration as end:
            self._reading = None
            self._say(state=IDLE, read=0.0, captured=end.value, number=self.recording.number + 1)
        except Exception:
            self.leave()
            raise
        else:
            self._say(read=done / axis.capture.records)

    def _watch(self, axis: Axis) -> None:
        now_s = time.monotonic()
        if now_s - self._looked_s < STATE_S:
            return
        self._looked_s = now_s
        state = axis.capture.state
        if state == "WAITING" and self._by_hand:
            axis.capture.trigger()
        if state == STATES[DONE]:
            self._reading = axis.capture.reading()
            state = READING
        # A board that was reset has forgotten the capture.
        self._say(state=state)

    def _say(self, **changes: Any) -> None:
        self.recording = replace(self.recording, **changes)
