"""Speed against accuracy: the cost and the error of every shortcut of a simulation, and the best for every purpose."""

import math
import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any, NamedTuple

from ..jobs.result import Table, table_of
from ..scene.schema import Scene
from .shortcuts import SCATTER, Shortcut


@dataclass(frozen=True)
class Point:
    """The cost and the error of a shortcut.

    Attributes:
        shortcut: the shortcut.
        hit_s: time of a hit, the mean over the estimators.
        hits: number of hits in the maps of all estimators.
        map_s: time of these maps, in one process.
        differ: by estimator, the share of the walls whose verdict differs from the reference's.
        errors: by estimator, the errors of K at the edge at every B, relative to the reference's K.
    """

    shortcut: Shortcut
    hit_s: float
    hits: int
    map_s: float
    differ: dict[str, float]
    errors: dict[str, list[float]]

    def of_stiffness(self, label: str) -> dict[str, float]:
        """Return the `median` and the `largest` error of K for an estimator."""
        return {"median": statistics.median(self.errors[label]), "largest": max(self.errors[label])}

    def report(self) -> dict[str, Any]:
        """Return the point as the command line prints it."""
        ends = {label: self.of_stiffness(label) for label in self.errors}
        keys = {"hit_s": self.hit_s, "map_hits": self.hits, "map_s": self.map_s}
        return asdict(self.shortcut) | keys | {"verdicts_that_differ": self.differ, "stiffness_error": ends}


class Question(NamedTuple):
    """A purpose of a simulation, with its cost (s) and its error for an estimator."""

    name: str
    cost_s: Callable[[Point], float]
    error: Callable[[Point, str], float]


HIT = Question("hit", lambda point: point.hit_s, lambda point, label: point.differ[label])
MAP = Question("map", lambda point: point.map_s, lambda point, label: max(point.errors[label]))
QUESTIONS = HIT, MAP


@dataclass(frozen=True)
class Trade:
    """The result of the study.

    Attributes:
        scene: the scene, with the grid of the maps.
        points: the points, the reference first.
        walls: by estimator, the number of verdicts that were compared.
        words_checked: number of hits of the hardware, all with the force words of `fixed`.
        seconds: wall time of the study.
    """

    scene: Scene
    points: list[Point]
    walls: dict[str, int]
    words_checked: int
    seconds: float = 0.0

    def scatter(self, question: Question, label: str) -> float:
        """Return the larger error of the two changes too slight to be measured; a smaller error counts as none."""
        return max(question.error(point, label) for point in self.points if point.shortcut.axis == SCATTER)

    def best(self, question: Question, label: str) -> list[Point]:
        """Return the points for which no other is as fast and as accurate for an estimator, within the scatter."""
        none = self.scatter(question, label)
        return best(self.points, question.cost_s, lambda point: max(question.error(point, label), none))

    def report(self) -> dict[str, Any]:
        """Return the trade as the command line prints it."""
        marks = [{f"best_for_{question.name}s": [] for question in QUESTIONS} for _ in self.points]
        for question, label in product(QUESTIONS, self.walls):
            best_points = self.best(question, label)
            for point, mark in zip(self.points, marks, strict=True):
                mark[f"best_for_{question.name}s"] += [label] * (point in best_points)
        points = [point.report() | mark for point, mark in zip(self.points, marks, strict=True)]
        keys = {"scene": self.scene.name, "walls": self.walls, "rtl_hits_with_the_words_of_fixed": self.words_checked}
        return keys | {"settings": points, "seconds": self.seconds}

    def tables(self) -> list[Table]:
        """Return the costs and errors of the shortcuts: a table of hits' verdicts, and a table of maps' edges."""
        hits, maps = [], []
        for point in self.points:
            share = [f"{self._star(HIT, label, point)}{part:.0%}" for label, part in point.differ.items()]
            hits.append([point.shortcut.label, f"{point.hit_s * 1e3:.1f}", *share])
            ends = {label: "{median:.0%} to {largest:.0%}".format(**point.of_stiffness(label)) for label in self.walls}
            wrong = [f"{self._star(MAP, label, point)}{text}" for label, text in ends.items()]
            maps.append([point.shortcut.label, str(point.hits), f"{point.map_s:.1f}", *wrong])
        return [
            table_of(("setting",), ("hit (ms)", *(f"{label}: verdicts" for label in self.walls)), hits),
            table_of(("setting",), ("maps: hits", "s", *(f"{label}: K" for label in self.walls)), maps),
        ]

    def _star(self, question: Question, label: str, point: Point) -> str:
        return "* " * (point in self.best(question, label))

    def notes(self) -> list[str]:
        """Return the meaning of the columns."""
        walls = ", ".join(f"{count} walls with {label}" for label, count in self.walls.items())
        return [
            f"verdicts: how many differ, of {walls}. K: its error at the edge of the map, median to largest over B. "
            f"*: none faster is as right; what is within the scatter is right. "
            f"rtl: its verdicts are those of fixed, whose force words it had in {self.words_checked} hits"
        ]


def best(points: list[Point], cost: Callable[[Point], float], error: Callable[[Point], float]) -> list[Point]:
    """Return the points for which no other is as good in both, by rising cost and falling error."""
    front, least = [], math.inf
    for point in sorted(points, key=lambda point: (cost(point), error(point))):
        if error(point) < least:
            front.append(point)
            least = error(point)
    return front
