"""Starts of a hit that differ by chance alone: the place in a count, and the phase of the push in the force's period.

Nobody who builds a device chooses either, and a verdict may depend on them. A start has a number. Its place and phase
are uniform, and follow from the number alone. So all methods, and all walls of a map, have the same starts, and two
methods do not differ by the luck of their starts. The mass, or the seed of an encoder's errors, is none of this: they
are keys of the scene.
"""

from typing import NamedTuple

import numpy as np

SEED = 2011


class Start(NamedTuple):
    """A start, by the keys of the protocol: `start_counts` and `start_periods`, each from 0 to less than 1."""

    counts: float
    periods: float


def start(number: int) -> Start:
    """Return the start of a number, from 0 on."""
    return Start(*np.random.default_rng([SEED, number]).random(2).tolist())
