"""A full search of Levant's gains: area of the stable region over lambda and alpha, for both outputs.

The gains are spaced in equal ratios around the founding paper's: lambda = sqrt(C) and alpha = 1.1 C, with C the bound
on the acceleration. Pairs without derivable words are left out. The paper's two pairs and the best pairs of the search
are then mapped again in finer steps: the best of hundreds of coarse maps owes some of its area to chance.

The sufficient condition for convergence is alpha > C and lambda^2 >= 4 C (alpha + C) / (alpha - C).

An area may mislead. At rest u chatters, with a period of two samples if the gains are large. A force that is updated
once in an even number of samples always sees the same side of the chatter. This is a false velocity: its force holds
the handle still, but in the wrong position. So every pair has two areas: of the stable walls, as in the paper, and of
the stable walls whose handle is also in place (`hit.Hit.in_place`).
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...model.estimators.levant import Design, Gains
from ...model.runtime.result import Table, table_of
from ..scene.case import Case, accepted
from ..scene.schema import Scene
from ..walls.boundary import Grid
from ..walls.grid import grid_of, wider_grid
from ..walls.mapping import Effort, Mapper
from ..walls.methods import methods
from ..walls.zwidth import Map
from .lipschitz import least_alpha_m_per_s2
from .zwidth import area_text, plus_of_areas

LAMBDAS = np.geomspace(0.3, 100, 16)
"""The values of lambda, as multiples of sqrt(C)."""
ALPHAS = np.geomspace(0.03, 300, 17)
"""The values of alpha, as multiples of C."""
COARSER, FINER = 4.0, 2.0
"""The steps of the search's maps and of the final maps, as multiples of the scene's steps."""
PAPERS = ("proposed", "adjusted")


@dataclass(frozen=True)
class Pick:
    """Gains with a name, and their map in finer steps."""

    gains: Gains
    map: Map


@dataclass(frozen=True)
class Search:
    """The result of the search.

    Attributes:
        scene: the scene as it was searched.
        lambdas, alphas: the gains that were tried, ascending, m^(1/2)/s and m/s^2.
        maps: maps in coarse steps, by output and gains; gains without derivable words are left out.
        picks: the paper's gains and the best gains, by output and name.
        effort: effort of the maps.
    """

    scene: Scene
    lambdas: np.ndarray
    alphas: np.ndarray
    maps: dict[str, dict[Gains, Map]]
    picks: dict[str, dict[str, Pick]]
    effort: Effort

    @property
    def coarse_grid(self) -> Grid:
        """The grid of the search."""
        return grid_of(next(iter(self.maps["u"].values())).case.scene)

    @property
    def bound_m_per_s2(self) -> float:
        """The bound C on the acceleration."""
        return self.scene.controller.acceleration_max_m_per_s2

    def areas(self, output: str, in_place: bool) -> np.ndarray:
        """Return the areas (N^2 s/m^2) of an output, shape (alphas, lambdas); NaN where gains were refused."""
        maps = self.maps[output]
        rows = [[maps.get(Gains(lam, alpha)) for lam in self.lambdas.tolist()] for alpha in self.alphas.tolist()]
        return np.array([[_area(a_map, in_place) if a_map else np.nan for a_map in row] for row in rows])

    def at_edge(self, gains: Gains) -> bool:
        """Return whether gains are at the edge of the tried range: better gains may lie beyond."""
        ends = (self.lambdas[[0, -1]], gains.lambda_sqrt_m_per_s), (self.alphas[[0, -1]], gains.alpha_m_per_s2)
        return any(value in pair for pair, value in ends)

    def of_papers(self, pick: Pick) -> float | None:
        """Return an area as a ratio to the area of the paper's better pair with the paper's output, u; None if that
        area is 0."""
        papers = max((self.picks["u"][name].map.area for name in PAPERS if name in self.picks["u"]), default=0.0)
        return pick.map.area / papers if papers else None

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys; every row of areas has one alpha."""
        return {
            **self.effort._asdict(),
            "scene": self.scene.name,
            "c_m_per_s2": self.bound_m_per_s2,
            "lambda_sqrt_m_per_s": self.lambdas.tolist(),
            "alpha_m_per_s2": self.alphas.tolist(),
            "outputs": {output: self._report(output) for output in self.maps},
        }

    def _report(self, output: str) -> dict[str, Any]:
        def rows(in_place: bool) -> list[list[float | None]]:
            return [[None if np.isnan(area) else area for area in row] for row in self.areas(output, in_place).tolist()]

        picks = {
            name: {
                **asdict(pick.gains),
                "meets_the_condition": converges(pick.gains, self.bound_m_per_s2),
                "at_the_edge": self.at_edge(pick.gains),
                "of_papers_best": self.of_papers(pick),
                **pick.map.report(),
            }
            for name, pick in self.picks[output].items()
        }
        return {"area_n2_s_per_m2": rows(False), "area_in_place_n2_s_per_m2": rows(True), "picks": picks}

    def _picks(self) -> list[tuple[str, str, Pick]]:
        return [(output, name, pick) for output, picks in self.picks.items() for name, pick in picks.items()]

    def tables(self) -> list[Table]:
        """Return the table of the gains that have a name."""
        numbers = ("lambda (m^.5/s)", "alpha (m/s^2)", "area (kN/m N s/m)", "of the paper's", "in place")
        rows = []
        for output, name, pick in self._picks():
            multiple = self.of_papers(pick)
            pair = f"{pick.gains.lambda_sqrt_m_per_s:.4g}", f"{pick.gains.alpha_m_per_s2:.4g}"
            times = "" if multiple is None else f"{multiple:.2f}"
            rows.append([output, name, *pair, area_text(pick.map), times, f"{pick.map.area_in_place / 1e3:.0f}"])
        return [table_of(("output", "gains"), numbers, rows)]

    def notes(self) -> list[str]:
        """Return the gains at the edge of the tried range, and the meaning of a +."""
        return [
            f"{output}, {name}: at the edge of what was tried; better gains may lie beyond"
            for output, name, pick in self._picks()
            if self.at_edge(pick.gains)
        ] + plus_of_areas(pick.map for _, _, pick in self._picks())


