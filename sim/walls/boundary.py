"""The walls of a map, and who hits them: at every B a search for the K at which as many starts are stable as not.

Stiffness K and damping B go in steps. At each B, from the K of the B before, `SCOUTS` starts look for two neighbours in
K: the softer one is stable for half of the starts, and the stiffer one is not. The steps double, then halve. If nothing
is stable below, one start looks at every doubling of K from the first step on. All starts then hit both neighbours, and
walls at twice the distance each time, until `SURE` of them are stable below and unstable above. Farther off, one start
hits a wall at every fourfold distance, down to the first step of K and up to the last. It does so at every B of a map
with few B, and at some `PATROLS` of a map with many. The region of stable walls may have holes, and islands around it.

Nothing here hits a wall: `walls` is a generator that yields walls and starts, and is sent verdicts. So the map does not
depend on the source of the verdicts, or on the order in which several maps get theirs.
"""

import math
from collections.abc import Generator, Iterable
from dataclasses import dataclass
from itertools import pairwise

SCOUTS = 3
SURE = 0.8
PATROLS = 16
"""The number of B, or up to twice as many, at which one start looks far from the edge."""
STABLE, UNDECIDED = "stable", "undecided"


@dataclass(frozen=True)
class Grid:
    """Steps and ends of a map: B from the first to the last one, K from one step to its end."""

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
    """Return the number of whole steps; the margin covers a division that lost the last bit of a step."""
    return math.floor(steps * (1 + 1e-12))


@dataclass(frozen=True)
class BoundaryPoint:
    """The boundary of a stable region at one B.

    Attributes:
        damping_n_s_per_m: B.
        stable_n_per_m: the K up to which a hit is more likely stable than not; 0 if no wall of the map is.
        marginal_n_per_m: the softest wall above that was hit and is not; None where the region goes on beyond the
            largest K of the map.
        held: the share of stable walls below the boundary; None if there is none below.
    """

    damping_n_s_per_m: float
    stable_n_per_m: float
    marginal_n_per_m: float | None
    held: float | None = None


Asked = Generator[tuple[float, float, list[int]], list[str], None]
"""A generator that yields K, B and the numbers of starts, and is sent their verdicts."""


def share(verdicts: Iterable[str]) -> float:
    """Return the share of stable ones; an undecided one counts half."""
    values = [1.0 if each == STABLE else 0.5 if each == UNDECIDED else 0.0 for each in verdicts]
    return sum(values) / len(values)


def walls(grid: Grid, starts: int) -> Asked:
    """Yield the walls of a map and the starts that hit them; no start hits a wall twice."""
    row, every = max(grid.rows // 8, 1), max(len(grid.dampings) // PATROLS, 1)
    for number, damping in enumerate(grid.dampings):
        column = _Column(grid, damping, starts, number // every % starts)
        row = yield from column.searched(row)
        yield from column.surrounded(row)
        if number % every == 0:
            yield from column.patrolled(row)
        row = max(row, 1)


class _Column:
    """The walls of one B, by rows of K from 1 on, and their verdicts so far by start; one of the starts goes alone."""

    def __init__(self, grid: Grid, damping_n_s_per_m: float, starts: int, alone: int):
        self._grid, self._damping = grid, damping_n_s_per_m
        self._alone, self._scouts, self._all = [alone], list(range(min(SCOUTS, starts))), list(range(starts))
        self._verdicts: dict[int, dict[int, str]] = {}

    def _share(self, row: int, starts: list[int]) -> Generator:
        """Hit a wall from the remaining starts; return the share of stable hits among all."""
        known = self._verdicts.setdefault(row, {})
        missing = [start for start in starts if start not in known]
        if missing:
            stiffness = row * self._grid.stiffness_step_n_per_m
            found = yield stiffness, self._damping, missing
            known.update(zip(missing, found, strict=True))
        return share(known.values())

    def _holds(self, row: int, starts: list[int]) -> Generator:
        return (yield from self._share(row, starts)) >= 0.5

    def searched(self, row: int) -> Generator:
        """Return the last row that scouts find stable, 0 if they find none."""
        low, high, step = row, row, 1
        while low >= 1 and not (yield from self._holds(low, self._scouts)):
            low, high, step = low - step, low, 2 * step
        low = max(low, 0)
        if low == 0:
            low = yield from self._doubled()
            high = low
        if low and high == low:
            low, high = yield from self._climbed(low)
        while high - low > 1:
            middle = (low + high) // 2
            if (yield from self._holds(middle, self._scouts)):
                low = middle
            else:
                high = middle
        return low

    def _doubled(self) -> Generator:
        """Return the last of the rows 1, 2, 4 and so on that is stable, 0 if none is."""
        last, row = 0, 1
        while row <= self._grid.rows:
            if (yield from self._holds(row, self._alone)) and (yield from self._holds(row, self._scouts)):
                last = row
            row *= 2
        return last

    def _climbed(self, low: int) -> Generator:
        """Return a stable row and an unstable one above, perhaps that beyond the last; from a stable row up."""
        step, high = 1, low + 1
        while high <= self._grid.rows and (yield from self._holds(high, self._scouts)):
            low, step = high, 2 * step
            high = min(low + step, self._grid.rows) if low < self._grid.rows else low + 1
        return low, high

    def surrounded(self, row: int) -> Generator:
        """Have all starts hit the walls around a boundary, as far as they differ."""
        away = 0
        while row - away >= 1 and (yield from self._share(row - away, self._all)) < SURE:
            away = max(2 * away, 1)
        away = 1
        while row + away <= self._grid.rows and (yield from self._share(row + away, self._all)) > 1 - SURE:
            away *= 2

    def patrolled(self, row: int) -> Generator:
        """Have one start hit walls at every fourfold distance from a boundary."""
        rows, away = {1, self._grid.rows}, 1
        while away < self._grid.rows:
            rows |= {row - away, row + away}
            away *= 4
        for each in sorted(rows):
            if 1 <= each <= self._grid.rows and each not in self._verdicts:
                yield from self._share(each, self._alone)


def area(boundary: list[BoundaryPoint]) -> float:
    """Return the area under the boundary, N^2 s/m^2, by trapezoids between the values of B."""
    return sum(
        (right.damping_n_s_per_m - left.damping_n_s_per_m) * (left.stable_n_per_m + right.stable_n_per_m) / 2
        for left, right in pairwise(boundary)
    )
