"""Velocity as the difference of successive counts: the baseline to which every estimator is compared.

Limits. The difference is taken modulo the count's width, so the count may wrap. A step, or a speed, of more than twice
the largest speed saturates for that sample alone. The first sample, a sample with `restart`, and standstill all read 0;
after a reset in motion the velocity is right from the second sample on.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, saturate, wrap
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from .estimate import EstimatorDesign, EstimatorGains, estimate, whole_counts


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """A finite difference has no gains."""

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        return cls()


class Params(NamedTuple):
    count_width: int
    velocity_max: int


class State(NamedTuple):
    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name


class FloatParams(NamedTuple):
    count_width: int


START = State(0, 0)


class Design(EstimatorDesign):
    """Formats of the finite difference for an axis.

    The velocity is a whole number of counts a sample. Its range is twice the axis's largest speed, so an overshooting
    loop is still read correctly. Beyond that range the velocity saturates, with the flag `velocity_saturated`.
    """

    name = "fdm"
    gains_class = Gains
    latency = 2

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self.velocity = SQ(whole_counts(axis).i, axis.shrunk(0))

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(self.count_width, self.velocity.max)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        return FloatParams(self.count_width)

    def start(self, floating: bool = False) -> State:
        return START


@compiled
def _difference(width, state, count, restart):
    return wrap(count - state.count, width) if state.running and not restart else 0


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    difference = _difference(params.count_width, state, seen.count, restart)
    velocity = saturate(difference, -params.velocity_max - 1, params.velocity_max)
    return State(1, seen.count), velocity, int(velocity != difference)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    return State(1, seen.count), float(_difference(params.count_width, state, seen.count, restart)), 0
