"""Random integers of all magnitudes: of uniform ones in a wide range, next to none would be small."""

import numpy as np


def magnitudes(random: np.random.Generator, low: int, high: int, rows: int, octaves: int = 16) -> np.ndarray:
    """Return `rows` random integers within `low` to `high`: uniform ones, each halved less than `octaves` times."""
    uniform = random.integers(low, high, rows, endpoint=True)
    return (uniform * 2.0 ** -random.integers(0, octaves, rows)).astype(np.int64)
