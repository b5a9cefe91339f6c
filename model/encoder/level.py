"""The levels of an ideal encoder's pins, by the count."""

from ..runtime.compiled import compiled


@compiled
def level(number):
    """Return the pins in cell `number` as the word a | b << 1: the Gray code of number + 1."""
    quarter = (number + 1) & 3
    return quarter ^ (quarter >> 1)
