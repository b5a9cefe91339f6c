"""The runs that trade speed for accuracy: shortcuts of a scene's simulation, compared with the most exact simulation.

The reference is the bit-accurate model with every part of the scene, the exact solver, and the scene's own rates and
steps of K. Two things are compared with it, for two estimators:

- the edge of the shortcut's own map, from the same starts, draw by draw of these: see `walls.moves`;
- the time of a hit, the mean over a wall of every B, and the time of a map: that of a hit times its number of hits.

The hardware has the verdicts of `fixed`, because it has its force words: every hit of the hardware checks that.
"""

import json
import statistics
import time
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from itertools import cycle
from typing import Protocol

from ..scene.case import Case
from ..scene.errors import SceneError
from ..walls import hit
from ..walls.edge_shift import move
from ..walls.grid import grid_of
from ..walls.methods import Curve, methods
from ..walls.zwidth import Map
from .shortcuts import REFERENCE, Shortcut, shortcuts
from .trade import Point, Trade

METHODS = "adjusted", "fdm-500"
GRID = {
    "zwidth.damping_from_n_s_per_m": 10.0,
    "zwidth.damping_to_n_s_per_m": 70.0,
    "zwidth.damping_step_n_s_per_m": 20.0,
}
"""A grid with few B, as there are many maps; both estimators have a boundary there on the paper's device and drive."""
AROUND = 0.7, 0.85, 0.95, 1 / 0.95, 1 / 0.85, 1 / 0.7
"""The stiffness of the walls that are timed, over the reference's boundary, from one B to the next."""
ROUNDS = 3
RTL_WALLS = 2
"""The number of walls on which the hardware is timed, once, for every estimator: a hit takes seconds."""

Wall = tuple[float, float]
"""The stiffness K (N/m) and the damping B (N s/m) of a wall."""


class Runs(Protocol):
    """A runner of the study's hits, which shows its progress; `starts` is the number of starts of its maps."""

    starts: int

    def maps(self, backend: str, cases: list[Case]) -> list[Map]:
        """Return the map of every case."""

    def medians(self, contestants: dict[Hashable, Callable[[], float]], rounds: int) -> dict[Hashable, float]:
        """Return the median of every contestant's results over rounds in which they take turns: `rounds.medians`."""


class _Contest:
    """A scene, its shortcuts, and the estimators with which the shortcuts are tried.

    Attributes:
        scene: the scene, with the grid of the maps.
        curves: the estimators, labelled as on the command line.
        shortcuts: all shortcuts; `computed` are those of a model, `hardware` those of the RTL.
        refused: why the scene does not take a shortcut, by its label.
    """

    def __init__(self, case: Case):
        self._case = case.with_defaults(GRID)
        self.scene = self._case.scene
        self._grid = grid_of(self.scene)
        if len(self._grid.dampings) < 2:
            key = f"{self.scene.name}: zwidth.damping_to_n_s_per_m"
            raise SceneError(f"{key} must leave two values of B, for a map of one has no area")
        self.refused: dict[str, str] = {}
        self.curves = [replace(methods(self.scene)[method], label=method) for method in METHODS]
        self.shortcuts = shortcuts(self.scene, self._differs)
        self.computed = [each for each in self.shortcuts if each.backend != "rtl"]
        self.hardware = [each for each in self.shortcuts if each.backend == "rtl"]

    def _differs(self, shortcut: Shortcut) -> bool:
        """Return whether a shortcut is valid for the scene, and differs from the reference."""
        reference = [self.case_of(REFERENCE, curve).scene for curve in self.curves]
        try:
            own = [self.case_of(shortcut, curve).scene for curve in self.curves]
        except SceneError as error:
            self.refused[shortcut.label] = str(error).removeprefix(f"{self._case.source}: ")
            return False
        return own != reference or shortcut.backend != REFERENCE.backend or shortcut.coarser > 1

    def case_of(self, shortcut: Shortcut, curve: Curve) -> Case:
        """Return the case of a shortcut with an estimator."""
        changes = curve.changes | shortcut.changes
        if shortcut.coarser > 1:
            changes["zwidth.stiffness_step_n_per_m"] = shortcut.coarser * self._grid.stiffness_step_n_per_m
        return self._case.changed(changes, curve.label)

    def model_of(self, shortcut: Shortcut) -> Shortcut:
        """Return the shortcut that computes the verdicts of another: itself, or the model of the hardware."""
        if shortcut.backend != "rtl":
            return shortcut
        return next(each for each in self.computed if (each.backend, each.changes) == ("fixed", shortcut.changes))

    def timed(self, boundary: dict[float, float]) -> list[Wall]:
        """Return the walls that are timed: one for every B of a boundary, at varying distances from it."""
        step, walls = self._grid.stiffness_step_n_per_m, []
        for (damping, stiffness), times in zip(boundary.items(), cycle(AROUND), strict=False):
            row = round(times * (stiffness / step + 0.5))
            walls.append((min(max(row, 1), self._grid.rows) * step, damping))
        return walls

    def hit(self, shortcut: Shortcut, curve: Curve, wall: Wall, until_sure: bool = True) -> hit.Hit:
        """Hit a wall with a shortcut and an estimator."""
        return hit.run(self.case_of(shortcut, curve).hitting(*wall), shortcut.backend, until_sure=until_sure)


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
        RuntimeError: if no wall of a reference's map is stable, or the hardware's force words are not those of `fixed`.
    """
    began, contest = time.perf_counter(), _Contest(case)
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


def _maps(contest: _Contest, runs: Runs, wanted: list[Shortcut]) -> dict[tuple[str, str], Map]:
    """Return the maps of some shortcuts, by the labels of shortcut and estimator."""
    maps = {}
    for backend in dict.fromkeys(each.backend for each in wanted):
        keys = [(each, curve) for each in wanted if each.backend == backend for curve in contest.curves]
        made = runs.maps(backend, [contest.case_of(*key) for key in keys])
        maps |= {(each.label, curve.label): a_map for (each, curve), a_map in zip(keys, made, strict=True)}
    return maps


def _seconds(contest: _Contest, timed: dict[str, list[Wall]], runs: Runs) -> dict[tuple[str, str], float]:
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
