"""The serial-line layer of Modbus RTU: where a frame ends, whether its CRC is good, and to whom it is addressed.

A frame is a unit, a function, data and a CRC, at most `FRAME_MAX` bytes. Its end follows from its length, which
function and data give: pauses mean nothing behind a USB adapter. A frame with an unknown function ends at a gap of
`GAP_S`, longer than the pauses of USB. What is spoilt on the way is dropped in silence, up to the next gap, and
counted.

No single bit that is flipped on the way lets a frame through. The CRC finds every flipped bit, as long as the frame is
taken with its true length. A flip changes that length only by way of the function or of a byte count. No function with
a length differs by one bit from a function with another length. So a flipped function either keeps its length or ends
by a gap. And a byte count that does not agree with its number of registers is refused by the server.
"""

from enum import IntEnum

GAP_S = 20e-3
"""The silence that ends a frame: USB adapters hold bytes back for 16 ms by default."""
FRAME_MAX = 256
"""Bytes of a frame, CRC included."""
FRAME_MIN = 4
UNIT, BROADCAST = 1, 0
FIXED = {3: 8, 4: 8, 6: 8, 8: 8, 43: 7}
"""Bytes of a request by its function, CRC included."""
COUNTED = {16: 6, 23: 10}
"""The place of the byte count of a request by its function; as many bytes and a CRC follow it."""


class Verdict(IntEnum):
    """The verdict on a frame."""

    SPOILT = 0  # the CRC is bad, a stop bit was low, it is too long, or it ended too early
    OVERRUN = 1  # bytes came while an answer was under way
    FOREIGN = 2  # to another unit
    BROADCAST = 3
    REQUEST = 4  # to this unit


def crc(data: bytes | bytearray) -> int:
    """Return the CRC-16 of Modbus: polynomial 0x8005, least significant bit first, from 0xFFFF."""
    register = 0xFFFF
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
    return register


def framed(data: bytes) -> bytes:
    """Return a frame: unit, function and data with their CRC, its low byte first."""
    return data + crc(data).to_bytes(2, "little")


def length_of(frame: bytes | bytearray) -> int | None:
    """Return the length of a frame by its beginning; None if it is not known, or not yet."""
    if len(frame) < 2:
        return None
    place = COUNTED.get(frame[1])
    if place is not None:
        return place + 3 + frame[place] if len(frame) > place else None
    return FIXED.get(frame[1])


class Line:
    """The line's receiving end, byte by byte.

    Attributes:
        frame: the bytes of the frame under way, or of the frame judged after a verdict.
        draining: everything is dropped until a gap.
    """

    def __init__(self) -> None:
        self.frame = bytearray()
        self.draining = False
        self._spoilt = self._over = False

    def _judged(self, good: bool) -> Verdict:
        """Return the verdict on the frame and get ready for the next one."""
        self._over = True
        if not good or self._spoilt or crc(self.frame):
            return Verdict.SPOILT
        unit = self.frame[0]
        return {UNIT: Verdict.REQUEST, BROADCAST: Verdict.BROADCAST}.get(unit, Verdict.FOREIGN)

    def receive(self, byte: int, spoilt: bool = False) -> Verdict | None:
        """Take a byte; return the verdict if it ends a frame."""
        if self.draining:
            return None
        if self._over:
            self.frame.clear()
            self._spoilt = self._over = False
        self.frame.append(byte)
        self._spoilt |= spoilt
        length = length_of(self.frame)
        if len(self.frame) not in (length, FRAME_MAX):
            return None
        verdict = self._judged(len(self.frame) == length)
        self.draining = verdict is Verdict.SPOILT
        return verdict

    def gap(self) -> Verdict | None:
        """Take a gap; return the verdict on the frame that it ends, if there is one."""
        self.draining = False
        if self._over or not self.frame:
            return None
        known = self.frame[1] in FIXED or self.frame[1] in COUNTED if len(self.frame) > 1 else True
        return self._judged(not known and len(self.frame) >= FRAME_MIN)

    def overrun(self) -> Verdict:
        """Note that bytes came while an answer was under way; return the verdict, which comes after the answer."""
        self.draining = True
        return Verdict.OVERRUN
