"""Velocity from the changes of the count: the Kalman filter of `edge_kalman`, for encoders without clock stamps.

A count is a poor measurement of the position at a sample. It is off by up to half a count, for as long as the count
stays. A change of the count is a better one: between the last sample and this one, the axis was at the border of two
cells. It is off by the motion within half a sample at most, and this becomes less as the rate grows. Where the count
does not change, the axis is still within its cell: this bounds the velocity.

So this estimator makes edges from counts, and gives them to the filter of `edge_kalman`. Time is in halves of a sample.
With k the number of the sample and d the difference of its count from the last one:

    d = 1 or -1     the border was passed at 2 k - 1, in the middle between the samples
    larger          the last of several borders was passed at 2 k, near this sample
    0               no edge

d is held within `step_max`, as in the other filters of counts: the counts that twice the largest speed moves in a
sample, begun within a count, and one count for an edge out of place. What is beyond is a displacement of the scale,
without later effect (flag `velocity_saturated`).

Everything else is the filter's: the innovation at an edge, the memory that an alarm shortens, the bound by silence, and
the rest at which the velocity is exactly 0.

Derivation of the gains. The filter's table has a row for the time T between edges. An edge errs by its own error, and
by the time at which it was passed. This time is uniform within a sample tau. An axis with an edge every T moves tau / T
counts in it. An axis that passes several edges in a sample is uniform within a cell, a count. So

    error**2 = edge_error**2 + min(1, tau / T)**2 / 12        counts**2

and the memories and the bounds of the alarm follow from it as in `edge_kalman_tables`. Slow edges are as good as with
stamps. Where edges come every sample, this is a filter of counts. The filter learns no error here: the times of counts
err in patterns, which only look smaller than what they do.

Start, restart, saturation and wraps are as in the filter, whose flags are one here. A sample with `restart` has no
edge. The watch over bursts finds none: without stamps, edges in bursts look like a motion.

Source: as of `edge_kalman`. To take the time at a known position is the principle of fixed-position estimators: Brown,
Schneider, Mulligan, IEEE Transactions on Industrial Electronics 39 (1992), 11.
"""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import saturate, wrap
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import edge_kalman, edge_kalman_design
from .acceleration import Accelerated, acceleration_of
from .edge_kalman_design import Gains
from .estimate import estimate, largest_step

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

    halvings_max = 0

    def _passed_counts(self, axis: AxisRequirements, times_s: np.ndarray) -> np.ndarray:
        return np.minimum(1 / (axis.sample_hz * times_s), 1.0)


class Params(NamedTuple):
    """Widths of the count and of the time, bits; the largest difference of counts; the kernel of the filter."""

    count_width: int
    time_width: int
    step_max: int
    filter: edge_kalman_design.Params


class FloatParams(NamedTuple):
    count_width: int
    time_width: int
    filter: edge_kalman_design.FloatParams


class State(NamedTuple):
    """The last count, and the state of what the filter sees: the cell that the axis is in, times, and a direction.

    `cell` is the count less the displacements of the scale. `now` is the time of this sample, `at` the time of the last
    edge; `down` says whether it counted -1.
    """

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    cell: int
    now: int
    at: int
    down: int
    filter: edge_kalman_design.State


START = State(0, 0, 0, 0, 0, 0, edge_kalman_design.START)
FLOAT_START = START._replace(filter=edge_kalman_design.FLOAT_START)


class Design(Accelerated):
    """Formats, table and latency for an axis, derived as the module says.

    Attributes:
        filter: the design of the filter, on an axis with a clock of `UNITS` clocks a sample.
        step_max: largest difference of counts.
        velocity, acceleration: formats of the outputs, the filter's.

    Raises:
        ValueError: if the rates or ranges fit no format that int64 can hold, with the accepted range.
    """

    name = "count-kalman"
    gains_class = Gains
    latency = STEPS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        known = {field.name: getattr(axis, field.name) for field in dataclasses.fields(AxisRequirements)}
        self.filter = Filter(AxisRequirements(**known | {"clock_hz": UNITS * axis.sample_hz}), gains)
        self.velocity, self.acceleration = self.filter.velocity, self.filter.acceleration
        self.step_max = largest_step(axis)

    @property
    def fastest(self) -> int:
        """The velocity's word at a difference of counts that is limited at every sample."""
        return min(self.step_max << self.velocity.f, self.velocity.max)

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(self.count_width, self.filter.stamp_width, self.step_max, self.filter.params({}))

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: unrounded gains."""
        return FloatParams(self.count_width, self.filter.stamp_width, self.filter.float_params(gains, output, si))

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


@compiled
def _edge(params, step_max, state, seen, fresh):
    """Return (what the filter sees of this sample, the new state without the filter's, whether d was limited)."""
    mask = (1 << params.time_width) - 1
    now = (state.now + UNITS) & mask
    moved = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    d = saturate(moved, -step_max, step_max)
    cell = wrap(seen.count if fresh else state.cell + d, params.count_width)
    at, down = state.at, state.down
    if fresh:
        at, down = now, 0
    elif d != 0:
        at, down = (now - int(abs(d) == 1)) & mask, int(d < 0)
    # With a run of one edge the filter's watch over bursts finds none.
    edge = Seen(cell, now, at, at, at, at, 0, down, 1)
    return edge, State(1, seen.count, cell, now, at, down, state.filter), int(d != moved)


@compiled
def _with_filter(state, inner):
    return State(state.running, state.count, state.cell, state.now, state.at, state.down, inner)


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    edge, after, limited = _edge(params, params.step_max, state, seen, restart or not state.running)
    inner, velocity, flags = edge_kalman.step(params.filter, state.filter, edge, restart)
    return _with_filter(after, inner), velocity, int(limited or flags != 0)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm, as a reference for the cost of fixed point."""
    unlimited = 1 << params.count_width
    edge, after, _ = _edge(params, unlimited, state, seen, restart or not state.running)
    inner, velocity, _ = edge_kalman.float_step(params.filter, state.filter, edge, restart)
    return _with_filter(after, inner), velocity, 0


@acceleration_of.register(Params)
@compiled
def acceleration(params, state):
    return edge_kalman.acceleration(params.filter, state.filter)


@acceleration_of.register(FloatParams)
@compiled
def float_acceleration(params, state):
    return edge_kalman.float_acceleration(params.filter, state.filter)
