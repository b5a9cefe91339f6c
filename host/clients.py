"""The clients of pymodbus that open, read and write a port; and the reason why a port cannot be opened."""

import errno
import logging
import os
import re
import select
import socket
import time
from collections.abc import Callable
from typing import Any

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from ..model.link.board_pace import NETWORK
from .errors import PortError

# Every failure is an exception here: what the library says of it besides is said twice.
logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)


class SerialClient(ModbusSerialClient):
    """The library's client, without its pauses of whole ms, and with the reason why a port cannot be opened.

    Attributes:
        until_s: the time until which bytes are waited for, s of time.monotonic.
    """

    until_s = 0.0

    def connect(self) -> bool:
        """Open the port, unless it is open.

        Raises:
            OSError: if it cannot be opened.
        """
        if not self.socket:
            to = self.comm_params
            # Without a time-out a read returns what is there.
            self.socket = serial.Serial(
                to.host, to.baudrate, timeout=0, write_timeout=to.timeout_connect, exclusive=True
            )
        return True

    def recv(self, size: int | None) -> bytes:
        """Return the bytes that have come, after a wait for the first."""
        return _received(self.socket, self.socket.read if self.socket else None, self.until_s)


class NetworkClient(ModbusTcpClient):
    """The library's client, with the reason why a port cannot be opened.

    Attributes:
        until_s: the time until which bytes are waited for, s of time.monotonic.
    """

    until_s = 0.0

    def connect(self) -> bool:
        """Connect, unless it is connected.

        Raises:
            OSError: if nothing listens there.
        """
        if not self.socket:
            to = self.comm_params
            self.socket = socket.create_connection((to.host, to.port), timeout=to.timeout_connect)
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def recv(self, size: int | None) -> bytes:
        """Return the bytes that have come, after a wait for the first."""
        return _received(self.socket, self.socket.recv if self.socket else None, self.until_s)


def _received(source: Any, read: Callable[[int], bytes] | None, until_s: float) -> bytes:
    """Return the bytes that a source has, after a wait for the first; empty if none came until then.

    Raises:
        ConnectionException: if the other end has gone.
    """
    try:
        if read and not select.select([source], [], [], max(until_s - time.monotonic(), 0.0))[0]:
            return b""
        data = read(4096) if read else b""
    except OSError:
        data = b""
    if not data:
        raise ConnectionException("the port is gone")
    return data


def client_of(name: str, baud: int, wait_s: float) -> SerialClient | NetworkClient:
    """Return the client of a port, not yet connected.

    Args:
        name: a serial port's path, or tcp://HOST:PORT, where an address of IPv6 has brackets.
        baud: the rate of a serial port.
        wait_s: how long it is waited for a connection, and for room to write.

    Raises:
        PortError: if no port has such a name.
    """
    if not name.startswith(NETWORK):
        return SerialClient(name, baudrate=baud, timeout=wait_s, retries=0)
    host, _, number = name.removeprefix(NETWORK).rpartition(":")
    if not host or not re.fullmatch("[0-9]{1,5}", number) or not 0 < int(number) < 1 << 16:
        raise PortError(f"a port of the network must be {NETWORK}HOST:PORT, with a PORT of 1 to 65535, not {name}")
    if host.startswith("[") and host.endswith("]"):
        # An address of IPv6, as it stands before a port.
        host = host[1:-1]
    return NetworkClient(host, port=int(number), framer=FramerType.RTU, timeout=wait_s, retries=0)


def reason(error: Exception) -> str:
    """Return the reason why a port cannot be opened, and the remedy."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return "there is no such port; `ls /dev/serial/by-id` lists the boards that are plugged in"
    if number in (errno.EACCES, errno.EPERM):
        return "permission denied; on most systems your user must be in the group dialout"
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program uses it; `hardwall share` shares a board among several programs"
    if number in (errno.ECONNREFUSED, errno.ETIMEDOUT):
        return "nothing listens there"
    if number == errno.EISDIR or "configure" in str(error):
        return "it is no serial port"
    # The number of a name that is not found is not the system's.
    said = os.strerror(number) if number and number > 0 else getattr(error, "strerror", None)
    if isinstance(error, UnicodeError):
        said = "no machine has such a name"
    return said or str(error).rpartition(": ")[2] or str(error)
