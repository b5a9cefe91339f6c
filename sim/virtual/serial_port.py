"""The board's serial line as a host finds it: a pseudo-terminal, and a port of the loopback for one at a time."""

import os
import pty
import selectors
import socket
import tty
from contextlib import suppress

from ...model.link.board_pace import LOOPBACK, NETWORK

CHUNK = 4096


class PortError(RuntimeError):
    """There is no port for a host; one line that says why."""


class Line:
    """Where the bytes of hosts come from, and where the board's go to: whoever has spoken last.

    A context manager that closes everything.

    Args:
        tcp_port: port of 127.0.0.1 to listen at; 0 for any that is free; None for none.

    Attributes:
        path: the pseudo-terminal's name, which a host opens as a serial port.
        drops: how many of the next bytes to the board are lost.
        sent_away: how many guests were sent away because they sent more than the board's line has room for.

    Raises:
        PortError: if there is no pseudo-terminal, or the port cannot be had.
    """

    def __init__(self, tcp_port: int | None = None):
        self.drops, self.sent_away, self._room = 0, 0, 0
        try:
            self._listener = None if tcp_port is None else socket.create_server((LOOPBACK, tcp_port), backlog=1)
        except OSError as error:
            raise PortError(f"port {tcp_port} of {LOOPBACK} cannot be opened: {os.strerror(error.errno)}") from None
        try:
            self._master, self._slave = pty.openpty()
        except OSError as error:
            if self._listener:
                self._listener.close()
            raise PortError(f"no pseudo-terminal can be opened: {error.strerror or error}") from None
        # The slave is kept open, so that the terminal stays when a host closes it.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._guest = None
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._master, selectors.EVENT_READ, self._from_terminal)
        if self._listener:
            self._selector.register(self._listener, selectors.EVENT_READ, self._welcome)
        self._hearer = self._to_nobody
        self._came = bytearray()

    def __enter__(self) -> "Line":
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()
        self._selector.close()
        if self._listener:
            self._listener.close()
        os.close(self._master)
        os.close(self._slave)

    @property
    def names(self) -> list[str]:
        """The names of its ports, as a host gives them."""
        return [self.path] if self.tcp_port is None else [self.path, f"{NETWORK}{LOOPBACK}:{self.tcp_port}"]

    @property
    def tcp_port(self) -> int | None:
        """The port of 127.0.0.1; None without one."""
        return self._listener.getsockname()[1] if self._listener else None

    def take(self, wait_s: float, room: int) -> bytes:
        """Return the bytes that have come from hosts, and wait for them for some time, without lost bytes.

        A host waits for an answer, so a sender of more bytes than `room` is no host. If it is a guest it is sent away,
        and all its bytes are dropped, so that others are soon heard again.

        Args:
            wait_s: the longest wait, s.
            room: how many bytes are taken.
        """
        self._came.clear()
        self._room = room
        for key, _ in self._selector.select(wait_s):
            key.data()
        lost = min(self.drops, len(self._came))
        self.drops -= lost
        return bytes(self._came[lost:])

    def give(self, data: bytes) -> None:
        """Give bytes of the board to the host that has spoken last; without room for them they are lost."""
        with suppress(BlockingIOError):
            self._hearer(data)

    def _to_terminal(self, data: bytes) -> None:
        os.write(self._master, data)

    def _to_guest(self, data: bytes) -> None:
        """Give bytes to the guest; one that has gone is left."""
        try:
            self._guest.send(data)
        except BlockingIOError:
            raise
        except OSError:
            self._leave()

    def _to_nobody(self, data: bytes) -> None:
        """Lose the answer to a guest that has gone."""

    def _from_terminal(self) -> None:
        with suppress(BlockingIOError):
            data = os.read(self._master, CHUNK)[: self._room]
            self._room -= len(data)
            self._came += data
            self._hearer = self._to_terminal

    def _welcome(self) -> None:
        guest, _ = self._listener.accept()
        if self._guest:
            # One writer at a time.
            guest.close()
            return
        guest.setblocking(False)
        guest.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._guest = guest
        self._selector.register(guest, selectors.EVENT_READ, self._from_guest)

    def _from_guest(self) -> None:
        try:
            data = self._guest.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._leave()
            return
        if len(data) > self._room:
            self.sent_away += 1
            self._leave()
            return
        self._room -= len(data)
        self._came += data
        self._hearer = self._to_guest

    def _leave(self) -> None:
        if self._guest:
            self._selector.unregister(self._guest)
            self._guest.close()
            self._guest = None
            if self._hearer == self._to_guest:
                self._hearer = self._to_nobody
