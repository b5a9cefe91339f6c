"""Z-width of several methods on one scene: their maps side by side, and the facts of the paper's Figure 5."""

import csv
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ...model.runtime.result import Table, table_of
from ...model.runtime.whole_file import whole_file
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls import theory, worst_variant
from ..walls.boundary import UNDECIDED
from ..walls.coupled_theory import loop_of
from ..walls.figure_5 import Fact, with_shares
from ..walls.grid import grid_of
from ..walls.likelihood import Wall
from ..walls.mapping import Effort, Mapper
from ..walls.methods import Curve, methods
from ..walls.starts import start
from ..walls.zwidth import Map

WORST = "worst hand, at B"
WORST_SAYS = f"{WORST}: with which the fewest hits are stable of the walls on both sides of the edge"


@dataclass(frozen=True)
class ZWidth:
    """The result of the study.

    Attributes:
        scene: the scene, with its handle and rates.
        maps: the maps of the methods.
        facts: the facts of the paper's Figure 5, where the methods are the paper's; else empty.
        effort: effort of the maps.
    """

    scene: Scene
    maps: list[Map]
    facts: list[Fact]
    effort: Effort

    @cached_property
    def linear_limits(self) -> list[list[float] | None]:
        """The linear loop's limit (N/m) at every B, for each map; None for an estimator that is not linear."""
        return [_linear_limits(each.case) for each in self.maps]

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        maps = {"maps": [each.report() for each in self.maps], "facts": [asdict(fact) for fact in self.facts]}
        return {"scene": self.scene.name} | self.effort._asdict() | maps

    def tables(self) -> list[Table]:
        """Return a table of the maps, and a table of the facts if there are any."""
        areas = ("area (kN/m N s/m)", "of starts", "held", "in place")
        words = ("method", WORST) if any(each.variants for each in self.maps) else ("method",)
        rows = [
            [
                *(each.case.label, worst_variant.told(each.variants, each.boundary))[: len(words)],
                area_text(each),
                interval_text(each),
                "" if each.area_held is None else f"{each.area_held / 1e3:.0f}",
                f"{each.area_in_place / 1e3:.0f}",
                f"{each.largest_n_per_m / 1e3:.3g}" + "+" * each.clipped,
                f"{each.damping_n_s_per_m:g}" + "+" * (each.boundary[-1].stable_n_per_m > 0),
                str(len(each.islands)),
                str(sum(wall.number_of(UNDECIDED) for wall in each.walls)),
                str(each.hits),
                f"{each.seconds:.1f}",
            ]
            for each in self.maps
        ]
        numbers = (*areas, "largest K (kN/m)", "to B (N s/m)", "islands", "undecided", "hits", "s")
        tables = [table_of(words, numbers, rows)]
        if self.facts:
            lines = [[fact.text, _held(fact), fact.numbers] for fact in self.facts]
            tables.append(table_of(("the paper's Figure 5", "here, and in draws of the starts", "numbers"), (), lines))
        return tables

    def notes(self) -> list[str]:
        """Return the meaning of the columns."""
        return [
            "area: under the K at which a hit is as likely stable as not, at every B",
            f"of starts: between which it is in 95 of 100 draws of the {self.maps[0].starts} starts; the steps of the "
            "map come on top",
            "held: that area, times the share of the hits below the edge that are stable too",
            "in place: that area without each B whose stiffest stable wall holds the handle elsewhere than its spring "
            "alone would",
            "to B: the largest B with a stable wall",
            "islands: walls that were hit on the wrong side of the edge",
            "undecided: hits that still settled when their time was over; the lower end takes them for unstable",
            *plus_of_areas(self.maps),
            *([WORST_SAYS] if any(each.variants for each in self.maps) else []),
        ]

    def save(self, path: Path) -> None:
        """Write every hit as a line of a .csv, with units in the names of the columns.

        Raises:
            OSError: if the file cannot be written.
        """
        with whole_file(path) as part, part.open("w", newline="") as file:
            writer = csv.writer(file)
            keys = ("verdict", "in_place", "rms_mm", "offset_mm", "drift_mm_per_s", "run_s")
            names = ("label", "damping_n_s_per_m", "stiffness_n_per_m", "start", "start_counts", "start_periods")
            writer.writerow((*names, *keys))
            for label, wall, number, hit in self._hits():
                place = label, wall.damping_n_s_per_m, wall.stiffness_n_per_m, number, *start(number)
                writer.writerow((*place, *(hit[key] for key in keys)))

    def _hits(self) -> Iterator[tuple[str, Wall, int, dict]]:
        """Yield every hit once, with the label of its case, its wall and the number of its start. The hits of a worst
        case belong to its variants, whose own maps may have them already."""
        seen = set()
        for each in self.maps:
            labels = {name: case.label for name, case in each.case.variants.items()}
            for name, walls in (each.variants or dict.fromkeys(labels, each.walls)).items():
                for wall in walls:
                    for number, hit in sorted(wall.hits.items()):
                        place = labels[name], wall.damping_n_s_per_m, wall.stiffness_n_per_m, number
                        if place not in seen:
                            seen.add(place)
                            yield labels[name], wall, number, hit


def study(case: Case, curves: list[Curve] | None, hands: list[str] | None, mapper: Mapper) -> ZWidth:
    """Return the maps of a scene.

    Args:
        case: the scene.
        curves: the methods; None for the methods of the paper's Figure 5.
        hands: the hands on the handle, by name: one map each, and one more of the worst of several. None: the scene's
            hand.
        mapper: function that makes the maps.

    Raises:
        SceneError: if the scene is not valid with one of the methods, or has no section `zwidth`.
    """
    scene = case.scene
    papers = methods(scene)
    cases = [case.changed(curve.changes, curve.label) for curve in (papers.values() if curves is None else curves)]
    if hands is not None:
        cases = [held for each in cases for held in worst_variant.cases_of(each, hands)]
    maps = mapper(f"{scene.name} Z-width", cases)
    shown = with_shares(dict(zip(papers, maps, strict=True))) if curves is None and hands is None else []
    return ZWidth(scene, maps, shown, mapper.effort())


def _held(fact: Fact) -> str:
    """Return whether a fact is held, and in which part of the draws of the starts it is."""
    return ("held" if fact.held else "not held") + ("" if fact.share is None else f", {fact.share:.0%}")


def _linear_limits(case: Case) -> list[float] | None:
    if case.scene.controller.estimator not in theory.LINEAR:
        return None
    loops = [loop_of(each.scene) for each in case.variants.values()]
    dampings = grid_of(case.scene).dampings
    return [min(theory.linear_limit_n_per_m(loop, damping) for loop in loops) for damping in dampings]


def area_text(each: Map) -> str:
    """Return the area of a map as text, in kN/m N s/m, with a + where the region leaves the map."""
    return f"{each.area / 1e3:.0f}" + "+" * each.leaves


def interval_text(each: Map) -> str:
    """Return the interval of a map's area as text, in kN/m N s/m."""
    return "{:.0f} to {:.0f}".format(*(end / 1e3 for end in each.area_interval))


def plus_of_areas(maps: Iterable[Map]) -> list[str]:
    """Return the meaning of the + of `area_text` as a list of notes, empty if no map has it."""
    return ["+: the region goes on beyond the map"] if any(each.leaves for each in maps) else []
