"""Two kept edges and the last one: the state of the M/T estimators, and their velocity.

With c clocks a sample, and for the last edge its number N on the scale and its stamp S, in clocks:

    v = c (N - N') / (S - S')       N', S': the last edge that was known half a window to a whole one ago
    bound |v| <= 3 c / 2 A          the last edge was A ago, and the next is at most 1.5 counts from it

Every half window, of `half` samples, the newer of two kept edges becomes the older and the last edge the newer.
`observe` holds |N - N'|, its sign and S - S' while the older edge is the last one. Before there are two edges, and once
the last one is forgotten, |N - N'| is 0. Every estimator whose hardware rounds this velocity exactly, by any
arithmetic, uses these kernels: `mt` says what it is good for and guarantees, `mt_divisionless` is the other.

Bursts. Some encoders emit their edges several at once, after a silence that is no sign of a slower axis. An edge shows
such an encoder if the last age before it was more than 3/2 counts at the new speed: 2 |N - N'| A > 3 (S - S'). For
`bursts.doubt_samples` from then on the speed is not bounded.

Formats, derived.

- `velocity` and the quotient have the formats of `period`.
- A sample is at most half as long as with `period`: a window of one sample then fits stamps, and a dividend, below
  c 2**(stamp_width + 7), int64.
- `edges_max`: the decoder counts at most one edge a clock: between two kept edges and the last one are at most c (2
  half + 1); more are limited. The dividend is at most c edges_max 2**(f + 1), and may have `DIVIDEND_BITS`.
- An edge is forgotten after AGE_LIMIT of the stamp's range, as in `cycle_times`. The older edge was no older than that
  when it was taken, at most a window ago. So with a window of at most WINDOW_LIMIT of the range no time aliases.

The first sample, and a sample with a restart, forget the past; an edge is known once one came since.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.divide import divide
from ..arithmetic.fixed import wrap
from ..checks import FieldError
from ..encoder.quadrature import Seen, stamp_of
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import bursts
from .bursts import Limits, Watch, doubt_samples, watch
from .estimate import EstimatorDesign, EstimatorGains, estimate
from .period import check_stamps, velocity_format

WINDOW_LIMIT = 1 / 4
"""Part of the stamp's range that a window may last, beside AGE_LIMIT of it for the age of an edge."""
TOLERATED = 1 / 8
"""The silence between bursts that is tolerated, in windows."""
DIVIDEND_BITS = 62
"""Bits of the largest dividend, which int64 holds with its sign."""
LATENCY = 6
"""Clocks from the strobe to the edges of a sample: see `hardwall.hdl.estimators.kept_edges`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The longest time between the two edges of an estimate, if edges come, s."""

    window_s: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the minimax window for |f''| <= C and the axis's error of single edges: 2 sqrt(2 p q / C)."""
        displaced_m = axis.edge_error_max_counts * axis.count_m
        wanted = 2 * math.sqrt(2 * displaced_m / axis.acceleration_max_m_per_s2)
        return cls(min(wanted, 2 * max(half_max(axis), 1) / axis.sample_hz))


