"""Random words of a position: anywhere, or at an end of the range, beyond which a count wraps."""

import numpy as np


def place(random: np.random.Generator, width: int) -> int:
    """Return a signed word of so many bits; one of four is the least or the largest."""
    half = 1 << width - 1
    return int(random.choice((-half, half - 1)) if random.random() < 0.25 else random.integers(-half, half))
