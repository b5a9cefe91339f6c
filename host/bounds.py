"""The range of a word as messages print it, and the check of a value against exactly this range."""

from ..model.checks import FieldError, check_number, shown
from ..model.register import Register


def check_within(field: str, word: Register, value: float) -> None:
    """Raise FieldError unless an SI value is within the range of a word, before it is rounded to the word's unit.

    A bound is printed with six digits. A value may be as far as what is printed, and no farther. A plain number must be
    whole. `hardwall.model.words.Word.from_si` does it for the words of a model, and takes its own rounding besides.

    Args:
        field: what the value is called.
        word: the word.
        value: the value, in SI units.

    Raises:
        FieldError: if it is out of the range.
        TypeError: if it is no number; a bool is one only for a word of 0 and 1.
    """
    if not (isinstance(value, bool) and is_whole(word) and (word.low, word.high) == (0, 1)):
        check_number(field, value)
    least, most = word.low * word.lsb, word.high * word.lsb
    low, high = f"{least:g}", f"{most:g}"
    if not min(least, float(low)) <= value <= max(most, float(high)):
        unit = f" {word.unit}" if word.unit else ""
        raise FieldError(field, f"must be {low} to {high}{unit}, not {shown(value)}")
    if is_whole(word) and value % 1:
        raise FieldError(field, f"must be a whole number of {low} to {high}, not {shown(value)}")


def word_of(word: Register, value: float) -> int:
    """Return the word nearest to an SI value, which is checked before it is rounded; errors are `check_within`'s."""
    check_within(word.name, word, value)
    return min(max(round(value / word.lsb), word.low), word.high)


def is_whole(word: Register) -> bool:
    """Return whether a word is a plain number, a choice for instance, with nothing between two values."""
    return word.lsb == 1 and not word.unit
