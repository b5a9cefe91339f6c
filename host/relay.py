"""One owner of a board's port, and many programs at it: to each a port of the loopback is as the board itself."""

import socket
import threading
import time
from contextlib import suppress
from dataclasses import dataclass

from ..model.axes.registers import BANK
from ..model.link.board_pace import LOOPBACK, NETWORK
from ..model.link.line import FRAME_MAX, FRAME_MIN, UNIT, crc, framed, length_of
from ..model.link.server import DEVICE_IDENTIFICATION, DIAGNOSE, ECHO, IDENTIFY, WRITE_ONE, WRITES
from .device import Device
from .errors import HostError, PortError
from .leases import LEASE_OBJECT, NAMED_OBJECT, NO_ANSWER, Guest, Lease, name_of
from .port import Port

GUESTS_MAX = 32
"""The most programs at a board. A further program takes the place of the one that has been silent longest."""
IDLE_S = 1.0
"""The silence behind which a program without the lease may lose its place: `disarm` is to get in."""
REST_S = 1.0
"""An incomplete request is dropped after this time: the loopback has no such pauses."""
GRACE_S, BURST = 5e-3, 5
"""The waiting time of the line for the lease holder's next request, and how many times in a row. A beat has two
requests, four if one is lost, and may follow another request of its program. Behind a USB bridge a request of another
program in between would take 16 ms."""
DEAF_S, RUBBISH_MAX = 0.1, 16
"""After bytes that are no request, a program is ignored for this time; after so many in a row it is disconnected. A
program that sends only rubbish would otherwise take processor time from the lease holder and delay its beats."""
OWN_S = 0.01
"""The time for a request that does not go to the board, one after the other, for the same reason."""
WRITE_MANY = 16
CONFORMITY = 0x83
"""The identification has objects of its own."""


@dataclass(eq=False)
class _Program:
    """A program at the board: its connection, and when it last sent something; its lease once it is served."""

    connection: socket.socket
    heard_s: float
    guest: Guest | None = None


