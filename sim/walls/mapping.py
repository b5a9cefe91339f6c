"""Maps of stable walls, and who makes them for a study.

A map asks for one wall at a time. All starts of a wall are hit side by side, as are walls of different maps; every
verdict is kept as it comes. A verdict depends on the scene, the wall and the start alone. So the map is the same for
any pool. An interrupted map continues where it was, also with more starts.
"""

import platform
import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ..jobs import store
from ..jobs.job_pool import JobPool
from ..scene.case import Case
from . import hit, worst_variant
from .boundary import BoundaryPoint, walls
from .grid import grid_of
from .likelihood import Column, Wall, draws, held
from .starts import start as start_of
from .zwidth import Map

STARTS = 10
"""The number of starts of a map, unless another is asked for."""


class Effort(NamedTuple):
    """The effort for maps: their backend, the number of their hits, and the time until the last of them, s."""

    backend: str
    hits: int
    seconds: float


class Mapper:
    """The maker of a study's maps; it records their effort from its own beginning on.

    Args:
        backend: one of `backends.BACKENDS`.
        starts: number of starts of a map.
        known: the store of verdicts.
        pool_for: returns a context with the pool that does so many jobs at a time.
        progress: returns a context with what is told the number of maps done, by a title and the number of maps.
    """

    def __init__(
        self,
        backend: str,
        starts: int,
        known: store.Store,
        pool_for: Callable[[int], AbstractContextManager[JobPool]],
        progress: Callable[[str, int], AbstractContextManager[Callable[[float], None] | None]],
    ):
        self._backend, self._starts, self._known = backend, starts, known
        self._pool_for, self._progress = pool_for, progress
        self._hits, self._began = 0, time.perf_counter()

    def __call__(self, title: str, cases: list[Case]) -> list[Map]:
        """Return the map of each case; the title is shown with the progress.

        Raises:
            SceneError, NeverReached, RuntimeError: see `run`.
        """
        for case in cases:
            grid_of(case.scene)  # raises SceneError before a cluster is started
        with (
            self._pool_for(len(cases) * self._starts) as pool,
            self._progress(f"{title}, {self._backend}", len(cases)) as advance,
        ):
            maps = run(cases, self._backend, self._known, pool, advance, self._starts)
        self._hits += sum(a_map.hits for a_map in maps)
        return maps

    def effort(self) -> Effort:
        """Return the effort of the maps so far."""
        return Effort(self._backend, self._hits, time.perf_counter() - self._began)


class NeverReached(RuntimeError):
    """The handle did not reach the wall in the time of the protocol: such a hit says nothing about the wall."""


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
        raise RuntimeError(
            f"a worker, {platform.node()}, has other sources of hardwall, or other versions of its tools"
        )
    case, start = Case("", scene, text, changes), None if start is None else start_of(start)
    result = hit.run(case.hitting(*wall, start), backend, until_sure=True)
    if not result.touched:
        stiffness, damping = wall
        held = "" if case.scene.coupling is None else ", for its coupling holds it back or shakes it"
        raise NeverReached(
            f"the handle did not reach the wall{held}: no verdict on the wall K {stiffness:g}, B {damping:g} "
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

    Every wall is hit in all variants of the case. The search gets the verdicts of the worst variant so far. The map has
    each wall's verdicts by its worst variant.
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
        """Whether its case has variants; other maps may already have their hits."""
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
