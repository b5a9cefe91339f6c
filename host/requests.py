"""Requests to a board over its line: their bytes, their answers, and the check that an answer fits."""

from collections.abc import Callable
from typing import Any, NamedTuple

from pymodbus.exceptions import ModbusIOException

from ..model.link.line import FRAME_MAX, crc, framed
from .leases import LEASE_OBJECT, NAMED_OBJECT

EXCEPTION, EXCEPTION_SIZE = 0x80, 5
"""The bit of a function that is refused, and the bytes of such an answer."""
WRITTEN_SIZE = 8
"""The bytes of the answers to a write and to a diagnosis."""


class Sending(NamedTuple):
    """How a request goes out.

    Attributes:
        once: whether it makes a difference that it is done twice. Without an answer it is then not asked again.
        check: called in the turn of the request; what it raises is raised, and nothing is sent. None: no check.
        at_once: whether it does not wait for a beat either.
    """

    once: bool = False
    check: Callable[[], None] | None = None
    at_once: bool = False


PLAIN = Sending()
"""How a request goes out that may be done twice, needs no check and waits for its turn."""


class Relayed(NamedTuple):
    """An answer as it came, which may be an exception: unit, function and data."""

    frame: bytes

    def isError(self) -> bool:
        """Whether it must be shown as an error: never, because another program must judge it."""
        return False


class Request:
    """A request: what it is about, the bytes of it and its answer, how it is sent, and whether an answer fits it."""

    def __init__(self, what: str, size: int, send: Callable[[Any], Any], fits: Callable[[Any], bool]):
        self.what, self.size, self.send, self.fits = what, size, send, fits

    @classmethod
    def reading(cls, address: int, count: int) -> "Request":
        return cls(
            f"read {count} registers from {address:#06x} on",
            8 + 5 + 2 * count,
            lambda client: client.read_holding_registers(address, count=count),
            lambda answer: len(getattr(answer, "registers", ())) == count,
        )

    @classmethod
    def writing(cls, address: int, registers: tuple[int, ...]) -> "Request":
        return cls(
            f"write {len(registers)} registers from {address:#06x} on",
            9 + 2 * len(registers) + 8,
            lambda client: client.write_registers(address, list(registers)),
            lambda answer: (
                (getattr(answer, "address", None), getattr(answer, "count", None)) == (address, len(registers))
            ),
        )

    @classmethod
    def identifying(cls) -> "Request":
        return cls(
            "identify itself",
            7 + FRAME_MAX,
            lambda client: client.read_device_information(read_code=1, object_id=0),
            lambda answer: hasattr(answer, "information"),
        )

    @classmethod
    def echoing(cls, word: bytes) -> "Request":
        return cls(
            "repeat a word",
            8 + 8,
            lambda client: client.diag_query_data(word),
            lambda answer: getattr(answer, "message", None) == word,
        )

    @classmethod
    def lease(cls) -> "Request":
        return cls(
            "say who holds the lease",
            7 + FRAME_MAX,
            lambda client: client.read_device_information(read_code=NAMED_OBJECT, object_id=LEASE_OBJECT),
            lambda answer: LEASE_OBJECT in getattr(answer, "information", {}),
        )

    @classmethod
    def relaying(cls, request: bytes) -> "Request":
        """Return what sends another program's request, without its CRC, and takes the whole answer as it comes."""
        return cls(
            f"do function {request[1]}",
            len(request) + 2 + FRAME_MAX,
            lambda client: _relayed(client, request),
            lambda answer: answer.frame[:1] == request[:1] and answer.frame[1] & ~EXCEPTION == request[1],
        )


def _relayed(client: Any, request: bytes) -> Relayed:
    """Send a request, and return its answer; the client says until when it is waited for.

    Raises:
        ModbusIOException: if none comes, or what comes is spoilt.
    """
    client.send(framed(request))
    answer = b""
    while not _is_whole(answer):
        came = client.recv(None)
        if not came or len(answer) > FRAME_MAX:
            raise ModbusIOException("an incomplete answer")
        answer += came
    return Relayed(answer[:-2])


def _is_whole(answer: bytes) -> bool:
    """Return whether an answer has as many bytes as its function says, or any number that there is no rule for."""
    if len(answer) < EXCEPTION_SIZE or crc(answer):
        return False
    function = answer[1]
    if function & EXCEPTION:
        return len(answer) == EXCEPTION_SIZE
    if function in (3, 4, 23):
        return len(answer) == 3 + answer[2] + 2
    return len(answer) == WRITTEN_SIZE if function in (6, 8, 16) else True
