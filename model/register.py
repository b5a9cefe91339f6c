"""A register: a value that the host can read or write, its place, its range and its meaning."""

from dataclasses import dataclass
from enum import Enum

from .arithmetic.fixed import SQ, Format
from .checks import FieldError, check_int
from .words import Word

VALUE_BITS = 32
"""Bits of a value in two registers."""
COUNTER_BITS = 16
"""Bits of a value in one register."""
UNPLACED = -1
"""The address of a register before a map has placed it."""


def narrowed(signed: SQ) -> SQ:
    """Return the format of a signed value in its registers, which have its upper bits if it is wider than they are."""
    return SQ(signed.i, VALUE_BITS - signed.i) if signed.width > VALUE_BITS else signed


class Kind(Enum):
    """The kind of a register for the host; the value is the kind's name in texts."""

    CONSTANT = "constant"
    STATUS = "status"
    COUNTER = "counter"
    PULSE = "pulse"
    WORD = "word"
    LIVE = "live word"
    ACTIVE = "active"

    @property
    def wide(self) -> bool:
        """Whether the value has two registers."""
        return self not in (Kind.COUNTER, Kind.PULSE)

    @property
    def access(self) -> str:
        """How the host may use it: a pulse reads 0."""
        return "read, write" if self in (Kind.PULSE, Kind.WORD, Kind.LIVE) else "read"


@dataclass(frozen=True)
class Register:
    """A value that the host can read or write.

    Attributes:
        name: its name, in every text and port.
        kind: what it is to the host.
        format: fixed-point format of its word.
        meaning: one full sentence.
        si_per_unit: SI value of the format's 1.0.
        unit: SI unit, as text; empty for choices and plain numbers.
        least, most: the range of the word that the hardware accepts; None for the format's.
        reset: the word after a reset; of a constant, its value.
        address: address of its first register; `UNPLACED` before a map has placed it.

    Raises:
        ValueError: if the format is too wide for its registers, or a bound or the reset word does not fit it.
    """

    name: str
    kind: Kind
    format: Format
    meaning: str
    si_per_unit: float = 1.0
    unit: str = ""
    least: int | None = None
    most: int | None = None
    reset: int = 0
    address: int = UNPLACED

    def __post_init__(self) -> None:
        room = VALUE_BITS if self.kind.wide else COUNTER_BITS
        if self.format.width > room:
            raise FieldError(self.name, f"must have at most {room} bits, not {self.format}")
        for field in ("least", "most", "reset"):
            value = getattr(self, field)
            if value is not None:
                check_int(f"{field} of {self.name}", value, self.format.min, self.format.max)
        if self.kind in (Kind.WORD, Kind.LIVE, Kind.PULSE) and not self.low <= self.reset <= self.high < 1 << (
            room - 1
        ):
            bounds = f"{self.low} to {min(self.high, (1 << (room - 1)) - 1)}"
            raise FieldError(self.name, f"must reset to, and end within, {bounds}, not {self.reset} and {self.high}")

    @property
    def low(self) -> int:
        """The least word."""
        return self.format.min if self.least is None else self.least

    @property
    def high(self) -> int:
        """The largest word."""
        return self.format.max if self.most is None else self.most

    @property
    def lsb(self) -> float:
        """SI value of the word 1."""
        return self.format.lsb * self.si_per_unit

    @property
    def size(self) -> int:
        """Registers that it has."""
        return 2 if self.kind.wide else 1

    def to_registers(self, word: int) -> tuple[int, ...]:
        """Return a word as registers, the high one first.

        Raises:
            ValueError: if the word is outside the register's range.
        """
        check_int(self.name, word, self.low, self.high)
        return (word >> 16 & 0xFFFF, word & 0xFFFF) if self.kind.wide else (word & 0xFFFF,)

    def from_registers(self, registers: tuple[int, ...]) -> int:
        """Return the word that registers hold.

        Raises:
            ValueError: if there are more or fewer registers than it has.
        """
        if len(registers) != self.size:
            raise FieldError(self.name, f"must have {self.size} registers, not {len(registers)}")
        word = int.from_bytes(b"".join(register.to_bytes(2, "big") for register in registers), "big")
        return word - (1 << 16 * self.size) if self.format.signed and word >> (16 * self.size - 1) else word


def word_register(word: Word, kind: Kind = Kind.WORD) -> Register:
    """Return the register of a run-time word."""
    meaning = f"{word.doc[0].upper()}{word.doc[1:]}."
    bounds = word.least, word.most
    return Register(word.name, kind, word.format, meaning, word.si_per_unit, word.unit, *bounds, word.reset)
