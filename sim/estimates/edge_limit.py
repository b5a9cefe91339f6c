"""The limit to the velocity that edges tell: the posterior Cramer-Rao bound for a prior of white jerk.

The prior: the jerk is white noise of density S, and every edge is displaced by its own Gaussian error. This is linear
and Gaussian. So the bound is the covariance of the Kalman filter that knows S and the error, at the edges' own times.
No causal estimate has a smaller mean square error over the motions of the prior. S makes the edges of the given motion
most likely. One smooth motion may be read more accurately than the mean motion of the prior, and a motion that has
impacts has no one density: the bound is a measure, not a wall.
"""

import math

import numpy as np
import scipy

from ...model.runtime.compiled import compiled
from ...model.spec import AxisSpec
from . import signals
from .playback import encoded_signal

UNKNOWN = 1e12
"""Variances of velocity (counts/s)^2 and, squared, of acceleration before the first edge: far beyond any motion's."""
DENSITIES = 4.0, 20.0
"""The densities that are searched, as powers of ten of counts^2/s^5."""
READ_HZ = 100_000
"""The rate at which the variance between edges is read."""
STEPS = (0, 1, 3, 2)
"""The number within a cycle of the levels of the pins, a | b << 1, upwards."""


def edges_of(signal: signals.Signal, spec: AxisSpec, offsets, scale=None, lines=None) -> tuple[np.ndarray, np.ndarray]:
    """Return the times (s) of all edges of a signal, and their places on a perfect scale (counts)."""
    passed = encoded_signal(signal, spec, offsets, scale, lines)
    within = np.array(STEPS)[np.append(passed.start_level, passed.edges.levels)]
    up = (np.diff(within) + 1) % 4 - 1
    # Going up, the edge belongs to the new cell; going down, to the old one.
    return passed.edges.clocks / spec.clock_hz, np.cumsum(up) + (up < 0).astype(float)


@compiled
def _filtered(times, places, variance, density, read, out):
    """Fill `out` with the variance of the velocity at the times `read`; return twice the negative log likelihood."""
    x, v, a = places[0], 0.0, 0.0
    xx, xv, xa, vv, va, aa = variance, 0.0, 0.0, UNKNOWN, 0.0, UNKNOWN**2
    last, k, cost = times[0], 1, 0.0
    for i in range(len(read)):
        while k < len(times) and times[k] <= read[i]:
            t = times[k] - last
            last = times[k]
            x, v = x + v * t + a * t**2 / 2, v + a * t
            xx += 2 * t * xv + t**2 * (vv + xa) + t**3 * va + t**4 / 4 * aa + density * t**5 / 20
            xv += t * (vv + xa) + 1.5 * t**2 * va + t**3 / 2 * aa + density * t**4 / 8
            xa += t * va + t**2 / 2 * aa + density * t**3 / 6
            vv += 2 * t * va + t**2 * aa + density * t**3 / 3
            va += t * aa + density * t**2 / 2
            aa += density * t
            s, r = xx + variance, places[k] - x
            if i:
                cost += math.log(s) + r * r / s
            x, v, a = x + xx / s * r, v + xv / s * r, a + xa / s * r
            aa, va, vv = aa - xa * xa / s, va - xv * xa / s, vv - xv * xv / s
            xa, xv, xx = xa * variance / s, xv * variance / s, xx * variance / s
            k += 1
        t = read[i] - last
        out[i] = vv + 2 * t * va + t**2 * aa + density * t**3 / 3
    return cost


def rms_at(times_s: np.ndarray, places: np.ndarray, error_counts: float, density: float, read_s: np.ndarray) -> float:
    """Return the bound on the RMS error of the velocity, counts/s, for a known density (counts^2/s^5)."""
    out = np.empty(len(read_s))
    _filtered(times_s, places, error_counts**2, density, read_s, out)
    return math.sqrt(out.mean())


def limit(signal: signals.Signal, spec: AxisSpec, error_counts: float, *errors) -> tuple[float, float]:
    """Return (the likeliest density of the jerk, m^2/s^5; the bound on the RMS error of the velocity, m/s).

    Args:
        signal: the motion, judged as by `accuracy`.
        spec: the axis.
        error_counts: RMS error of an edge, counts; the error of the stamps is added.
        errors: the errors of the encoder, as from `accuracy.errors_of`.
    """
    times, places = edges_of(signal, spec, *errors)
    # A stamp is late by less than a clock, at the mean speed of the edges.
    error = math.hypot(error_counts, len(times) / signal.seconds / spec.clock_hz / math.sqrt(12))
    read = np.arange(signal.judged_from_s, signal.seconds, 1 / READ_HZ)
    out = np.empty(len(read))

    def cost(power: float) -> float:
        return _filtered(times, places, error**2, 10.0**power, read, out)

    found = scipy.optimize.minimize_scalar(cost, bounds=DENSITIES, method="bounded", options={"xatol": 0.01})
    density = 10.0**found.x
    return density * spec.count_m**2, rms_at(times, places, error, density, read) * spec.count_m
