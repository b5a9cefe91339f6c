"""Long runs of estimators at the largest and the smallest speeds: no drift, no overflow, no surprise later on.

`HARDWALL_ENDURANCE` is the number of samples; `make soak` takes 10^9. The decoder's outputs are computed directly for
a steady rate of edges, which is much faster than running its model.
"""

import os
from typing import NamedTuple

import numpy as np
import pytest

from hardwall.model.arithmetic.fixed import wrap
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder import quadrature
from hardwall.model.encoder.quadrature import RUN_MAX, Seen
from hardwall.model.estimators import registry
from hardwall.model.estimators.acceleration import room_of
from hardwall.model.runtime.compiled import compiled
from hardwall.testing.estimators import run
from stimuli.lengths import LONG
from stimuli.locked import mean_error
from stimuli.specs import spec

SAMPLES = int(os.environ.get("HARDWALL_ENDURANCE", "1000000"))
WINDOWS, SETTLED, PIECE = 10, 4, 1 << 12
# Clocks from one edge to the next, at 50 clocks a sample, and whether the motion is downwards.
STEADY = {
    "standstill": (0, 0),
    "slowest": (1_250_000, 1),
    "slow": (24_999, 0),
    "odd": (487, 1),
    "largest up": (25, 0),
    "largest down": (25, 1),
    "beyond": (3, 0),
}
EVERY_SPEED = "levant", "kalman", "period", "foaw"
"""Estimators of every kind: by the count or by stamps, with scalars or arrays as their state."""
FEW_SPEEDS = "slowest", "largest up", "beyond"
"""What the others run at, unless a number of samples is asked for: long rests, many edges a sample, and saturation."""
WHOLE = LONG or "HARDWALL_ENDURANCE" in os.environ
RUNS = [
    (estimator, speed)
    for estimator in registry.ESTIMATORS
    for speed in STEADY
    if WHOLE or estimator in EVERY_SPEED or speed in FEW_SPEEDS
]


class Widths(NamedTuple):
    count: int
    stamp: int


@compiled
def _stamp(widths, number, period):
    """Return the stamp of edge `number`, where the first edge is number 1; it is counted a clock later."""
    return (number * period - 1) & ((1 << widths.stamp) - 1) if number > 0 else 0


@compiled
def _seen(widths, clock, period, down):
    """Return the decoder's outputs at a clock, with an edge every `period` clocks from the reset on."""
    n = clock // period if period else 0
    # A rises with the first edge upwards, B with the first edge downwards.
    last = (2 - n) & 3 if down else (n - 1) & 3
    step = 1 if down else -1
    a, b = _stamp(widths, n, period), _stamp(widths, n - 1, period)
    c, d = _stamp(widths, n - 2, period), _stamp(widths, n - 3, period)
    stamps = (a, b, c, d)
    return Seen(
        wrap(-n if down else n, widths.count),
        clock & ((1 << widths.stamp) - 1),
        stamps[((0 - last) * step) & 3],
        stamps[((1 - last) * step) & 3],
        stamps[((2 - last) * step) & 3],
        stamps[((3 - last) * step) & 3],
        last if n else 0,
        down if n else 0,
        min(n, RUN_MAX),
    )


@compiled
def _show(widths, clocks_per_sample, period, down, first, seen):
    """Fill `seen` with the decoder's outputs at the samples from `first` on."""
    for k in range(len(seen.count)):
        now = _seen(widths, (first + k + 1) * clocks_per_sample - 1, period, down)
        seen.count[k], seen.stamp[k], seen.edge[k] = now.count, now.stamp, now.edge
        seen.stamp_a_rise[k], seen.stamp_b_rise[k] = now.stamp_a_rise, now.stamp_b_rise
        seen.stamp_a_fall[k], seen.stamp_b_fall[k] = now.stamp_a_fall, now.stamp_b_fall
        seen.down[k], seen.run[k] = now.down, now.run


