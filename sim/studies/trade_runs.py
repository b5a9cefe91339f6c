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
import time
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from typing import Protocol

from ..jobs.store import sources
from ..scene.case import Case
from ..scene.errors import SceneError
from ..walls import hit
from ..walls.grid import grid_of
from ..walls.methods import Curve, methods
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
        """Return the median over the rounds of what each gives, taken in turns: `rounds.medians`."""


class _Contest:
    """A scene, the shortcuts that it has, and the estimators that they are tried with.

    Attributes:
        scene: with the grid of the maps.
        curves: the estimators, labelled as on the command line.
        shortcuts: all of them; `computed` are those of a model, `hardware` those of the RTL.
    """

    def __init__(self, case: Case):
        self._case = case.with_defaults(GRID)
        self.scene = self._case.scene
        self._grid = grid_of(self.scene)
        self.curves = [replace(methods(self.scene)[method], label=method) for method in METHODS]
        self.shortcuts = shortcuts(self.scene, self._differs)
        self.computed = [each for each in self.shortcuts if each.backend != "rtl"]
        self.hardware = [each for each in self.shortcuts if each.backend == "rtl"]

    def _differs(self, shortcut: Shortcut) -> bool:
        """Whether a shortcut is a scene, and not the reference's."""
        try:
            own, reference = (
                [self.case_of(each, curve).scene for curve in self.curves] for each in (shortcut, REFERENCE)
            )
        except SceneError:
            return False
        return own != reference or shortcut.backend != REFERENCE.backend or shortcut.coarser > 1

    def case_of(self, shortcut: Shortcut, curve: Curve) -> Case:
        """Return what a shortcut makes of the scene with an estimator."""
        changes = curve.changes | shortcut.changes
        if shortcut.coarser > 1:
            changes["zwidth.stiffness_step_n_per_m"] = shortcut.coarser * self._grid.stiffness_step_n_per_m
        return self._case.changed(changes, curve.label)

    def model_of(self, shortcut: Shortcut) -> Shortcut:
        """Return the shortcut whose verdicts one has: its own, or those of the hardware's model."""
        if shortcut.backend != "rtl":
            return shortcut
        return next(each for each in self.computed if (each.backend, each.changes) == ("fixed", shortcut.changes))

    def walls_around(self, edge: dict[float, float]) -> list[list[Wall]]:
        """Return the walls around an edge, by B."""
        step, walls = self._grid.stiffness_step_n_per_m, []
        for damping, stiffness in edge.items():
            rows = (min(max(round(times * (stiffness / step + 0.5)), 1), self._grid.rows) for times in AROUND)
            walls.append([(row * step, damping) for row in dict.fromkeys(rows)])
        return walls

    def hit(self, shortcut: Shortcut, curve: Curve, wall: Wall) -> hit.Hit:
        """Hit a wall."""
        return hit.run(self.case_of(shortcut, curve).hitting(*wall), shortcut.backend, until_sure=True)


def _edge(of: Map) -> dict[float, float]:
    """Return the largest stable K by B, where there is one."""
    return {edge.damping_n_s_per_m: edge.stable_n_per_m for edge in of.edges if edge.stable_n_per_m}


def _hits_of(shortcut: Shortcut) -> str:
    """Return a name for the hits of a shortcut: two that differ in the map's steps alone have the same."""
    return json.dumps([shortcut.backend, shortcut.changes], sort_keys=True)


