"""A device whose Figure 5 is known: the founding paper's, stretched by an error of the mass."""

import numpy as np

from hardwall.sim.scene.case import Case
from hardwall.sim.walls import methods
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.grid import grid_of
from hardwall.sim.walls.zwidth import Map

from . import results
from .figure_5 import PAPER
from .maps import Known

MASS_KG, DELAY_S = 0.2, 1.4e-3
NAMES = {curve.label: name for name, curve in methods.methods().items()}


def largest_n_per_m(method: str, changes: dict, damping: float) -> float:
    """Return K of the paper's figure, stretched over B by the error of the mass; an error of delay stiffens 1000 Hz."""
    stretch = 0.3 * changes.get("handle.mass_kg", 0.35) / MASS_KG
    points = [10.0 * (n + 1) * stretch for n in range(len(PAPER[method]))]
    # K is constant between the figure's points, so a drop remains a drop.
    place = int(np.searchsorted(points, damping + 1e-9)) - 1
    inside = 0 <= place < len(points)
    stiffer = 1 + 1e3 * abs(changes.get("amplifier.delay_s", 1e-3) - DELAY_S) * (method == "fdm-1000")
    return 1e3 * PAPER[method][max(place, 0)] * stiffer if inside or place < 0 else 0.0


class KnownDevice(Known):
    """Maps of a known device."""

    def __init__(self):
        self.cases = []

    def __call__(self, title: str, cases: list[Case]) -> list[Map]:
        self.cases += cases
        return [self._map(case) for case in cases]

    def _map(self, case: Case) -> Map:
        boundary = []
        for damping in grid_of(case.scene).dampings:
            stiffness = largest_n_per_m(NAMES[case.label], case.changes, damping)
            boundary.append(BoundaryPoint(damping, stiffness, stiffness + 1e3))
            if not stiffness:
                break
        drawn = np.array([[[point.stable_n_per_m] for point in boundary]] * 2)
        return Map(case, boundary, 1, [True] * len(boundary), drawn=drawn)


def verdict(changes: dict, wall: tuple[float, float], **_) -> dict:
    """Return the verdict on a wall of this device, in place of `mapping.verdict`."""
    stiffness, damping = wall
    estimator = changes["controller.estimator"]
    gains = changes[f"controller.gains.{estimator}"]
    name = f"fdm-{gains['cutoff_hz']:g}" if estimator == "butterworth" else "adjusted"
    if gains == methods.PROPOSED:
        name = "proposed"
    stable = stiffness <= largest_n_per_m(name, changes, damping)
    return results.verdict(stable)
