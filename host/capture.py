"""The capture memory of a board: samples at the full rate around an event, as arrays in SI units."""

import io
import time
from collections.abc import Callable, Collection, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from ..model.axis.capture import DONE, IDLE, RECORD_REGISTERS, SOURCES, STATE_FLAGS, STATES
from ..model.axis.registers import CAPTURE
from ..model.checks import FieldError, check_int
from ..model.runtime.whole_file import whole_file
from .device import Device
from .durations import check_seconds
from .errors import ForeignError, NotReadyError, RefusedError
from .status import flag_names

PART_RECORDS = 15
"""Records that are read by one request."""
TAKEN = "capture_axis"
"""The word that selects the captured axis, on a board of several axes."""
ACCELERATED = "capture_acceleration"
"""The word that selects the acceleration, on a board that has one."""
LOOK_S = 0.02
"""The time between two looks at the state of a capture."""


@dataclass(frozen=True)
class Captured:
    """A capture. Every array has one element per record; `place` of the records are before the trigger.

    Records have either the velocity or the acceleration. The array of the other one is None.

    Attributes:
        time_s: time from the first record at the trigger or behind it, s.
        position_m: the position that the sample took, m.
        velocity_m_per_s: the velocity estimated from it, m/s; or None.
        acceleration_m_per_s2: the acceleration estimated from it, m/s^2; or None.
        force_n: the force that was let out for it, N.
        flags: bits as in `flag_names`.
        flag_names: names of the flags, bit 0 first.
        place: records before the trigger.
        identity: the identity of the board.
    """

    time_s: np.ndarray
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray | None
    acceleration_m_per_s2: np.ndarray | None
    force_n: np.ndarray
    flags: np.ndarray
    flag_names: tuple[str, ...]
    place: int
    identity: str

    def flag(self, name: str) -> np.ndarray:
        """Return whether a flag is set, bool.

        Raises:
            FieldError: if there is no such flag.
        """
        if name not in self.flag_names:
            raise FieldError("flag", f"must be one of {', '.join(self.flag_names)}, not {name!r}")
        return (self.flags >> self.flag_names.index(name) & 1).astype(bool)

    @property
    def npz(self) -> bytes:
        """The content of an .npz file with all that is not None, by its name."""
        file = io.BytesIO()
        np.savez_compressed(file, **{name: value for name, value in vars(self).items() if value is not None})
        return file.getvalue()

    def save(self, path: Path) -> None:
        """Write `npz` to a file.

        Raises:
            OSError: if the file cannot be written.
        """
        with whole_file(path) as part:
            part.write_bytes(self.npz)


class Board(Protocol):
    """The part of `hardwall.host.axis.Axis` that a capture needs."""

    device: Device

    def set(self, **values: float) -> None: ...

    def get(self, name: str) -> float: ...

    def read(self, name: str) -> int: ...

    def read_registers(self, address: int, count: int) -> tuple[int, ...]: ...

    def pulse(self, name: str) -> None: ...

    def sleep(self, seconds: float) -> None: ...


