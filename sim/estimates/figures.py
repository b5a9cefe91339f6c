"""The contents of the founding paper's Figures 1 and 2, the second extended to every estimator and to 10 MHz.

Besides the estimators, Figure 2 has two lines of theory, for |f''| <= C and noise up to eps = q/2, half a count:

- no causal differentiator can guarantee a largest error under 2 sqrt(C eps). The bound holds for the worst such signal;
  the RMS error on a particular signal may well be less;
- a plain difference over the window W = 2 sqrt(eps/C) attains the bound. Its RMS error is
  sqrt(q^2 / (6 W^2) + (a W / 2)^2): the first term comes from two roundings, independent and uniform, the second from
  half a window's delay under the signal's RMS acceleration a. W is a whole number of samples, at least one.
"""

import math

import numpy as np

from ...model.estimators import registry
from ..scene.load import load
from ..walls.methods import ADJUSTED, Curve, label
from . import signals
from .accuracy import exact_velocity

COUNT_M = load("mhz").encoder.count_m
RATES_HZ = {
    1: (10_000,),
    2: (*(step * 10**decade for decade in (3, 4, 5, 6) for step in (1, 2, 5)), 10_000_000),
}
LAG_HZ = 100.0
"""Assumed cutoff of Figure 1's filter: one of the paper's cutoffs, and slow enough for a visible lag."""


def curves(figure: int) -> list[Curve]:
    """Return the estimators of a figure: the paper's, followed in Figure 2 by all others."""
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
        for name in registry.ESTIMATORS
        for output in registry.design_of(name).outputs
        if (name, output) not in shown
    ]
    return papers + others


def lower_bound_m_per_s(acceleration_max_m_per_s2: float) -> float:
    """Return the least bound on the largest error that a causal differentiator can guarantee."""
    return 2 * math.sqrt(acceleration_max_m_per_s2 * COUNT_M / 2)


def window_floor_m_per_s(signal: signals.Signal, sample_hz: float) -> float:
    """Return the RMS error of a difference over the minimax window, from its formula."""
    window_s = 2 * math.sqrt(COUNT_M / 2 / signal.acceleration_max_m_per_s2)
    window_s = max(round(window_s * sample_hz), 1) / sample_hz
    step_s = 1e-5
    times = np.arange(signal.judged_from_s, signal.seconds, step_s)
    acceleration = np.diff(exact_velocity(signal.motion, times)) / step_s
    lag = np.sqrt(np.mean(acceleration**2)) * window_s / 2
    return math.hypot(COUNT_M / math.sqrt(6) / window_s, lag)
