"""Speed against accuracy: what shortcuts of a scene's simulation save, and how far they move the edge of stable walls.

The reference is the bit-accurate model with every part of the scene, the exact solver, and the scene's own rates and
steps of K. Two things are compared with it, for two estimators:

- the edge of the shortcut's own map, from the same starts, draw by draw of these: see `walls.edge_shift`;
- the time of a hit, the mean over a wall of every B; and the time of a map: the time of a hit times its number of hits.

The hardware has the verdicts of `fixed`, because it has its force words: every hit of the hardware checks that.
"""

import json
import math
import statistics
import time
from collections.abc import Callable, Hashable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

from ...model.runtime.result import Table, table_of
from ..jobs import rounds
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls.edge_shift import Move, move
from ..walls.mapping import Mapper
from ..walls.methods import Curve
from ..walls.zwidth import Map
from .shortcuts import REFERENCE, Contest, Shortcut, Wall

ROUNDS = 3
RTL_WALLS = 2
"""The number of walls on which the hardware is timed, once, for every estimator: a hit takes seconds."""


@dataclass(frozen=True)
class Point:
    """The cost of a setting, and what it changes.

    Attributes:
        shortcut: the setting.
        hit_s: time of a hit, the mean over the estimators.
        hits: number of hits in the maps of all estimators.
        map_s: time of these maps, in one process.
        moves: by estimator, how far the edge of its map lies from the reference's.
    """

    shortcut: Shortcut
    hit_s: float
    hits: int
    map_s: float
    moves: dict[str, Move]

    def report(self) -> dict[str, Any]:
        """Return the point as the command line prints it; what is infinite is None there."""
        keys = {"hit_s": self.hit_s, "map_hits": self.hits, "map_s": self.map_s}
        moves = {
            label: {
                "area_ratio": move.area,
                "area_ratio_low": move.low,
                "area_ratio_high": move.high if math.isfinite(move.high) else None,
                "moved": move.moved,
                "clipped": move.clipped,
                "farthest_stiffness_change": move.stiffness if math.isfinite(move.stiffness) else None,
                "moved_at_dampings": move.dampings,
            }
            for label, move in self.moves.items()
        }
        return asdict(self.shortcut) | keys | {"moves": moves}


@dataclass(frozen=True)
class Trade:
    """The result of the study.

    Attributes:
        scene: the scene, with the grid of the maps.
        points: the points, the reference first.
        starts: number of starts of a map.
        words_checked: number of hits of the hardware, all with the force words of `fixed`.
        refused: why the scene does not take a setting, by its label.
        seconds: wall time of the study.
    """

    scene: Scene
    points: list[Point]
    starts: int
    words_checked: int
    refused: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def labels(self) -> list[str]:
        """The labels of the estimators."""
        return list(self.points[0].moves)

    def best(self, label: str) -> list[Point]:
        """Return the points that no other map beats in both speed and certainty for an estimator."""
        return best(self.points, lambda point: point.map_s, lambda point: point.moves[label].distance)

    def report(self) -> dict[str, Any]:
        """Return the trade as the command line prints it."""
        fronts = {label: self.best(label) for label in self.labels}
        settings = [
            point.report() | {"best_for": [label for label, front in fronts.items() if point in front]}
            for point in self.points
        ]
        keys = {"scene": self.scene.name, "starts": self.starts}
        keys |= {"rtl_hits_with_the_words_of_fixed": self.words_checked}
        return keys | {"settings": settings, "refused": self.refused, "seconds": self.seconds}

    def tables(self) -> list[Table]:
        """Return a table of the settings: costs, and for each estimator the area and the farthest move of K."""
        fronts = {label: self.best(label) for label in self.labels}
        rows = []
        for point in self.points:
            row = [point.shortcut.label, f"{point.hit_s * 1e3:.1f}", str(point.hits), f"{point.map_s:.1f}"]
            for label, moved in point.moves.items():
                star = "* " * (point in fronts[label])
                far = f"{moved.stiffness:+.0%}" if math.isfinite(moved.stiffness) else "new"
                where = f"{far} at {moved.dampings}" if moved.dampings else ""
                row += [f"{star}{area_text(moved)}{'!' * moved.moved}", where]
            rows.append(row)
        heads = [f"{label}: {what}" for label in self.labels for what in ("area", "K")]
        return [table_of(("setting",), ("hit (ms)", "maps: hits", "s", *heads), rows)]

    def notes(self) -> list[str]:
        """Return the meaning of the columns."""
        return [
            "area: of the stable walls, over the reference's, and between which it is in 95 of 100 draws of the "
            f"{self.starts} starts",
            "!: it is another one, by more than that and than a step of K; one of ten or twenty is so by chance",
            *(["+: a region goes on beyond the largest K of the map"] if self._clipped else []),
            "K: its farthest move at one B, and at how many B it moved beyond its interval and a step",
            *(["new: an edge at a B at which the reference has none"] if self._new else []),
            "*: no map is both faster and, by the farther end of its interval, nearer to the reference's",
            f"rtl: its maps are those of fixed, whose force words it had in {self.words_checked} hits",
            *(f"not tried: {label}, for {reason}" for label, reason in self.refused.items()),
        ]

    @property
    def _moves(self) -> list[Move]:
        return [move for point in self.points for move in point.moves.values()]

    @property
    def _clipped(self) -> bool:
        return any(move.clipped for move in self._moves)

    @property
    def _new(self) -> bool:
        return any(math.isinf(move.stiffness) for move in self._moves)


