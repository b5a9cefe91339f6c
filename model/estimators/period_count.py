"""Velocity by the time of one encoder cycle at low speed, and by the counts of a window at high speed: the classical
switching.

With c clocks a sample, velocities in counts a sample and times in clocks:

    slow    v = 4 c / max(D, B)     D: from the last edge back to the one of its kind a cycle before, in one direction
                                    B: from now back to the edge three before the last; the next completes a cycle
    fast    v = n / w               n: counts moved in the last full window of w = 2**k samples, held for the next

The slow speed needs no multiplication, only one division of a constant by the larger of D and B. Like `period` it is
immune to misplaced edges, because it subtracts only stamps of the same kind; but after a turn it reads 0 until there is
a cycle in the new direction.

Errors, with |f''| <= C in counts and samples. A cycle's stamps are late by less than a clock: an error of v^2 / 4 c.
Its speed is the speed D / 2 ago plus up to a gap: an error of 3 C / v. A window's counts are off by less than one: an
error of 1 / w. Its speed is the speed w / 2 to 3 w / 2 ago: an error of 3 C w / 2. So w = sqrt(2 / 3 C) is the best
window. Counting is the better of the two above the switching speed. There v^2 / 4 c equals the window's error, 1 / w +
3 C w / 2. It is also at most CYCLE_SPEED, since an axis that makes more than a cycle in a sample leaves no single cycle
to be timed. The run-time word goes no higher than a cycle a sample.

Counting begins with a window of more than `switch` counts, and timing again with a window of fewer than `switch` - 1.
This is a hysteresis of two counts. At constant speed windows differ by less: the floor of a length takes two values, or
three with edges a quarter count out of place. At a switch v jumps by at most the sum of both errors.

`period` uses all cycles in a sample, so its stamps add an error of at most v / c; a window of one sample is off by 1.
With the same stamps `period` is better than counting at all speeds (v <= c). Only a window longer than the mean of
`period`, over a sample or a cycle, changes this. This estimator is the published scheme for comparison.

Source: Brown, Schneider, Mulligan, IEEE Trans. Industrial Electronics 1992: fixed time, fixed position, switching.

Formats. `velocity` is derived as in `period`, with at least k fraction bits, so that n / w is exact. A window may be no
longer than half the counter's range at twice the largest speed, so that n does not alias. D, B and ages are as in
`period`: v = 0, exactly, when B is AGE_LIMIT of the stamp's range. Count and stamps may wrap; the largest step makes a
fast window, and no cycle. While edges come in bursts the flag `edges_in_bursts` is up, see `bursts`. Both speeds
saturate at the format, with the flag `velocity_saturated`. After the first sample or a restart, v = 0 until there are
five edges in one direction, or a fast window.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.divide import divide
from ..arithmetic.divide import latency as divide_latency
from ..arithmetic.fixed import UQ, bits_for, saturate, wrap
from ..checks import FieldError
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word
from . import bursts, cycle_times
from .bursts import Limits, Watch, watch
from .cycle_times import NOTHING, Memory, observe
from .estimate import EstimatorDesign, EstimatorGains, estimate
from .period import check_stamps, velocity_format

CYCLE_SPEED = 3.0
"""Highest switching speed, counts a sample: even with a misplaced edge a sample has at most the four of a cycle."""
SWITCH_MIN = 2
"""Fewest counts a window at which to switch: with fewer, the hysteresis would never return to timing."""
STEPS = cycle_times.LATENCY + 2
"""Clocks of the sequence besides the division: see `hardwall.hdl.estimators.period_count`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The window to count over, rounded to a power of two of samples, and the speed above which to count."""

    window_s: float
    switch_m_per_s: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the best window for the axis's bound on the acceleration, and the speed at which it beats a cycle."""
        acceleration = axis.acceleration_max_m_per_s2 / (axis.count_m * axis.sample_hz**2)
        window = 1 << min(max(round(math.log2(2 / (3 * acceleration)) / 2), 0), _window_bits_max(axis))
        error = 1 / window + 1.5 * acceleration * window
        speed = min(math.sqrt(4 * axis.clocks_per_sample * error), CYCLE_SPEED)
        switch = min(max(round(speed * window), SWITCH_MIN), (1 << (axis.count_width - 1)) - 1)
        return cls(window / axis.sample_hz, switch / window * axis.velocity_unit_m_per_s)


class Params(NamedTuple):
    count_width: int
    stamp_width: int
    window: int
    switch: int
    bursts: Limits
    dividend: int
    quotient_width: int
    shift: int  # left shift from a window's counts to the velocity's format
    velocity_max: int


class FloatParams(NamedTuple):
    count_width: int
    stamp_width: int
    window: int
    switch: int
    bursts: Limits
    clocks: int


class State(NamedTuple):
    """The state: `cycle` is D (0: none), `first` the window's first count, `moved` the counts of the last window."""

    memory: Memory
    watch: Watch
    cycle: int
    samples: int
    first: int
    moved: int
    counting: int


START = State(NOTHING, bursts.NOTHING, 0, 0, 0, 0, 0)


