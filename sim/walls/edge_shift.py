"""The distance between the edges of two maps, draw by draw of their common starts."""

from typing import NamedTuple

import numpy as np

from .grid import grid_of
from .zwidth import Map, interval


class Move(NamedTuple):
    """The difference between the edges of two maps.

    Attributes:
        area: the ratio of their areas.
        low, high: the ends of its interval, of draws of the starts; 0 and infinity if the other area may be 0.
        step: the part of the other area that a step of K is, all along its edge: no map tells less.
        stiffness: the farthest move of K at one B, as a fraction of the other's K there. It is 0 if no move is beyond
            its own interval and a step. It is infinite if there is an edge at a B at which the other has none.
        dampings: number of B at which K moved beyond its interval and a step.
        clipped: whether one of the regions goes on beyond the largest K of the map, so that the areas are bounds.
    """

    area: float
    low: float
    high: float
    step: float
    stiffness: float
    dampings: int
    clipped: bool = False

    @property
    def distance(self) -> float:
        """How far the area may be from the other: the farther end of the interval of their ratio, from 1."""
        return max(self.high - 1, 1 - self.low)

    @property
    def moved(self) -> bool:
        """Whether the area is another one: by more than a step of K, and than the draws of the starts differ."""
        # The margin covers a ratio that lost the last bit of a step.
        return abs(self.area - 1) > self.step * (1 + 1e-9) and not self.low <= 1 <= self.high


def move(one: Map, other: Map) -> Move:
    """Return how far the edge of a map lies from another's, which has the same B, the same starts and an area.

    An undecided hit makes both uncertain, also where both are the same hit: so an interval may be too wide.
    """
    dampings = [point.damping_n_s_per_m for point in other.boundary]
    step = grid_of(other.case.scene).stiffness_step_n_per_m
    far = [_moved(one, other, place, step) for place in range(len(dampings))]
    return Move(
        area=one.area / other.area,
        **dict(zip(("low", "high"), one.times(other) or (0.0, np.inf), strict=True)),
        step=step * (dampings[-1] - dampings[0]) / other.area,
        stiffness=max(far, key=abs),
        dampings=sum(part != 0 for part in far),
        clipped=one.clipped or other.clipped,
    )


def _moved(one: Map, other: Map, place: int, step_n_per_m: float) -> float:
    """Return by which part of the other's K the edge moved at a B, by its place; 0 within a step or the interval, and
    infinity if the other has no edge there."""
    here, there = one.boundary[place].stable_n_per_m, other.boundary[place].stable_n_per_m
    if abs(here - there) <= step_n_per_m:
        return 0.0
    if one.drawn is not None and other.drawn is not None:
        # Undecided hits make both edges uncertain: at the least the one is low and the other high.
        (low, high), (other_low, other_high) = one.drawn[:, place], other.drawn[:, place]
        least, most = interval(np.stack([low - other_high, high - other_low]))
        if least <= 0 <= most:
            return 0.0
    return here / there - 1 if there else np.inf