def area_text(move: Move) -> str:
    """Return the ratio of areas with its interval as text."""
    return f"{move.area:.2f}{'+' * move.clipped} ({move.low:.2f} to {move.high:.2f})"


def best(points: list[Point], cost: Callable[[Point], float], error: Callable[[Point], float]) -> list[Point]:
    """Return the points that no other beats in both cost and error, by rising cost and falling error."""
    front: list[Point] = []
    for point in sorted(points, key=lambda point: (cost(point), error(point))):
        if not front or error(point) < error(front[-1]):
            front.append(point)
    return front


@dataclass(frozen=True)
class Runs:
    """The runs of the study, whose timed hits run alone, in this process.

    Attributes:
        mapper: returns what makes the maps on a backend.
        starts: number of starts of a map.
        progress: returns a context with what is told the number of timed hits so far, by a title and their number.
    """

    mapper: Callable[[str], Mapper]
    starts: int
    progress: Callable[[str, int], AbstractContextManager[Callable[[int], None]]]

    def maps(self, backend: str, cases: list[Case]) -> list[Map]:
        """Return the map of every case."""
        return self.mapper(backend)("maps", cases)

    def medians(self, contestants: dict[Hashable, Callable[[], float]], times: int) -> dict[Hashable, float]:
        """Return the median of every contestant's results over rounds in which they take turns: `rounds.medians`."""
        every = times * len(contestants)
        with self.progress("times", every) as advance:
            begun = iter(range(every))
            return rounds.medians(contestants, times, lambda _: advance(next(begun)))


def _boundary(of: Map) -> dict[float, float]:
    """Return the largest stable K by B, where a wall is stable."""
    return {point.damping_n_s_per_m: point.stable_n_per_m for point in of.boundary if point.stable_n_per_m}


def _hits_of(shortcut: Shortcut) -> str:
    """Return a name for the hits of a shortcut; shortcuts that differ only in the steps of the map share the name."""
    return json.dumps([shortcut.backend, shortcut.changes], sort_keys=True)


