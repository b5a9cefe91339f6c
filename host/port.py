"""The line to a board: requests of Modbus RTU, one after the other, on a serial port or a port of the network."""

import errno
import logging
import secrets
import select
import socket
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.pdu import ModbusPDU

from ..model.checks import check_int, check_range
from ..model.link.server import FAILURE, READ_MAX, VALUE, WRITE_MAX
from .errors import ForeignError, PortError, RefusedError, SilentError

BAUD, BAUD_MAX = 921_600, 4_000_000
"""The board's rate unless its clock is slow, and the highest of a serial port."""
ANSWER_S = 1.0
"""How long an answer is waited for: it takes some ms on a board, and longer where a simulation is slower than it."""
ANSWER_S_LEAST, ANSWER_S_MOST = 1e-3, 3600.0
"""The limits of that."""
TRIES = 5
"""Attempts to find the beginning of an answer again."""
PAUSE_S = 0.025
"""The silence behind which the board takes the next byte for the beginning of a request."""
NETWORK = "tcp://"
"""How the name of a port of the network begins."""
EXCEPTIONS = {1: "it does not know the function", 2: "it has no such register", VALUE: "a value is out of its range"}
"""What an exception of Modbus says of a request, but `FAILURE`."""

# Every failure is an exception here: what the library says of it besides is said twice.
logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)


class _SerialClient(ModbusSerialClient):
    """The library's client, without its pauses of whole ms, and with the reason why a port cannot be had."""

    def connect(self) -> bool:
        """Open the port, unless it is open.

        Raises:
            OSError: if it cannot be had.
        """
        if not self.socket:
            to = self.comm_params
            # Without a time-out a read returns what is there.
            self.socket = serial.Serial(to.host, to.baudrate, timeout=0, write_timeout=ANSWER_S, exclusive=True)
        return True

    def recv(self, size: int | None) -> bytes:
        """Return the bytes that have come, after a wait for the first."""
        return _received(self.socket, self.socket.read if self.socket else None, self.comm_params.timeout_connect)


class _NetworkClient(ModbusTcpClient):
    """The library's client, which says why a port cannot be had."""

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
        return _received(self.socket, self.socket.recv if self.socket else None, self.comm_params.timeout_connect)


def _received(source: Any, read: Callable[[int], bytes] | None, wait_s: float | None) -> bytes:
    """Return the bytes that a source has, after a wait for the first; empty if none came.

    Raises:
        ConnectionException: if the other end has gone.
    """
    try:
        if read and not select.select([source], [], [], wait_s)[0]:
            return b""
        data = read(4096) if read else b""
    except OSError:
        data = b""
    if not data:
        raise ConnectionException("the port is gone")
    return data


def _client(name: str, baud: int, answer_s: float) -> ModbusSerialClient | ModbusTcpClient:
    """Return the client of a port, not yet connected."""
    if not name.startswith(NETWORK):
        return _SerialClient(name, baudrate=baud, timeout=answer_s, retries=0)
    host, _, number = name.removeprefix(NETWORK).rpartition(":")
    if not host or not number.isdecimal() or not 0 < int(number) < 1 << 16:
        raise PortError(f"a port of the network must be {NETWORK}HOST:PORT, with a PORT of 1 to 65535, not {name}")
    return _NetworkClient(host, port=int(number), framer=FramerType.RTU, timeout=answer_s, retries=0)


