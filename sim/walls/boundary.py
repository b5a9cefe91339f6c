"""The trace of the boundary of the stable region of walls, by the founding paper's method: the walls to hit, in order.

Stiffness K and damping B go in steps. From a stable wall, raise K until a wall is unstable; then raise B by a step, and
from that K go down to the first stable wall if the wall there is unstable, else up to the first unstable wall. At each
B the lowest unstable K found in this way is the marginal K. The trace ends where no K is stable, or at the last B. It
starts from the softest wall of the first B; if that wall is unstable, K is doubled, then B raised, until one is stable.

The boundary is the upper one. Walls below it may still be unstable, which a trace does not see: `below` hits some.

Nothing here hits a wall: `trace` is a generator that yields walls and is sent verdicts, so the map does not depend on
the source of the verdicts, or on the order in which several maps get theirs.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from itertools import pairwise


@dataclass(frozen=True)
class Grid:
    """Steps and ends of a map: B from `damping_from_n_s_per_m` to `damping_to_n_s_per_m`, K from one step to its end.

    At each B, `walls_below` walls below the boundary are hit as well.
    """

    stiffness_step_n_per_m: float
    stiffness_to_n_per_m: float
    damping_from_n_s_per_m: float
    damping_to_n_s_per_m: float
    damping_step_n_s_per_m: float
    walls_below: int = 0

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
    """Return the number of whole steps; the margin covers a division that lost the last bit of a step."""
    return math.floor(steps * (1 + 1e-12))


@dataclass(frozen=True)
class BoundaryPoint:
    """The boundary of a stable region at one B.

    Attributes:
        damping_n_s_per_m: B.
        stable_n_per_m: the largest stable K under the marginal K; 0 if no K is stable.
        marginal_n_per_m: the lowest unstable K above it; None where the largest K of the map is still stable.
        held: the part of the walls hit below the boundary that is stable; None if no wall below was hit.
    """

    damping_n_s_per_m: float
    stable_n_per_m: float
    marginal_n_per_m: float | None
    held: float | None = None


def trace(grid: Grid) -> Generator[tuple[float, float], bool, list[BoundaryPoint]]:
    """Yield walls (K, B) to hit, receive whether each is stable, and return the boundary, by B.

    The walls below the boundary that the grid asks for come last.
    """
    step, boundary, row = grid.stiffness_step_n_per_m, [], 0
    for damping in grid.dampings:
        if row == 0:
            row = yield from _first(grid, damping)
            if row == 0:
                boundary.append(BoundaryPoint(damping, 0.0, step))
                continue
            starts_stable = True
        else:
            starts_stable = yield row * step, damping
        if starts_stable:
            stable = row
            while stable < grid.rows and (yield (stable + 1) * step, damping):
                stable += 1
        else:
            stable = row - 1
            while stable > 0 and not (yield stable * step, damping):
                stable -= 1
        boundary.append(BoundaryPoint(damping, stable * step, (stable + 1) * step if stable < grid.rows else None))
        if stable == 0:
            break
        row = min(stable + 1, grid.rows)
    return (yield from below(boundary, grid)) if grid.walls_below else boundary


def _first(grid: Grid, damping: float) -> Generator[tuple[float, float], bool, int]:
    """Yield walls of one B, with K doubled each time; return the row of the first stable wall, 0 if none is stable."""
    row = 1
    while row <= grid.rows:
        if (yield row * grid.stiffness_step_n_per_m, damping):
            return row
        row *= 2
    return 0


def below(boundary: list[BoundaryPoint], grid: Grid) -> Generator[tuple[float, float], bool, list[BoundaryPoint]]:
    """Yield as many walls below each point as the grid asks for, evenly spaced in K; return the points with `held`."""
    step, checked = grid.stiffness_step_n_per_m, []
    for point in boundary:
        top = round(point.stable_n_per_m / step)
        rows = sorted({round(top * n / (grid.walls_below + 1)) for n in range(1, grid.walls_below + 1)} - {0, top})
        stable = 0
        for row in rows:
            stable += yield row * step, point.damping_n_s_per_m
        checked.append(replace(point, held=stable / len(rows)) if rows else point)
    return checked


def area(boundary: list[BoundaryPoint]) -> float:
    """Return the area under the largest stable K, N^2 s/m^2, by trapezoids between the values of B."""
    return sum(
        (right.damping_n_s_per_m - left.damping_n_s_per_m) * (left.stable_n_per_m + right.stable_n_per_m) / 2
        for left, right in pairwise(boundary)
    )
