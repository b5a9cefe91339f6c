"""The pace of a virtual board, which it tells its hosts beside the line: nothing in the board knows of it.

Both ends meet at an abstract socket of this machine, whose name has the port in it. The socket exists as long as the
process of the virtual board, so no old socket tells a pace. A port without it has the pace 1.
"""

import os
import socket
import struct
import threading
from collections.abc import Iterable
from contextlib import suppress

NETWORK = "tcp://"
"""How the name of a port of the network begins."""
PACE_LEAST = 1e-3
"""The slowest board, in its seconds in a second."""
MARGIN = 3.0
"""The margin by which hosts are told less than its pace, because a machine is not always equally fast."""
CHANGE = 0.1
"""The part by which a pace is another one."""
FIRST_S = 5.0
"""The longest time in which a virtual board tells a new host its pace."""
HOSTS = 8
"""Hosts that may wait for it."""
WORD = 64
"""More bytes than what is told has."""
LOOPBACK = "127.0.0.1"
"""The address of this machine on itself, where `localhost` is said for it, too."""


def place_of(port: str) -> str:
    """Return the socket's name of a port, which is named as a host does: also by a link, or as `localhost`."""
    if not port.startswith(NETWORK):
        return f"\0hardwall pace {os.path.realpath(port)}"
    host, _, number = port.removeprefix(NETWORK).rpartition(":")
    return f"\0hardwall pace {NETWORK}{LOOPBACK if host == 'localhost' else host}:{number}"


def _socket() -> socket.socket:
    # What is sent at once is received at once.
    return socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class Teller:
    """The end of the virtual board. A context manager that closes it.

    Args:
        ports: the names of its ports.

    Raises:
        RuntimeError: if another process tells the pace of one of them.
    """

    def __init__(self, ports: Iterable[str]):
        self._listeners: list[socket.socket] = []
        self._hosts: list[socket.socket] = []
        self._behind: list[socket.socket] = []
        self._told = 0.0
        for port in ports:
            self._listeners.append(listener := _socket())
            listener.setblocking(False)
            try:
                listener.bind(place_of(port))
                listener.listen(HOSTS)
            except OSError as error:
                self.close()
                raise RuntimeError(f"the pace of {port} cannot be told: {error.strerror or error}") from None

    def __enter__(self) -> "Teller":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave all hosts; they keep the last pace that they were told."""
        for each in (*self._listeners, *self._hosts):
            each.close()

    def tell(self, pace: float) -> None:
        """Tell new hosts a pace, in seconds of the board in a second, and all of them if it has changed.

        They are told less, by `MARGIN`, and never more than that part of 1.
        """
        safe = max(min(pace, 1.0) / MARGIN, PACE_LEAST)
        self._leave_those_that_have_gone()
        new, self._behind = self._welcome() + self._behind, []
        if abs(safe - self._told) > CHANGE * self._told:
            self._told, new = safe, self._hosts
        word = f"{self._told:.3g}".encode("ascii")
        for host in list(new):
            try:
                host.send(word)
            except BlockingIOError:
                # It has not asked for long, and is told again.
                self._behind.append(host)
            except OSError:
                host.close()
                self._hosts.remove(host)

    def _leave_those_that_have_gone(self) -> None:
        """Close the ends of hosts that have closed theirs. A host says nothing else."""
        for host in list(self._hosts):
            with suppress(BlockingIOError):
                with suppress(ConnectionError):
                    host.recv(WORD)
                host.close()
                self._hosts.remove(host)
        self._behind = [host for host in self._behind if host in self._hosts]

    def _welcome(self) -> list[socket.socket]:
        """Return the hosts that have come."""
        new = []
        for listener in self._listeners:
            # Nobody waits, or this process has no room for more; then they wait.
            with suppress(OSError):
                while True:
                    host, _ = listener.accept()
                    host.setblocking(False)
                    new.append(host)
        self._hosts += new
        return new


class Told:
    """The end of a host: the pace of the board at a port.

    Args:
        port: the port's name.
    """

    def __init__(self, port: str):
        self._pace, self._lock = 1.0, threading.Lock()
        self._line: socket.socket | None = None
        # Without a virtual board no pace is told, and only Linux has such sockets. A stopped board does not answer
        # other requests either.
        with suppress(OSError, ValueError, AttributeError):
            self._line = _socket()
            self._line.settimeout(FIRST_S)
            self._line.connect(place_of(port))
            if _owner(self._line) in (os.getuid(), 0):
                self._hear()
                self._line.setblocking(False)
                return
        self.close()

    def close(self) -> None:
        if self._line is not None:
            self._line.close()
            self._line = None

    @property
    def pace(self) -> float:
        """The seconds of the board in a second, or fewer; 1 of what is no virtual board of this user."""
        with self._lock, suppress(OSError):
            while self._hear():
                pass
        return self._pace

    def _hear(self) -> bool:
        """Take what was told, unless it is no pace; return whether there was something."""
        if self._line is None:
            return False
        word = self._line.recv(WORD)
        with suppress(ValueError):
            pace = float(word)
            if PACE_LEAST <= pace <= 1.0:
                self._pace = pace
        return bool(word)


def _owner(line: socket.socket) -> int:
    """Return the user whose process is at the other end."""
    return struct.unpack("3i", line.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))[1]