class Endurance:
    """A run of an estimator at a steady speed, piece by piece, by the kernel that its other tests run."""

    def __init__(self, axis: Axis, period: int, down: int):
        spec = axis.spec
        self.axis, self.state, self.first = axis, axis.design.start().estimator, 0
        self.shown = Widths(spec.count_width, spec.stamp_width), spec.clocks_per_sample, period, down
        self.seen, self.zeros = Seen(*np.zeros((len(Seen._fields), PIECE), np.int64)), np.zeros(PIECE, np.int64)
        self.made, self.flags = room_of(axis.design.estimator, (PIECE,), np.int64), np.zeros(PIECE, np.int64)

    def window(self, length: int) -> tuple[int, int, float]:
        """Run over so many samples; return the least, the largest and the mean velocity."""
        low, high, total, until = 1 << 62, -(1 << 62), 0, self.first + length
        while self.first < until:
            some = min(PIECE, until - self.first)
            seen, made = (
                Seen(*(each[:some] for each in self.seen)),
                type(self.made)(*(each[:some] for each in self.made)),
            )
            _show(*self.shown, self.first, seen)
            self.state = run(self.axis.params.estimator, self.state, seen, self.zeros[:some], made, self.flags[:some])
            low, high = min(low, int(made.velocity.min())), max(high, int(made.velocity.max()))
            total += int(made.velocity.sum())
            self.first += some
        return low, high, total / length


def test_what_is_made_up_is_what_a_decoder_shows():
    widths, clock = Widths(6, 9), np.arange(1500)
    params = quadrature.Params(widths.count, widths.stamp, 8)
    for period, down in ((7, 0), (7, 1), (13, 0), (13, 1)):
        # The decoder counts edge n at clock n * period, so the edge is at the pins one latency earlier.
        quarter = (clock + quadrature.latency(0)) // period * (-1 if down else 1) & 3
        levels = quarter ^ quarter >> 1
        record = quadrature.run(params, quadrature.Inputs(levels & 1, levels >> 1, 0))
        for now in range(1, 1500):
            state = quadrature.State(*(int(column[now - 1]) for column in record))
            made, shown = _seen(widths, now, period, down), quadrature.seen(state)
            # Stamps of edges that have not come yet mean nothing.
            names = [name for name in Seen._fields if made.run == RUN_MAX or not name.startswith("stamp_")]
            assert [getattr(shown, name) for name in names] == [getattr(made, name) for name in names], now


@pytest.mark.parametrize(("estimator", "speed"), RUNS)
def test_it_neither_drifts_nor_stops_short(estimator, speed):
    """No tenth of a steady run has larger extremes than the fourth: the estimator settles before, even from rest."""
    axis_spec = spec("mhz", estimator)
    axis, (period, down) = Axis(axis_spec), STEADY[speed]
    length, endurance = SAMPLES // WINDOWS, Endurance(axis, period, down)
    if speed == "beyond" and not WHOLE:
        length //= 4  # words that saturate repeat themselves soon
    seen = [endurance.window(length) for _ in range(WINDOWS)]
    fmt = axis.design.estimator.velocity
    assert all(fmt.min <= low <= high <= fmt.max for low, high, _ in seen)
    # The words repeat themselves in time, so an extreme that a tenth of the run does not reach is not reached later.
    # With filtering they nearly do: the extremes of a count's ripple wander by a fiftieth of it at most.
    low, high, _ = seen[SETTLED - 1]
    within = 1 + ((high - low) // 50 if estimator.endswith("-filtering") else 0)
    assert min(low for low, _, _ in seen[SETTLED:]) >= low - within
    assert max(high for _, high, _ in seen[SETTLED:]) <= high + within
    if speed != "beyond":
        # The mean velocity is the speed, but for a count gained or lost over a tenth and for the rounding of a word.
        exact = (-1) ** down * axis_spec.clocks_per_sample / period if period else 0.0
        off = mean_error(axis.design.estimator) + (fmt.lsb if fmt.f else 0.0)
        assert max(abs(mean * fmt.lsb - exact) for _, _, mean in seen[SETTLED:]) <= 1 / length + off
