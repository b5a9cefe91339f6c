"""Speed against accuracy: what every setting of a simulation costs, and how far it moves the edge of stable walls."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

from ...model.runtime.result import Table, table_of
from ..scene.schema import Scene
from ..walls.edge_shift import Move
from .shortcuts import Shortcut


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
        """Return the points for which no other map is as fast and as surely right for an estimator."""
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
            for label, move in point.moves.items():
                star = "* " * (point in fronts[label])
                far = f"{move.stiffness:+.0%}" if math.isfinite(move.stiffness) else "new"
                moved = f"{far} at {move.dampings}" if move.dampings else ""
                row += [f"{star}{area_text(move)}{'!' * move.moved}", moved]
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
    """Return the points for which no other is as good in both, by rising cost and falling error."""
    front: list[Point] = []
    for point in sorted(points, key=lambda point: (cost(point), error(point))):
        if not front or error(point) < error(front[-1]):
            front.append(point)
    return front
