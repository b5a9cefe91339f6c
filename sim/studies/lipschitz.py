"""The bound C on the acceleration from a recorded hit, as the founding paper estimates it for Levant's gains.

The wall is hit with a finite difference filtered at 500 Hz. A sum of seven sines is fitted to the recorded positions. C
is the largest magnitude of its second derivative (Figure 4).

The estimate has limits: seven sines cannot follow an impact, so C is less than the handle's true acceleration, and
falls as the fitted record grows longer. Both accelerations are reported. The amplitudes are reported too: two sines of
almost the same frequency may cancel, so the fit is a curve and not a spectrum.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...model.runtime.result import Summary
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls import hit
from ..walls.methods import ADJUSTED, methods
from .sines import Sines, fit

METHOD = "fdm-500"
POINTS = 500
"""The largest number of positions that are fitted; the sines need no more."""


@dataclass(frozen=True)
class Lipschitz(Summary):
    """The bound C from a hit.

    Attributes:
        scene: the scene with the wall that was hit.
        times_s: times of the record, 0 at the contact.
        positions_m: recorded positions, whole counts.
        velocities_m_per_s: true velocities of the handle.
        sines: sines fitted to the positions, in time from the start of the record.
        peak_m_per_s2: the handle's largest true acceleration, over one sample.
        cut: remarks on what was asked for of the record, and lies beyond the run.
    """

    scene: Scene
    times_s: np.ndarray
    positions_m: np.ndarray
    velocities_m_per_s: np.ndarray
    sines: Sines
    peak_m_per_s2: float
    cut: list[str]

    def fitted(self, order: int) -> np.ndarray:
        """Return the fit at the times of the record, or its derivative of the given order."""
        return self.sines.derivative(self.times_s - self.times_s[0], order)

    @property
    def bound_m_per_s2(self) -> float:
        """The bound C on the acceleration."""
        return float(np.abs(self.fitted(2)).max())

    def report(self) -> dict[str, Any]:
        """Return what the command line prints: C, the quality of the fit, and the gains that follow."""
        bound, adjusted = self.bound_m_per_s2, ADJUSTED["lambda_sqrt_m_per_s"]
        return {
            "scene": self.scene.name,
            "stiffness_n_per_m": self.scene.wall.stiffness_n_per_m,
            "damping_n_s_per_m": self.scene.wall.damping_n_s_per_m,
            "from_s": float(self.times_s[0]),
            "to_s": float(self.times_s[-1]),
            "sines": len(self.sines.rad_per_s),
            "frequencies_hz": (self.sines.rad_per_s / (2 * math.pi)).tolist(),
            "amplitudes_mm": (np.hypot(self.sines.sine, self.sines.cosine) * 1e3).tolist(),
            "residual_rms_mm": float(np.sqrt(np.mean((self.fitted(0) - self.positions_m) ** 2)) * 1e3),
            "c_m_per_s2": bound,
            "true_peak_m_per_s2": self.peak_m_per_s2,
            "proposed_lambda_sqrt_m_per_s": math.sqrt(bound),
            "proposed_alpha_m_per_s2": 1.1 * bound,
            "adjusted_lambda_sqrt_m_per_s": adjusted,
            "adjusted_alpha_least_m_per_s2": least_alpha_m_per_s2(adjusted, bound),
        }

    def notes(self) -> list[str]:
        """Return the part of the requested record that is missing."""
        return self.cut


def least_alpha_m_per_s2(lambda_sqrt_m_per_s: float, bound_m_per_s2: float) -> float | None:
    """Return the least alpha with lambda^2 >= 4 C (alpha + C) / (alpha - C), or None if there is none."""
    square, four = lambda_sqrt_m_per_s**2, 4 * bound_m_per_s2
    return bound_m_per_s2 * (square + four) / (square - four) if square > four else None


def study(case: Case, before_s: float, after_s: float, count: int) -> Lipschitz:
    """Hit the wall of a scene, and fit sines to the positions recorded around the contact.

    Args:
        case: the scene; the estimator is the paper's for this purpose, a difference filtered at 500 Hz.
        before_s, after_s: lengths of the fitted record before and after the first contact.
        count: number of sines.

    Raises:
        SceneError: if the scene is not valid.
        RuntimeError: if the handle never reached the wall, or the record is too short.
    """
    method = methods()[METHOD]
    scene = case.changed(method.changes, method.label).scene
    result = hit.run(scene, "fixed", traces=True)
    if not (result.detail.position_m > 0).any():
        near = f"{hit.DETAIL_S:g} s of coming within {-hit.DETAIL_FROM_M * 1e3:g} mm"
        raise RuntimeError(f"the handle did not reach the wall, or not within {near}: there is no impact to fit")
    whole, contact = result.overview, result.detail
    run_s = result.samples / scene.spec.sample_hz
    cut = [
        f"--{side} {asked_s:g}: the run has {there_s:g} s {side} the contact, and all of it is taken"
        for side, asked_s, there_s in (
            ("before", before_s, result.contact_s),
            ("after", after_s, run_s - result.contact_s),
        )
        if asked_s > there_s
    ]
    times = whole.time_s - result.contact_s
    inside = np.flatnonzero((times >= -before_s) & (times <= after_s))
    kept = inside[:: max(-(-len(inside) // POINTS), 1)]
    positions = np.floor(whole.position_m[kept] / scene.encoder.count_m) * scene.encoder.count_m
    try:
        sines = fit(times[kept] - times[kept][0] if len(kept) else times[kept], positions, count)
    except ValueError as error:
        raise RuntimeError(f"the record is too short: {error}") from None
    peak = np.abs(np.diff(contact.velocity_m_per_s)).max() * scene.spec.sample_hz
    return Lipschitz(scene, times[kept], positions, whole.velocity_m_per_s[kept], sines, float(peak), cut)
