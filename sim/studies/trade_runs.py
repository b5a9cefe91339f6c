"""What is run to trade speed for accuracy: the shortcuts of a scene's simulation, held against the most exact there is.

The reference is the bit-accurate model with every part of the scene, the exact solver, the scene's own rates and steps
of K. Against it, for two estimators:

- the verdicts on walls around the reference's edge, from 0.7 times as stiff to 1 / 0.7 times;
- K at the edge of the shortcut's own map, at each B where the reference has one;
- the time of a hit, the mean over a wall of every B; and of a map, so many times the number of its hits.

The hardware has the verdicts of `fixed`, for it has its force words: here that is checked on every hit of it.
"""

import json
import statistics
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from ..scene.load import load, parse, read
from ..scene.schema import SceneError
from ..walls import hit, methods
from ..walls.case import Case, grid_of
from ..walls.zwidth import Map
from .shortcuts import REFERENCE, Shortcut, shortcuts
from .trade import Point, Trade

METHODS = "adjusted", "fdm-500"
GRID = {
    "zwidth.damping_from_n_s_per_m": 10.0,
    "zwidth.damping_to_n_s_per_m": 70.0,
    "zwidth.damping_step_n_s_per_m": 15.0,
}
"""Few B, for there are many maps: those at which both estimators have an edge on the paper's device with its drive."""
AROUND = 0.7, 0.85, 0.95, 1 / 0.95, 1 / 0.85, 1 / 0.7
"""Walls whose verdicts are compared, as multiples of the reference's edge."""
ROUNDS = 3
RTL_WALLS = 2
"""On which the hardware is timed, once, for each estimator: a hit takes seconds."""

Wall = tuple[float, float]
"""K (N/m) and B (N s/m)."""


class Runs(Protocol):
    """What runs a study's hits, and shows how far it is."""

    def maps(self, backend: str, cases: list[Case]) -> list[Map]:
        """Return the map of each case."""

    def verdicts(self, jobs: list[dict]) -> list[dict]:
        """Return the results of jobs for `zwidth.verdict`."""

    def medians(self, contestants: dict[Hashable, Callable[[], float]], rounds: int) -> dict[Hashable, float]:
        """Return the median over the rounds of what each gives, taken in turns: `bench.medians`."""


class _Cases:
    """What is run, and against what, as cases of a scene."""

    def __init__(self, name: str, changes: dict[str, Any]):
        self._name, self._text, self._changes = name, read(name), GRID | changes
        self.scene = load(name, self._changes)
        self._grid = grid_of(self.scene)
        self.curves = [replace(methods.methods(self.scene)[method], label=method) for method in METHODS]
        self.shortcuts = shortcuts(self.scene, self._differs)
        self.computed = [each for each in self.shortcuts if each.backend != "rtl"]
        self.hardware = [each for each in self.shortcuts if each.backend == "rtl"]

    def _differs(self, shortcut: Shortcut) -> bool:
        """Whether a shortcut is a scene, and not the reference's."""
        try:
            scenes = [(self.of(shortcut, curve).parsed, self.of(REFERENCE, curve).parsed) for curve in self.curves]
        except SceneError:
            return False
        same_hits = shortcut.backend == REFERENCE.backend and shortcut.coarser == 1
        return not same_hits or any(one != other for one, other in scenes)

    def of(self, shortcut: Shortcut, curve: methods.Curve) -> Case:
        """Return the map of a shortcut."""
        changes = self._changes | curve.changes | shortcut.changes
        if shortcut.coarser > 1:
            changes["zwidth.stiffness_step_n_per_m"] = shortcut.coarser * self._grid.stiffness_step_n_per_m
        return Case(curve.label, self._name, self._text, changes)

    def model_of(self, shortcut: Shortcut) -> Shortcut:
        """Return what has the verdicts of a shortcut: itself, or of hardware its model."""
        if shortcut.backend != "rtl":
            return shortcut
        return next(each for each in self.computed if (each.backend, each.changes) == ("fixed", shortcut.changes))

    def around(self, edge: dict[float, float]) -> list[list[Wall]]:
        """Return the walls around an edge, by B."""
        step, walls = self._grid.stiffness_step_n_per_m, []
        for damping, stiffness in edge.items():
            rows = (min(max(round(times * (stiffness / step + 0.5)), 1), self._grid.rows) for times in AROUND)
            walls.append([(row * step, damping) for row in dict.fromkeys(rows)])
        return walls

    def run(self, shortcut: Shortcut, curve: methods.Curve, wall: Wall) -> hit.Hit:
        """Hit a wall."""
        at = {"wall.stiffness_n_per_m": wall[0], "wall.damping_n_s_per_m": wall[1]}
        scene = parse(self._name, self._text, self.of(shortcut, curve).changes | at)
        return hit.run(scene, shortcut.backend, until_sure=True)


def _edge(of: Map) -> dict[float, float]:
    """Return the largest stable K by B, where there is one."""
    return {edge.damping_n_s_per_m: edge.stable_n_per_m for edge in of.edges if edge.stable_n_per_m}


