"""The best cutoff of the filter behind a finite difference: area of the stable region against cutoff, by device.

The search begins with a sweep, which includes the founding paper's cutoffs; its maps are independent, so they run side
by side. Then bounded minimisation (SciPy: golden section and parabolas) of minus the area over the logarithm of the
cutoff searches between the neighbours of the sweep's best. The method needs no derivative, and the area has none: every
area is a sum of steps of the map. For the same reason the search ends early: cutoffs closer than `TOLERANCE` differ by
chance. The best cutoff is the best of all maps, including the sweep's.

The grid is wider and coarser than the scene's: see `_Cases`.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from ...model.estimators.butterworth import CUTOFF_MAX
from ...model.runtime.result import Table, table_of
from ..scene.case import Case, accepted
from ..scene.schema import Scene
from ..walls.grid import wider_grid
from ..walls.mapping import Effort, Mapper
from ..walls.zwidth import Map
from .zwidth import area_text, interval_text, plus_of_areas

SCENES = ("seed-2011", "desktop-arm", "maglev")
"""The paper's device, and two devices with another mass, friction, count and rates."""
PAPERS_HZ = (30.0, 100.0, 500.0, 1000.0)
SWEEP_HZ = (30, 40, 50, 70, 100, 140, 200, 300, 400, 500, 700, 1000, 1400, 2000, 2800, 4000)
COARSER = 2.0
"""The steps of the maps, as a multiple of the scene's steps."""
TOLERANCE = 0.03
EVALUATIONS = 10
LEVEL = 0.05
"""The share of the best area by which an area may be less and count as equally good."""


@dataclass(frozen=True)
class Optimum:
    """The best cutoff of one scene, and the areas that it was chosen from.

    Attributes:
        scene: the scene as it was mapped.
        maps: maps of the sweep and of the search, by cutoff in Hz, ascending.
        unfiltered: map of the finite difference alone.
    """

    scene: Scene
    maps: dict[float, Map]
    unfiltered: Map

    @cached_property
    def best_hz(self) -> float:
        """The cutoff with the largest region, the lowest of several equal ones."""
        return max(self.maps, key=lambda cutoff_hz: self.maps[cutoff_hz].area)

    @property
    def best(self) -> Map:
        """The map with the largest region behind a filter."""
        return self.maps[self.best_hz]

    @cached_property
    def level_hz(self) -> tuple[float, float]:
        """The range of equally good cutoffs around the best, limited to the mapped cutoffs.

        Between two maps the area is interpolated linearly over the logarithm of the cutoff. Where the starts do not
        tell a cutoff from the best, the range goes on to it.
        """
        cutoffs, areas = list(self.maps), [a_map.area for a_map in self.maps.values()]
        enough = (1 - LEVEL) * self.best.area

        def good(place: int) -> bool:
            times = self.maps[cutoffs[place]].times(self.best)
            return areas[place] >= enough or (times is not None and times[1] >= 1)

        def end(direction: int) -> float:
            inside = cutoffs.index(self.best_hz)
            while 0 <= (beyond := inside + direction) < len(areas) and good(beyond):
                inside = beyond
            if not 0 <= beyond < len(areas) or areas[inside] < enough:
                return cutoffs[inside]
            logs = np.log([cutoffs[beyond], cutoffs[inside]])
            return float(np.exp(np.interp(enough, [areas[beyond], areas[inside]], logs)))

        return end(-1), end(+1)

    @property
    def at_end(self) -> bool:
        """Whether the best cutoff is the first or the last, so that a better cutoff may lie beyond."""
        return self.best_hz in (next(iter(self.maps)), next(reversed(self.maps)))

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        return {
            "scene": self.scene.name,
            "best_cutoff_hz": self.best_hz,
            "best_area_n2_s_per_m2": self.best.area,
            "best_is_at_the_end": self.at_end,
            "best_leaves_the_map": self.best.leaves,
            "as_good_within": LEVEL,
            "as_good_from_hz": self.level_hz[0],
            "as_good_to_hz": self.level_hz[1],
            "unfiltered": self.unfiltered.report(),
            "maps": [{"cutoff_hz": cutoff_hz} | each.report() for cutoff_hz, each in self.maps.items()],
        }


