"""A UART's receiver and transmitter, 8 data bits, no parity, one stop bit, with a fractional divider.

Divider. A phase of `PHASE_BITS` bits advances by `step` at every clock, and each overflow is one bit's time, so that

    step = floor(2**PHASE_BITS baud / clock + 1/2),     rate = clock step / 2**PHASE_BITS

The rate is wrong by at most half a step, that is by at most 1 / (2 step) of itself: 0.01 % at 10 clocks a bit, 0.4 % at
500, and 1 % at 1310. A pair of clock and rate is refused if its own error exceeds `ERROR_MAX`. No overflow is more than
a clock late, and lateness does not add up.

Receiver. With n clocks a bit, the clock that first sees the start bit is up to 1 clock late, and so is the overflow at
which a bit is sampled; the phase starts a clock early, so every sample is taken within 1 clock of the middle of its bit
as the receiver's rate has it. The middle of the stop bit is 9.5 bits behind the edge. It is still inside the stop bit,
and the last data bit too, if the two ends' rates differ by a fraction e with

    9.5 e n + 1 < n / 2         so e < (1/2 - 1/n) / 9.5: 2.6 % at 4 clocks a bit, 4.7 % at 20

With `CLOCKS_PER_BIT_MIN` clocks a bit and an error of 1 % at each end a frame is therefore always read.
"""

from dataclasses import dataclass
from typing import NamedTuple

from ..checks import FieldError, check_int

PHASE_BITS = 16
"""Bits of the divider's phase: the fewest that hold the error below 1 % at 115 200 baud up to 150 MHz."""
ERROR_MAX = 0.01
"""The largest error of the rate."""
BAUD_MIN, BAUD_MAX = 115_200, 3_000_000
"""The rates that USB serial adapters have in common and that are quick enough for a haptic host."""
BAUD = 921_600
"""The rate where none is chosen."""
CLOCKS_PER_BIT_MIN = 4
DATA_BITS = 8
FRAME_BITS = DATA_BITS + 2
"""Bits of a byte on the line, with its start bit and its stop bit."""
HALF = 1 << PHASE_BITS - 1


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
        ValueError: if the rate is out of its range, a bit is too short for the clock, or the error is too large; the
            message has the rates that the clock allows.
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
        if abs(self.error) > ERROR_MAX:
            least = -(-self.clock_hz * int(1 / (2 * ERROR_MAX)) >> PHASE_BITS)
            raise FieldError(
                "baud",
                f"must be {least} to {most} at clock_hz {self.clock_hz}, where the divider is exact to "
                f"{ERROR_MAX:.0%}, not {self.baud}",
            )

    @property
    def step(self) -> int:
        """The phase's advance at every clock."""
        return ((self.baud << PHASE_BITS + 1) // self.clock_hz + 1) // 2

    @property
    def error(self) -> float:
        """The rate's error, as a fraction of it."""
        return self.step * self.clock_hz / (self.baud << PHASE_BITS) - 1


class Receiver(NamedTuple):
    """The state of the receiver before a clock edge; `byte` and `spoilt` are valid while `arrived`."""

    first: int = 1  # the two stages of the synchroniser
    pin: int = 1
    before: int = 1
    busy: int = 0
    phase: int = 0
    bits: int = 0
    byte: int = 0
    arrived: int = 0
    spoilt: int = 0


def receive(design: Design, state: Receiver, pin: int) -> Receiver:
    """Return the state after a clock edge at which the line is `pin`."""
    mask, low = (1 << PHASE_BITS) - 1, state.pin == 0
    now = state._replace(first=pin, pin=state.first, before=state.pin, arrived=0)
    if not state.busy:
        begins = int(state.before == 1 and low)
        return now._replace(busy=begins, phase=(HALF + design.step) & mask, bits=0)
    total = state.phase + design.step
    now = now._replace(phase=total & mask)
    if total <= mask:
        return now
    now = now._replace(bits=state.bits + 1)
    if state.bits == 0:
        return now._replace(busy=int(low))
    if state.bits == FRAME_BITS - 1:
        return now._replace(busy=0, arrived=1, spoilt=int(low))
    return now._replace(byte=state.pin << DATA_BITS - 1 | state.byte >> 1)


class Transmitter(NamedTuple):
    """The state of the transmitter before a clock edge; the line is bit 0 of `shift`, and `bits` of 0 is idle."""

    shift: int = 1
    phase: int = 0
    bits: int = 0


def transmit(design: Design, state: Transmitter, byte: int | None) -> Transmitter:
    """Return the state after a clock edge; an idle transmitter takes `byte`, if there is one."""
    if state.bits == 0:
        return state if byte is None else Transmitter(1 << DATA_BITS + 1 | byte << 1, 0, FRAME_BITS)
    total = state.phase + design.step
    if total >> PHASE_BITS == 0:
        return state._replace(phase=total)
    # What is shifted in is the level of an idle line.
    return Transmitter(1 << DATA_BITS + 1 | state.shift >> 1, total & (1 << PHASE_BITS) - 1, state.bits - 1)