class Capture:
    """The capture memory of a board, for one of its axes.

    Several axes share one memory. It records the axis whose capture was started last; the others have none then.

    Args:
        board: the axis.
        axis: its number on the board.

    Attributes:
        records: records that it has; 0 for a board without one.
    """

    def __init__(self, board: Board, axis: int = 0):
        self._board, self._axis = board, axis
        self.records = board.device.capture_registers // RECORD_REGISTERS

    @property
    def state(self) -> str:
        """IDLE, FILLING, WAITING, TRIGGERED or DONE; IDLE if another axis of the board is captured.

        Raises:
            NotReadyError: if the board has no capture memory.
            HostError: if the board is not reached.
        """
        self._check()
        return STATES[self._board.read("capture_state") if self._taken == self._axis else IDLE]

    def start(
        self,
        sources: Collection[str] = ("contact",),
        before: int | None = None,
        decimation: int = 1,
        level_m: float = 0.0,
        acceleration: bool = False,
    ) -> None:
        """Begin a capture of this axis, whatever was before, and of whichever axis.

        Args:
            sources: what triggers it, one or several, besides `trigger`: `contact`, `trip`, and the position that
                passes `level_m`, `rise` or `fall`.
            before: records that are wanted before the trigger; a quarter of all if it is not given.
            decimation: samples from a record to the next.
            level_m: that level, m.
            acceleration: whether records have the acceleration in place of the velocity.

        Raises:
            FieldError: if a source is not known, or a number is out of its range.
            NotReadyError: if the board has no capture memory, or is asked for an acceleration that it does not have.
            HostError: if the board is not reached.
        """
        self._check()
        if acceleration and not self._board.device.accelerates:
            raise NotReadyError("the board has no acceleration: its estimator estimates only the velocity")
        sources = [sources] if isinstance(sources, str) else sources
        for source in sources:
            if source not in SOURCES:
                raise FieldError("sources", f"must be of {', '.join(SOURCES)}, not {source!r}")
        wanted = self.records // 4 if before is None else before
        check_int("before", wanted, 0, self.records - 1)
        self._board.set(
            capture_sources=sum(1 << SOURCES.index(source) for source in set(sources)),
            capture_level=level_m,
            capture_before=wanted,
            capture_decimation=decimation,
            **({TAKEN: self._axis} if self._several else {}),
            **({ACCELERATED: acceleration} if self._board.device.accelerates else {}),
        )
        self._board.pulse("capture_start")

    def trigger(self) -> None:
        """Trigger a capture by hand.

        Raises:
            NotReadyError: if the board has no capture memory, or another axis of it is captured.
            HostError: if the board is not reached.
        """
        self._check()
        if (taken := self._taken) != self._axis:
            raise NotReadyError(
                f"the capture is of axis {taken}, not of axis {self._axis}: start a capture of this axis"
            )
        self._board.pulse("capture_trigger")

    def until(self, wanted: str, seconds: float) -> None:
        """Wait until the state is one, or one behind it, and live meanwhile: usually `DONE`.

        Raises:
            FieldError: if the time is not finite, or negative.
            TimeoutError: if that does not come in time.
            HostError: if the board is not reached, or has no capture memory.
        """
        check_seconds("seconds", seconds)
        end = time.monotonic() + seconds
        while STATES.index(state := self.state) < STATES.index(wanted):
            if time.monotonic() > end:
                raise TimeoutError(f"the capture is not {wanted} in {seconds:g} s: it is {state}")
            self._board.sleep(LOOK_S)

    def read(self, progress: Callable[[int], object] = lambda done: None, lives: bool = True) -> Captured:
        """Return a capture that is done. Errors: see `reading`.

        Args:
            progress: called with the number of records that are read.
            lives: whether the lease is renewed meanwhile. Otherwise nothing is written, so that any program may read.
        """
        reading = self.reading()
        while True:
            try:
                done = next(reading)
            except StopIteration as end:
                return end.value
            if lives:
                self._board.sleep(0.0)
            progress(done)

    def reading(self) -> Generator[int, None, Captured]:
        """Read a finished capture, one request per step, so that a caller can do other things in between.

        Yields the number of records that are read, and returns the capture.

        Raises:
            NotReadyError: if it is not done, or the board has no capture memory.
            ForeignError: if the records do not follow each other.
            HostError: if the board is not reached.
        """
        if (state := self.state) != STATES[DONE]:
            raise NotReadyError(f"the capture is {state}: wait until it is {STATES[DONE]}")
        registers: list[int] = []
        while (done := len(registers) // RECORD_REGISTERS) < self.records:
            some = min(PART_RECORDS, self.records - done)
            try:
                registers += self._board.read_registers(CAPTURE + len(registers), some * RECORD_REGISTERS)
            except RefusedError:
                raise NotReadyError("the capture was started again while it was read") from None
            yield done + some
        return self._captured(np.array(registers, np.uint16).reshape(-1, RECORD_REGISTERS))

    def _captured(self, cells: np.ndarray) -> Captured:
        """Return the capture of registers of shape (records, 8), uint16."""
        device, place = self._board.device, self._board.read("capture_place")
        clocks = round(self._board.get("capture_decimation")) * device.clocks_per_sample
        steps = np.diff(cells[:, 7])
        wrong = np.flatnonzero(steps != clocks & 0xFFFF)
        if len(wrong):
            raise ForeignError(
                f"records must be {clocks} clocks apart, and record {wrong[0] + 1} of the capture is not: "
                f"{steps[wrong[0]]} of 65536"
            )
        halves = cells.astype(np.int64)
        values = (halves[:, 0:6:2] << 16 | halves[:, 1:6:2]).astype(np.uint32).view(np.int32)
        # The records have the formats of the status with these names.
        motion = "acceleration" if device.accelerates and self._board.get(ACCELERATED) else "velocity"
        si = {name: values[:, k] * device.registers[name].lsb for k, name in enumerate(("count", motion, "driven"))}
        known = device.registers["flags"].format.width
        return Captured(
            time_s=(np.arange(len(cells)) - place) * (clocks / device.clock_hz),
            position_m=si["count"],
            velocity_m_per_s=si.get("velocity"),
            acceleration_m_per_s2=si.get("acceleration"),
            force_n=si["driven"],
            flags=halves[:, 6],
            flag_names=(*STATE_FLAGS, *flag_names(known)),
            place=place,
            identity=device.identity,
        )

    @property
    def _several(self) -> bool:
        return TAKEN in self._board.device.registers

    @property
    def _taken(self) -> int:
        """The axis that is captured."""
        return self._board.read(TAKEN) if self._several else self._axis

    def _check(self) -> None:
        if not self.records:
            raise NotReadyError("the board has no capture memory: its bitstream was made without one")