def converges(gains: Gains, bound_m_per_s2: float) -> bool:
    """Return whether gains satisfy the sufficient condition for signals with a bound on the acceleration."""
    least = least_alpha_m_per_s2(gains.lambda_sqrt_m_per_s, bound_m_per_s2)
    return least is not None and gains.alpha_m_per_s2 >= least


def study(case: Case, mapper: Mapper) -> Search:
    """Return the areas of a scene over Levant's gains.

    Args:
        case: the scene.
        mapper: function that makes the maps.

    Raises:
        SceneError: if the scene is not valid, or is refused with all of the gains, or has no section `zwidth`.
    """
    plain = case.scene
    bound = plain.controller.acceleration_max_m_per_s2
    adjusted = Gains(**methods(plain)["adjusted"].gains)
    papers = dict(zip(PAPERS, (Gains.default(plain.controller), adjusted), strict=True))
    lambdas, alphas = LAMBDAS * np.sqrt(bound), ALPHAS * bound
    tried = [Gains(lam, alpha) for lam in lambdas.tolist() for alpha in alphas.tolist()]

    def maps(title: str, coarser: float, wanted: list[tuple[str, Gains]]) -> dict[tuple[str, Gains], Map]:
        cases = {}
        for output, gains in wanted:
            levant = {"controller.estimator": "levant", "controller.output": output}
            levant["controller.gains.levant"] = asdict(gains)
            label = f"{output}, lambda {gains.lambda_sqrt_m_per_s:.4g}, alpha {gains.alpha_m_per_s2:.4g}"
            cases[output, gains] = case.changed(wider_grid(plain, coarser) | levant, label)
        possible = accepted(cases)
        return dict(zip(possible, mapper(title, list(possible.values())), strict=True))

    coarse = maps("search of gains", COARSER, [(output, gains) for output in Design.outputs for gains in tried])
    by_output = {out: {gains: each for (of, gains), each in coarse.items() if of == out} for out in Design.outputs}
    chosen = {output: papers | _best(found, bound) for output, found in by_output.items()}
    pairs = dict.fromkeys((output, gains) for output in Design.outputs for gains in chosen[output].values())
    finer = maps("the best again, in finer steps", FINER, list(pairs))
    picks = {
        output: {name: Pick(gains, finer[output, gains]) for name, gains in named.items() if (output, gains) in finer}
        for output, named in chosen.items()
    }
    return Search(next(iter(finer.values())).case.scene, lambdas, alphas, by_output, picks, mapper.effort())


def _area(each: Map, in_place: bool) -> float:
    return each.area_in_place if in_place else each.area


def _best(found: dict[Gains, Map], bound_m_per_s2: float) -> dict[str, Gains]:
    """Return the gains with the largest areas: of all, within the condition, and in place."""
    sure = [gains for gains in found if converges(gains, bound_m_per_s2)]
    best = {"best": max(found, key=lambda gains: found[gains].area)}
    if sure:
        best["best within the condition"] = max(sure, key=lambda gains: found[gains].area)
    return best | {"best in place": max(found, key=lambda gains: found[gains].area_in_place)}