def study(case: Case, runs: Runs) -> Trade:
    """Return the trade of speed for accuracy on a scene.

    Args:
        case: the scene.
        runs: runner of the hits.

    Raises:
        SceneError: if the scene is not valid, or has no section `zwidth`.
        RuntimeError: if no wall of a reference's map is stable, or the hardware's force words differ from `fixed`'s.
    """
    began, contest = time.perf_counter(), Contest(case)
    maps = _maps(contest, runs, [REFERENCE])
    for curve in contest.curves:
        if not maps[REFERENCE.label, curve.label].area:
            name = f"{contest.scene.name}: with {curve.label}"
            raise RuntimeError(f"{name} no wall of the map is stable: nothing to compare with")
    maps |= _maps(contest, runs, [each for each in contest.computed if each != REFERENCE])
    boundaries = {curve.label: _boundary(maps[REFERENCE.label, curve.label]) for curve in contest.curves}
    timed = {label: contest.timed(boundary) for label, boundary in boundaries.items()}
    seconds = _seconds(contest, timed, runs)
    points = []
    for shortcut in contest.shortcuts:
        model, hits = contest.model_of(shortcut), _hits_of(shortcut)
        own = {label: maps[model.label, label] for label in boundaries}
        hit_s = {label: seconds[hits, label] for label in boundaries}
        point = Point(
            shortcut,
            hit_s=statistics.mean(hit_s.values()),
            hits=sum(a_map.hits for a_map in own.values()),
            map_s=sum(a_map.hits * hit_s[label] for label, a_map in own.items()),
            moves={label: move(a_map, maps[REFERENCE.label, label]) for label, a_map in own.items()},
        )
        points.append(point)
    checked = len(contest.hardware) * sum(len(walls[:RTL_WALLS]) for walls in timed.values())
    seconds_in_all = time.perf_counter() - began
    return Trade(contest.scene, points, runs.starts, checked, contest.refused, seconds_in_all)


def _maps(contest: Contest, runs: Runs, wanted: list[Shortcut]) -> dict[tuple[str, str], Map]:
    """Return the maps of some shortcuts, by the labels of shortcut and estimator."""
    maps = {}
    for backend in dict.fromkeys(each.backend for each in wanted):
        keys = [(each, curve) for each in wanted if each.backend == backend for curve in contest.curves]
        made = runs.maps(backend, [contest.case_of(*key) for key in keys])
        maps |= {(each.label, curve.label): a_map for (each, curve), a_map in zip(keys, made, strict=True)}
    return maps


def _seconds(contest: Contest, timed: dict[str, list[Wall]], runs: Runs) -> dict[tuple[str, str], float]:
    """Return the mean time of a hit over the walls, by `_hits_of` a shortcut and the estimator's label."""

    def contestants(shortcuts: list[Shortcut], walls: int | None, seconds_of: Callable[..., float]) -> dict:
        return {
            (_hits_of(each), curve.label, wall): partial(seconds_of, each, curve, wall)
            for each in shortcuts
            for curve in contest.curves
            for wall in timed[curve.label][:walls]
        }

    def model(shortcut: Shortcut, curve: Curve, wall: Wall) -> float:
        return contest.hit(shortcut, curve, wall).seconds

    def hardware(shortcut: Shortcut, curve: Curve, wall: Wall) -> float:
        # A model may see that a handle rests for ever, where the hardware goes on.
        both = shortcut, contest.model_of(shortcut)
        result, same = (contest.hit(each, curve, wall, until_sure=False) for each in both)
        if result.force_sha256 != same.force_sha256:
            where = f"{shortcut.label}, {curve.label}, K {wall[0]:g}, B {wall[1]:g}"
            raise RuntimeError(f"the RTL and the model differ in their force words: {where}")
        return result.seconds

    times = runs.medians(contestants(contest.computed, None, model), ROUNDS)
    times |= runs.medians(contestants(contest.hardware, RTL_WALLS, hardware), 1)
    means: dict[tuple[str, str], list[float]] = {}
    for (hits, label, _), seconds in times.items():
        means.setdefault((hits, label), []).append(seconds)
    return {key: statistics.mean(seconds) for key, seconds in means.items()}
