"""Unsigned integer division, rounded down, with a quotient width that does not depend on the dividend's."""

from ..runtime.compiled import compiled


@compiled
def divide(dividend, divisor, quotient_width):
    """Return floor(dividend / divisor), at most 2**quotient_width - 1, which is also the result if the divisor is 0.

    0 <= dividend < 2**63, 0 <= divisor < 2**63, 1 <= quotient_width <= 62.
    """
    largest = (1 << quotient_width) - 1
    return min(dividend // divisor, largest) if divisor > 0 else largest


def latency(quotient_width: int, bits_per_clock: int = 1) -> int:
    """Return the clocks from `start` to `done` of the hardware.

    One clock loads the operands, and one clock makes every `bits_per_clock` bits of the quotient.
    """
    return 1 + -(-quotient_width // bits_per_clock)
