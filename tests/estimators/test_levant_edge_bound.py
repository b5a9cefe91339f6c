"""The edge-driven differentiator in motions beyond its gains: the bound that its module derives, and such motions.

Motions have a position at every clock, in counts, so edges, stamps and the true velocity are exact to a clock.
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest

from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.estimate import estimate
from hardwall.model.runtime.compiled import compiled
from hardwall.model.spec import AxisSpec
from hardwall.testing import rng
from stimuli.specs import spec

ROUNDING = 16
"""LSB of the velocity by which all roundings of a correction may change it: a time cut to its mantissa makes 4."""


def axis_of(name: str) -> AxisSpec:
    return spec(name, "levant-edge")


def seen_by(axis: AxisSpec, position: np.ndarray) -> np.ndarray:
    """Return the columns of `Seen` at every sample of a motion, its position in counts at every clock."""
    cells = np.floor(position).astype(np.int64)
    cells -= cells[0]
    at = np.flatnonzero(np.diff(cells)) + 1
    assert (np.abs(np.diff(cells)[at - 1]) == 1).all()
    count, down = cells[at], (cells[at] < cells[at - 1]).astype(np.int64)
    kind = (count + down) & 3 ^ down << 1
    turns = np.flatnonzero(np.diff(down, prepend=1 - down[0]))
    run = np.minimum(np.arange(len(at)) - turns[np.searchsorted(turns, np.arange(len(at)), "right") - 1] + 1, 4)
    now = np.arange(axis.clocks_per_sample, len(position), axis.clocks_per_sample)

    def last(of: np.ndarray, where: np.ndarray) -> np.ndarray:
        """Return a value of the last of the edges `where` before every sample, 0 if there is none."""
        index = np.searchsorted(at[where], now)
        return np.concatenate([[0], of[where]])[index]

    every = np.ones(len(at), bool)
    stamps = [last(at, kind == number) for number in range(4)]
    return np.stack([last(count, every), now, *stamps, last(kind, every), last(down, every), last(run, every)], axis=1)


class Trace(NamedTuple):
    """What an estimator makes of every sample: its output and its state, in counts, samples and clocks."""

    velocity: np.ndarray
    known: np.ndarray
    stamp: np.ndarray
    acceleration: np.ndarray
    apart: np.ndarray  # the largest difference of two places, in counts


@compiled
def _trace(params, state, rows, out):
    for k in range(len(rows)):
        r = rows[k]
        seen = Seen(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
        state, velocity, _ = estimate(params, state, seen, 0)
        out[0, k], out[1, k], out[2, k], out[3, k] = velocity, state.known, state.stamp, state.acceleration
        out[4, k] = max(state.places) - min(state.places)


def trace(axis: AxisSpec, rows: np.ndarray, floating: bool, share: float) -> Trace:
    """Return the trace for gains of which alpha is a share of the designed one, and lambda its root."""
    d, gains = axis.design.estimator, axis.design.gains
    words = {
        "levant_edge_lambda": gains.lambda_sqrt_m_per_s3 * math.sqrt(share),
        "levant_edge_alpha": gains.alpha_m_per_s3 * share,
    }
    out = np.zeros((5, len(rows)))
    _trace(Axis(axis, floating, **words).params.estimator, d.start(floating), rows, out)
    units = (1, 1, 1) if floating else (d.velocity.lsb, d.a.lsb, d.place.lsb)
    velocity, known, stamp, acceleration, apart = out
    return Trace(velocity * units[0], known, stamp, acceleration * units[1], apart * units[2] / d.clocks)


def bounds(axis: AxisSpec, rows: np.ndarray, seen: Trace, steep: float) -> np.ndarray:
    """Return the module's bound of the error at every sample, counts a sample, for |f''| <= `steep` counts a clock^2.

    It is infinite until an edge has corrected the velocity.
    """
    d, clocks, out = axis.design.estimator, axis.clocks_per_sample, np.full(len(rows), np.inf)
    corrected, interval, before = 0, 0, 0.0
    for k in range(1, len(rows)):
        now, step = int(rows[k, 1]), int(seen.stamp[k] - seen.stamp[k - 1])
        if step >> d.shortest and seen.known[k - 1]:
            corrected, interval, before = int(seen.stamp[k]), step, abs(seen.acceleration[k - 1]) / clocks
        interval *= int(seen.known[k])
        if interval:
            since, silent = now - corrected, max(now - int(seen.stamp[k]), 1)
            after = abs(seen.acceleration[k]) / clocks
            line = (1 + seen.apart[k]) / interval + (steep + before) * interval / 2 + (steep + after) * since
            rest = 1 / silent + steep * silent / 2 if silent < interval else 0.0
            out[k] = max(line, rest) * clocks + ROUNDING * d.velocity.lsb
    return out


def journey(axis: AxisSpec, steep: float, clocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (position, velocity) at every clock of a random motion with |f''| <= `steep`, in counts and clocks."""
    random, fast = rng(), axis.speed_max_counts_per_sample / axis.clocks_per_sample
    speeds, speed, made = [], 0.0, 0
    while made < clocks:
        change, long = steep * random.choice((-1.0, 0.0, 1.0, random.uniform(-1, 1))), int(10 ** random.uniform(2, 5))
        speeds.append(np.clip(speed + change * np.arange(1, long + 1), -fast, fast))
        speed, made = speeds[-1][-1], made + long
    velocity = np.concatenate(speeds)[:clocks]
    return np.cumsum(velocity), velocity


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("name", ["mhz", "paper", "narrow"])
def test_no_gains_and_no_motion_break_the_derived_bound(name, floating):
    axis = axis_of(name)
    designed = axis.acceleration_max_m_per_s2 / axis.count_m / axis.clock_hz**2
    for times in (0.3, 3.0, 30.0, 300.0):
        position, velocity = journey(axis, times * designed, 1_000_000)
        rows = seen_by(axis, position)
        truth = velocity[rows[:, 1]] * axis.clocks_per_sample
        for share in (1.0, 1e-1, 1e-3, 0.0):
            seen = trace(axis, rows, floating, share)
            bound = bounds(axis, rows, seen, times * designed)
            assert np.isfinite(bound).mean() > 0.5
            assert (np.abs(seen.velocity - truth) <= bound).all()


