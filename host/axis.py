"""An axis on a board: its wall, its status, and the calls that arm and disarm it."""

import math
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from functools import partial

from ..model.axis.registers import TELEMETRY
from ..model.register import Kind
from .capture import Capture
from .device import Device, read_identity
from .durations import check_seconds
from .errors import ChangedError, HostError, LateError, NotReadyError, RefusedError, TrippedError
from .groups import FreeSpace, Named, Supervisor, Wall
from .heartbeat import LEASE_S, Beat, Heartbeat
from .homing import Homed, homing
from .port import Port
from .requests import Sending
from .shared import Shared
from .status import State, Status, Trip, status_of
from .words import Words

READY_TRIES = 20
"""Looks at `ready` after the first beat."""
HOMING_S = 0.01
"""The time between two looks at a handle that is homed."""
TWICE = "disarm", "acknowledge"
"""Pulses that may come twice: without an answer they are asked for again."""
LATCHED = Trip(0, (), (), {})
"""Stands for the trip that the board has when it is asked to acknowledge it."""


class Axis(Named):
    """An axis on a board, from `hardwall.host.connect`. A context manager that disarms and closes.

    These calls renew the application's lease: `set`, every attribute of `wall`, `free` and `supervisor`, `arm`,
    `renew`, `sleep` and `watch`. The lease lasts half a second of the board. While it lasts, a thread sends the
    heartbeat. If an application hangs, or only reads, the axis trips with the cause link_timeout.

    Several threads may use it. If one arms while another disarms or closes, the axis ends disarmed.

    Args:
        port: the line.
        device: the device there.
        shared: the state shared with the other axes of the device; None for a single axis.
        number: the number of the axis on the device.

    Attributes:
        device: the board's identity and registers.
        wall: the wall.
        free: free space, where the wall has no force.
        supervisor: the limits.
        capture: the capture memory.

    Raises:
        HostError: if the board does not answer.
    """

    device: Device
    wall: Wall
    free: FreeSpace
    supervisor: Supervisor
    capture: Capture

    def __init__(self, port: Port, device: Device, shared: Shared | None = None, number: int = 0):
        self.device, self._port = device, port
        # The time, of time.monotonic, after which no write goes out, except a disarm and beats.
        self._until_s = math.inf
        self._words = Words(port, device, None if shared is None else shared.words, self._check_time)
        self.wall, self.free, self.supervisor = Wall(self), FreeSpace(self), Supervisor(self)
        self.capture = Capture(self, number)
        self._status = device.of_kind(Kind.STATUS)
        # Whether this program may have ARMED it; and whether it may be ARMED against this program's wish: by a host
        # that has gone, or after a lost answer. It is disarmed before the heartbeat goes on.
        self._may_drive, self._unwanted = False, self.status.state is State.ARMED
        # Whether a disarming has begun since the last arming did. There is no lock, for one who ends this program must
        # not wait for a thread that is held up in `arm`.
        self._called_off = False
        self._disarming = False
        beat = Beat(port, device.registers["heartbeat"]) if shared is None else partial(shared.send, self)
        self._heartbeat = Heartbeat(beat, self._words.written("supervisor_watchdog"))

    def __enter__(self) -> "Axis":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disarm, if the board can still be reached, and close the port."""
        self._called_off = True
        try:
            if self._may_drive:
                self.disarm()
        except HostError:
            # Without beats the board comes to rest by itself.
            pass
        finally:
            self._heartbeat.close()
            self._port.close()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all words that `get` and `set` take."""
        return self._words.names

    def get(self, name: str) -> float:
        """Return the SI value of a word as the axis uses it. Errors: see `Words.get`."""
        return self._words.get(name)

    def set(self, **values: float) -> None:
        """Write words in SI units, and commit them all at one sample. Errors: see `Words.set`."""
        self._let_go()
        self._words.set(values)
        self.renew()

    def read(self, name: str) -> int:
        """Return the word of a register; `device.registers` has its unit and format.

        Raises:
            KeyError: if there is no such register.
            HostError: if the board is not reached.
        """
        register = self.device.registers[name]
        return register.from_registers(self._port.read(register.address, register.size))

    def read_registers(self, address: int, count: int) -> tuple[int, ...]:
        """Return the raw words of successive registers. Errors: see `Port.read`."""
        return self._port.read(address, count)

    def line_s(self, count: int) -> float:
        """Return the time that the line needs to read so many registers, s, from its baud rate."""
        return self._port.line_s(count)

    def pulse(self, name: str) -> None:
        """Send a pulse to the axis.

        Raises:
            KeyError: if there is no such register.
            RefusedError: if the board refuses it in its present state.
            HostError: if the board is not reached.
        """
        checks = {"arm": self._check_wanted, "disarm": None}
        check = checks.get(name, self._check_time)
        sending = Sending(once=name not in TWICE, check=check, at_once=name == "disarm")
        self._port.write(self.device.registers[name].address, (1,), sending)

    @contextmanager
    def by(self, until_s: float) -> Iterator[None]:
        """Let calls write only until a time; from then on they raise LateError. A disarm and the heartbeat have no such
        limit.

        A board that does not answer is asked again and again. The limit keeps a late answer from doing an old wish.

        Args:
            until_s: the last time at which a write is sent, s of time.monotonic.
        """
        before, self._until_s = self._until_s, until_s
        try:
            yield
        finally:
            self._until_s = before

    def _check_time(self) -> None:
        if time.monotonic() > self._until_s:
            raise LateError("the board did not answer in time: the rest was not sent")

    def _check_wanted(self) -> None:
        self._check_time()
        if self._called_off:
            raise NotReadyError("the axis is not armed: it was disarmed or closed meanwhile")

    @property
    def lease(self) -> str | None:
        """The program that holds the lease of a shared board, empty if none does; None if the board is not shared."""
        return self._port.lease

    @property
    def counters(self) -> dict[str, int]:
        """The counters of the link since the board's reset, by name; they wrap at 65536."""
        block = self.device.of_kind(Kind.COUNTER)
        return dict(zip((each.name for each in block), self._port.read(block[0].address, len(block)), strict=True))

    @property
    def status(self) -> Status:
        """The state, position, velocity, force and flags of the axis now."""
        last = self._status[-1]
        registers = self._port.read(TELEMETRY, last.address + last.size - TELEMETRY)
        words = {}
        for each in self._status:
            at = each.address - TELEMETRY
            words[each.name] = each.from_registers(registers[at : at + each.size])
        si = {each.name: words[each.name] * each.lsb for each in self._status}
        return status_of(words, si, self.device.registers["flags"].format.width)

    @property
    def trip(self) -> Trip | None:
        """The latched causes of a trip; None if there are none."""
        return self.status.trip

    def renew(self) -> None:
        """Renew the lease: the heartbeat continues for another half second of the board.

        Raises:
            ChangedError: if the board was reset, or another host writes to it.
            HostError: if the board is not reached, or the heartbeat fails for another reason.
        """
        self._let_go()
        self._heartbeat.watchdog_s = self._words.written("supervisor_watchdog")
        self._heartbeat.renew(self._lease_s)
        if self._heartbeat.lost:
            raise self._heartbeat.lost

    @property
    def is_left_armed(self) -> bool:
        """Whether the axis is ARMED without a lease, or against the program's wish; False while it is being disarmed.

        Raises:
            HostError: if the board is not reached.
        """
        let = self._heartbeat.beats and not self._unwanted
        if let or self._disarming or not (self._may_drive or self._unwanted):
            return False
        return self.status.state is State.ARMED

    @property
    def _lease_s(self) -> float:
        return LEASE_S / self._port.pace

    def sleep(self, seconds: float) -> None:
        """Wait, and renew the lease meanwhile.

        Raises:
            FieldError: if the time is not finite, or negative.
            HostError: as `renew` does.
        """
        check_seconds("seconds", seconds)
        until = time.monotonic() + seconds
        self.renew()
        while (left := until - time.monotonic()) > 0:
            time.sleep(min(left, self._lease_s / 4))
            self.renew()

    def watch(self, period_s: float = 0.05, seconds: float | None = None) -> Iterator[Status]:
        """Yield the status again and again, and renew the lease meanwhile: for a time, or for ever.

        Raises:
            FieldError: if a time is not finite, or negative.
            HostError: if the board is not reached.
        """
        check_seconds("period_s", period_s)
        if seconds is not None:
            check_seconds("seconds", seconds)
        return self._watch(period_s, seconds)

    def _watch(self, period_s: float, seconds: float | None) -> Iterator[Status]:
        began = time.monotonic()
        while seconds is None or time.monotonic() - began < seconds:
            self.renew()
            yield self.status
            self.sleep(period_s)

    def arm(self) -> None:
        """Arm the axis: it drives, within a force limit that rises from 0. From now on the application must renew its
        lease.

        Raises:
            TrippedError: if causes are latched, or come at once.
            NotReadyError: if the axis cannot be armed for another reason.
            ChangedError: if the board was reset, or another host has written to it.
            HostError: if the board is not reached.
        """
        self._called_off = False
        self._check_ready()
        self._may_drive = True
        try:
            self.pulse("arm")
            status = self.status
        except RefusedError as error:
            status = self.status
            if status.trip:
                raise TrippedError(f"the axis tripped before it was armed: {status.trip}") from error
            raise NotReadyError(f"the axis cannot be armed: {self._why_not(status)}") from error
        except BaseException:
            # Whether it is ARMED is not known, and who sees this error takes it for not armed.
            with suppress(HostError):
                self.disarm()
            raise
        if status.trip:
            raise TrippedError(f"the axis tripped as it was armed: {status.trip}")
        if status.state is not State.ARMED:
            raise NotReadyError("the axis was armed, and disarmed at once: the loop of drive_enable opened")

    def _check_ready(self) -> None:
        """Renew the lease; check that the board was not reset or exchanged, and can be armed. Errors: see `arm`."""
        if (found := read_identity(self._port)) != self.device.identity:
            raise ChangedError(
                f"the board at {self._port.name} is now {found}, not {self.device.identity}: connect again"
            )
        self._words.check()
        self.renew()
        for _ in range(READY_TRIES):
            status = self.status
            if status.ready or status.trip:
                break
        if status.trip:
            raise TrippedError(f"the axis is tripped; acknowledge it first: {status.trip}")
        if not status.ready:
            raise NotReadyError(f"the axis cannot be armed: {self._why_not(status)}")

    def disarm(self) -> None:
        """Disarm the axis: the drive becomes 0, and the heartbeat stops.

        Raises:
            HostError: if the board is not reached. Its watchdog then makes the drive 0. If this program would let the
                heartbeat continue first, its next call disarms the axis.
        """
        self._called_off = self._disarming = True
        try:
            self._heartbeat.rest()
            self._unwanted = True
            self.pulse("disarm")
            self._may_drive = self._unwanted = False
        finally:
            self._disarming = False

    def acknowledge(self, trip: Trip | None = LATCHED) -> None:
        """Acknowledge a trip, exactly as it was read, and clear the flags: the axis is DISARMED, unless a cause is
        still present.

        It arms nothing.

        Args:
            trip: the value of the attribute `trip` when it was read. None (the axis was not tripped) acknowledges
                nothing. Without this argument the causes latched now are read and acknowledged.

        Raises:
            TrippedError: if a cause is still present, or another came since `trip` was read.
            HostError: if the board is not reached.
        """
        if trip is LATCHED:
            trip = self.trip
        if trip:
            word = self.device.registers["acknowledged"]
            self._port.write(word.address, word.to_registers(trip.latched), Sending(check=self._check_time))
            # The encoder's flags are a cause until they are cleared, so this comes first.
            self.pulse("clear_flags")
            self.pulse("acknowledge")
        if now := self.trip:
            raise TrippedError(f"the axis is still tripped: {now}")

    def preload(self, position_m: float) -> None:
        """Set the position of the handle, m. The handle must be at rest. The axis loses its reference.

        Raises:
            FieldError: if the position is out of range.
            NotReadyError: if the axis is ARMED.
            HostError: if the board is not reached.
        """
        self._move("preload", position_m)

    def shift_origin(self, by_m: float) -> None:
        """Add a length, m, to all positions at one clock: the handle's and a latched index's. The handle may move.

        With a latched index, the axis is referenced from then on.

        Raises:
            FieldError: if the length is out of range.
            NotReadyError: if the axis is ARMED.
            HostError: if the board is not reached.
        """
        self._move("origin_shift", by_m)

    def _move(self, pulse: str, count_m: float) -> None:
        """Write a word and send the pulse that moves the count by it."""
        self.set(preload_count=count_m)
        try:
            self.pulse(pulse)
        except RefusedError as error:
            raise NotReadyError("the axis is ARMED: disarm it before its position is set") from error

    def homing(self, index_m: float = 0.0) -> Generator[str, None, Homed]:
        """Home as `home` does, one look at the axis per step: see `hardwall.host.homing.homing`."""
        return homing(self, index_m)

    def home(self, index_m: float = 0.0, seconds: float = 60.0) -> float:
        """Wait until a hand has moved the handle over the index; then give the index the position `index_m`.

        Returns the position of the handle, m. The handle may move all the time.

        If a homing fails, the board still waits for its index, and is without a reference until a later homing ends.
        There is no way back from this wait.

        Raises:
            FieldError: if `index_m` is beyond the range of positions, or would take the handle beyond it, or the time
                is not finite, or negative.
            TimeoutError: if the index does not come in time.
            NotReadyError: if the axis is ARMED, or its scale has slipped since the index was found.
            HostError: if the board is not reached.
        """
        check_seconds("seconds", seconds)
        until, steps = time.monotonic() + seconds, self.homing(index_m)
        while True:
            try:
                waits_for = next(steps)
            except StopIteration as end:
                return end.value.position_m
            if time.monotonic() > until:
                raise TimeoutError(f"in {seconds:g} s the axis did not see {waits_for}")
            self.sleep(HOMING_S)

    def _why_not(self, status: Status) -> str:
        if status.state is State.ARMED:
            return "it is ARMED"
        if self.supervisor.reference and not status.referenced:
            return "it needs its reference: home it first"
        if not status.live:
            return "no heartbeat has reached it"
        return "the loop of drive_enable is open"

    def _let_go(self) -> None:
        """Disarm an axis that this program does not want ARMED; if another program holds the lease, leave it to that
        program."""
        if self._unwanted:
            if self.lease is not None:
                # The beat that the board has already is none, but it needs the lease.
                word = self.device.registers["heartbeat"]
                self._port.write(word.address, word.to_registers(self.read(word.name)), Sending(once=True))
            self.disarm()