def _reason(error: Exception) -> str:
    """Return why a port cannot be had, and what helps."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return "there is none of that name; `ls /dev/serial/by-id` shows those of boards that are plugged in"
    if number in (errno.EACCES, errno.EPERM):
        return "it is not yours to open; on most systems it is, once you are in the group dialout"
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program has it, and a board has one host at a time"
    if number in (errno.ECONNREFUSED, errno.ETIMEDOUT):
        return "nothing listens there"
    if "configure" in str(error):
        return "it is no serial port"
    return str(error).rpartition(": ")[2] or str(error)


class Port:
    """A line to a board. Requests may come from several threads: each waits for its turn, and they come in order.

    An answer of Modbus RTU does not say which request it belongs to. So after a request without an answer, and at the
    beginning, the board is asked to repeat a random word until it does: what it had left to say is then over.

    Args:
        name: a serial port's path, or tcp://HOST:PORT.
        baud: the rate of a serial port.
        answer_s: how long an answer is waited for.

    Attributes:
        name: as given.

    Raises:
        FieldError: if a number is out of its range.
        PortError: if the port cannot be had.
    """

    def __init__(self, name: str, baud: int = BAUD, answer_s: float = ANSWER_S):
        check_int("baud", baud, 1, BAUD_MAX)
        check_range("answer_s", answer_s, ANSWER_S_LEAST, ANSWER_S_MOST)
        self.name, self._baud = name, baud
        self._client, self._in_step, self._gone = _client(name, baud, answer_s), False, False
        try:
            self._client.connect()
        except (OSError, ValueError, OverflowError) as error:
            raise PortError(f"{name} cannot be opened: {_reason(error)}") from None
        # A request that waits in a thread of its own is not torn by an interrupt, and none overtakes another.
        self._turns = ThreadPoolExecutor(1, "hardwall-port")

    def close(self) -> None:
        """Close the port, behind the requests that wait for their turn."""
        self._gone = True
        self._turns.shutdown()
        self._client.close()

    def read(self, address: int, count: int) -> tuple[int, ...]:
        """Return successive registers, in as many requests as they need.

        Raises:
            HostError: if the board does not answer, or refuses.
        """
        registers: list[int] = []
        while len(registers) < count:
            some = min(count - len(registers), READ_MAX)
            registers += self._ask(_Request.reading(address + len(registers), some)).registers
        return tuple(registers)

    def write(self, address: int, registers: tuple[int, ...]) -> None:
        """Write successive registers, all in one request.

        Raises:
            ValueError: if they are more than a request takes.
            HostError: if the board does not answer, or refuses.
        """
        if not 1 <= len(registers) <= WRITE_MAX:
            raise ValueError(f"registers must be 1 to {WRITE_MAX}, not {len(registers)}")
        self._ask(_Request.writing(address, registers))

    def identify(self) -> dict[int, bytes]:
        """Return the objects by which the device identifies itself: 0 its vendor, 1 its product, 2 its revision."""
        return dict(self._ask(_Request.identifying()).information)

    def _ask(self, request: "_Request") -> Any:
        if self._gone:
            raise PortError(f"{self.name} is closed or gone: connect again")
        try:
            turn = self._turns.submit(self._turn, request)
        except RuntimeError:
            # Another thread has closed it just now, or the program ends.
            raise PortError(f"{self.name} is closed: connect again") from None
        return turn.result()

    def _turn(self, request: "_Request") -> ModbusPDU:
        if not self._in_step:
            self._find_step()
        answer = self._answer(request)
        if answer.isError():
            code = getattr(answer, "exception_code", 0)
            said = "it does not do that in its present state" if code == FAILURE else EXCEPTIONS.get(code, f"{code}")
            raise RefusedError(f"the board refuses to {request.what}: {said}", code)
        if not request.fits(answer):
            self._in_step = False
            raise ForeignError(f"the answer to the request to {request.what} does not fit it")
        return answer

    def _answer(self, request: "_Request") -> Any:
        try:
            return request.send(self._client)
        except ConnectionException:
            self._gone = True
            raise PortError(f"{self.name} is gone: is the cable in, and the board powered?") from None
        except ModbusException:
            if self._in_step:
                self._in_step = False
                raise SilentError(
                    f"nothing answers any more at {self.name}, to the request to {request.what}, which may have been "
                    "carried out: is the cable in, and the board powered?"
                ) from None
            raise SilentError(
                f"nothing answers at {self.name} at {self._baud} baud: is the board powered and configured, "
                "and is it this port and this rate?"
            ) from None

    def _find_step(self) -> None:
        """Let the board repeat random words until it says the last one."""
        for tries_left in reversed(range(TRIES)):
            time.sleep(PAUSE_S)
            self._drain()
            request = _Request.echoing(secrets.token_bytes(2))
            with suppress(*([SilentError] if tries_left else [])):
                if request.fits(self._answer(request)):
                    self._in_step = True
                    return
        raise ForeignError(f"what answers at {self.name} does not repeat what it is told, as an axis does")

    def _drain(self) -> None:
        """Take what has come, until nothing does for a while."""
        waited, self._client.comm_params.timeout_connect = self._client.comm_params.timeout_connect, PAUSE_S
        try:
            while self._client.recv(None):
                pass
        except ConnectionException:
            self._gone = True
            raise PortError(f"{self.name} is gone: is the cable in, and the board powered?") from None
        finally:
            self._client.comm_params.timeout_connect = waited


class _Request:
    """A request: what it is about, how it is sent, and whether an answer fits it."""

    def __init__(self, what: str, send: Callable[[Any], Any], fits: Callable[[Any], bool]):
        self.what, self.send, self.fits = what, send, fits

    @classmethod
    def reading(cls, address: int, count: int) -> "_Request":
        return cls(
            f"read {count} registers from {address:#06x} on",
            lambda client: client.read_holding_registers(address, count=count),
            lambda answer: len(getattr(answer, "registers", ())) == count,
        )

    @classmethod
    def writing(cls, address: int, registers: tuple[int, ...]) -> "_Request":
        return cls(
            f"write {len(registers)} registers from {address:#06x} on",
            lambda client: client.write_registers(address, list(registers)),
            lambda answer: (
                (getattr(answer, "address", None), getattr(answer, "count", None)) == (address, len(registers))
            ),
        )

    @classmethod
    def identifying(cls) -> "_Request":
        return cls(
            "identify itself",
            lambda client: client.read_device_information(read_code=1, object_id=0),
            lambda answer: hasattr(answer, "information"),
        )

    @classmethod
    def echoing(cls, word: bytes) -> "_Request":
        return cls(
            "repeat a word",
            lambda client: client.diag_query_data(word),
            lambda answer: getattr(answer, "message", None) == word,
        )