def sine(amplitude_m: float, hertz: float, seconds: float) -> tuple[np.ndarray, float]:
    """Return (velocity at every clock on the axis of a megahertz, largest acceleration), in counts and clocks."""
    axis = axis_of("mhz")
    omega, peak = math.tau * hertz / axis.clock_hz, amplitude_m / axis.count_m
    return peak * omega * np.cos(omega * np.arange(round(seconds * axis.clock_hz))), peak * omega**2


def to_and_fro(speed_m_per_s: float, every_s: float, within_s: float) -> tuple[np.ndarray, float]:
    """Return the same of a motion that reverses in a time, at constant deceleration, and goes on at its speed."""
    axis = axis_of("mhz")
    speed, every, within = (
        speed_m_per_s / axis.count_m / axis.clock_hz,
        every_s * axis.clock_hz,
        within_s * axis.clock_hz,
    )
    corners = [0, every - within, every, 2 * every - within, 2 * every]
    velocity = np.interp(np.arange(round(20 * every)) % (2 * every), corners, speed * np.array([1, 1, -1, -1, 1]))
    return velocity, 2 * speed / within


LOWERED = [(partial(sine, 1e-3, 10.0, 0.12), share) for share in (1e-3, 0.0)]
BEYOND = [(partial(sine, 33 * 12.0 / (math.tau * hertz) ** 2, hertz, 0.05), 1.0) for hertz in (50.0, 200.0)]
REVERSED = [(partial(to_and_fro, speed, 1e-3, 1e-3), 1.0) for speed in (0.1, 0.2, 0.3)]


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize(("motion", "share"), [*LOWERED, *BEYOND, *REVERSED])
def test_a_motion_beyond_the_gains_is_not_lost(motion, share, floating):
    """The host lowers its gains; 33 C; reversals within a millisecond: the bound holds, and the motion is followed."""
    (velocity, steep), axis = motion(), axis_of("mhz")
    rows = seen_by(axis, np.cumsum(velocity) + 0.3)
    seen = trace(axis, rows, floating, share)
    error = np.abs(seen.velocity - velocity[rows[:, 1]] * axis.clocks_per_sample)
    assert (error <= bounds(axis, rows, seen, steep)).all()
    rms = math.sqrt(np.mean(error[len(error) // 5 :] ** 2))
    assert 4 * rms <= np.abs(velocity).max() * axis.clocks_per_sample
