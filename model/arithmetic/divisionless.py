"""A rounded quotient by multiplications alone: a reciprocal by a table and a step of Newton's method, then corrections.

With the divisor t of w bits, and both operands shifted until t's top bit is 1, t in [1/2, 1) of 2**w:

    r <- r0 (2 - t r0)                          r0 = 1 / t from a table by the INDEX bits after the first
    e = 1 - t r                                 what is left of 1, 0 < e <= ERROR_MAX
    q <- q + d,  R <- B**j (R - t r d)          d: the leading digit of R in base B; R is r x to begin with

r x / (r t) is x / t whatever r is, so the rounding of r costs no accuracy. r must only be slightly below 1 / t, and
never above it. Then t r is a little below 1, and the leading digit of R is the quotient's. R - d t r is R's fraction
and d e: a product of a digit and of a word of about w bits. What a division finds bit by bit, a product finds DIGIT
bits at a time. At the end R is compared with r t, and q is one more if R is not less.

Bound. Let s = t r0 for t in one of the table's intervals. The table's entry is the reciprocal of the interval's middle,
rounded to TABLE bits behind the first. 2 - s is rounded down to STEP bits and the new r to FINE bits, so that

    0 < e <= (1 - s)**2 + s 2**-STEP + t 2**-FINE <= ERROR_MAX = 2**-(DIGIT + 1)       `reciprocal_error`

R stays below 2. A digit has DIGIT + 1 bits, and its first bit carries into earlier digits. So the next R is below 1 +
2**(DIGIT + 1) e <= 2. So R is below twice r t at the end, and q is one too small at most: q is exact.

Source: Newton's method for a reciprocal, and digits of a quotient by a reciprocal in a high base with what remains, are
textbook arithmetic.
"""

from ..runtime.compiled import compiled

INDEX = 5
"""Bits of the divisor, after its first 1, that address the table."""
TABLE = 6
"""Bits behind the first of an entry of the table."""
STEP = 13
"""Fraction bits of 2 - t r0."""
FINE = 11
"""Bits behind the first of a reciprocal."""
DIGIT = 9
"""Most bits of a quotient's digit."""
ERROR_MAX = 2.0 ** -(DIGIT + 1)
"""The largest error of a reciprocal, as a part of it, with which a digit is the leading one."""
DIVISOR_BITS_MIN = INDEX + 2


def table() -> list[int]:
    """Return the reciprocals of the middles of the intervals of [1/2, 1), with TABLE bits behind the first."""
    places = 1 << INDEX
    return [round((2 * places << TABLE) / (places + index + 0.5)) for index in range(places)]


def reciprocal(divisor: int, width: int) -> int:
    """Return r for a divisor of `width` bits whose top bit is 1: a little less than 2**(width + FINE) / divisor."""
    entry = table()[(divisor >> width - 1 - INDEX) & (1 << INDEX) - 1]
    two_less = ((2 << width + TABLE) - 1 - entry * divisor) >> width + TABLE - STEP
    return entry * two_less >> TABLE + STEP - FINE


def reciprocal_error() -> float:
    """Return the bound on the error of any reciprocal: the largest at the ends of the table's intervals."""
    places, worst = 1 << INDEX, 0.0
    for index, entry in enumerate(table()):
        for end in (index, index + 1):
            t = (places + end) / (2 * places)
            s = t * entry / (1 << TABLE)
            worst = max(worst, (1 - s) ** 2 + s * 2.0**-STEP + t * 2.0**-FINE)
    return worst


def digits(bits: int) -> tuple[int, int]:
    """Return how many digits a quotient of so many bits has, and how many bits each of them."""
    number = -(-bits // DIGIT)
    return number, -(-bits // number)


def places(divisor_width: int, factor_width: int) -> int:
    """Return how many of the divisor's top bits a shift looks at: as many as the narrower factor, a power of 2, has."""
    return min(divisor_width, max(FINE + 1, factor_width))


def passes(divisor_width: int, factor_width: int) -> int:
    """Return how many shifts it takes until any divisor's top bit is 1: each but the last by a place less than seen."""
    seen = places(divisor_width, factor_width)
    return 1 - (seen - divisor_width) // (seen - 1)


def latency(divisor_width: int, quotient_width: int, factor_width: int = 1) -> int:
    """Return the clocks from `start` to `done` of the hardware.

    One clock loads the operands, and two make each shift of them. Five make the reciprocal and multiply both operands
    by it. Two make each digit.
    """
    return 6 + 2 * passes(divisor_width, factor_width) + 2 * digits(quotient_width + 1)[0]


@compiled
def quotient(dividend, divisor, fraction, quotient_width):
    """Return floor(dividend 2**fraction / divisor + 1/2), at most 2**quotient_width - 1.

    0 <= dividend < 2**(61 - fraction), 1 <= divisor < 2**61, 1 <= quotient_width <= 61.
    """
    twice = (dividend << fraction + 1) // divisor
    return min((twice + 1) >> 1, (1 << quotient_width) - 1)
