"""Z-width: the boundary of the region of stable walls for each case, a scene with its changes.

A map is a trace, and a trace asks for one hit at a time. Hits of different traces run side by side; every verdict is
kept as it comes. A verdict depends on the scene and the wall alone, so the map is the same for any crew, and an
interrupted map continues where it was.
"""

import platform
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

from ..jobs import store
from ..jobs.crew import Crew
from ..scene.case import Case
from . import hit
from .boundary import BoundaryPoint, area, trace
from .grid import grid_of


@dataclass(frozen=True)
class Map:
    """The boundary of one stable region.

    Attributes:
        case: the case that was mapped.
        boundary: its points, by B.
        hits: number of walls that were hit for it.
        in_place: for each point, whether its largest stable wall holds the handle there: see `hit.Hit.in_place`.
        seconds: wall time of its hits, wherever and whenever they ran; maps are compared without it.
    """

    case: Case
    boundary: list[BoundaryPoint]
    hits: int
    in_place: list[bool]
    seconds: float = field(default=0.0, compare=False)

    @property
    def area(self) -> float:
        """The area under the boundary, N^2 s/m^2, whether or not all walls there are stable."""
        return area(self.boundary)

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
        """The area under the boundary, N^2 s/m^2, with K = 0 at each B whose largest stable wall is not in place."""
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

    def report(self) -> dict[str, Any]:
        """Return the map as the command line prints it.

        The boundary is a list of [B (N s/m), K (N/m)], with K the largest stable; the true K is larger where the
        boundary leaves the map.
        """
        return {
            "label": self.case.label,
            "scene": self.case.source,
            "changes": self.case.changes,
            "boundary": [[point.damping_n_s_per_m, point.stable_n_per_m] for point in self.boundary],
            "leaves_the_map_at": [point.damping_n_s_per_m for point in self.boundary if point.marginal_n_per_m is None],
            "area_n2_s_per_m2": self.area,
            "area_held_n2_s_per_m2": self.area_held,
            "area_in_place_n2_s_per_m2": self.area_in_place,
            "largest_stiffness_n_per_m": self.largest_n_per_m,
            "hits": self.hits,
            "seconds": self.seconds,
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


def verdict(scene: str, text: str, sources: str, changes: dict, stiffness: float, damping: float, backend: str) -> dict:
    """Hit a wall; return whether it is `stable`, then `in_place` at rest, its `rms_mm` until the verdict was sure, and
    the `seconds` it took.

    Args:
        scene, text, changes: attributes of a `Case`.
        sources: the result of `store.sources` where the map is made; results are kept under it.
        stiffness, damping: the wall's, N/m and N s/m.
        backend: one of `backends.BACKENDS`.

    Raises:
        SceneError: if the scene is not valid.
        NeverReached: if the handle did not reach the wall.
        RuntimeError: if the worker has other sources of the project.
    """
    if sources != store.sources():
        raise RuntimeError(f"a worker, {platform.node()}, has other sources of hardwall, or versions of its tools")
    result = hit.run(Case("", scene, text, changes).hitting(stiffness, damping), backend, until_sure=True)
    if not result.touched:
        raise NeverReached(f"the handle did not reach the wall: nothing is said of K {stiffness:g}, B {damping:g}")
    in_place = result.stable and result.in_place
    rms_mm = result.rms_m * 1e3
    return {"stable": result.stable, "in_place": in_place, "rms_mm": rms_mm, "seconds": result.seconds}


class _Tracing:
    """A trace in progress: the job that it asks for next, and at the end its map."""

    def __init__(self, case: Case, backend: str):
        self._case, self._grid = case, grid_of(case.scene)
        self._steps: Generator = trace(self._grid)
        self._job = case.job() | {"sources": store.sources(), "backend": backend}
        self._hits, self._seconds = 0, 0.0
        self._in_place: dict[tuple[float, float], bool] = {}
        self.wanted: dict | None = None
        self.found: Map | None = None
        self._send(None)

    def answer(self, result: dict) -> None:
        """Continue the trace with the verdict on the wall that it asked for."""
        self._hits += 1
        self._seconds += result["seconds"]
        self._in_place[self.wanted["stiffness"], self.wanted["damping"]] = result["in_place"]
        self._send(result["stable"])

    def _send(self, stable: bool | None) -> None:
        try:
            stiffness, damping = self._steps.send(stable)
            self.wanted = self._job | {"stiffness": stiffness, "damping": damping}
        except StopIteration as end:
            walls = [(point.stable_n_per_m, point.damping_n_s_per_m) for point in end.value]
            in_place = [self._in_place.get(wall, False) for wall in walls]
            self.wanted, self.found = None, Map(self._case, end.value, self._hits, in_place, self._seconds)

    @property
    def done(self) -> float:
        """The part of the values of B that the trace has finished."""
        dampings = self._grid.dampings
        return dampings.index(self.wanted["damping"]) / len(dampings) if self.wanted else 1.0


def run(
    cases: list[Case],
    backend: str,
    known: store.Store,
    crew: Crew,
    progress: Callable[[float], None] | None = None,
) -> list[Map]:
    """Return the map of each case.

    Args:
        cases: the cases to map, each on its scene's grid.
        backend: one of `backends.BACKENDS`.
        known: the store of verdicts.
        crew: who hits the walls.
        progress: called after every verdict with the number of maps done, unfinished maps counted in part.

    Raises:
        SceneError: if a case is not valid, or its scene has no section `zwidth`.
        NeverReached: if the handle does not reach the wall in a case.
        RuntimeError: if the cluster fails; see `jobs.cluster`.
    """
    traces = [_Tracing(case, backend) for case in cases]

    def forward(tracing: _Tracing) -> dict | None:
        """Answer the trace from the store as far as possible; return the next hit to run, or None at its end."""
        while tracing.wanted and tracing.wanted in known:
            tracing.answer(known.get(tracing.wanted))
        if progress:
            progress(sum(running.done for running in traces))
        return tracing.wanted

    under_way = 0
    for tracing in traces:
        if job := forward(tracing):
            crew.give(tracing, verdict, job)
            under_way += 1
    while under_way:
        tracing, result = crew.take()
        known.put(tracing.wanted, result)
        if job := forward(tracing):
            crew.give(tracing, verdict, job)
        else:
            under_way -= 1
    return [tracing.found for tracing in traces]
