"""Run-time parameters of the hardware: a word on a port, and what it means in SI units."""

from collections.abc import Iterable
from dataclasses import dataclass

from .arithmetic.fixed import UQ, Format, bits_for
from .checks import FieldError, check_number, shown

GAIN_BITS = 16
"""Bits of a gain word: an operand that the multipliers of both iCE40UP (16 x 16) and ECP5 (18 x 18) hold."""
ROUNDING = 1e-12
"""The largest relative error of an SI value that was computed from a word, in whatever order."""


def gain_format(largest: float) -> UQ:
    """Return the `GAIN_BITS`-bit format that holds `largest` with the finest resolution."""
    i = bits_for(largest)
    fmt = UQ(i, GAIN_BITS - i)
    # A largest value just below a power of two may round up to that power.
    return fmt if largest <= fmt.to_real(fmt.max) else UQ(i + 1, GAIN_BITS - i - 1)


@dataclass(frozen=True)
class Word:
    """A parameter that the host may change while the axis runs.

    Attributes:
        name: name of the port.
        format: fixed-point format of the word.
        si_per_unit: SI value of the format's 1.0.
        unit: SI unit, as text; empty for choices and plain numbers.
        reset: the word after reset.
        doc: one line for the port table.
        least, most: the range of the words that are accepted; None for the format's.
    """

    name: str
    format: Format
    si_per_unit: float
    unit: str
    reset: int
    doc: str
    least: int | None = None
    most: int | None = None

    def __post_init__(self):
        for bound in (self.low, self.high, self.reset):
            if not self.format.min <= bound <= self.format.max:
                raise FieldError(self.name, f"must fit {self.format}, not {bound!r}")
        if not self.low <= self.reset <= self.high:
            raise FieldError(self.name, f"must be {self.low} to {self.high} after reset, not {self.reset!r}")

    @property
    def low(self) -> int:
        """The least word that is accepted."""
        return self.format.min if self.least is None else self.least

    @property
    def high(self) -> int:
        """The largest word that is accepted."""
        return self.format.max if self.most is None else self.most

    @property
    def si_min(self) -> float:
        """The smallest value, in SI units."""
        return self.to_si(self.low)

    @property
    def si_max(self) -> float:
        """The largest value, in SI units."""
        return self.to_si(self.high)

    def to_si(self, word: int) -> float:
        """Return the value of `word` in SI units."""
        return self.format.to_real(word) * self.si_per_unit

    def from_si(self, value: float) -> int:
        """Return the word nearest to `value` (SI).

        A value may be beyond the last word by `ROUNDING`, or as far as the six digits of the bound in the message: its
        word is then the last one.

        Raises:
            TypeError: if `value` is not a number.
            ValueError: if the value does not fit the word; the message gives the accepted range in SI units.
        """
        whole = self.format.f == 0 and not self.unit
        if not (isinstance(value, bool) and whole and self.format.max == 1):
            check_number(self.name, value)
        least, most = self.si_min, self.si_max
        accepted = f"{least:g} to {most:g}"
        if whole and value % 1:
            raise FieldError(self.name, f"must be a whole number of {accepted}, not {shown(value)}")
        lowest = min(least - abs(least) * ROUNDING, float(f"{least:g}"))
        highest = max(most + abs(most) * ROUNDING, float(f"{most:g}"))
        if not lowest <= value <= highest:
            unit = f" {self.unit}" if self.unit else ""
            raise FieldError(self.name, f"must be {accepted}{unit}, not {shown(value)}")
        return self.format.from_real(min(max(value, least), most) / self.si_per_unit)


def ranges_of(words: Iterable[Word]) -> dict[str, tuple[int, int]]:
    """Return the least and the largest value of the words whose range is smaller than their format's, by name."""
    return {word.name: (word.low, word.high) for word in words if (word.least, word.most) != (None, None)}