@dataclass(frozen=True)
class Cutoffs:
    """The result of the study: the optimum of every device, and the effort of their maps."""

    optima: list[Optimum]
    effort: Effort

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        return self.effort._asdict() | {"devices": [each.report() for each in self.optima]}

    def tables(self) -> list[Table]:
        """Return the best cutoff of every device, and the areas at every cutoff."""
        numbers = ("best (Hz)", "its area (kN/m N s/m)", "of starts", "as good from (Hz)", "to (Hz)", "no filter: area")
        rows = []
        for each in self.optima:
            best = f"{each.best_hz:.0f}" + ", at the end" * each.at_end
            level = [f"{end:.0f}" for end in each.level_hz]
            rows.append(
                [
                    each.scene.name,
                    best,
                    area_text(each.best),
                    interval_text(each.best),
                    *level,
                    area_text(each.unfiltered),
                ]
            )
        cutoffs = sorted({cutoff_hz for each in self.optima for cutoff_hz in each.maps})
        areas = [
            [f"{cutoff:g}", *(area_text(each.maps[cutoff]) if cutoff in each.maps else "" for each in self.optima)]
            for cutoff in cutoffs
        ]
        columns = ("cutoff (Hz)", *(f"{each.scene.name}: area" for each in self.optima))
        return [table_of(("device",), numbers, rows), table_of((), columns, areas)]

    def notes(self) -> list[str]:
        """Return what is as good, and the meaning of a +."""
        good = f"as good: within {LEVEL:.0%} of the best area, or not told from it by the starts"
        return [good, *plus_of_areas(a_map for each in self.optima for a_map in (*each.maps.values(), each.unfiltered))]


class _Cases:
    """The cases of one scene, on a grid that is wider and coarser than the scene's."""

    def __init__(self, case: Case):
        self._case = case.changed(wider_grid(case.scene, COARSER))
        self.scene = self._case.scene

    def unfiltered(self) -> Case:
        return self._of("unfiltered", {"controller.estimator": "fdm"})

    def filtered(self, cutoff_hz: float) -> Case:
        gains = {"controller.gains.butterworth": {"cutoff_hz": cutoff_hz}}
        return self._of(f"{cutoff_hz:g} Hz", {"controller.estimator": "butterworth", **gains})

    def sweep(self) -> dict[float, Case]:
        """Return the sweep's cases by cutoff, up to the highest cutoff that the sample rate allows."""
        end = min(float(SWEEP_HZ[-1]), CUTOFF_MAX * self.scene.controller.sample_hz)
        cutoffs = [*(float(cutoff_hz) for cutoff_hz in SWEEP_HZ if cutoff_hz < end), end]
        return accepted({cutoff_hz: self.filtered(cutoff_hz) for cutoff_hz in cutoffs})

    def _of(self, label: str, changes: dict[str, Any]) -> Case:
        return self._case.changed(changes, f"{self.scene.name}, {label}")


def study(cases: list[Case], mapper: Mapper) -> Cutoffs:
    """Return the areas of every scene against the cutoff, including the best cutoff of every scene.

    Args:
        cases: the scenes.
        mapper: function that makes the maps.

    Raises:
        SceneError: if a scene is not valid, or has no section `zwidth`.
    """
    devices = [_Cases(case) for case in cases]
    sweeps = [device.sweep() for device in devices]
    # The largest regions come first, because they take longest.
    swept = {(place, cutoff): sweep[cutoff] for place, sweep in enumerate(sweeps) for cutoff in reversed(sweep)}
    swept |= {(place, None): device.unfiltered() for place, device in enumerate(devices)}
    maps = dict(zip(swept, mapper("sweep of cutoffs", list(swept.values())), strict=True))
    searched = [
        _searched(device, {cutoff: maps[place, cutoff] for cutoff in sweeps[place]}, maps[place, None], mapper)
        for place, device in enumerate(devices)
    ]
    return Cutoffs(searched, mapper.effort())


def _searched(device: _Cases, sweep: dict[float, Map], unfiltered: Map, mapper: Mapper) -> Optimum:
    """Return the best cutoff of a device: of the sweep, and of a search around the sweep's best."""
    maps = dict(sweep)

    def loss(log_cutoff: float) -> float:
        # The cutoff is tried exactly as printed.
        cutoff_hz = float(f"{math.exp(log_cutoff):.4g}")
        if cutoff_hz not in maps:
            case = device.filtered(cutoff_hz)
            (maps[cutoff_hz],) = mapper(f"search: {case.label}", [case])
        return -maps[cutoff_hz].area

    cutoffs, areas = list(sweep), [a_map.area for a_map in sweep.values()]
    top = areas.index(max(areas))
    bounds = [math.log(cutoffs[min(max(place, 0), len(cutoffs) - 1)]) for place in (top - 1, top + 1)]
    if areas[top] > 0 and bounds[0] < bounds[1]:
        options = {"xatol": math.log1p(TOLERANCE), "maxiter": EVALUATIONS}
        scipy.optimize.minimize_scalar(loss, bounds=bounds, method="bounded", options=options)
    return Optimum(device.scene, dict(sorted(maps.items())), unfiltered)
