"""Velocity from the changes of the count: the Kalman filter of `edge_kalman`, for encoders without clock stamps.

A count is a poor measurement of the position at a sample. It is off by up to half a count, for as long as the count
stays. A change of the count is a better one: between the last sample and this one, the axis was at the border of two
cells. It is off by the motion within half a sample at most, and this becomes less as the rate grows. Where the count
does not change, the axis is still within its cell: this bounds the velocity.

So this estimator makes edges from counts, and gives them to the filter of `edge_kalman`. Time is in halves of a sample.
With f the count, k the number of the sample and d = f - f of the last sample:

    d = 1 or -1     the border was passed at 2 k - 1, in the middle between the samples
    larger          the last of several borders was passed at 2 k, near this sample
    0               no edge

Everything else is the filter's: the innovation at an edge, the memory that an alarm shortens, the bound by silence, and
the rest at which the velocity is exactly 0.

Derivation of the gains. The filter's table has a row for the time T between edges. An edge errs by its own error, and
by the time at which it was passed. This time is uniform within a sample tau. An axis with an edge every T moves tau / T
counts in it. An axis that passes several edges in a sample is uniform within a cell, a count. So

    error**2 = edge_error**2 + min(1, tau / T)**2 / 12        counts**2

and the memories and the bounds of the alarm follow from it as in `edge_kalman_design`. Slow edges are as good as with
stamps. Where edges come every sample, this is a filter of counts.

Start, restart, saturation and wraps are the filter's. A sample with `restart` has no edge. The watch over bursts is
left out: without stamps, edges in bursts look like a motion.

Source: as of `edge_kalman`. To take the time at a known position is the principle of fixed-position estimators: Brown,
Schneider, Mulligan, IEEE Transactions on Industrial Electronics 39 (1992), 11.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import wrap
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import edge_kalman, edge_kalman_design
from .edge_kalman_design import Gains
from .estimate import EstimatorDesign, estimate

UNITS = 2
"""Units of time in a sample."""
STEPS = 1 + edge_kalman_design.STEPS
"""Clocks of the sequence: one to make the edge, and the filter's."""


class Filter(edge_kalman_design.Design):
    """Formats and table of the filter for edges whose times are known to a sample.

    Args:
        axis: the axis with a clock of `UNITS` clocks a sample.
        gains: as of `edge_kalman`.
    """

    def _errors_counts(self, axis: AxisRequirements, gains: Gains, times_s: np.ndarray) -> np.ndarray:
        passed = np.minimum(1 / (axis.sample_hz * times_s), 1.0)
        return np.hypot(gains.edge_error_counts, passed / math.sqrt(12))


class Params(NamedTuple):
    """Widths of the count and of the time, bits, and the integer kernel of the filter."""

    count_width: int
    time_width: int
    filter: edge_kalman_design.Params


class FloatParams(NamedTuple):
    count_width: int
    time_width: int
    filter: edge_kalman_design.FloatParams


class State(NamedTuple):
    """The last count, the times of this sample and of the last edge, that edge's direction, and the filter's state."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    now: int
    at: int
    down: int
    filter: edge_kalman_design.State


START = State(0, 0, 0, 0, 0, edge_kalman_design.START)
FLOAT_START = START._replace(filter=edge_kalman_design.FLOAT_START)


class Design(EstimatorDesign):
    """Formats, table and latency for an axis, derived as the module says.

    Attributes:
        filter: the design of the filter, on an axis with a clock of `UNITS` clocks a sample.
        velocity: format of the output.

    Raises:
        ValueError: if the rates or ranges fit no format that int64 can hold, with the accepted range.
    """

    name = "count-kalman"
    gains_class = Gains
    flags = edge_kalman_design.Design.flags[:2]
    latency = STEPS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        known = {field.name: getattr(axis, field.name) for field in dataclasses.fields(AxisRequirements)}
        self.filter = Filter(AxisRequirements(**known | {"clock_hz": UNITS * axis.sample_hz}), gains)
        self.velocity = self.filter.velocity

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(self.count_width, self.filter.stamp_width, self.filter.params({}))

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: unrounded gains."""
        return FloatParams(self.count_width, self.filter.stamp_width, self.filter.float_params(gains, output, si))

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


@compiled
def _edge_of(params, state, count, fresh):
    """Return (time of this sample, time of the last edge, whether that edge counted -1)."""
    mask = (1 << params.time_width) - 1
    now = (state.now + UNITS) & mask
    moved = wrap(count - state.count, params.count_width)
    if fresh:
        return now, now, 0
    if moved == 0:
        return now, state.at, state.down
    return now, (now - int(abs(moved) == 1)) & mask, int(moved < 0)


@compiled
def _seen(count, now, at, down):
    """Return an edge as a decoder shows it."""
    return Seen(count, now, at, at, at, at, 0, down, 1)


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    now, at, down = _edge_of(params, state, seen.count, restart or not state.running)
    inner, velocity, flags = edge_kalman.step(params.filter, state.filter, _seen(seen.count, now, at, down), restart)
    return State(1, seen.count, now, at, down, inner), velocity, flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm, as a reference for the cost of fixed point."""
    now, at, down = _edge_of(params, state, seen.count, restart or not state.running)
    edge = _seen(seen.count, now, at, down)
    inner, velocity, flags = edge_kalman.float_step(params.filter, state.filter, edge, restart)
    return State(1, seen.count, now, at, down, inner), velocity, flags
