"""An AXI4-Lite subordinate over a register file: what a processor beside the axis reads and writes.

A word of 32 bits at the byte address 2 A, A even, has the registers A, in its upper half, and A + 1: a value of 32 bits
is one word. Of pulses and counters, which have one register each, a word has two; a write with two byte strobes writes
one of them.

A write is a frame of its own: it is checked, done, and answered when the axis has it. A read of a status takes a
snapshot, unless its word follows the word read last. So words that are read in the order of their addresses are of one
snapshot.
"""

from enum import IntEnum

from ..axis.register_file import CELL, CELL_BITS, Design, RegisterFile
from ..axis.registers import COUNTERS, TELEMETRY

ADDRESS_BITS = 17
"""Bits of a byte address: two bytes a register."""
STROBES = {0b0000: (), 0b0011: (1,), 0b1100: (0,), 0b1111: (0, 1)}
"""The halves that a write has, by its byte strobes; the upper half is the first register."""


class Response(IntEnum):
    """How a transfer ended."""

    OKAY = 0
    SLVERR = 2  # a value is out of its range, the register is refused now, or half of one was to be written
    DECERR = 3  # there is no such register, it cannot be written, or half of a value was to be written


class Subordinate:
    """The subordinate's twin.

    Args:
        design: the registers.

    Attributes:
        file: the register file, whose inputs are the axis's.
        pulses: names of the pulses of the last write.
    """

    def __init__(self, design: Design):
        self.file = RegisterFile(design)
        self.pulses: tuple[str, ...] = ()
        self._next = 0

    def write(self, address: int, data: int, strobes: int) -> Response:
        """Write a word at a byte address; its two lowest bits have no effect."""
        file, self.pulses = self.file, ()
        file.clear()
        halves = STROBES.get(strobes)
        if halves is None:
            return Response.SLVERR
        place = address >> 2 << 1
        values = {place + half: data >> CELL_BITS * (1 - half) & CELL for half in halves}
        for at, value in values.items():
            file.check_write(at, at == place + halves[0], at == place + halves[-1], value)
        if file.absent:
            return Response.DECERR
        if file.outside or file.refused:
            return Response.SLVERR
        for at, value in values.items():
            file.write(at, value)
        file.finish()
        self.pulses = file.pulses
        return Response.OKAY

    def read(self, address: int) -> tuple[Response, int]:
        """Return how a read of the word at a byte address ends, and the word, which is 0 if there is none."""
        file, place = self.file, address >> 2 << 1
        file.clear()
        if TELEMETRY <= place < COUNTERS and place != self._next:
            file.snapshot()
        self._next = place + 2
        file.check_read(place, True, False)
        file.check_read(place + 1, False, True)
        if file.absent:
            return Response.DECERR, 0
        if file.refused:
            return Response.SLVERR, 0
        return Response.OKAY, file.read(place) << CELL_BITS | file.read(place + 1)