def study(case: Case, runs: Runs) -> Trade:
    """Return the trade of a scene.

    Args:
        case: the scene.
        runs: what runs the hits.

    Raises:
        SceneError: if the scene cannot be, or has no section `zwidth`.
        RuntimeError: if none of its walls is stable, or the hardware's force words are not those of `fixed`.
    """
    began, contest = time.perf_counter(), _Contest(case)
    maps = _maps(contest, runs)
    edges = {curve.label: _edge(maps[REFERENCE.label, curve.label]) for curve in contest.curves}
    for label, edge in edges.items():
        if not edge:
            raise RuntimeError(
                f"{contest.scene.name}: with {label} no wall of the map is stable: nothing to compare at"
            )
    around = {label: contest.walls_around(edge) for label, edge in edges.items()}
    verdicts = _verdicts(contest, around, runs)
    # One wall of each B, each at another distance from the edge.
    timed = {label: [at[n % len(at)] for n, at in enumerate(walls)] for label, walls in around.items()}
    seconds = _seconds(contest, timed, runs)
    points = []
    for shortcut in contest.shortcuts:
        model, hits = contest.model_of(shortcut), _hits_of(shortcut)
        own = {label: maps[model.label, label] for label in edges}
        hit_s = {label: seconds[hits, label] for label in edges}
        point = Point(
            shortcut,
            hit_s=statistics.mean(hit_s.values()),
            hits=sum(each.hits for each in own.values()),
            map_s=sum(each.hits * hit_s[label] for label, each in own.items()),
            differ={
                label: _share_that_differs(verdicts[_hits_of(model), label], verdicts[_hits_of(REFERENCE), label])
                for label in edges
            },
            errors={label: _errors(_edge(own[label]), edge) for label, edge in edges.items()},
        )
        points.append(point)
    checked = len(contest.hardware) * sum(len(walls[:RTL_WALLS]) for walls in timed.values())
    walls = {label: sum(map(len, walls)) for label, walls in around.items()}
    return Trade(contest.scene, points, walls, checked, time.perf_counter() - began)


def _share_that_differs(verdicts: list[bool], truth: list[bool]) -> float:
    return statistics.mean(float(here != there) for here, there in zip(verdicts, truth, strict=True))


def _errors(edge: dict[float, float], truth: dict[float, float]) -> list[float]:
    """Return the relative errors of K at each B where the true edge is; a region that has ended there is wrong by 1."""
    return [abs(edge.get(damping, 0.0) / stiffness - 1) for damping, stiffness in truth.items()]


def _maps(contest: _Contest, runs: Runs) -> dict[tuple[str, str], Map]:
    """Return the maps by the labels of shortcut and estimator."""
    maps = {}
    for backend in dict.fromkeys(each.backend for each in contest.computed):
        keys = [(each, curve) for each in contest.computed if each.backend == backend for curve in contest.curves]
        found = runs.maps(backend, [contest.case_of(*key) for key in keys])
        maps |= {(each.label, curve.label): one for (each, curve), one in zip(keys, found, strict=True)}
    return maps


def _verdicts(contest: _Contest, around: dict[str, list[list[Wall]]], runs: Runs) -> dict[tuple[str, str], list[bool]]:
    """Return whether each wall is stable, by `_hits_of` a shortcut and the estimator's label."""
    common = {"sources": sources()}
    cases = {
        (_hits_of(each), curve.label): contest.case_of(each, curve).job() | common | {"backend": each.backend}
        for each in contest.computed
        if each.coarser == 1
        for curve in contest.curves
    }
    jobs = [
        job | {"stiffness": stiffness, "damping": damping}
        for (_, label), job in cases.items()
        for walls in around[label]
        for stiffness, damping in walls
    ]
    results = iter(runs.verdicts(jobs))
    return {key: [next(results)["stable"] for walls in around[key[1]] for _ in walls] for key in cases}


def _seconds(contest: _Contest, timed: dict[str, list[Wall]], runs: Runs) -> dict[tuple[str, str], float]:
    """Return the time of a hit, the mean over the walls, by `_hits_of` a shortcut and the estimator's label."""

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
        result, same = (contest.hit(each, curve, wall) for each in (shortcut, contest.model_of(shortcut)))
        if result.force_sha256 != same.force_sha256:
            where = f"{shortcut.label}, {curve.label}, K {wall[0]:g}, B {wall[1]:g}"
            raise RuntimeError(f"the RTL and the model differ in their force words: {where}")
        return result.seconds

    found = runs.medians(contestants(contest.computed, None, model), ROUNDS)
    found |= runs.medians(contestants(contest.hardware, RTL_WALLS, hardware), 1)
    means: dict[tuple[str, str], list[float]] = {}
    for (hits, label, _), seconds in found.items():
        means.setdefault((hits, label), []).append(seconds)
    return {key: statistics.mean(each) for key, each in means.items()}
