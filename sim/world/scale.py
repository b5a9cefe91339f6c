"""The errors of a scale besides its four kinds of edges: the true place of each edge, and its hysteresis.

Edge n is displaced by its own random amount, a function of n and the seed, and by waves along the scale. A wave is an
error that repeats every so many edges: of an interpolator, or, once a turn, of a disk that is mounted off its centre.
The random amounts are cut, so that each edge keeps its distance from the next: see `cut_of`.

Hysteresis moves all edges by half of itself in the direction of motion: after a turn the handle must come back by the
whole of it before the pins change again.
"""

import math
from typing import NamedTuple

from ...model.runtime.compiled import compiled
from .chance import normal

WAVES = 5
"""Room for four cycles and for eccentricity: one type for all scales, so that the loop is compiled once for them."""
CUT_SIGMAS = 4.0
"""The most by which a random displacement exceeds 0, in sigma; 6 of 100 000 would."""
MOST_COUNTS = 0.475
"""The most by which all errors together may displace an edge against its neighbours: they keep 0.05 counts."""
EDGES = 1
"""The stream of the edges' random numbers."""
SETTLED = 64
"""Steps in which the search for a cell ends: each halves its distance at least."""


class Wave(NamedTuple):
    """An error that repeats along the scale: counts sin(2 pi (n / edges + phase)) for edge n."""

    edges: int = 4
    counts: float = 0.0
    phase: float = 0.0


class Scale(NamedTuple):
    """The errors of a scale; lengths are in counts."""

    sigma: float  # of the random displacement of each edge
    cut: float  # its largest size
    waves: tuple[Wave, Wave, Wave, Wave, Wave]
    hysteresis: float
    seed: int


def spread(wave: Wave) -> float:
    """Return how far, in counts, a wave moves edges against their neighbours: half the change of any level's length.

    It is half of the largest change in the length of a level (two counts) or in the distance of two edges. Independent
    errors of this size at each edge, in any direction, would do the same.
    """
    return abs(wave.counts) * max(abs(math.sin(math.pi / wave.edges)), abs(math.sin(math.tau / wave.edges)))


def cut_of(sigma: float, others: float) -> float:
    """Return the largest random displacement of an edge, counts: 4 sigma, or less where other errors leave no more.

    Args:
        sigma: RMS of the random displacement, counts.
        others: how far all other errors move edges against their neighbours, counts.
    """
    return min(CUT_SIGMAS * sigma, MOST_COUNTS - others)


@compiled
def waved(scale, number):
    """Return the displacement of edge `number` (counts) by the waves alone."""
    total = 0.0
    for wave in scale.waves:
        if wave.counts != 0.0:
            total += wave.counts * math.sin(math.tau * ((number % wave.edges) / wave.edges + wave.phase))
    return total


@compiled
def displacement(scale, number):
    """Return the displacement of edge `number` (counts)."""
    total = waved(scale, number)
    if scale.sigma > 0.0:
        drawn = scale.sigma * normal(scale.seed, EDGES, number, 0)
        total += min(max(drawn, -scale.cut), scale.cut)
    return total


@compiled
def near(scale, counts):
    """Return the number of an edge within a few of a place on the scale (counts), however far the waves carry edges.

    A wave moves an edge by less than half of the neighbour's displacement. So each step halves the distance.
    """
    number = math.floor(counts)
    for _ in range(SETTLED):
        found = math.floor(counts - waved(scale, number))
        if abs(found - number) <= 1:
            break
        number = found
    return number