def _what(shortcut: Shortcut) -> str:
    """Return what a shortcut's hits are: two that differ in the map's steps alone have the same."""
    return json.dumps([shortcut.backend, shortcut.changes], sort_keys=True)


def study(name: str, changes: dict[str, Any], runs: Runs) -> Trade:
    """Return the trade of a scene.

    Args:
        name: of the scene, or its file.
        changes: of it, by dotted key.
        runs: what runs the hits.

    Raises:
        SceneError: if the scene cannot be, or has no section `zwidth`.
        RuntimeError: if none of its walls is stable, or the hardware's force words are not those of `fixed`.
    """
    cases = _Cases(name, changes)
    maps = _maps(cases, runs)
    edges = {curve.label: _edge(maps[REFERENCE.label, curve.label]) for curve in cases.curves}
    for label, edge in edges.items():
        if not edge:
            raise RuntimeError(f"{cases.scene.name}: with {label} no wall of the map is stable: nothing to compare at")
    around = {label: cases.around(edge) for label, edge in edges.items()}
    verdicts = _verdicts(cases, around, runs)
    # One wall of each B, each at another distance from the edge.
    timed = {label: [at[n % len(at)] for n, at in enumerate(walls)] for label, walls in around.items()}
    seconds = _seconds(cases, timed, runs)
    points = []
    for shortcut in cases.shortcuts:
        model, hits, differ, errors, hit_s, map_s = cases.model_of(shortcut), 0, {}, {}, [], 0.0
        for label, edge in edges.items():
            one, truth = maps[model.label, label], verdicts[_what(REFERENCE), label]
            pairs = zip(verdicts[_what(model), label], truth, strict=True)
            differ[label] = statistics.mean(float(here != there) for here, there in pairs)
            found = _edge(one)
            errors[label] = [abs(found.get(damping, 0.0) / wanted - 1) for damping, wanted in edge.items()]
            hit_s.append(seconds[_what(shortcut), label])
            hits += one.hits
            map_s += one.hits * hit_s[-1]
        points.append(Point(shortcut, statistics.mean(hit_s), hits, map_s, differ, errors))
    checked = len(cases.hardware) * sum(len(walls[:RTL_WALLS]) for walls in timed.values())
    return Trade(cases.scene, points, {label: sum(map(len, walls)) for label, walls in around.items()}, checked)


def _maps(cases: _Cases, runs: Runs) -> dict[tuple[str, str], Map]:
    """Return the maps by the labels of shortcut and estimator."""
    maps = {}
    for backend in dict.fromkeys(each.backend for each in cases.computed):
        keys = [(each, curve) for each in cases.computed if each.backend == backend for curve in cases.curves]
        found = runs.maps(backend, [cases.of(*key) for key in keys])
        maps |= {(each.label, curve.label): one for (each, curve), one in zip(keys, found, strict=True)}
    return maps


def _verdicts(cases: _Cases, around: dict[str, list[list[Wall]]], runs: Runs) -> dict[tuple[str, str], list[bool]]:
    """Return whether each wall is stable, by what is run and the estimator's label."""
    keys = {
        (_what(each), curve.label): cases.of(each, curve).job(each.backend)
        for each in cases.computed
        if each.coarser == 1
        for curve in cases.curves
    }
    jobs = [
        job | {"stiffness": stiffness, "damping": damping}
        for (_, label), job in keys.items()
        for walls in around[label]
        for stiffness, damping in walls
    ]
    results = iter(runs.verdicts(jobs))
    return {key: [next(results)["stable"] for walls in around[key[1]] for _ in walls] for key in keys}


def _seconds(cases: _Cases, timed: dict[str, list[Wall]], runs: Runs) -> dict[tuple[str, str], float]:
    """Return the time of a hit, the mean over the walls, by what is run and the estimator's label."""

    def contestants(shortcuts: list[Shortcut], walls: int | None, seconds_of: Callable[..., float]) -> dict:
        return {
            (_what(each), curve.label, wall): partial(seconds_of, each, curve, wall)
            for each in shortcuts
            for curve in cases.curves
            for wall in timed[curve.label][:walls]
        }

    def model(*which: Any) -> float:
        return cases.run(*which).seconds

    def hardware(shortcut: Shortcut, *which: Any) -> float:
        result, words = cases.run(shortcut, *which), cases.run(cases.model_of(shortcut), *which).force_sha256
        if result.force_sha256 != words:
            raise RuntimeError(f"the RTL and the model differ in their force words: {shortcut.label}, {which}")
        return result.seconds

    found = runs.medians(contestants(cases.computed, None, model), ROUNDS)
    found |= runs.medians(contestants(cases.hardware, RTL_WALLS, hardware), 1)
    means: dict[tuple[str, str], list[float]] = {}
    for (what, label, _), seconds in found.items():
        means.setdefault((what, label), []).append(seconds)
    return {key: statistics.mean(each) for key, each in means.items()}
