"""The founding paper's Figures 1, 2 and 5, the second carried on to every estimator and to 10 MHz: what is in them.

Beside the estimators, Figure 2 has two lines that no run gives, for |f''| <= C and noise up to eps = q/2, half a count:

- no causal differentiator can guarantee a largest error under 2 sqrt(C eps): that is so on the worst of such signals,
  and an RMS error on a given one may well be less;
- a plain difference over the window W = 2 sqrt(eps/C) attains it. Its RMS error is
  sqrt(q^2 / (6 W^2) + (a W / 2)^2): that of two roundings, independent and even, and half a window's delay under the
  signal's RMS acceleration a. W is a whole number of samples, one at least.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..model import estimators
from . import signals
from .accuracy import exact_velocity
from .scene import Scene, load

COUNT_M = load("mhz").encoder.count_m
RATES_HZ = {
    1: (10_000,),
    2: (*(step * 10**decade for decade in (3, 4, 5, 6) for step in (1, 2, 5)), 10_000_000),
}
PROPOSED = {"lambda_sqrt_m_per_s": math.sqrt(12.0), "alpha_m_per_s2": 13.2}
"""The paper's proposed gains, for its C of 12 m/s^2."""
ADJUSTED = {"lambda_sqrt_m_per_s": 500 * math.sqrt(1e-3), "alpha_m_per_s2": 50.0}
"""The paper's adjusted gains; its alpha was lost, and this one satisfies the condition that it names."""
LAG_HZ = 100.0
"""Cutoff of Figure 1's filter, assumed: one of those that the paper compares, and slow enough to be seen to lag."""


@dataclass(frozen=True)
class Curve:
    """One estimator of a figure.

    Attributes:
        label: in the legend.
        estimator, output: their names.
        gains: others than the default ones, by name.
        cutoff_of_rate: a cutoff, as a share of the sample rate, in their place.
    """

    label: str
    estimator: str
    output: str
    gains: dict[str, float] = field(default_factory=dict)
    cutoff_of_rate: float | None = None

    @property
    def changes(self) -> dict[str, Any]:
        """What it changes in a scene, by dotted key; without a cutoff as a share of the rate."""
        gains = {f"controller.gains.{self.estimator}": self.gains} if self.gains else {}
        return {"controller.estimator": self.estimator, "controller.output": self.output, **gains}

    def job(self, signal: str, sample_hz: int, **options) -> dict:
        """Return the arguments of `accuracy.measure`."""
        gains = {"cutoff_hz": self.cutoff_of_rate * sample_hz} if self.cutoff_of_rate else self.gains
        return {
            "estimator": self.estimator,
            "output": self.output,
            "signal": signal,
            "sample_hz": sample_hz,
            "gains": gains or None,
            **options,
        }


def curves(figure: int) -> list[Curve]:
    """Return the estimators of a figure: the paper's, then for the second all others."""
    if figure == 1:
        return [
            Curve(f"finite difference, {LAG_HZ:g} Hz Butterworth", "butterworth", "u", {"cutoff_hz": LAG_HZ}),
            Curve("Levant u, adjusted gains", "levant", "u", ADJUSTED),
        ]
    papers = [
        Curve("fdm", "fdm", "u"),
        Curve("butterworth, 0.1 fs", "butterworth", "u", cutoff_of_rate=0.1),
        Curve("levant u, proposed gains", "levant", "u"),
        Curve("levant u, adjusted gains", "levant", "u", ADJUSTED),
    ]
    shown = {(curve.estimator, curve.output) for curve in papers if not curve.cutoff_of_rate}
    others = [
        Curve(label(name, output), name, output)
        for name in estimators.ESTIMATORS
        for output in estimators.load(name).OUTPUTS
        if (name, output) not in shown
    ]
    return papers + others


def methods(scene: Scene | None = None) -> dict[str, Curve]:
    """Return the methods of the paper's Figure 5, by the name used on the command line.

    Args:
        scene: its own gains of Levant's are the adjusted ones, if it has any: their alpha was lost, and is its to say.
    """
    own = scene and scene.controller.gains.levant
    adjusted = own.model_dump() if own else ADJUSTED
    filtered = {
        f"fdm-{cutoff}": Curve(f"FDM + {cutoff} Hz", "butterworth", "u", {"cutoff_hz": float(cutoff)})
        for cutoff in (30, 100, 500, 1000)
    }
    return filtered | {
        "proposed": Curve("Levant u, proposed gains", "levant", "u", PROPOSED),
        "adjusted": Curve("Levant u, adjusted gains", "levant", "u", adjusted),
    }


def label(estimator: str, output: str) -> str:
    """Return what an estimator's output is called: its name alone where it has one output."""
    return estimator if len(estimators.load(estimator).OUTPUTS) == 1 else f"{estimator} {output}"


def lower_bound_m_per_s(acceleration_max_m_per_s2: float) -> float:
    """Return the largest error that no causal differentiator can promise to stay under."""
    return 2 * math.sqrt(acceleration_max_m_per_s2 * COUNT_M / 2)


def window_floor_m_per_s(signal: signals.Signal, sample_hz: float) -> float:
    """Return the RMS error of a difference over the minimax window, by its formula."""
    window_s = 2 * math.sqrt(COUNT_M / 2 / signal.acceleration_max_m_per_s2)
    window_s = max(round(window_s * sample_hz), 1) / sample_hz
    step_s = 1e-5
    times = np.arange(signal.judged_from_s, signal.seconds, step_s)
    acceleration = np.diff(exact_velocity(signal.motion, times)) / step_s
    lag = np.sqrt(np.mean(acceleration**2)) * window_s / 2
    return math.hypot(COUNT_M / math.sqrt(6) / window_s, lag)
