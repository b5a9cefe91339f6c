"""Velocity from the time of whole encoder cycles between the clock stamps of their edges, in fixed point.

Only edges of the same kind are subtracted, so the estimator is immune to misplaced edges: see `cycle_times`. With c
clocks a sample, velocities in counts a sample and times in clocks:

    cycle    v = 4 m c / D      from the last edge of its kind at the previous sample to the last edge: m cycles in D
    gap      v = c / g          until there is such a cycle in this direction: the last two edges are g apart
    bound    |v| <= 3 c / 2 A   the last edge was A ago, and the next is at most 1.5 counts from it
             |v| <= 4 c / B     the edge three before it was B ago, and the next is of the same kind as that edge

A cycle is used only if all its edges went in one direction, as far as samples show: if a sample hides a turn and a turn
back, v is the mean over it. All cycles within one sample are used (m > 1), so the mean is over a sample or a cycle,
whichever is longer. The relative error of a gap is twice the encoder's error. Gaps are used for at most four edges
after a turn. (RMS error for the paper's signal at 1 MHz, in mm/s: v = 0 until there is a cycle 0.120; half of the gap's
speed 0.101; all edges since the turn 0.094; the gap 0.092.) With only one edge in this direction v = 0.

Both bounds hold wherever the edges are: the first for errors up to a quarter of a count, the second for any error. At
constant speed the second bound is reached just as the next edge is due. The first becomes the tighter one as the axis
slows. (Without the first bound the error is 0.097 instead of 0.092. The bound c / A holds only for an ideal encoder: it
gives 0.086 there and 1.25 with a phase error of a quarter count.)

Accuracy: a stamp is late by less than a clock. So a cycle's v is off by less than v / D, that is v^2 / 4 c counts a
sample. Also, v is the velocity D / 2 ago, off by at most C D / 2 if |f''| <= C. The two errors are equal at v = (4 c
C)^(1/3), the design speed.

Source: Brown, Schneider, Mulligan, IEEE Trans. Industrial Electronics 1992, fixed-position methods; Ohmae et al. 1982,
the M/T method; the bound by the time since the last edge is classical.

Formats, derived.

- `velocity` SQ(i, f): i holds twice the largest speed. The rounding, half an LSB, is at most ERROR_SHARE of the slowest
  readable speed, one cycle in the age limit, and so of every speed. f follows from clock and rate alone.
- The quotient is unsigned and has one bit more for rounding half up, so it is as wide as `velocity`.
- Cycles: the decoder counts at most one edge a clock, so a sample has at most ceil(c / 4) cycles; more are limited.

At standstill v is exactly 0 once the last edge is AGE_LIMIT of the stamp's range ago. It is 0 earlier if the bound is
less than half an LSB. If a cycle lasts longer than that, v is read from gaps; if a gap lasts longer, v = 0. Twice the
largest speed fits the format; the largest step of position is a cycle's mean like any other.

Bursts. An encoder that emits its edges several at once has no cycles to be timed: the flag `edges_in_bursts` says so,
see `bursts`.

The velocity saturates at its format's largest word, with either sign, and the flag `velocity_saturated`. Count and
stamps may wrap. The first sample, and a sample with a restart, forget the past: v = 0 until there are two new edges.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.divide import divide
from ..arithmetic.divide import latency as divide_latency
from ..arithmetic.fixed import SQ, bits_for
from ..checks import FieldError
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import bursts, cycle_times
from .bursts import Limits, Watch, watch
from .cycle_times import AGE_LIMIT, NOTHING, Memory, observe
from .estimate import EstimatorDesign, EstimatorGains, estimate

ERROR_SHARE = 0.01
"""The largest rounding error, as a part of any speed that can be read."""
DIVIDEND_BITS = 56
"""Most bits of stamp and sample together: a dividend, at most c 4 ceil(c / 4) 2**(f + 1) < 2**(stamp_width + 6) c, is
then an int64."""
STEPS = cycle_times.LATENCY + 2
"""Clocks of the sequence besides the division."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The gains of `period`: none."""

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        return cls()


class Params(NamedTuple):
    """Parameters of the integer kernel: widths, clocks a sample, most cycles in a sample, and the quotient's format."""

    count_width: int
    stamp_width: int
    clocks: int
    cycles_max: int
    bursts: Limits
    fraction: int
    quotient_width: int
    velocity_max: int


class FloatParams(NamedTuple):
    count_width: int
    stamp_width: int
    clocks: int
    cycles_max: int
    bursts: Limits


