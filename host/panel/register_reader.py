"""Reads all registers of a board again and again, at a moderate rate, and only while somebody looks at them."""

import math
import time
from collections.abc import Mapping
from typing import NamedTuple

from ...model.register import Kind, Register
from ..axis import Axis
from .register_tree import blocks_of
from .wishes import is_fresh, time_of

ASKED_S = 1.5
"""How long registers are read after a tab has asked for them: a tab asks again and again while it shows them."""
SHARE = 0.2
"""The share of the line's time that reading may take."""
LEAST_S = 0.5
"""The shortest time between two readings: a person does not read faster."""


class Reading(NamedTuple):
    """All registers, each block of them read in one request, and the blocks one after the other.

    Attributes:
        number: how many there were before.
        words: the words by the names of their registers.
        period_s: the time from a reading to the next, s.
    """

    number: int
    words: Mapping[str, int]
    period_s: float


def period_s(line_s: float, took_s: float) -> float:
    """Return the time between two readings, s: so long that they take at most `SHARE` of the line.

    Args:
        line_s: the time that the requests of a reading take of the line by its baud rate, s.
        took_s: the time that they took; longer where answers wait in an adapter, or another program has the line.
    """
    return max(LEAST_S, max(line_s, took_s) / SHARE)


class RegisterReader:
    """Reads the registers for all tabs. It reads only, and it never writes.

    Attributes:
        reading: the last reading; None while nobody looks.
    """

    def __init__(self) -> None:
        self.reading: Reading | None = None
        self._asked_s, self._due_s, self._number = -math.inf, -math.inf, 0
        self._left: list[tuple[Register, ...]] = []
        self._found: dict[str, int] = {}
        self._line_s = self._took_s = self._began_s = 0.0

    def ask(self, at_s: float | None = None) -> None:
        """Note that a tab shows the registers, or showed them at a time; old notes are dropped."""
        asked_s = time_of(at_s)
        if is_fresh(asked_s):
            self._asked_s = max(self._asked_s, asked_s)

    def leave(self) -> None:
        """Forget what was read: nobody looks, or the board is gone."""
        self.reading, self._left = None, []

    def step(self, axis: Axis) -> None:
        """Read one block, if it is due. A block is at most as long as one read of the board.

        Raises:
            HostError: if the board is not reached.
        """
        now_s = time.monotonic()
        if now_s - self._asked_s > ASKED_S:
            self.leave()
            return
        if not self._left:
            if self.reading and now_s < self._due_s:
                return
            self._begin(axis, now_s)
        self._read(axis, self._left.pop(0))
        self._took_s += time.monotonic() - now_s
        if not self._left:
            apart_s = period_s(self._line_s, self._took_s)
            self._due_s = self._began_s + apart_s
            self.reading = Reading(self._number, self._found, apart_s)
            self._number += 1

    def _begin(self, axis: Axis, now_s: float) -> None:
        blocks = [block.registers for block in blocks_of(axis.device)]
        # A pulse has no value.
        self._left = [block for block in blocks if block[0].kind is not Kind.PULSE]
        self._found, self._began_s, self._took_s = {}, now_s, 0.0
        self._line_s = sum(axis.line_s(_size(block)) for block in self._left)

    def _read(self, axis: Axis, block: tuple[Register, ...]) -> None:
        first = block[0].address
        registers = axis.read_registers(first, _size(block))
        for each in block:
            at = each.address - first
            self._found[each.name] = each.from_registers(registers[at : at + each.size])


def _size(block: tuple[Register, ...]) -> int:
    """Return how many registers of 16 bits a block has, with what is not assigned between them."""
    return block[-1].address + block[-1].size - block[0].address
