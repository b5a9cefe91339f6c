"""Velocity as the mean of the last two differences of counts: a worked example of an estimator.

    v = (d_k + d_{k-1}) / 2                  counts a sample
    d_k = f_k - f_{k-1}                      modulo the count's width

Formats, derived. The velocity has one fraction bit, so that half a count a sample is exact: nothing is rounded. Its
range is twice the axis's largest speed, like the range of the finite difference.

Ends. Every difference is taken modulo the count's width, so the count may wrap; their sum is one bit wider, so it does
not wrap. A velocity beyond the range saturates, with the flag `velocity_saturated`. The first sample, and every sample
with `restart`, reads 0, and the sample after it has only one difference, which counts half. Standstill reads 0.

Source: elementary.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, bits_for, saturate, wrap
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from .estimate import EstimatorDesign, EstimatorGains, estimate


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """A mean of two differences has no gains."""

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        return cls()


class Params(NamedTuple):
    """The count's width, and the largest velocity word."""

    count_width: int
    velocity_max: int


class FloatParams(NamedTuple):
    """The count's width."""

    count_width: int


class State(NamedTuple):
    """Whether a sample was taken, the last count, and the last difference."""

    running: int
    last: int
    moved: int


START = State(0, 0, 0)


class Design(EstimatorDesign):
    """Formats of the mean of two differences for an axis, as the module derives them."""

    name = "two-step"
    gains_class = Gains
    latency = 2

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        # The word is the sum of two differences: `hardwall bits` can drop none of its bits.
        self.velocity = SQ(1 + max(1, bits_for(2 * axis.speed_max_counts_per_sample)), 1 + axis.shrunk(0))

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(self.count_width, self.velocity.max)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        return FloatParams(self.count_width)

    def start(self, floating: bool = False) -> State:
        return START


@compiled
def _take(width, state, count, restart):
    """Return the sum of the last two differences, and the state after this sample."""
    if restart or not state.running:
        return 0, State(1, count, 0)
    moved = wrap(count - state.last, width)
    return moved + state.moved, State(1, count, moved)


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    # The velocity has one fraction bit, so its word is the sum of two differences.
    change, state = _take(params.count_width, state, seen.count, restart)
    velocity = saturate(change, -params.velocity_max - 1, params.velocity_max)
    return state, velocity, int(velocity != change)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    change, state = _take(params.count_width, state, seen.count, restart)
    return state, change / 2, 0