class State(NamedTuple):
    """The state; `speed` is the speed of the last cycle or gap, without bound and sign (float: counts a sample)."""

    memory: Memory
    watch: Watch
    speed: float


START = State(NOTHING, bursts.NOTHING, 0)
FLOAT_START = State(NOTHING, bursts.NOTHING, 0.0)


def check_stamps(axis, spare: int = 0) -> None:
    """Raise ValueError if the samples of an axis are too long for its stamps to distinguish edges.

    An estimator that needs `spare` more bits, in the stamp and in the dividend, takes samples shorter by as much.
    """
    longest = 1 << min(axis.stamp_width - 2, DIVIDEND_BITS - axis.stamp_width) - spare
    if axis.clocks_per_sample > longest:
        raise FieldError(
            "sample_hz",
            f"must be at least {axis.clock_hz / longest:g} at clock_hz {axis.clock_hz}, not {axis.sample_hz!r}",
        )


def velocity_format(axis, least_fraction: int = 0) -> SQ:
    """Return the format that the module derives, with `least_fraction` fraction bits or more.

    Raises:
        ValueError: if int64 cannot hold a word of that format.
    """
    clocks, speed = axis.clocks_per_sample, axis.speed_max_counts_per_sample
    slowest = 4 * clocks / (AGE_LIMIT * 2.0**axis.stamp_width)
    i, f = 1 + max(1, bits_for(2 * speed)), max(bits_for(0.5 / (ERROR_SHARE * slowest)), least_fraction)
    if i + f > 62:
        most = 2.0 ** (60 - f) * axis.velocity_unit_m_per_s
        raise FieldError("speed_max_m_per_s", f"must be at most {most:g}, not {axis.speed_max_m_per_s!r}")
    return SQ(i, axis.shrunk(f))


class Design(EstimatorDesign):
    """Formats and latency for an axis, derived as the module says.

    Raises:
        ValueError: if a sample is too long for the stamps, or the dividend for int64, with the accepted range.
    """

    name = "period"
    gains_class = Gains
    inputs = Seen._fields
    flags = ("velocity_saturated", "edges_in_bursts")

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        check_stamps(axis)
        self.clocks = axis.clocks_per_sample
        self.velocity = velocity_format(axis)
        self.cycles_max, self.bursts = (self.clocks + 3) // 4, bursts.limits(axis)

    @property
    def latency(self) -> int:
        return STEPS + divide_latency(self.velocity.width)

    def params(self, words: Mapping[str, int]) -> Params:
        limits = self.cycles_max, self.bursts
        quotient = self.velocity.f + 1, self.velocity.width
        return Params(self.count_width, self.stamp_width, self.clocks, *limits, *quotient, self.velocity.max)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        return FloatParams(self.count_width, self.stamp_width, self.clocks, self.cycles_max, self.bursts)

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


@compiled
def bound(times):
    """Return the tighter of the two bounds on the speed, as (twice its counts, clocks)."""
    tighter = times.cycle_age and 8 * times.age < 3 * times.cycle_age
    return (8, times.cycle_age) if tighter else (3, times.age)


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    memory, times = observe(params, state.memory, seen, restart)
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    speed = state.speed
    if times.age == 0:
        speed = 0
    elif times.news:
        unit = params.clocks << params.fraction
        speed = 0
        if times.cycles:
            speed = divide(unit * 4 * min(times.cycles, params.cycles_max), times.cycle, params.quotient_width)
        elif times.gap:
            speed = divide(unit, times.gap, params.quotient_width)
    counts, clocks = bound(times)
    limit = divide(params.clocks * counts << (params.fraction - 1), clocks, params.quotient_width)
    far = (min(speed, limit) + 1) >> 1
    magnitude = min(far, params.velocity_max)
    return State(memory, watched, speed), -magnitude if seen.down else magnitude, int(far != magnitude) | clumped << 1


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    memory, times = observe(params, state.memory, seen, restart)
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    speed = state.speed
    if times.age == 0:
        return State(memory, watched, 0.0), 0.0, 0
    if times.news:
        speed = 0.0
        if times.cycles:
            speed = 4.0 * params.clocks * times.cycles / times.cycle
        elif times.gap:
            speed = 1.0 * params.clocks / times.gap
    counts, clocks = bound(times)
    magnitude = min(speed, 0.5 * params.clocks * counts / clocks)
    return State(memory, watched, speed), -magnitude if seen.down else magnitude, clumped << 1
