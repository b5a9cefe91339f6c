"""Z-width: the map of stable walls of one case, a scene with its changes, from several starts; `mapping` makes it."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..scene.case import Case
from . import hit, worst_variant
from .boundary import BoundaryPoint, area
from .likelihood import ENDS, Wall, islands


@dataclass(frozen=True)
class Map:
    """The boundary of one stable region.

    Attributes:
        case: the case that was mapped.
        boundary: its points, by B: where a hit is as likely stable as not.
        hits: number of hits for it.
        in_place: for each point, whether its stiffest stable wall holds the handle there: see `hit.Hit.in_place`.
        seconds: time of its hits, wherever and whenever they ran; maps are compared without it.
        starts: number of starts.
        walls: the walls that were hit, by B and K.
        drawn: the K of every point in every bootstrap, shape (2, points, draws): with undecided hits taken for
            unstable, and for stable; None without walls. See `likelihood`.
        variants: the walls that were hit in each variant of a `worst_variant.WorstCase`, in the order of `walls`, by
            name; none for other cases.
    """

    case: Case
    boundary: list[BoundaryPoint]
    hits: int
    in_place: list[bool]
    seconds: float = field(default=0.0, compare=False)
    starts: int = 1
    walls: tuple[Wall, ...] = field(default=(), compare=False)
    drawn: np.ndarray | None = field(default=None, compare=False)
    variants: dict[str, tuple[Wall, ...]] = field(default_factory=dict, compare=False)

    @property
    def area(self) -> float:
        """The area under the boundary, N^2 s/m^2, whether or not all walls there are stable."""
        return area(self.boundary)

    @cached_property
    def drawn_areas(self) -> np.ndarray:
        """The area in every bootstrap, shape (2, draws): with undecided hits taken for unstable, and for stable."""
        if self.drawn is None:
            return np.full((2, 1), self.area)
        return np.trapezoid(self.drawn, [point.damping_n_s_per_m for point in self.boundary], axis=1)

    def draw(self, number: int) -> "Map":
        """Return the map of one bootstrap, with undecided hits taken for unstable."""
        heights = zip(self.boundary, self.drawn[0, :, number].tolist(), strict=True)
        return replace(self, boundary=[replace(point, stable_n_per_m=height) for point, height in heights])

    @property
    def area_interval(self) -> tuple[float, float]:
        """The ends of the interval of the area, N^2 s/m^2."""
        return interval(self.drawn_areas)

    def times(self, other: "Map") -> tuple[float, float] | None:
        """Return the interval of this area over another one's, start for start; None if that may be 0."""
        least, most = other.drawn_areas
        if not (least > 0).all() or self.drawn_areas.shape[1] not in (1, len(least)):
            return None
        return interval(np.stack([self.drawn_areas[0] / most, self.drawn_areas[1] / least]))

    @property
    def intervals(self) -> list[tuple[float, float]]:
        """The ends of the interval of the K of every point, N/m."""
        if self.drawn is None:
            return [(point.stable_n_per_m, point.stable_n_per_m) for point in self.boundary]
        return [interval(self.drawn[:, number]) for number in range(len(self.boundary))]

    @property
    def islands(self) -> list[Wall]:
        """The walls that were hit on the wrong side of the boundary."""
        boundary = {point.damping_n_s_per_m: point.stable_n_per_m for point in self.boundary}
        return islands(self.walls, boundary.__getitem__)

    @property
    def area_held(self) -> float | None:
        """The area under the boundary, N^2 s/m^2, times the stable part of the walls hit below; None if none was."""
        if all(point.held is None for point in self.boundary):
            return None
        parts = [1.0 if point.held is None else point.held for point in self.boundary]
        pairs = zip(self.boundary, parts, strict=True)
        return area([replace(point, stable_n_per_m=point.stable_n_per_m * part) for point, part in pairs])

    @property
    def area_in_place(self) -> float:
        """The area under the boundary, N^2 s/m^2, with K = 0 at each B whose stiffest stable wall is not in place."""
        kept = [
            point if in_place else replace(point, stable_n_per_m=0.0)
            for point, in_place in zip(self.boundary, self.in_place, strict=True)
        ]
        return area(kept)

    @property
    def damping_n_s_per_m(self) -> float:
        """The largest B with a stable K; 0 if no B has one."""
        return max((point.damping_n_s_per_m for point in self.boundary if point.stable_n_per_m), default=0.0)

    @property
    def leaves(self) -> bool:
        """Whether the region continues beyond the map in K or B."""
        return self.boundary[-1].stable_n_per_m > 0 or self.clipped

    @property
    def clipped(self) -> bool:
        """Whether the region continues beyond the map in K."""
        return any(point.marginal_n_per_m is None for point in self.boundary)

    @property
    def largest_n_per_m(self) -> float:
        """The largest stable stiffness on the map; the true one is larger if the map is `clipped`."""
        return max(point.stable_n_per_m for point in self.boundary)

    @property
    def largest_interval(self) -> tuple[float, float]:
        """The ends of the interval of the largest K, N/m."""
        largest = np.full((2, 1), self.largest_n_per_m) if self.drawn is None else self.drawn.max(axis=1)
        return interval(largest)

    def report(self) -> dict[str, Any]:
        """Return the map as the command line prints it.

        The boundary is a list of [B (N s/m), K (N/m), low, high]. K is the stiffness at which a hit is as likely stable
        as not; low and high are the ends of its interval. The true K is larger where the boundary leaves the map.
        `p_stable` is a list of [B, K, stable, unstable, undecided], the numbers of hits. A worst case also has what
        `worst_variant.report` says.
        """
        low, high = self.area_interval
        return {
            "label": self.case.label,
            "scene": self.case.source,
            "changes": self.case.changes,
            "starts": self.starts,
            "boundary": [
                [point.damping_n_s_per_m, point.stable_n_per_m, *ends]
                for point, ends in zip(self.boundary, self.intervals, strict=True)
            ],
            "p_stable": [
                [wall.damping_n_s_per_m, wall.stiffness_n_per_m, *map(wall.number_of, hit.VERDICTS)]
                for wall in self.walls
            ],
            "islands": [[wall.damping_n_s_per_m, wall.stiffness_n_per_m] for wall in self.islands],
            "leaves_the_map_at": [point.damping_n_s_per_m for point in self.boundary if point.marginal_n_per_m is None],
            "area_n2_s_per_m2": self.area,
            "area_low_n2_s_per_m2": low,
            "area_high_n2_s_per_m2": high,
            "area_held_n2_s_per_m2": self.area_held,
            "area_in_place_n2_s_per_m2": self.area_in_place,
            "largest_stiffness_n_per_m": self.largest_n_per_m,
            "hits": self.hits,
            "seconds": self.seconds,
            **(worst_variant.report(self.variants, self.boundary) if self.variants else {}),
        }


def interval(drawn: np.ndarray) -> tuple[float, float]:
    """Return the ends of an interval, of the lower and the upper values of bootstraps, shape (2, draws)."""
    return float(np.percentile(drawn[0], ENDS[0])), float(np.percentile(drawn[1], ENDS[1]))
