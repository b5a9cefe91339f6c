"""A full search of Levant's gains: area of the stable region over lambda and alpha, for both outputs.

The gains are spaced in equal ratios around the founding paper's: lambda = sqrt(C) and alpha = 1.1 C, with C the bound
on the acceleration. Pairs without derivable words are left out. The areas lie on narrow ridges, along which lambda^2 /
alpha is constant, and the grid passes between their tops. So the highest hills of the grid are climbed, in steps that
are halved. The paper's two pairs and the best pairs of all are then mapped again in finer steps of the walls: the best
of hundreds of coarse maps owes some of its area to chance.

The sufficient condition for convergence is alpha > C and lambda^2 >= 4 C (alpha + C) / (alpha - C).

An area may mislead. At rest u chatters, with a period of two samples if the gains are large. A force that is updated
once in an even number of samples always sees the same side of the chatter. This is a false velocity: its force holds
the handle still, but in the wrong position. So every pair has two areas: of the stable walls, as in the paper, and of
the stable walls whose handle is also in place (`hit.Hit.in_place`).

Nor is being in place enough. With lambda^2 = 2 alpha the cycle has four samples, and every second value of u is exactly
0. A force that is updated once in an even number of samples may see nothing else. With one sample a force more it sees
the whole cycle. So the pairs with a name are mapped with that, too.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter

from ...model.estimators.levant import Design, Gains
from ...model.runtime.result import Table, table_of
from ..scene.case import Case, accepted
from ..scene.errors import SceneError
from ..scene.schema import Scene
from ..walls.boundary import Grid
from ..walls.chatter import force_every
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
HILLS = 3
"""The number of hills that are climbed for each output: the highest, by the area in place."""
HALVINGS = 3
"""How often the steps of a climb are halved; the first are half of the grid's."""
COARSER, FINER = 4.0, 2.0
"""The steps of the search's maps and of the final maps, as multiples of the scene's steps."""
PAPERS = ("proposed", "adjusted")
Pair = tuple[str, Gains]
"""An output and gains."""
Areas = dict[Pair, Map]


@dataclass(frozen=True)
class Pick:
    """Gains with a name, and their map in finer steps.

    Attributes:
        gains: the gains.
        map: their map.
        shifted: the same with one sample a force more; None if these gains have no words for that rate.
    """

    gains: Gains
    map: Map
    shifted: Map | None


@dataclass(frozen=True)
class Search:
    """The result of the search.

    Attributes:
        scene: the scene as it was searched.
        lambdas, alphas: the gains that were tried, ascending, m^(1/2)/s and m/s^2.
        maps: maps of the grid, in coarse steps, by output and gains; gains without derivable words are left out.
        between: maps with gains between the grid's, likewise.
        picks: the paper's gains and the best gains, by output and name.
        effort: effort of the maps.
    """

    scene: Scene
    lambdas: np.ndarray
    alphas: np.ndarray
    maps: dict[str, dict[Gains, Map]]
    between: dict[str, dict[Gains, Map]]
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

    def areas_between(self, output: str, in_place: bool) -> np.ndarray:
        """Return the gains between the grid's with their areas, shape (pairs, 3): lambda, alpha and N^2 s/m^2."""
        rows = [
            (gains.lambda_sqrt_m_per_s, gains.alpha_m_per_s2, _area(a_map, in_place))
            for gains, a_map in self.between[output].items()
        ]
        return np.array(rows).reshape(-1, 3)

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
                "area_in_place_with_a_sample_more_n2_s_per_m2": pick.shifted and pick.shifted.area_in_place,
                **pick.map.report(),
            }
            for name, pick in self.picks[output].items()
        }
        between = [
            {**asdict(gains), "area_n2_s_per_m2": each.area, "area_in_place_n2_s_per_m2": each.area_in_place}
            for gains, each in self.between[output].items()
        ]
        return {
            "area_n2_s_per_m2": rows(False),
            "area_in_place_n2_s_per_m2": rows(True),
            "between": between,
            "picks": picks,
        }

    def _picks(self) -> list[tuple[str, str, Pick]]:
        return [(output, name, pick) for output, picks in self.picks.items() for name, pick in picks.items()]

    def tables(self) -> list[Table]:
        """Return the table of the gains that have a name."""
        numbers = (
            *("lambda (m^.5/s)", "alpha (m/s^2)", "area (kN/m N s/m)", "of the paper's", "in place"),
            f"in place, {self.scene.spec.samples_per_actuation + 1} samples a force",
        )
        rows = []
        for output, name, pick in self._picks():
            multiple = self.of_papers(pick)
            pair = f"{pick.gains.lambda_sqrt_m_per_s:.4g}", f"{pick.gains.alpha_m_per_s2:.4g}"
            times = "" if multiple is None else f"{multiple:.2f}"
            in_place = (f"{each.area_in_place / 1e3:.0f}" if each else "" for each in (pick.map, pick.shifted))
            rows.append([output, name, *pair, area_text(pick.map), times, *in_place])
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

    def maps(title: str, steps: dict[str, Any], wanted: list[Pair]) -> Areas:
        cases = {}
        for output, gains in wanted:
            levant = {"controller.estimator": "levant", "controller.output": output}
            levant["controller.gains.levant"] = asdict(gains)
            label = f"{output}, lambda {gains.lambda_sqrt_m_per_s:.4g}, alpha {gains.alpha_m_per_s2:.4g}"
            cases[output, gains] = case.changed(steps | levant, label)
        possible = accepted(cases)
        return dict(zip(possible, mapper(title, list(possible.values())), strict=True))

    coarse, fine = (wider_grid(plain, coarser) for coarser in (COARSER, FINER))
    grid = maps("search of gains", coarse, [(output, gains) for output in Design.outputs for gains in tried])
    climbed = _climbed(grid, lambdas, alphas, lambda title, wanted: maps(title, coarse, wanted))
    of_grid, between = _by_output(grid), _by_output(climbed)
    chosen = {output: papers | _best(of_grid[output] | between[output], bound) for output in Design.outputs}
    pairs = dict.fromkeys((output, gains) for output in Design.outputs for gains in chosen[output].values())
    finer = maps("the best again, in finer steps", fine, list(pairs))
    shift = force_every(plain, plain.spec.samples_per_actuation + 1)
    shifted: Areas = {}
    with suppress(SceneError):  # that rate may leave the scene's axis too few clocks
        shifted = maps("and with one sample a force more", fine | shift, list(finer))
    picks = {
        output: {
            name: Pick(gains, finer[output, gains], shifted.get((output, gains)))
            for name, gains in named.items()
            if (output, gains) in finer
        }
        for output, named in chosen.items()
    }
    scene = next(iter(finer.values())).case.scene
    return Search(scene, lambdas, alphas, of_grid, between, picks, mapper.effort())