class Relay:
    """Shares a port among programs. A context manager that ends it.

    A request of the lease holder goes before all others. So do the requests that follow it at once, up to `BURST`. So a
    beat waits for two requests of others at most, and others are not kept out.

    What any program may do at any time is read, and disarm. The relay sends nothing of its own. The board's heartbeat
    comes from the program that holds the lease, and stops with it.

    Args:
        port: the board's port, which is closed at the end.
        device: the board.
        number: the port of the loopback; 0 for any that is free.

    Attributes:
        name: the port, as programs name it.
        failure: why the board's port is gone; None while it is there.

    Raises:
        PortError: if that port of the loopback cannot be had.
    """

    def __init__(self, port: Port, device: Device, number: int = 0):
        self._port, self._lease = port, Lease(lambda: port.pace)
        disarm = device.registers["disarm"].address
        self._disarms = {disarm + BANK * axis for axis in range(device.axes)}
        try:
            self._listener = socket.create_server((LOOPBACK, number))
        except OSError as error:
            raise PortError(f"port {number} of {LOOPBACK} cannot be opened: {error.strerror}") from None
        self.name = f"{NETWORK}{LOOPBACK}:{self._listener.getsockname()[1]}"
        self.failure: HostError | None = None
        # Whose turn it is: one request at a time, the holder's first; and how many wait, of the holder and of others.
        self._turns = threading.Condition()
        self._busy, self._waiting = False, {True: 0, False: 0}
        # Until when the line is kept for the holder, and how many requests in a row it has had.
        self._kept_s, self._in_a_row = 0.0, 0
        self._programs: set[_Program] = set()
        self._ended, self._own_turns = threading.Event(), threading.Lock()
        self._welcoming = threading.Thread(target=self._welcome, name="hardwall-relay", daemon=True)
        self._welcoming.start()

    def __enter__(self) -> "Relay":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave all programs, and close the board's port."""
        self._ended.set()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for program in list(self._programs):
            _send_away(program)
        self._port.close()

    @property
    def pace(self) -> float:
        """The board's seconds in a second, or fewer."""
        return self._port.pace

    @property
    def holder(self) -> str:
        """The name of the program that holds the lease; empty if none does."""
        with self._turns:
            holder = self._lease.holder
        return holder.name if holder else ""

    def _welcome(self) -> None:
        while not self._ended.is_set():
            try:
                connection, peer = self._listener.accept()
            except OSError:
                # It is closed; or this process has as many files as it may have, until a program leaves.
                self._ended.wait(REST_S)
                continue
            if len(self._programs) >= GUESTS_MAX and not self._makes_room():
                connection.close()
                continue
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            program = _Program(connection, time.monotonic())
            self._programs.add(program)
            threading.Thread(target=self._serve, args=(program, peer), name="hardwall-guest", daemon=True).start()

    def _makes_room(self) -> bool:
        """Send away the program that has been silent for longest, and return true; false if all are busy."""
        with self._turns:
            holder = self._lease.holder
        others = [program for program in list(self._programs) if program.guest is None or program.guest is not holder]
        idle = min(others, key=lambda program: program.heard_s)
        if time.monotonic() - idle.heard_s < IDLE_S:
            return False
        _send_away(idle)
        self._programs.discard(idle)
        return True

    def _serve(self, program: _Program, peer: tuple[str, int]) -> None:
        """Answer a program until it goes."""
        connection = program.connection
        name = name_of(peer, connection.getsockname())
        with self._turns:
            program.guest = guest = self._lease.welcome(name)
        try:
            with connection, suppress(OSError):
                begun, rubbish = b"", 0
                while rubbish < RUBBISH_MAX:
                    connection.settimeout(REST_S if begun else None)
                    try:
                        data = connection.recv(FRAME_MAX)
                    except TimeoutError:
                        begun = b""
                        continue
                    if not data:
                        return
                    program.heard_s = time.monotonic()
                    begun += data
                    while (size := _size_of(begun)) and len(begun) >= size:
                        request, begun = begun[:size], begun[size:]
                        if crc(request) or request[0] != UNIT:
                            # As the board itself: silent to what is spoilt, or not for it.
                            rubbish += 1
                            self._ended.wait(DEAF_S)
                            continue
                        rubbish = 0
                        connection.sendall(framed(self._answer(guest, request[:-2])))
        finally:
            self._programs.discard(program)
            with self._turns:
                self._lease.leave(guest)

    def _answer(self, guest: Guest, request: bytes) -> bytes:
        """Return the answer to a request, both without their CRC."""
        function = request[1]
        if (own := self._own_answer(request)) is not None:
            with self._own_turns:
                self._ended.wait(OWN_S)
            return own
        with self._turns:
            self._wait_for_turn(self._lease.holder is guest)
            if (refused := self._refusal(guest, request)) is not None:
                self._turns.notify_all()
                return bytes([UNIT, function | 0x80, refused])
            self._busy = True
        try:
            return self._port.relay(request)
        except HostError as error:
            if isinstance(error, PortError):
                self.failure = error
            return bytes([UNIT, function | 0x80, NO_ANSWER])
        finally:
            with self._turns:
                self._busy = False
                if function in WRITES and not self._disarms_alone(request):
                    self._lease.wrote(guest)
                self._in_a_row = self._in_a_row + 1 if self._lease.holder is guest else 0
                self._kept_s = time.monotonic() + (GRACE_S if 0 < self._in_a_row < BURST else 0.0)
                self._turns.notify_all()

    def _own_answer(self, request: bytes) -> bytes | None:
        """Return the relay's own answer to a request; None if the request goes to the board."""
        function, data = request[1], request[2:]
        if function == DIAGNOSE and data[:2] == ECHO.to_bytes(2, "big"):
            return request
        if function == IDENTIFY and data == bytes([DEVICE_IDENTIFICATION, NAMED_OBJECT, LEASE_OBJECT]):
            name = self.holder.encode()[: FRAME_MAX // 2]
            return request[:4] + bytes([CONFORMITY, 0, 0, 1, LEASE_OBJECT, len(name)]) + name
        return None

    def _wait_for_turn(self, holds: bool) -> None:
        """Wait, with the lock, until a request of the holder, or of another program, may go out."""
        self._waiting[holds] += 1
        while not self._may_go(holds):
            # The end of a request wakes all; the line's waiting time ends by itself.
            self._turns.wait(GRACE_S)
        self._waiting[holds] -= 1

    def _may_go(self, holds: bool) -> bool:
        if self._busy:
            return False
        enough = self._in_a_row >= BURST
        if holds:
            return not (enough and self._waiting[False])
        return enough or not (self._waiting[True] or time.monotonic() < self._kept_s)

    def _refusal(self, guest: Guest, request: bytes) -> int | None:
        """Return the exception with which a request is refused; None if it is passed to the board."""
        if request[1] not in WRITES or self._disarms_alone(request):
            return None
        return self._lease.refusal(guest)

    def _disarms_alone(self, request: bytes) -> bool:
        """Return whether a request writes only the pulse that disarms an axis."""
        place, count = (int.from_bytes(request[at : at + 2], "big") for at in (2, 4))
        if request[1] not in (WRITE_ONE, WRITE_MANY):
            return False
        return place in self._disarms and count == 1 and request[-2:] == b"\0\1"


def _send_away(program: _Program) -> None:
    """End a program's connection; the thread that serves it then closes it."""
    with suppress(OSError):
        program.connection.shutdown(socket.SHUT_RDWR)


def _size_of(begun: bytes) -> int | None:
    """Return the bytes of a request by its beginning; of a function without a rule all that has come."""
    if len(begun) < FRAME_MIN:
        return None
    known = length_of(begun)
    if known is None and begun[1] not in WRITES:
        return len(begun)
    return min(known, FRAME_MAX) if known else None
