"""Encoders that emit their edges on a clock of their own: the clocks of the edges, by whole numbers alone."""

from typing import NamedTuple

import numpy as np


class Emission(NamedTuple):
    """What an encoder does with the edges that it has passed, in clocks: emits them every `period`, `apart` of one
    another, at times that are `phase` more than a multiple of the period."""

    period: int
    apart: int
    phase: int = 0

    def clocks(self, passed: np.ndarray) -> np.ndarray:
        """Return the clocks at which edges are emitted that were passed at the given ones, in order."""
        due = -(-(passed - self.phase) // self.period) * self.period + self.phase
        waits = self.apart * np.arange(len(passed))
        return np.maximum.accumulate(due - waits) + waits