def _window_bits_max(axis) -> int:
    """Return log2 of the longest window, samples, in which the count cannot alias."""
    return max(axis.count_width - 1 - bits_for(2 * max(axis.speed_max_counts_per_sample, 1.0)), 0)


class Design(EstimatorDesign):
    """Formats, run-time word and latency for an axis, derived as the module says.

    Attributes:
        window_bits: log2 of the window, samples.
        words: `period_count_switch`.

    Raises:
        ValueError: if the gains or the axis do not fit formats that int64 can hold, with the accepted range.
    """

    name = "period-count"
    gains_class = Gains
    inputs = Seen._fields
    flags = ("velocity_saturated", "edges_in_bursts")
    cycles_max = 2
    """More than one cycle in a sample is not timed, so only 0, 1 and more must be distinguished."""

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        check_stamps(axis)
        tau, most = 1 / axis.sample_hz, _window_bits_max(axis)
        self.window_bits = round(math.log2(gains.window_s / tau))
        if not 0 <= self.window_bits <= most:
            raise FieldError("window_s", f"must be {tau:g} to {tau * 2**most:g} at these rates, not {gains.window_s!r}")
        self.clocks, self.bursts = axis.clocks_per_sample, bursts.limits(axis)
        self.velocity = velocity_format(axis, self.window_bits)
        # Above a cycle a sample no cycle is timed: the largest word switches at just that speed.
        fmt = UQ(min(self.window_bits + 2, axis.count_width - 1), 0)
        unit = axis.velocity_unit_m_per_s / 2**self.window_bits
        if not SWITCH_MIN <= round(gains.switch_m_per_s / unit) <= fmt.max:
            raise FieldError(
                "switch_m_per_s",
                f"must be {SWITCH_MIN * unit:g} to {fmt.max * unit:g} with this window, not {gains.switch_m_per_s!r}",
            )
        self.switch = Word(
            "period_count_switch",
            fmt,
            unit,
            "m/s",
            fmt.from_real(gains.switch_m_per_s / unit),
            "speed above which counts of a window are taken rather than the time of a cycle",
        )
        self.words = (self.switch,)

    @property
    def dividend(self) -> int:
        """The constant that is divided by D or B: 4 c, with one fraction bit more than the velocity."""
        return 4 * self.clocks << (self.velocity.f + 1)

    @property
    def latency(self) -> int:
        return STEPS + divide_latency(self.velocity.width)

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(
            count_width=self.count_width,
            stamp_width=self.stamp_width,
            window=1 << self.window_bits,
            switch=words["period_count_switch"],
            bursts=self.bursts,
            dividend=self.dividend,
            quotient_width=self.velocity.width,
            shift=self.velocity.f - self.window_bits,
            velocity_max=self.velocity.max,
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters; like the integer kernel it switches at whole counts."""
        word = self.switch
        switch = word.from_si(si["period_count_switch"]) if "period_count_switch" in si else word.reset
        window = 1 << self.window_bits
        return FloatParams(self.count_width, self.stamp_width, window, switch, self.bursts, self.clocks)

    def start(self, floating: bool = False) -> State:
        return START


@compiled
def _count(params, state, seen, restart):
    """Return (samples of the window so far, count at its begin, counts of the last full window, whether to count)."""
    if restart or not state.memory.running:
        return 0, seen.count, 0, 0
    if state.samples < params.window - 1:
        return state.samples + 1, state.first, state.moved, state.counting
    moved = wrap(seen.count - state.first, params.count_width)
    counting = abs(moved) > params.switch or (state.counting and abs(moved) >= params.switch - 1)
    return 0, seen.count, moved, int(counting)


@compiled
def _sample(params, state, seen, restart):
    """Take one sample: return (state, the clocks of a cycle that give the slow speed, 0: none; whether in bursts)."""
    samples, first, moved, counting = _count(params, state, seen, restart)
    memory, times = observe(params, state.memory, seen, restart)
    # With more than one cycle in a sample the last timed cycle stays, until counting begins.
    cycle = state.cycle if times.age and (not times.news or times.cycles > 1) else 0
    if times.age and times.news and times.cycles == 1:
        cycle = times.cycle
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    state = State(memory, watched, cycle, samples, first, moved, counting)
    return state, max(cycle, times.cycle_age) if cycle and times.cycle_age else 0, clumped


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    state, clocks, clumped = _sample(params, state, seen, restart)
    if state.counting:
        far = state.moved << params.shift
    else:
        far = (divide(params.dividend, clocks, params.quotient_width) + 1) >> 1 if clocks else 0
        far = -far if seen.down else far
    velocity = saturate(far, -params.velocity_max, params.velocity_max)
    return state, velocity, int(velocity != far) | clumped << 1


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    state, clocks, clumped = _sample(params, state, seen, restart)
    if state.counting:
        return state, state.moved / params.window, clumped << 1
    speed = 4.0 * params.clocks / clocks if clocks else 0.0
    return state, -speed if seen.down else speed, clumped << 1
