"""Unsigned integer division, rounded down, with the quotient's range chosen apart from the dividend's."""

from ..compiled import compiled


@compiled
def divide(dividend, divisor, quotient_width):
    """Return floor(dividend / divisor), at most 2**quotient_width - 1; that too where the divisor is 0.

    0 <= dividend < 2**63, 0 <= divisor < 2**63, 1 <= quotient_width <= 62.
    """
    largest = (1 << quotient_width) - 1
    return min(dividend // divisor, largest) if divisor > 0 else largest


def latency(quotient_width: int, bits_per_clock: int = 1) -> int:
    """Return the clocks from `start` to `done` of the hardware.

    One to load, and one for each `bits_per_clock` bits of the quotient.
    """
    return 1 + -(-quotient_width // bits_per_clock)
