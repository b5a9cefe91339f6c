"""A handle that is moved at random, as the pins of its encoder, one edge at a time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

QUARTERS = ((0, 0), (1, 0), (1, 1), (0, 1))
"""Levels of A and B in the order of an upward motion."""


@dataclass(frozen=True)
class Habits:
    """How often the handle does what.

    Attributes:
        change: the chance at an edge that speed and direction change.
        too_fast: the chance at such a change that the edges come as fast as clocks.
        illegal: the chance that an edge is of both pins at once.
        index: the chance at an edge that Z takes a level.
    """

    change: float = 0.02
    too_fast: float = 0.02
    illegal: float = 0.002
    index: float = 0.01


def edges(random: np.random.Generator, habits: Habits | None = None) -> Iterator[tuple[dict[str, int], int]]:
    """Yield for ever the pins that change, and the clocks until the next change: slowly, fast, back and forth."""
    habits = habits or Habits()
    quarter, spacing, direction = 0, 20.0, 1
    while True:
        if random.random() < habits.change:
            steady = random.random() >= habits.too_fast
            spacing = float(random.choice([4, 8, 15, 40, 200])) if steady else 1.0
            direction = int(random.choice([-1, 1]))
        # Both pins change at once now and then, which is always an illegal transition.
        quarter = (quarter + direction * (2 if random.random() < habits.illegal else 1)) % 4
        pins = dict(zip(("encoder_a", "encoder_b"), QUARTERS[quarter], strict=True))
        if random.random() < habits.index:
            pins["encoder_z"] = int(random.integers(0, 2))
        yield pins, max(1, int(random.exponential(spacing)))
