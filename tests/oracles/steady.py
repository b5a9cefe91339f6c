"""A handle at a constant speed, and the stability of a filter, in exact arithmetic without anything of the project.

A speed is a rational number of counts a sample. Its counts and edges repeat after a number of samples, the *ripple
period*, so that the mean of an estimate over it has no ripple. All of it is computed in integers and fractions.
"""

import math
import operator
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

SAMPLES = 500
"""The samples of a ripple period, unless the speed is so small that there are more."""
LEVELS = {1: (1, 3, 2, 0), -1: (2, 3, 1, 0)}
"""The levels a | b << 1 after each edge, for either direction, of an encoder that begins at 0."""


class Steady(NamedTuple):
    """`counts` counts in `samples` samples, in a direction; `begun` / `samples` of a count have passed at the start."""

    counts: int
    samples: int
    way: int = 1
    begun: int = 0

    @property
    def speed(self) -> Fraction:
        """The speed, counts a sample."""
        return self.way * Fraction(self.counts, self.samples)

    def count(self, samples: int) -> np.ndarray:
        """Return the counts at samples 0 to `samples`, without wrap."""
        passed = (np.arange(samples + 1, dtype=np.int64) * self.counts + self.begun) // self.samples
        return self.way * passed

    def edges(self, clocks_per_sample: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the clocks and levels of the edges: edge k is at the first clock at which k counts have passed."""
        passed = np.arange(1, (samples * self.counts + self.begun) // self.samples + 1, dtype=np.int64)
        clocks = -((self.begun - passed * self.samples) * clocks_per_sample // self.counts)
        return clocks, np.array(LEVELS[self.way])[(passed - 1) % 4]


def ladder(least: Fraction, most: Fraction, ratio: Fraction, multiple: int = 1) -> list[tuple[int, int]]:
    """Return speeds as (counts, samples), ascending by a ratio from about `least` to `most` or just below it.

    The counts of a ripple period are a multiple of `multiple`: that of whole cycles of an encoder is 4.
    """
    speeds, speed = {}, Fraction(least)
    while speed < most:
        samples = max(SAMPLES, math.ceil(2 * multiple / speed))
        counts = round(speed * samples / multiple) * multiple
        speeds[Fraction(counts, samples)] = counts, samples
        speed *= ratio
    counts = most * SAMPLES // multiple * multiple
    speeds[Fraction(counts, SAMPLES)] = counts, SAMPLES
    return [speeds[speed] for speed in sorted(speeds) if speed <= most]


def polynomial(matrix: Sequence[Sequence[Fraction]]) -> list[Fraction]:
    """Return the characteristic polynomial of a matrix, the highest power first, by Faddeev and LeVerrier."""
    size, found = len(matrix), [Fraction(1)]
    power = [[Fraction(0)] * size for _ in range(size)]
    for k in range(1, size + 1):
        for place in range(size):
            power[place][place] += found[-1]
        columns = list(zip(*power, strict=True))
        power = [[sum(map(operator.mul, row, column)) for column in columns] for row in matrix]
        found.append(-sum(power[place][place] for place in range(size)) / k)
    return found


def stable(of: Sequence[Fraction]) -> bool:
    """Return whether all roots of a polynomial, the highest power first, are within the unit circle (Schur, Cohn)."""
    left = list(of)
    while len(left) > 1:
        first, last = left[0], left[-1]
        if abs(last) >= abs(first):
            return False
        left = [first * a - last * b for a, b in zip(left, reversed(left), strict=True)][:-1]
    return True