def _climbed(grid: Areas, lambdas: np.ndarray, alphas: np.ndarray, maps: Callable[[str, list[Pair]], Areas]) -> Areas:
    """Return the maps on the way to the tops of the highest hills of both outputs; `maps` makes them, by a title."""
    every = dict(grid)
    tops = [(output, top) for output in Design.outputs for top in _hills(grid, output, lambdas, alphas)]
    for halving in range(1, HALVINGS + 1):
        steps = [float(values[1] / values[0]) ** 0.5**halving for values in (lambdas, alphas)]
        around = [[(output, gains) for gains in (top, *_beside(top, *steps))] for output, top in tops]
        new = dict.fromkeys(pair for pairs in around for pair in pairs if pair not in every)
        if new:
            every |= maps(f"the highest hills, {halving} of {HALVINGS}", list(new))
        tops = [
            max((pair for pair in pairs if pair in every), key=lambda pair: every[pair].area_in_place)
            for pairs in around
        ]
    return {pair: each for pair, each in every.items() if pair not in grid}


def _by_output(areas: Areas) -> dict[str, dict[Gains, Map]]:
    return {out: {gains: each for (of, gains), each in areas.items() if of == out} for out in Design.outputs}


def _hills(grid: Areas, output: str, lambdas: np.ndarray, alphas: np.ndarray) -> list[Gains]:
    """Return the gains of the highest hills of an output, by the area in place: none beside them has more."""
    pairs = [Gains(lam, alpha) for lam, alpha in product(lambdas.tolist(), alphas.tolist())]
    areas = [grid[output, gains].area_in_place if (output, gains) in grid else 0.0 for gains in pairs]
    ground = np.array(areas).reshape(len(lambdas), len(alphas))
    tops = ((ground > 0) & (ground == maximum_filter(ground, 3))).ravel()
    highest = sorted(np.flatnonzero(tops).tolist(), key=lambda place: -areas[place])
    return [pairs[place] for place in highest[:HILLS]]


def _beside(top: Gains, lambda_step: float, alpha_step: float) -> list[Gains]:
    """Return the eight pairs about a pair of gains, a step away in either gain or in both."""
    return [
        Gains(top.lambda_sqrt_m_per_s * lambda_step**east, top.alpha_m_per_s2 * alpha_step**north)
        for east, north in product((-1, 0, 1), repeat=2)
        if east or north
    ]


def _area(each: Map, in_place: bool) -> float:
    return each.area_in_place if in_place else each.area


def _best(found: dict[Gains, Map], bound_m_per_s2: float) -> dict[str, Gains]:
    """Return the gains with the largest areas: of all, within the condition, and in place."""
    sure = [gains for gains in found if converges(gains, bound_m_per_s2)]
    best = {"best": max(found, key=lambda gains: found[gains].area)}
    if sure:
        best["best within the condition"] = max(sure, key=lambda gains: found[gains].area)
    return best | {"best in place": max(found, key=lambda gains: found[gains].area_in_place)}
