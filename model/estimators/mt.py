"""The M/T method: whole counts between two edges that are a window apart, over the time between them, in fixed point.

With c clocks a sample, and for the last edge its number N on the scale and its stamp S, in clocks:

    v = c (N - N') / (S - S')       N', S': the last edge that was known half a window to a whole one ago
    bound |v| <= 3 c / 2 A          the last edge was A ago, and the next is at most 1.5 counts from it

The classical method counts the edges of a sample (M) and times them (T) from the last edge before it to the last edge
in it, so that counts and time belong together and neither has a fraction. Here samples may be much shorter than the
window: two edges are kept, and every half window, of `half` samples, the newer becomes the older and the last edge the
newer. v is made anew in every sample, over half a window to a whole one; over longer if no edge came, as in the
method. While the older edge is the last one, v is held within the bound. Before there are two edges v = 0.

N is the number of the edge itself, `count + down`, not the count: after a turn the same edge has the same number, so v
is the mean velocity between two instants at which the position is known, whatever the direction. It has the edges'
errors in full, for any two edges may be of different kinds: what repeats every four edges, `period` is immune to.

Guarantee. With |f''| <= C counts/sample^2 and each edge displaced by at most p counts, v over W samples is off by at
most C W / 2 from acceleration and 2 p / W from the edges. For W between `half` and twice that, the sum is at most
C half + 2 p / half, least at half = sqrt(2 p / C): `window_s`, a whole window, is 2 sqrt(2 p q / C). p is the axis's
`edge_error_max_counts`, q a count. A clock of error in a stamp adds v / W clocks, one part in thousands.

Sources: T. Ohmae, T. Matsuda, K. Kamiyama, M. Tachikawa, A Microprocessor-Controlled High-Accuracy Wide-Range Speed
Regulator for Motor Drives, IEEE Transactions on Industrial Electronics, 1982: the M/T method. The two kept edges, and
the rule for the window, are this project's.

Formats, derived.

- `velocity` and the quotient are those of `period`.
- A sample is at most half as long as with `period`: a window of one sample then fits stamps, and a dividend, below
  c 2**(stamp_width + 7), int64.
- `edges_max`: the decoder counts at most one edge a clock, so that between two kept edges and the last one are at most
  c (2 half + 1); more are limited. The dividend is at most c edges_max 2**(f + 1), and may have `DIVIDEND_BITS`.
- An edge is forgotten after AGE_LIMIT of the stamp's range, as in `cycle_times`. The older edge was not older than that
  when it was taken, at most a window ago, so with a window of at most WINDOW_LIMIT of the range no time aliases.

At standstill v = 0, exactly, once the last edge is forgotten, or earlier if the bound is less than half an LSB. The
velocity saturates at its format's largest word, with either sign, and the flag `velocity_saturated`. Count and stamps
may wrap. The first sample, and a sample with a restart, forget the past; an edge is known once one came since.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.divide import divide
from ..arithmetic.divide import latency as divide_latency
from ..arithmetic.fixed import wrap
from ..checks import FieldError
from ..compiled import compiled
from ..quadrature import Seen, stamp_of
from ..requirements import AxisRequirements
from .estimate import EstimatorDesign, EstimatorGains, estimate
from .period import check_stamps, velocity_format

WINDOW_LIMIT = 1 / 4
"""Part of the stamp's range that a window may last, beside AGE_LIMIT of it for the age of an edge."""
DIVIDEND_BITS = 62
"""Bits of the largest dividend, which int64 holds with its sign."""
STEPS = 9
"""Clocks of the sequence besides the division: see `hardwall.hdl.estimators.mt`."""


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
    fraction: int
    quotient_width: int
    velocity_max: int


class FloatParams(NamedTuple):
    count_width: int
    stamp_width: int
    clocks: int
    half: int


class Edges(NamedTuple):
    """The last edge, the two that are kept, and the samples since the last change of these; `known` of all three."""

    running: int
    known: int
    number: int
    stamp: int
    newer_number: int
    newer_stamp: int
    older_number: int
    older_stamp: int
    phase: int


