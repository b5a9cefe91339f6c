"""Edges by hand, as a rival sees them, and what it reads at any times."""

from collections.abc import Sequence

import numpy as np

from hardwall.sim.estimates.rivals.rival import edge, read, start

Edge = tuple[float, int]
"""The time of an edge (s), and the cell after it."""


def steady(first: int, counts_per_s: float, way: int, many: int) -> list[Edge]:
    """Return edges at a constant speed, the first of them a count after time 0."""
    return [((k + 1) / counts_per_s, first + way * (k + 1)) for k in range(many)]


def read_at(rival: tuple, first: int, edges: Sequence[Edge], times_s: Sequence[float]) -> list[float]:
    """Return the velocities (counts/s) that a rival reads at some times, in order."""
    state, waiting, found = start(rival, first), list(edges), []
    for now_s in times_s:
        while waiting and waiting[0][0] <= now_s:
            state = edge(rival, state, *waiting.pop(0))
        state, velocity = read(rival, state, float(now_s))
        found.append(float(velocity))
    return found


def every(period_s: float, until_s: float) -> np.ndarray:
    """Return the times of readings, the first at time 0."""
    return np.arange(round(until_s / period_s) + 1) * period_s
