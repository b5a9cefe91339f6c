"""A UART's receiver and transmitter, 8 data bits, no parity, one stop bit, with a fractional divider.

Divider. A bit lasts n clocks, which are counted in parts of `FRACTION_BITS` bits,

    period = floor(2**FRACTION_BITS clock / baud + 1/2)

a whole number of clocks, and one more whenever the parts that are left over have become a clock. The rate is wrong by
at most half a part in a bit, that is by about 1 / (2**(FRACTION_BITS + 1) n) of itself: 0.2 % at 4 clocks a bit. No
edge is more than a clock late, and lateness does not add up.

Receiver. The clock that first sees the start bit is up to 1 clock late, and so is the clock at which a bit is sampled.
The count starts a clock early. So every sample is taken within 1 clock of the middle of its bit, by the receiver's
rate. The middle of the stop bit is 9.5 bits behind the edge. It is still inside the stop bit, and the last data bit
too, if the two ends' rates differ by a fraction e with

    9.5 e n + 1 < n / 2         so e < (1/2 - 1/n) / 9.5: 2.6 % at 4 clocks a bit, 4.7 % at 20

With `CLOCKS_PER_BIT_MIN` clocks a bit, and a sender whose rate is wrong by 2 %, a frame is therefore always read.
"""

from dataclasses import dataclass
from typing import NamedTuple

from ..checks import FieldError, check_int

FRACTION_BITS = 6
"""Bits of the part of a clock in the length of a bit."""
BAUD_MIN, BAUD_MAX = 115_200, 3_000_000
"""Baud rates that USB serial adapters have in common, fast enough for a haptic host."""
BAUD = 921_600
"""The rate where none is chosen."""
CLOCKS_PER_BIT_MIN = 4
DATA_BITS = 8
FRAME_BITS = DATA_BITS + 2
"""Bits of a byte on the line, with its start bit and its stop bit."""
LAST_PART = (1 << FRACTION_BITS) - 1


def usual_baud(clock_hz: int) -> int:
    """Return `BAUD`, or the largest half, quarter or eighth of it that a clock allows; the last if it allows none."""
    rates = [BAUD >> halvings for halvings in range(4)]
    return next((rate for rate in rates if rate * CLOCKS_PER_BIT_MIN <= clock_hz), rates[-1])


@dataclass(frozen=True)
class Design:
    """The divider of a UART at a clock, for a rate.

    Attributes:
        clock_hz: clock, Hz.
        baud: rate, bits a second.

    Raises:
        TypeError: if a field is not an int.
        ValueError: if the rate is out of its range, or a bit is too short for the clock; the message has the rates that
            the clock allows.
    """

    clock_hz: int
    baud: int = BAUD

    def __post_init__(self) -> None:
        check_int("clock_hz", self.clock_hz, 1)
        most = min(BAUD_MAX, self.clock_hz // CLOCKS_PER_BIT_MIN)
        if most < BAUD_MIN:
            least_clock = BAUD_MIN * CLOCKS_PER_BIT_MIN
            raise FieldError("clock_hz", f"must be {least_clock} or more for a UART, not {self.clock_hz}")
        check_int("baud", self.baud, BAUD_MIN, most)

    @property
    def period(self) -> int:
        """The length of a bit in parts of a clock."""
        return ((self.clock_hz << FRACTION_BITS + 1) // self.baud + 1) // 2

    @property
    def error(self) -> float:
        """The rate's error, as a fraction of it."""
        return (self.clock_hz << FRACTION_BITS) / (self.baud * self.period) - 1

    @property
    def bit(self) -> tuple[int, int]:
        """A bit's whole clocks and the parts beyond them."""
        return self.period >> FRACTION_BITS, self.period & LAST_PART

    @property
    def to_first_sample(self) -> tuple[int, int]:
        """Clocks and parts that a receiver counts to the middle of the start bit."""
        parts = (self.period >> 1) + LAST_PART
        return (parts >> FRACTION_BITS) - 2, parts & LAST_PART

    @property
    def to_first_edge(self) -> tuple[int, int]:
        """Clocks and parts that a transmitter counts to the end of the start bit."""
        return self.after(LAST_PART)

    def after(self, parts: int) -> tuple[int, int]:
        """Return the clocks to count, less one, and the remaining parts, for a bit that begins with `parts`."""
        total = self.period + parts
        return (total >> FRACTION_BITS) - 1, total & LAST_PART


class Receiver(NamedTuple):
    """The state of the receiver before a clock edge; `byte` and `spoilt` are valid while `arrived`."""

    first: int = 1  # the two stages of the synchroniser
    pin: int = 1
    before: int = 1
    busy: int = 0
    left: int = 0  # clocks to the next sample
    parts: int = 0
    bits: int = 0
    byte: int = 0
    arrived: int = 0
    spoilt: int = 0


def receive(design: Design, state: Receiver, pin: int) -> Receiver:
    """Return the state after a clock edge at which the line is `pin`."""
    low = state.pin == 0
    now = state._replace(first=pin, pin=state.first, before=state.pin, arrived=0)
    if not state.busy:
        left, parts = design.to_first_sample
        return now._replace(busy=int(state.before == 1 and low), left=left, parts=parts, bits=0)
    if state.left:
        return now._replace(left=state.left - 1)
    left, parts = design.after(state.parts)
    now = now._replace(left=left, parts=parts)
    now = now._replace(bits=state.bits + 1)
    if state.bits == 0:
        return now._replace(busy=int(low))
    if state.bits == FRAME_BITS - 1:
        return now._replace(busy=0, arrived=1, spoilt=int(low))
    return now._replace(byte=state.pin << DATA_BITS - 1 | state.byte >> 1)


class Transmitter(NamedTuple):
    """The state of the transmitter before a clock edge; the line is bit 0 of `shift`, and `bits` of 0 is idle."""

    shift: int = 1
    left: int = 0  # clocks to the next edge
    parts: int = 0
    bits: int = 0


def transmit(design: Design, state: Transmitter, byte: int | None) -> Transmitter:
    """Return the state after a clock edge; an idle transmitter takes `byte`, if there is one."""
    if state.bits == 0:
        return state if byte is None else Transmitter(1 << DATA_BITS + 1 | byte << 1, *design.to_first_edge, FRAME_BITS)
    if state.left:
        return state._replace(left=state.left - 1)
    # What is shifted in is the level of an idle line.
    return Transmitter(1 << DATA_BITS + 1 | state.shift >> 1, *design.after(state.parts), state.bits - 1)
