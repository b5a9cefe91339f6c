"""Division of a signed by an unsigned integer with fraction bits, rounded toward zero."""

from ..runtime.compiled import compiled
from .divide import latency as unsigned_latency

BITS_PER_CLOCK = 2


@compiled
def divide(dividend, divisor, fraction):
    """Return dividend 2**fraction / divisor, rounded toward zero, for divisor > 0.

    The whole part and the remainder are scaled separately, so it suffices that the result and divisor 2**fraction fit
    int64.
    """
    size = abs(dividend)
    quotient = (size // divisor << fraction) + (size % divisor << fraction) // divisor
    return -quotient if dividend < 0 else quotient


def latency(quotient_bits: int) -> int:
    """Return the clocks from `start` to `done` of the hardware division with a magnitude of `quotient_bits`.

    The division of the magnitudes makes `BITS_PER_CLOCK` bits a clock; one more clock applies the sign.
    """
    return unsigned_latency(quotient_bits, BITS_PER_CLOCK) + 1
