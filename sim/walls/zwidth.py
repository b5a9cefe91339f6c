"""Z-width: the region of stable walls for each case, a scene with its changes, from several starts.

A map asks for one wall at a time, and all starts of a wall are hit side by side, as are walls of different maps; every
verdict is kept as it comes. A verdict depends on the scene, the wall and the start alone, so the map is the same for
any pool, and an interrupted map continues where it was, also with more starts.
"""

import platform
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..jobs import store
from ..jobs.job_pool import JobPool
from ..scene.case import Case
from . import hit, worst_variant
from .boundary import BoundaryPoint, area, walls
from .grid import grid_of
from .likelihood import ENDS, Column, Wall, draws, held, islands
from .starts import start as start_of

STARTS = 10
"""The number of starts of a map, unless another is asked for."""


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

        The boundary is a list of [B (N s/m), K (N/m), low, high]: the K at which a hit is as likely stable as not, and
        the ends of its interval; the true K is larger where the boundary leaves the map. `p_stable` is a list of [B, K,
        stable, unstable, undecided], the numbers of hits. A worst case also has what `worst_variant.report` says.
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


class Effort(NamedTuple):
    """The effort for maps: their backend, the number of their hits, and the time until the last of them, s."""

    backend: str
    hits: int
    seconds: float


class Mapper(Protocol):
    """The function that makes maps for a study."""

    def __call__(self, title: str, cases: list[Case]) -> list[Map]:
        """Return the map of each case; the title is shown with the progress."""

    def effort(self) -> Effort:
        """Return the effort for the maps so far."""


class NeverReached(RuntimeError):
    """The handle did not reach the wall in the time of the protocol: such a hit says nothing about the wall."""


def interval(drawn: np.ndarray) -> tuple[float, float]:
    """Return the ends of an interval, of the lower and the upper values of bootstraps, shape (2, draws)."""
    return float(np.percentile(drawn[0], ENDS[0])), float(np.percentile(drawn[1], ENDS[1]))


def verdict(
    scene: str, text: str, sources: str, changes: dict, wall: tuple[float, float], start: int | None, backend: str
) -> dict:
    """Hit a wall; return the `verdict` on it, whether the handle is `in_place` if stable, what else is said of the hit,
    and the `seconds` it took.

    Args:
        scene, text, changes: attributes of a `Case`.
        sources: the result of `store.sources` where the map is made; results are kept under it.
        wall: its stiffness and damping, N/m and N s/m.
        start: number of the start; None for the scene's own.
        backend: one of `backends.BACKENDS`.

    Raises:
        SceneError: if the scene is not valid.
        NeverReached: if the handle did not reach the wall.
        RuntimeError: if the worker has other sources of the project.
    """
    if sources != store.sources():
        raise RuntimeError(f"a worker, {platform.node()}, has other sources of hardwall, or versions of its tools")
    case, start = Case("", scene, text, changes), None if start is None else start_of(start)
    result = hit.run(case.hitting(*wall, start), backend, until_sure=True)
    if not result.touched:
        stiffness, damping = wall
        held = "" if case.scene.coupling is None else ", for its coupling holds it back or shakes it"
        raise NeverReached(
            f"the handle did not reach the wall{held}: nothing is said of K {stiffness:g}, B {damping:g} "
            f"with {case.scene.controller.estimator}"
        )
    return {
        "verdict": result.verdict,
        "in_place": result.stable and result.in_place,
        "rms_mm": result.rms_m * 1e3,
        "offset_mm": result.offset_m * 1e3,
        "drift_mm_per_s": result.drift_m_per_s * 1e3,
        "run_s": result.samples / result.scene.spec.sample_hz,
        "seconds": result.seconds,
    }


