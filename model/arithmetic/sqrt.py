"""Integer square root, rounded down."""

import math

from ..runtime.compiled import compiled


@compiled
def isqrt(radicand):
    """Return floor(sqrt(radicand)) for 0 <= radicand < 2**62, exactly.

    The float64 root of a 62-bit integer is within one of the answer: its relative error is at most 2**-53, and the root
    has at most 31 bits. So one comparison each way makes it exact.
    """
    root = int(math.sqrt(radicand))
    if root * root > radicand:
        root -= 1
    if (root + 1) * (root + 1) <= radicand:
        root += 1
    return root


def digits(width: int) -> int:
    """Return the number of digits in base 4 of the root of a `width`-bit radicand."""
    return -(-width // 4)


def latency(width: int) -> int:
    """Return the clocks from `start` to `done` of the hardware root of a `width`-bit radicand.

    One clock loads the radicand, and one clock makes each digit of the result.
    """
    return 1 + digits(width)
