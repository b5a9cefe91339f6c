"""The range of a counter that wraps, as a user gives it: its width in bits, or its modulus."""

from dataclasses import dataclass

BITS = 8, 64
"""The widths of counters that can be given."""
MODULI = 4, 1 << 62
"""The moduli of counters that can be given."""


@dataclass(frozen=True)
class Counter:
    """A counter that wraps.

    Attributes:
        size: how many counts it has.
        option: the option that gives it.
    """

    size: int
    option: str

    @classmethod
    def of_bits(cls, bits: int) -> "Counter":
        """Return the counter of a width."""
        return cls(1 << bits, "--counter-bits")

    @classmethod
    def of_modulus(cls, modulus: int) -> "Counter":
        """Return the counter of a modulus, such as 4000 for counts of 0 to 3999."""
        return cls(modulus, "--counter-modulus")

    @property
    def range(self) -> str:
        """How many counts it has, for a message."""
        return f"2**{self.size.bit_length() - 1}" if self.option == "--counter-bits" else str(self.size)

    def __str__(self) -> str:
        if self.option == "--counter-bits":
            return f"a counter of {self.size.bit_length() - 1} bits"
        return f"a counter of {self.size} counts"