class _Mapping:
    """A map in progress: the jobs that it asks for next, by variant and start, and at the end the map.

    Every wall is hit in all variants of the case. The search is sent the verdicts of the worst of them so far, and the
    map is of the walls as the worst variant had them.
    """

    def __init__(self, case: Case, backend: str, starts: int):
        self._case, self._grid, self._starts = case, grid_of(case.scene), starts
        self._steps: Generator = walls(self._grid, starts)
        common = {"sources": store.sources(), "backend": backend}
        self._jobs = {name: variant.job() | common for name, variant in case.variants.items()}
        self._hits: dict[tuple[float, float], dict[str, dict[int, dict]]] = {}
        self._wall: tuple[float, float] | None = None
        self.wanted: dict[tuple[str, int], dict] = {}
        self._results: dict[tuple[str, int], dict] = {}
        self.found: Map | None = None
        self._send(None)

    @property
    def of_variants(self) -> bool:
        """Whether it is of a case that has variants, whose hits other maps may have had."""
        return len(self._jobs) > 1

    def answer(self, place: tuple[str, int], result: dict) -> None:
        """Continue the map with the verdict on the wall that it asked for, in one of the variants from one start."""
        self._results[place] = result
        if len(self._results) == len(self.wanted):
            hits = self._hits.setdefault(self._wall, {name: {} for name in self._jobs})
            for name, start in self.wanted:
                hits[name][start] = self._results[name, start]
            verdicts = hits[worst_variant.of(self._walls(self._wall))[0]]
            self._send([verdicts[start]["verdict"] for start in dict.fromkeys(start for _, start in self.wanted)])

    def _walls(self, place: tuple[float, float]) -> dict[str, Wall]:
        """Return a wall that was hit, by variant."""
        stiffness, damping = place
        return {name: Wall(damping, stiffness, hits) for name, hits in self._hits[place].items()}

    def _send(self, verdicts: list[str] | None) -> None:
        self._results, self.wanted = {}, {}
        try:
            stiffness, damping, starts = self._steps.send(verdicts)
        except StopIteration:
            self._wall, self.found = None, self._made()
        else:
            self._wall = stiffness, damping
            self.wanted = {
                (name, start): job | {"wall": self._wall, "start": start}
                for name, job in self._jobs.items()
                for start in starts
            }

    def _made(self) -> Map:
        """Return the map of all hits."""
        every = [self._walls(place) for place in sorted(self._hits, key=lambda place: place[::-1])]
        found = [walls_of[worst_variant.of(walls_of)[0]] for walls_of in every]
        variants = {name: tuple(walls_of[name] for walls_of in every) for name in self._jobs if self.of_variants}
        drawn, dampings = draws(self._starts), self._grid.dampings
        points, in_place, bounds = [], [], []
        for damping, walls_of in groupby(found, lambda wall: wall.damping_n_s_per_m):
            at = list(walls_of)
            column = Column(at, self._starts)
            stiffness = column.boundary()
            bounds.append(column.bounds(drawn))
            above = [wall.stiffness_n_per_m for wall in at if wall.stiffness_n_per_m > stiffness]
            points.append(BoundaryPoint(damping, stiffness, min(above, default=None), held(at, stiffness)))
            in_place.append(_in_place(at, stiffness))
        assert len(points) == len(dampings)
        hits = [result for walls_of in every for wall in walls_of.values() for result in wall.hits.values()]
        seconds = sum(result["seconds"] for result in hits)
        drawn_points = np.array(bounds).transpose(1, 0, 2)
        return Map(self._case, points, len(hits), in_place, seconds, self._starts, tuple(found), drawn_points, variants)

    @property
    def done(self) -> float:
        """The part of the values of B that the map has finished."""
        dampings = self._grid.dampings
        return dampings.index(self._wall[1]) / len(dampings) if self._wall else 1.0


def _in_place(found: list[Wall], boundary_n_per_m: float) -> bool:
    """Return whether half of the stable hits of the stiffest wall below a boundary that has some are in place."""
    for wall in reversed(found):
        stable = [each["in_place"] for each in wall.hits.values() if each["verdict"] == hit.VERDICTS[0]]
        if wall.stiffness_n_per_m <= boundary_n_per_m and stable:
            return 2 * sum(stable) >= len(stable)
    return False


def run(
    cases: list[Case],
    backend: str,
    known: store.Store,
    pool: JobPool,
    progress: Callable[[float], None] | None = None,
    starts: int = STARTS,
) -> list[Map]:
    """Return the map of each case.

    Args:
        cases: the cases to map, each on its scene's grid.
        backend: one of `backends.BACKENDS`.
        known: the store of verdicts.
        pool: who hits the walls.
        progress: called after every verdict with the number of maps done, unfinished maps counted in part.
        starts: number of starts.

    Raises:
        SceneError: if a case is not valid, or its scene has no section `zwidth`.
        NeverReached: if the handle does not reach the wall in a case.
        RuntimeError: if the cluster fails; see `jobs.cluster`.
    """
    maps = [_Mapping(case, backend, starts) for case in cases]

    def forward(mapping: _Mapping) -> int:
        """Answer a map from the store as far as possible; give the hits that it waits for, and return their number."""
        while mapping.wanted:
            missing = {place: job for place, job in mapping.wanted.items() if job not in known}
            wanted = mapping.wanted
            for place in [place for place in wanted if place not in missing]:
                mapping.answer(place, known.get(wanted[place]))
            if missing:
                for place, job in missing.items():
                    pool.give((mapping, place, job), verdict, job)
                break
        if progress:
            progress(sum(running.done for running in maps))
        return len(missing) if mapping.wanted else 0

    # Worst cases come last: what their variants share with the maps of these alone is known by then.
    for of_variants in (False, True):
        under_way = sum(forward(mapping) for mapping in maps if mapping.of_variants == of_variants)
        while under_way:
            (mapping, place, job), result = pool.take()
            known.put(job, result)
            under_way -= 1
            asked = mapping.wanted
            mapping.answer(place, result)
            if mapping.wanted is not asked:
                under_way += forward(mapping)
    return [mapping.found for mapping in maps]
