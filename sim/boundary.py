"""Tracing the edge of the stable region of walls, as the founding paper does: which wall to hit next, and when to end.

Stiffness K and damping B go in steps. From a stable wall, raise K until one is unstable; then raise B by a step, and
from that K go down to the first stable wall if it is unstable, else up to the first unstable one. At each B the lowest
unstable K found so is the marginal one. The end is where no K is stable, or the last B.

Nothing here hits a wall: `trace` is a generator that yields walls and is sent verdicts, so the map does not depend on
who answers, or in which order several maps are answered.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True)
class Grid:
    """Steps and ends of a map; B from `damping_from_n_s_per_m` to `damping_to_n_s_per_m`, K from a step to its end."""

    stiffness_step_n_per_m: float
    stiffness_to_n_per_m: float
    damping_from_n_s_per_m: float
    damping_to_n_s_per_m: float
    damping_step_n_s_per_m: float

    @property
    def dampings(self) -> list[float]:
        """Every B of the map, N s/m."""
        first, step = self.damping_from_n_s_per_m, self.damping_step_n_s_per_m
        return [first + n * step for n in range(_whole((self.damping_to_n_s_per_m - first) / step) + 1)]

    @property
    def rows(self) -> int:
        """Number of steps of K."""
        return _whole(self.stiffness_to_n_per_m / self.stiffness_step_n_per_m)


def _whole(steps: float) -> int:
    """Return how many whole steps there are, where a division may have lost the last bit of one."""
    return math.floor(steps * (1 + 1e-12))


@dataclass(frozen=True)
class Edge:
    """The edge of a stable region at one B.

    Attributes:
        damping_n_s_per_m: B.
        stable_n_per_m: the largest stable K under the marginal one; 0 where none is.
        marginal_n_per_m: the lowest unstable K above it; None where the largest K of the map is still stable.
    """

    damping_n_s_per_m: float
    stable_n_per_m: float
    marginal_n_per_m: float | None


def trace(grid: Grid) -> Generator[tuple[float, float], bool, list[Edge]]:
    """Yield walls (K, B) to be hit, be sent whether each is stable, and return the edge, by B.

    The first wall is the softest of the first B.
    """
    step, edges, row = grid.stiffness_step_n_per_m, [], 1
    for damping in grid.dampings:
        if (yield row * step, damping):
            stable = row
            while stable < grid.rows and (yield (stable + 1) * step, damping):
                stable += 1
        else:
            stable = row - 1
            while stable > 0 and not (yield stable * step, damping):
                stable -= 1
        edges.append(Edge(damping, stable * step, (stable + 1) * step if stable < grid.rows else None))
        if stable == 0:
            break
        row = min(stable + 1, grid.rows)
    return edges


def area(edges: list[Edge]) -> float:
    """Return the area under the largest stable K, N^2 s/m^2: trapezoids between the values of B."""
    return sum(
        (right.damping_n_s_per_m - left.damping_n_s_per_m) * (left.stable_n_per_m + right.stable_n_per_m) / 2
        for left, right in pairwise(edges)
    )
