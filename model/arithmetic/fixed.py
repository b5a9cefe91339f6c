"""Fixed-point formats as types, and the named ways a number may narrow.

A format says how an integer word is read: value = word * 2**-f. `f` may be negative (a word counted in units larger
than one) or exceed the width (a word of a small fraction). Nothing narrows silently: `saturate` or `wrap` narrows a
range by name, and `shift_floor` or `shift_round_half_up` drops fraction bits.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from ..checks import check_number
from ..runtime.compiled import compiled


@dataclass(frozen=True)
class Format:
    """A fixed-point format of `i` integer bits (the sign included, if it has one) and `f` fraction bits.

    Raises:
        TypeError: if `i` or `f` is not an int.
        ValueError: if the width `i + f` is outside 1 to 63 (the model computes in int64).
    """

    i: int
    f: int
    signed: ClassVar[bool]

    def __post_init__(self):
        for name in ("i", "f"):
            if not isinstance(getattr(self, name), int):
                raise TypeError(f"{name} must be an int, not {getattr(self, name)!r}")
        if not 1 <= self.i + self.f <= 63:
            raise ValueError(f"width i + f must be 1 to 63 bits, not {self.i + self.f!r}")

    def __str__(self) -> str:
        return f"{type(self).__name__}({self.i}, {self.f})"

    @property
    def width(self) -> int:
        """Bits in a word."""
        return self.i + self.f

    @property
    def lsb(self) -> float:
        """Value of one unit of the word."""
        return 2.0**-self.f

    @property
    def min(self) -> int:
        """Smallest word."""
        return -(1 << (self.width - 1)) if self.signed else 0

    @property
    def max(self) -> int:
        """Largest word."""
        return (1 << (self.width - (1 if self.signed else 0))) - 1

    def to_real(self, word: int) -> float:
        """Return the value of `word` (a scalar or an array of words)."""
        return word * self.lsb

    def from_real(self, value: float) -> int:
        """Return the word nearest to `value`, ties upward.

        Raises:
            TypeError: if the value is not a number.
            ValueError: if the value is not finite or its word is outside the format.
        """
        check_number(f"value for {self}", value)
        if not math.isfinite(value):
            raise ValueError(f"value for {self} must be finite, not {value!r}")
        word = math.floor(math.ldexp(value, self.f) + 0.5)
        if not self.min <= word <= self.max:
            raise ValueError(
                f"value for {self} must be {self.to_real(self.min):g} to {self.to_real(self.max):g}, not {value!r}"
            )
        return word


class SQ(Format):
    """A signed two's complement format: -2**(i-1) <= value < 2**(i-1), in steps of 2**-f."""

    signed = True


class UQ(Format):
    """An unsigned format: 0 <= value < 2**i, in steps of 2**-f."""

    signed = False


def bits_for(value: float) -> int:
    """Return the smallest n, which may be negative, with 2**n >= value > 0."""
    mantissa, exponent = math.frexp(value)
    return exponent - 1 if mantissa == 0.5 else exponent


@compiled
def saturate(value, low, high):
    """Return `value` held within `low` to `high`."""
    return min(max(value, low), high)


@compiled
def wrap(value, width):
    """Return `value` modulo 2**width as a signed word of `width` bits."""
    half = 1 << (width - 1)
    return ((value + half) & ((1 << width) - 1)) - half


@compiled
def shift_floor(value, shift):
    """Return floor(value * 2**-shift); a negative shift is exact."""
    return value >> shift if shift >= 0 else value << -shift


@compiled
def shift_round_half_up(value, shift):
    """Return floor(value * 2**-shift + 1/2); a negative shift is exact."""
    return (value + (1 << (shift - 1))) >> shift if shift > 0 else value << -shift


@compiled
def length_of(value):
    """Return the number of bits of a word: the least n with value < 2**n."""
    n = 0
    while value >> n:
        n += 1
    return n