class State(NamedTuple):
    """The state; `speed` is the last quotient, without bound and sign (float: counts a sample)."""

    edges: Edges
    speed: float
    down: int


NOTHING = Edges(0, 0, 0, 0, 0, 0, 0, 0, 0)
START = State(NOTHING, 0, 0)
FLOAT_START = State(NOTHING, 0.0, 0)


class Design(EstimatorDesign):
    """Formats and latency for an axis, derived as the module says.

    Attributes:
        clocks: clocks a sample.
        half: samples of half a window.
        edges_max: the most counts between the older edge and the last.

    Raises:
        ValueError: if a sample or the window is too long for the stamps or for int64, with the accepted range.
    """

    name = "mt"
    gains_class = Gains
    inputs = tuple(name for name in Seen._fields if name != "run")

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        check_stamps(axis, spare=1)
        self.clocks = axis.clocks_per_sample
        self.velocity = velocity_format(axis)
        most = half_max(axis)
        self.half = max(1, round(min(gains.window_s * axis.sample_hz, 4.0 * most) / 2))
        if self.half > most:
            longest = 2 * most / axis.sample_hz
            raise FieldError(
                "window_s", f"must be more than 0 and at most {longest:g} at these rates, not {gains.window_s!r}"
            )
        self.edges_max = self.clocks * (2 * self.half + 1)

    @property
    def latency(self) -> int:
        return STEPS + divide_latency(self.velocity.width)

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(
            count_width=self.count_width,
            stamp_width=self.stamp_width,
            clocks=self.clocks,
            half=self.half,
            edges_max=self.edges_max,
            fraction=self.velocity.f + 1,
            quotient_width=self.velocity.width,
            velocity_max=self.velocity.max,
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: the same whole samples."""
        return FloatParams(self.count_width, self.stamp_width, self.clocks, self.half)

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


@compiled
def observe(params, edges, seen, restart):
    """Take a sample: return (edges, counts from the older edge to the last, clocks between them, age of the last).

    The age is 0 if there is no edge that is known; the counts are limited by nothing but their width.
    """
    modulus = (1 << params.stamp_width) - 1
    number = wrap(seen.count + seen.down, params.count_width)
    stamp = stamp_of(seen, seen.edge)
    age = (seen.stamp - stamp) & modulus
    first = restart or not edges.running
    news = stamp != edges.stamp or number != edges.number
    young = 0 < age < modulus - (modulus >> 2)
    known = int(not first and young and (edges.known or news))
    due = edges.phase + 1 == params.half
    if not (known and edges.known):
        edges = Edges(1, known, number, stamp, number, stamp, number, stamp, 0)
    elif due:
        edges = Edges(1, known, number, stamp, number, stamp, edges.newer_number, edges.newer_stamp, 0)
    else:
        edges = Edges(
            1,
            known,
            number,
            stamp,
            edges.newer_number,
            edges.newer_stamp,
            edges.older_number,
            edges.older_stamp,
            edges.phase + 1,
        )
    moved = wrap(number - edges.older_number, params.count_width)
    return edges, moved, (stamp - edges.older_stamp) & modulus, age if known else 0


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    edges, moved, time, age = observe(params, state.edges, seen, restart)
    speed, down = state.speed, state.down
    if age == 0:
        speed = 0
    elif time:
        counts = min(abs(moved), params.edges_max)
        speed, down = divide(params.clocks * counts << params.fraction, time, params.quotient_width), int(moved < 0)
    limit = divide(3 * params.clocks << (params.fraction - 1), age, params.quotient_width)
    far = (min(speed, limit) + 1) >> 1
    magnitude = min(far, params.velocity_max)
    return State(edges, speed, down), -magnitude if down else magnitude, int(far != magnitude)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    edges, moved, time, age = observe(params, state.edges, seen, restart)
    speed, down = state.speed, state.down
    if age == 0:
        return State(edges, 0.0, down), 0.0, 0
    if time:
        speed, down = 1.0 * params.clocks * abs(moved) / time, int(moved < 0)
    magnitude = min(speed, 1.5 * params.clocks / age)
    return State(edges, speed, down), -magnitude if down else magnitude, 0
