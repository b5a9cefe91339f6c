"""The application layer of Modbus: functions, exceptions and counters over a register file.

A frame with a verdict other than a request is only counted. A request is checked as a whole before anything of it is
done, in the order of the specification:

1. Exception 1: the function, the sub-function or the kind of identification is not known.
2. Exception 3: a number of registers or of bytes is not within its bounds, or they do not agree.
3. Exception 2: there is no such register, it cannot be written, or the frame has half of a value.
4. Exception 3: a value is out of its register's range.
5. Exception 4: the device refuses a pulse in its present state.

Function 23 writes before it reads. Functions 3 and 4 read the same registers.
"""

from ..axis.register_file import Design, RegisterFile
from ..axis.registers import COUNTERS
from .line import UNIT, Verdict

READ_MAX, WRITE_MAX, WRITE_AND_READ_MAX = 125, 123, 121
"""Registers that a frame of 256 bytes can read, write, and write beside reading."""
READS, WRITES = (3, 4, 23), (6, 16, 23)
WRITE_ONE, DIAGNOSE, IDENTIFY = 6, 8, 43
DEVICE_IDENTIFICATION = 14
ECHO, CLEAR, FIRST_COUNTER, LAST_COUNTER = 0x00, 0x0A, 0x0B, 0x12
"""Sub-functions of diagnostics; the counter of one is at its three lowest bits."""
NAMED = 4
"""The kind of identification that asks for one object; lower kinds ask for a stream."""
FUNCTION, ABSENT, VALUE, FAILURE = 1, 2, 3, 4
"""The exceptions."""
OVERRUNS, MESSAGES, ERRORS, EXCEPTIONS, REQUESTS, UNANSWERED = 2, 3, 4, 5, 6, 7
"""Places of the counters in their block."""
COUNTED_AS = {
    Verdict.SPOILT: (ERRORS,),
    Verdict.OVERRUN: (OVERRUNS,),
    Verdict.FOREIGN: (MESSAGES,),
    Verdict.BROADCAST: (MESSAGES, UNANSWERED),
    Verdict.REQUEST: (MESSAGES, REQUESTS),
}


class _Refusal(Exception):
    """A request that ends with an exception of Modbus, its code."""


def _word(data: bytes, place: int) -> int:
    return int.from_bytes(data[place : place + 2], "big")


class Server:
    """The server's twin.

    Args:
        design: the registers.

    Attributes:
        file: the register file, whose inputs are the axis's.
    """

    def __init__(self, design: Design):
        self.file = RegisterFile(design)

    def take(self, verdict: Verdict, frame: bytes) -> bytes | None:
        """Take a frame with its verdict; return the answer without its CRC, or None."""
        for counter in COUNTED_AS[verdict]:
            self._count(counter)
        if verdict is not Verdict.REQUEST:
            return None
        try:
            return self._answer(bytes(frame[:-2]))
        except _Refusal as refusal:
            self._count(EXCEPTIONS)
            return bytes([UNIT, frame[1] | 0x80, *refusal.args])

    def _count(self, counter: int) -> None:
        self.file.count(COUNTERS + counter)

    def _answer(self, request: bytes) -> bytes:
        function = request[1]
        if function == DIAGNOSE:
            return self._diagnose(request)
        if function == IDENTIFY:
            return self._identify(request)
        if function not in (*READS, *WRITES):
            raise _Refusal(FUNCTION)
        return self._transfer(request)

    def _transfer(self, request: bytes) -> bytes:
        """Read or write registers, or both."""
        function, file = request[1], self.file
        address, count, written, values = self._fields(request)
        file.clear()
        if function in READS:
            for k in range(count):
                file.check_read(address + k, k == 0, k == count - 1)
        for k, value in enumerate(values):
            file.check_write(written + k, k == 0, k == len(values) - 1, value)
        for found, code in ((file.absent, ABSENT), (file.outside, VALUE), (file.refused, FAILURE)):
            if found:
                raise _Refusal(code)
        if function in WRITES:
            for k, value in enumerate(values):
                file.write(written + k, value)
            file.finish()
        if function not in READS:
            return request[:6]
        file.snapshot()
        registers = [file.read(address + k) for k in range(count)]
        return request[:2] + bytes([2 * count]) + b"".join(each.to_bytes(2, "big") for each in registers)

    def _fields(self, request: bytes) -> tuple[int, int, int, list[int]]:
        """Return the first address and the number of registers to read, and the first address and values to write."""
        function = request[1]
        address, count = _word(request, 2), _word(request, 4)
        written, quantity, data, most = address, count, request[7:], WRITE_MAX
        if function == WRITE_ONE:
            quantity, data = 1, request[4:]
        elif function in READS:
            written, quantity, data, most = _word(request, 6), _word(request, 8), request[11:], WRITE_AND_READ_MAX
        if function in READS and not 1 <= count <= READ_MAX:
            raise _Refusal(VALUE)
        if function not in WRITES:
            return address, count, 0, []
        if not (1 <= quantity <= most and len(data) == 2 * quantity):
            raise _Refusal(VALUE)
        return address, count, written, [_word(data, place) for place in range(0, len(data), 2)]

    def _diagnose(self, request: bytes) -> bytes:
        sub, data = _word(request, 2), _word(request, 4)
        if sub == ECHO:
            return request
        if not CLEAR <= sub <= LAST_COUNTER:
            raise _Refusal(FUNCTION)
        if data:
            raise _Refusal(VALUE)
        if sub == CLEAR:
            for counter in range(8):
                self.file.write(COUNTERS + counter, 0)
            return request
        return request[:4] + self.file.read(COUNTERS + sub % 8).to_bytes(2, "big")

    def _identify(self, request: bytes) -> bytes:
        kind, code, number = request[2:5]
        if kind != DEVICE_IDENTIFICATION:
            raise _Refusal(FUNCTION)
        if not 1 <= code <= NAMED:
            raise _Refusal(VALUE)
        answers = self.file.design.registers.identification
        known = (True, number) in answers
        if code == NAMED and not known:
            raise _Refusal(ABSENT)
        return request[:4] + answers[code == NAMED, number if known else 0]
