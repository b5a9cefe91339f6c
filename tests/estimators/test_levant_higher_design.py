"""What the formats of Levant's differentiators of order 2 and 3 follow from, against the equations of the papers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_levant_higher import design, every, limited

from hardwall.model.estimators.levant_higher_design import LAMBDA, LARGEST_L, MEAN_ERROR, PEAKS
from hardwall.model.records import velocity
from hardwall.model.runtime.compiled import compiled
from stimuli.lengths import LONG

SCALES = [*range(12), 16, 20, 30, 39] if LONG else [0, 1, 3, 5, 8, 39]
"""The times of their own, of forty, at which means are taken where counts lock: they are largest at the first."""


@compiled
def _slopes(order, filtering, gains, s, f, slopes):
    """Fill the slopes of the states, w first, by the differential equation with the input f."""
    n = order + filtering
    error = s[0] if filtering else s[0] - f
    away, root = -float(np.sign(error)), abs(error) ** (1 / (n + 1))
    for j in range(n + 1):
        slopes[j] = away * gains[n - j] * root ** (n - j) - (f if j == filtering - 1 else 0.0)
        if j < n:
            slopes[j] += s[j + 1]


@compiled
def _peaks(order, filtering, gains, ways, period, steps, peaks):
    """Raise the peaks of |w|, |z0 - f|, |z1|, ... to those of a velocity of 1/2 in each of these ways for a period."""
    s, slopes, f = np.zeros(5), np.zeros(5), 0.0
    for k in range(len(ways) * steps):
        f += 0.5 * ways[k // steps] * period / steps
        _slopes(order, filtering, gains, s, f, slopes)
        for j in range(order + filtering + 1):
            s[j] += slopes[j] * period / steps
            peaks[j + 1 - filtering] = max(peaks[j + 1 - filtering], abs(s[j] - (f if j == filtering else 0.0)))


@every
def test_the_peaks_are_those_of_the_differential_equation(name):
    """By Euler's method in small steps, over half periods and random reversals: the figures hold, none too large."""
    d, random = design(name), np.random.default_rng(7)
    found = np.zeros(d.order + 2)
    gains = np.array([*LAMBDA[d.degree - 1]])
    for half_period in np.geomspace(0.05, 8, 60):
        ways = 1.0 - 2.0 * (np.arange(14) % 2)
        _peaks(d.order, d.filtering, gains, ways, half_period, math.ceil(half_period / 1e-3), found)
    # `levant-3` is close to a figure of its own after some thousand alone.
    for _ in range(2000 if LONG or name == "levant-3" else 400):
        period = 10 ** random.uniform(-1, 0.5)
        ways = np.where(random.random(40) < 0.5, -1.0, 1.0)
        _peaks(d.order, d.filtering, gains, ways, period, math.ceil(period / 2e-3), found)
    for peak, figure in zip(found, PEAKS[d.order, d.filtering], strict=True):
        assert 0.9 * figure <= peak <= figure


@compiled
def _start(order, filtering, gains, steps, velocities):
    """Fill the velocities at steps of a time, of a start from rest in a motion at a speed of 1, with L = 1."""
    s, slopes = np.zeros(5), np.zeros(5)
    for k in range(len(velocities)):
        _slopes(order, filtering, gains, s, k / steps, slopes)
        for j in range(order + filtering + 1):
            s[j] += slopes[j] / steps
        velocities[k] = s[filtering + 1]


@every
def test_a_start_in_motion_overshoots_and_settles_as_documented(name):
    d, steps = design(name), 10_000
    velocities = np.zeros(20 * steps)
    _start(d.order, d.filtering, np.array([*LAMBDA[d.degree - 1]]), steps, velocities)
    assert 0.37 <= velocities.max() - 1 <= 0.58
    settled = (np.flatnonzero(np.abs(velocities - 1) > 0.005)[-1] + 1) / steps
    assert 2.7 <= settled <= 3.7


@compiled
def _mean(order, filtering, gains, moved, period, phase, settle, samples):
    """Return how far the mean of z1 is from a steady speed of `moved` counts in `period` samples, by the equation."""
    s, slopes, total = np.zeros(5), np.zeros(5), 0.0
    speed = moved / period
    s[filtering + 1] = speed
    for k in range(settle + samples):
        _slopes(order, filtering, gains, s, math.floor(moved * k / period + phase), slopes)
        for j in range(order + filtering + 1):
            # Taylor's second term of a state comes from the state after the next, which has not moved yet.
            s[j] += slopes[j] + (s[j + 2] / 2 if filtering <= j <= order + filtering - 2 else 0.0)
        total += s[filtering + 1] - speed if k >= settle else 0.0
    return total / samples


@every
def test_the_mean_where_counts_lock_is_as_near_as_its_figure(name):
    """Over patterns of up to 12 samples, three phases, and the largest L and less: none is more, and some are close."""
    d, worst = design(name), 0.0
    n = d.degree - 1
    for own in np.geomspace(LARGEST_L ** (-1 / (d.order + 1)), 60, 40)[SCALES]:
        gains = np.array([LAMBDA[n][j] * own ** (-(d.order + 1) * (n + 1 - j) / (n + 1)) for j in range(n + 1)])
        for period, moved in ((q, p) for q in range(1, 13) for p in range(q) if math.gcd(p, q) == 1):
            samples = 4 * period * max(1, int(200 * own / period))
            for phase in (0.0, 0.01 / period, 0.5 / period):
                settle = int(60 * own) // period * period
                found = _mean(d.order, d.filtering, gains, moved, period, phase, settle, samples)
                worst = max(worst, abs(found) * own)
    figure = MEAN_ERROR[d.order, d.filtering]
    assert 0.9 * figure <= worst <= figure


@every
def test_a_bound_beyond_the_steps_is_refused_and_no_word_leads_there(name):
    of = limited(name)
    d, gains = of.design.estimator, of.design.gains
    (word,), ((field, most),) = d.words, vars(gains).items()
    assert (d.lipschitz, word.high) == (LARGEST_L, 0)
    with pytest.raises(ValueError, match=rf"^{field} must be .* to {most:g} at these rates, not "):
        assert replace(of, gains=type(gains)(1.01 * most)).design


def test_a_speed_that_no_bound_fits_is_refused():
    counts = np.cumsum(np.random.default_rng(1).integers(9_000_000, 15_000_000, 20))
    with pytest.raises(
        ValueError, match="estimator levant-2-filtering has no words for the largest speed at this rate"
    ):
        velocity(counts, 1.0, "levant-2-filtering", count=1e-6, acceleration_max=1.0)
