"""Values of a word whose bits all rise and fall soon."""

from typing import Protocol

import numpy as np

DRAWN = 60
"""Values of which each time the best is taken."""


class Bounded(Protocol):
    """What has bounds: a register of a map.

    Attributes:
        low, high: the least and the largest value.
    """

    low: int
    high: int


class Restless:
    """The values of a word, one after the other: of some at random, the one that changes most bits for the first time.

    Args:
        word: the word.
        random: draws the values.

    Attributes:
        value: the last one; 0 at first.
    """

    def __init__(self, word: Bounded, random: np.random.Generator):
        self._word, self._random = word, random
        self._bits = (2 << word.high.bit_length()) - 1
        self._risen = self._fallen = self.value = 0

    def next(self) -> int:
        """Return the next value."""
        low, high = self._word.low, self._word.high
        drawn = [low, high, low + high - self.value, *self._random.integers(low, high + 1, DRAWN).tolist()]
        best = max(drawn, key=lambda value: sum(each.bit_count() for each in self._new(value)))
        risen, fallen = self._new(best)
        self._risen, self._fallen, self.value = self._risen | risen, self._fallen | fallen, best
        return best

    def _new(self, value: int) -> tuple[int, int]:
        """Return the bits that a value would let rise and fall for the first time."""
        changed = (value ^ self.value) & self._bits
        return changed & value & ~self._risen, changed & ~value & ~self._fallen
