"""The results of the experiments on the drop of a stable region, which `drop` makes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...model.runtime.result import Table, table_of
from ..scene.schema import Scene
from ..walls.chatter import Chatter
from ..walls.mapping import Effort
from ..walls.zwidth import Map

STIFFNESS_N_PER_M = 5e3
"""The stiffness of the walls that are hit one by one, soft enough to be stable by far without chatter."""


@dataclass(frozen=True)
class Shaken:
    """One hit of the first experiment: the RMS of position after the settling mark, None if the handle fled."""

    method: str
    damping_n_s_per_m: float
    rms_m: float | None


@dataclass(frozen=True)
class End:
    """The largest B of `ENDS_N_S_PER_M` at which enough of the hits come to rest, or are stable; 0 if there is none."""

    method: str
    stiffness_n_per_m: float
    rests_n_s_per_m: float
    stable_n_s_per_m: float


@dataclass(frozen=True)
class Law:
    """One change of the scene, and the B up to which the handle comes to rest.

    Attributes:
        factor, value: the quantity that was changed, and its change.
        method: name of the method.
        predicted_n_s_per_m: the B up to which enough of the cycles let the handle rest; infinite without end.
        measured_n_s_per_m: the B up to which enough of the hits came to rest; 0 if under the least B tried, infinite if
            beyond the largest.
    """

    factor: str
    value: str
    method: str
    predicted_n_s_per_m: float
    measured_n_s_per_m: float


def _finite(of: End | Law) -> dict[str, Any]:
    """Return the values by name, with None for infinity, which JSON does not have."""
    return {key: None if value == math.inf else value for key, value in vars(of).items()}


@dataclass(frozen=True)
class Drop:
    """The result of the study.

    Attributes:
        scene: the scene as it was hit.
        chatters: chatter at rest, by the names of `curves`.
        shaken, ends, laws: results of the first three experiments.
        maps: stable regions, by the names of `curves`.
        effort: effort of the maps.
    """

    scene: Scene
    chatters: dict[str, Chatter]
    shaken: list[Shaken]
    ends: list[End]
    laws: list[Law]
    maps: dict[str, Map]
    effort: Effort

    def agreement(self) -> list[float]:
        """Return the ratios of measured to predicted B, where both are known: least, quartiles and most."""
        ratios = [
            law.measured_n_s_per_m / law.predicted_n_s_per_m
            for law in self.laws
            if 0 < law.measured_n_s_per_m < math.inf and law.predicted_n_s_per_m < math.inf
        ]
        return np.quantile(ratios, (0, 0.25, 0.5, 0.75, 1)).tolist() if ratios else []

    def before_the_end(self, name: str) -> float | None:
        """Return K one step of B before the end of a stable region, over its largest K: a sharp drop has half or more.

        Return None where the region leaves the map, or has fewer than two dampings.
        """
        boundary = self.maps[name].boundary
        stable = [point.stable_n_per_m for point in boundary if point.stable_n_per_m]
        return None if boundary[-1].stable_n_per_m or len(stable) < 2 else stable[-2] / max(stable)

    def of_papers(self, name: str) -> float | None:
        """Return a map's area as a ratio to the area of Levant u with the paper's adjusted gains; None if that area is
        0."""
        papers = self.maps["adjusted"].area
        return self.maps[name].area / papers if papers else None

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, with null for infinite values."""
        return {
            **self.effort._asdict(),
            "scene": self.scene.name,
            "stiffness_n_per_m": STIFFNESS_N_PER_M,
            "methods": {
                name: {
                    "swing_m_per_s": [float(chatter.swing_m_per_s.min()), float(chatter.swing_m_per_s.max())],
                    "mean_m_per_s": float(np.abs(chatter.mean_m_per_s).max()),
                    "of_papers_best": self.of_papers(name),
                    "before_the_end": self.before_the_end(name),
                    **self.maps[name].report(),
                }
                for name, chatter in self.chatters.items()
            },
            "shaken": [vars(each) for each in self.shaken],
            "ends": [_finite(each) for each in self.ends],
            "measured_over_predicted": self.agreement(),
            "laws": [_finite(each) for each in self.laws],
        }

    def tables(self) -> list[Table]:
        """Return the laws with the chatter that causes them, the ends, and the maps."""
        return [self._table_of_laws(), self._table_of_ends(), self._table_of_maps()]

    def notes(self) -> list[str]:
        """Return how well the predictions agree with the measurements."""
        ratios = ", ".join(f"{ratio:.2f}" for ratio in self.agreement())
        return [f"measured over predicted, least, quartiles and most: {ratios}"]

    def _table_of_laws(self) -> Table:
        rows = []
        for each in self.laws:
            own, plain = self.chatters[each.method], each.factor == "none"
            ends = f"{own.swing_m_per_s.max() * 1e3:.2f}", f"{abs(own.mean_m_per_s).max() * 1e3:.2f}"
            rests = f"{each.predicted_n_s_per_m:.3g}", f"{each.measured_n_s_per_m:.3g}"
            changed = "" if plain else f"{each.factor} {each.value}"
            rows.append([each.method, changed, *(ends if plain else ("", "")), *rests])
        numbers = ("swing at rest (mm/s)", "mean", "rests to B: predicted", "measured")
        return table_of(("method", "changed"), numbers, rows)

    def _table_of_ends(self) -> Table:
        rows = [
            [
                each.method,
                f"{each.stiffness_n_per_m / 1e3:g}",
                f"{each.rests_n_s_per_m:.3g}",
                f"{each.stable_n_s_per_m:.3g}",
            ]
            for each in self.ends
        ]
        return table_of(("method",), ("K (kN/m)", "rests to B (N s/m)", "stable to B (N s/m)"), rows)

    def _table_of_maps(self) -> Table:
        rows = []
        for name, each in self.maps.items():
            times, before = self.of_papers(name), self.before_the_end(name)
            areas = f"{each.area / 1e3:.0f}", "" if times is None else f"{times:.2f}", f"{each.area_in_place / 1e3:.0f}"
            end = f"{each.damping_n_s_per_m:g}", "" if before is None else f"{before:.2f}"
            rows.append([each.case.label, *areas, *end])
        areas = ("area (kN/m N s/m)", "of Levant u, adjusted", "in place")
        return table_of(("method",), (*areas, "to B (N s/m)", "K near its end / largest"), rows)