def half_max(axis: AxisRequirements) -> int:
    """Return the largest half of a window that stamps and dividend allow, samples: 1 or more if a sample is allowed."""
    clocks = axis.clocks_per_sample
    fraction = velocity_format(axis).f + 1 + axis.estimator_bits_dropped
    of_stamps = int(WINDOW_LIMIT * 2.0**axis.stamp_width) // (2 * clocks)
    return min(of_stamps, ((1 << DIVIDEND_BITS) // (clocks * clocks << fraction) - 1) // 2)


class Params(NamedTuple):
    """Parameters of the integer kernel: widths, clocks a sample, samples of half a window, the quotient's format."""

    count_width: int
    stamp_width: int
    clocks: int
    half: int
    edges_max: int
    doubt: int
    bursts: Limits
    fraction: int
    quotient_width: int
    velocity_max: int


class FloatParams(NamedTuple):
    count_width: int
    stamp_width: int
    clocks: int
    half: int
    edges_max: int
    doubt: int
    bursts: Limits


class Edges(NamedTuple):
    """The state: edges, the samples since the last change of the kept ones, and what was between two of them.

    `known` is of all three edges, `moved` the magnitude of the counts from the older edge to the last, and `time` the
    clocks between them.
    """

    running: int
    known: int
    number: int
    stamp: int
    newer_number: int
    newer_stamp: int
    older_number: int
    older_stamp: int
    phase: int
    moved: int
    down: int
    time: int
    quiet: int
    doubt: int


class State(NamedTuple):
    """The state of an estimator: of its edges, and of the watch over bursts."""

    edges: Edges
    watch: Watch


NOTHING = Edges(*(int(name == "time") for name in Edges._fields))


class KeptDesign(EstimatorDesign):
    """Formats for an axis, derived as the module says; a subclass has the name, and the latency of its arithmetic.

    Attributes:
        clocks: clocks a sample.
        half: samples of half a window.
        edges_max: the most counts between the older edge and the last.

    Raises:
        ValueError: if a sample or the window is too long for the stamps or for int64, with the accepted range.
    """

    gains_class = Gains
    inputs = Seen._fields
    flags = ("velocity_saturated", "edges_in_bursts")

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        check_stamps(axis, spare=1)
        self.clocks, self.doubt = axis.clocks_per_sample, doubt_samples(axis)
        self.velocity = velocity_format(axis)
        most = half_max(axis)
        self.half = max(1, round(min(gains.window_s * axis.sample_hz, 4.0 * most) / 2))
        if self.half > most:
            longest = 2 * most / axis.sample_hz
            raise FieldError(
                "window_s", f"must be more than 0 and at most {longest:g} at these rates, not {gains.window_s!r}"
            )
        self.edges_max = self.clocks * (2 * self.half + 1)
        self.bursts = bursts.limits(axis, TOLERATED * 2 * self.half / axis.sample_hz)

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(
            count_width=self.count_width,
            stamp_width=self.stamp_width,
            clocks=self.clocks,
            half=self.half,
            edges_max=self.edges_max,
            doubt=self.doubt,
            bursts=self.bursts,
            fraction=self.velocity.f + 1,
            quotient_width=self.velocity.width,
            velocity_max=self.velocity.max,
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: the same whole samples."""
        held = self.half, self.edges_max, self.doubt, self.bursts
        return FloatParams(self.count_width, self.stamp_width, self.clocks, *held)

    def start(self, floating: bool = False) -> State:
        return State(NOTHING, bursts.NOTHING)


@compiled
def observe(params, edges, seen, restart):
    """Take a sample: return (edges, age of the last edge), an age of 0 if there is no edge that is known."""
    modulus = (1 << params.stamp_width) - 1
    number = wrap(seen.count + seen.down, params.count_width)
    stamp = stamp_of(seen, seen.edge)
    age = (seen.stamp - stamp) & modulus
    first = restart or not edges.running
    news = stamp != edges.stamp or number != edges.number
    young = 0 < age < modulus - (modulus >> 2)
    known = int(not first and young and (edges.known or news))
    newer_number, newer_stamp, older_number, older_stamp = number, stamp, number, stamp
    phase = 0
    if known and edges.known:
        if edges.phase + 1 == params.half:
            older_number, older_stamp = edges.newer_number, edges.newer_stamp
        else:
            newer_number, newer_stamp = edges.newer_number, edges.newer_stamp
            older_number, older_stamp = edges.older_number, edges.older_stamp
            phase = edges.phase + 1
    between, passed = wrap(number - older_number, params.count_width), (stamp - older_stamp) & modulus
    moved, down, time = edges.moved, edges.down, edges.time
    if not known:
        moved = 0
    elif passed:
        moved, down, time = min(abs(between), params.edges_max), int(between < 0), passed
    # An edge after so long a silence, in so fast a motion, shows that edges come in bursts.
    doubt = max(edges.doubt - 1, 0)
    if not known:
        doubt = 0
    elif news and 2 * moved * edges.quiet > 3 * time:
        doubt = params.doubt
    edges = Edges(
        running=1,
        known=known,
        number=number,
        stamp=stamp,
        newer_number=newer_number,
        newer_stamp=newer_stamp,
        older_number=older_number,
        older_stamp=older_stamp,
        phase=phase,
        moved=moved,
        down=down,
        time=time,
        quiet=age if known else 0,
        doubt=doubt,
    )
    return edges, age if known else 0


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    edges, age = observe(params, state.edges, seen, restart)
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    speed = divide(params.clocks * edges.moved << params.fraction, edges.time, params.quotient_width)
    limit = divide(3 * params.clocks << (params.fraction - 1), age, params.quotient_width)
    far = ((speed if edges.doubt else min(speed, limit)) + 1) >> 1
    magnitude = min(far, params.velocity_max)
    return State(edges, watched), -magnitude if edges.down else magnitude, int(far != magnitude) | clumped << 1


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    edges, age = observe(params, state.edges, seen, restart)
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    speed = 1.0 * params.clocks * edges.moved / edges.time
    limit = 1.5 * params.clocks / age if age else 0.0
    magnitude = speed if edges.doubt else min(speed, limit)
    return State(edges, watched), -magnitude if edges.down else magnitude, clumped << 1
