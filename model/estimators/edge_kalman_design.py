"""Gains, formats and state of `edge_kalman`, derived from the axis; `edge_kalman` defines the law.

`edge_kalman` defines the symbols T, M, r, v, a and D. q is a count, s the error of an edge (counts), J and C are the
bounds on jerk and acceleration. Times are in units of 2**`unit` clocks, 1 clock unless the stamp has more than
TIME_BITS bits; D is then the units in a sample. The memories, the bounds and the gains are tables: `edge_kalman_tables`
has the rule. s combines the edge's own error and, independent of it, its stamp's: 1 / sqrt(12) of the counts that pass
in a unit at that T, and no more than at the largest speed.

Formats.

- `velocity` SQ(i, f): i holds twice the largest speed; f resolves sqrt(C q), the speed that C gives within half a
  count, to 2**-SPEED_BITS, and at least the slowest edges.
- `motion`, the state v: GUARD_BITS more: corrections are rounded, and a rounding error stays for a whole memory.
- `error`, r, and the state's place x: edges times D. i holds the edges that twice the largest speed makes in two
  samples and two agile memories: a start in motion is caught up in this time. f is one more than the velocity's, less
  the bits of D: a place off by half an LSB at every edge is a velocity off by a quarter of the output's LSB.
- `a`, in counts a sample per unit: i holds 2**ACCELERATION_BITS C, at most four times the velocity's range in a unit;
  f turns the velocity by a quarter of its LSB over the longest memory.
- `acceleration`, the second output, in counts a sample^2: a D, rounded down. i holds the largest a, f resolves C to
  2**-C_BITS. D has no more bits here than a time.
- The next edge is at most 1 + m counts from the last one, m = ROOM s and at least LEAST_ROOM: ROOM s are 3.5 standard
  deviations of the difference of two edges' errors. The silence of `edge_kalman` has (2 + 2 m) D as its `bound`.
- int64 holds every product: with a time of 26 bits motion has at most 35 and acceleration too, with a gain of
  GAIN_BITS the error at most 38.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from ..arithmetic.fixed import SQ, bits_for
from ..checks import FieldError
from ..encoder import scale_map
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from . import bursts
from . import edge_kalman_tables as tables
from .acceleration import Accelerated
from .bursts import Limits, Watch, doubt_samples
from .edge_kalman_tables import HALVINGS, USUAL_SHARE
from .estimate import EstimatorGains

ROOM = 5.0
"""The excess over a count of the distance of two edges, in errors of an edge."""
LEAST_ROOM = 0.25
"""The least such distance, counts: the line has errors of its own."""
TOLERATED = 0.5
"""The silence between bursts that is tolerated, in the shortest memories for the stated error."""
SPEED_BITS = 14
"""The velocity resolves sqrt(C q), the speed that C gives within half a count, to 2**-SPEED_BITS."""
GUARD_BITS = 6
"""Bits of the state v below the output LSB."""
ACCELERATION_BITS = 3
"""The acceleration may reach 2**ACCELERATION_BITS C."""
C_BITS = 20
"""The acceleration that is given out resolves C to 2**-C_BITS."""
TIME_BITS = 27
"""The most bits of a stamp that are used; a time in use has one less."""
WORD_BITS, SHIFT_MAX = 63, 62
"""Bits of a product in int64, and the most that a word is shifted."""
MOTION_MAX, ERROR_MAX = 35, 38
"""Largest widths of velocity and acceleration, and of the error, bits."""
STEPS = 44
"""Clocks of the sequence: see `hardwall.hdl.estimators.edge_kalman`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The bounds from which the memories follow: an edge's error, counts; jerk, m/s^3; acceleration, m/s^2."""

    edge_error_counts: float
    jerk_m_per_s3: float
    acceleration_m_per_s2: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the bounds of the axis."""
        return cls(axis.edge_error_max_counts, axis.jerk_bound_m_per_s3, axis.acceleration_max_m_per_s2)


class Params(NamedTuple):
    """Widths, limits and shifts of the integer kernel; see `Design` for the formats.

    `limits` and `gains` have the tables' words, and `scale` the errors of the edges' places: none, unless it is
    replaced.
    """

    count_width: int
    unit: int
    time_bits: int
    clocks: int
    distance_max: int
    place_shift: int
    travel_shift: int
    error_max: int
    alarm_shift: int
    usual_shift: int
    halvings_max: int
    shortest: int
    velocity_shift: int
    bend_shift: int
    turn_shift: int
    turn_max: int
    velocity_max: int
    acceleration_max: int
    output_shift: int
    per_sample: int
    sample_shift: int
    bound: int
    bound_max: int
    doubt: int
    bursts: Limits
    row_bits: int
    limits: np.ndarray
    gains: np.ndarray
    scale: scale_map.Params


class FloatParams(NamedTuple):
    count_width: int
    unit: int
    time_bits: int
    per_sample: float
    bound: float
    doubt: int
    bursts: Limits
    steepest: float
    row_bits: int
    halvings_max: int
    limits: np.ndarray
    gains: np.ndarray
    scale: scale_map.Params


class State(NamedTuple):
    """The anchor (`known` if its arrival was seen), the motion there, and how long it is remembered.

    `number` and `stamp` (in units) belong to the last edge. `memory` is in half octaves (a word; float: a number).
    `place` is the place of the axis beside the anchor, `mean` the mean of the innovations (float: both in counts times
    units a sample). `share` counts edges whose innovation is larger than usual, in 2**-SHARE_BITS. velocity and
    acceleration are words (float: counts a sample, and counts a sample per unit). `halvings` is what was learned.
    """

    running: int
    known: int
    number: int
    stamp: int
    bound: float
    doubt: int
    memory: float
    place: float
    mean: float
    share: float
    velocity: float
    acceleration: float
    halvings: int
    watch: Watch


START = State(0, 0, 0, 0, 0, 0, 0, 0, 0, USUAL_SHARE, 0, 0, 0, bursts.NOTHING)
FLOAT_START = State(0, 0, 0, 0, 0.0, 0, 0.0, 0.0, 0.0, float(USUAL_SHARE), 0.0, 0.0, 0, bursts.NOTHING)


class Design(Accelerated):
    """Formats, tables and latency of the filter for an axis, derived as the module says.

    Args:
        axis, gains: as of every estimator.
        scale: the map of the scale that the hardware is to have; None for none.

    Attributes:
        scale: the argument.
        halvings_max: the most halvings of an edge's error; 0 if the filter is not to learn it.
        velocity, acceleration: formats of the outputs.
        motion, a, error: formats of v, of a, and of r and the place.
        distance: format of the number of edges passed in an interval.
        unit, time_bits: log2 of the clocks in a unit of time, and the bits of a stamp in units.
        per_sample, per_sample_f: the units in a sample as a word, and the fraction bits of the word.
        row_bits: bits of the part that a time gives of the number of a row of `limits`.
        columns: formats of the columns of `limits`.
        limits: its words, shape (rows, columns); a row's number is the halvings, then what the time gives.
        shortest: the whole octaves of the shortest memory; a rate has GAIN_BITS - 1 + `shortest` fraction bits.
        quiet_s, agile_s: the memories, s, shape (halvings, times).

    Raises:
        ValueError: if the rates or ranges fit no format that int64 can hold, with the accepted range.
    """

    name = "edge-kalman"
    gains_class = Gains
    inputs = Seen._fields
    flags = ("error_saturated", "velocity_saturated", "edges_in_bursts")
    latency = STEPS
    halvings_max: ClassVar[int] = HALVINGS

    def __init__(self, axis: AxisRequirements, gains: Gains, scale: scale_map.Design | None = None):
        super().__init__(axis, gains)
        self.scale = scale
        self.clocks = axis.clocks_per_sample
        if 4 * self.clocks > 1 << axis.stamp_width:
            raise FieldError("sample_hz", f"must be 4 or more for stamps that last a second, not {axis.sample_hz!r}")
        self.unit = max(axis.stamp_width - TIME_BITS, 0)
        self.time_bits = axis.stamp_width - self.unit
        self.row_bits = bits_for(2 * self.time_bits)
        self._unit_s = 2.0**self.unit / axis.clock_hz
        self._per_sample = self.clocks * 2.0**-self.unit
        self._apart = 1 + max(ROOM * gains.edge_error_counts, LEAST_ROOM)
        self.doubt = doubt_samples(axis)
        self._derive_tables(axis, gains)
        self.bursts = bursts.limits(axis, TOLERATED * float(self.agile_s[0].min()))
        self._derive_motion(axis)

    def _passed_counts(self, axis: AxisRequirements, times_s: np.ndarray) -> np.ndarray:
        """Return the counts that pass in the time to which an edge's time is known, by the interval before it."""
        return np.minimum(self._unit_s / times_s, axis.edges_per_clock_max)

    def _derive_tables(self, axis: AxisRequirements, gains: Gains) -> None:
        """Derive the tables, for the error that is stated and for its halves."""
        times = tables.Times(self._unit_s, self.time_bits, self._per_sample)
        own = gains.edge_error_counts * 2.0 ** -np.arange(self.halvings_max + 1)[:, None]
        passed = self._passed_counts(axis, tables.middles(np.arange(1 << self.row_bits)) * self._unit_s)
        motion = gains.jerk_m_per_s3 / axis.count_m, gains.acceleration_m_per_s2 / axis.count_m
        self.quiet_s, self.agile_s, self.limit_rates = tables.limits(
            np.hypot(own, passed / math.sqrt(12)), *motion, times
        )
        self.columns = tables.limit_formats(self.limit_rates, times)
        self.limits = tables.words(self.limit_rates, self.columns)
        self.shortest = tables.whole_octaves(int(self.limits[:, tables.AGILE_AT].min()))

    def _derive_motion(self, axis: AxisRequirements) -> None:
        """Derive the formats of the states and of the output."""
        tau, q, bound = 1 / axis.sample_hz, axis.count_m, axis.acceleration_max_m_per_s2
        i = 1 + bits_for(max(2 * axis.speed_max_counts_per_sample, 2.0))
        resolved = SPEED_BITS - math.floor(math.log2(math.sqrt(bound / q) * tau))
        slowest = 1 - math.floor(math.log2(self._per_sample * 2.0 ** (1 - self.time_bits)))
        f = min(max(resolved, slowest, 0), MOTION_MAX - GUARD_BITS - i)
        if f < 0:
            most = 2.0 ** (MOTION_MAX - GUARD_BITS - 2) * axis.velocity_unit_m_per_s
            raise FieldError("speed_max_m_per_s", f"must be at most {most:g}, not {axis.speed_max_m_per_s!r}")
        self.velocity = SQ(i, axis.shrunk(f))
        self.motion = SQ(i, self.velocity.f + GUARD_BITS)

        samples = 2 + 2 * self._agile_samples(axis)
        reach = 2 * axis.speed_max_counts_per_sample * samples + 2
        i = 1 + bits_for(reach * self._per_sample)
        f = self.velocity.f + 1 - math.floor(math.log2(self._per_sample))
        self.error = SQ(i, max(min(f, ERROR_MAX - i), 2 - i))
        widest = WORD_BITS - scale_map.FRACTION_BITS - self.clocks.bit_length()
        self.distance = SQ(min(1 + bits_for(reach), axis.count_width, widest), 0)

        longest = bits_for(self.quiet_s.max() / self._unit_s)
        finest = min(self.velocity.f + 2 + longest, self.motion.f + self._rate_f)
        i = 1 + ACCELERATION_BITS + bits_for(bound * tau * self._unit_s / q)
        i = min(max(i, 2 - finest), self.motion.i + 2)
        self.a = SQ(i, min(finest, MOTION_MAX - i))
        cut = max(self.clocks.bit_length() - self.time_bits, 0)
        self.per_sample, self.per_sample_f = self.clocks >> cut, self.unit - cut
        finest = C_BITS - math.floor(math.log2(bound * tau**2 / q))
        i += bits_for(self._per_sample)
        self.acceleration = SQ(i, max(min(finest, self.a.f + self.per_sample_f), 2 - i))

    def _agile_samples(self, axis: AxisRequirements) -> float:
        """Return the agile memory for an edge a sample, in samples."""
        row = min(2 * bits_for(max(self._per_sample, 1.0)), self.agile_s.shape[1] - 1)
        return float(self.agile_s[0, row]) * axis.sample_hz

    @property
    def _rate_f(self) -> int:
        """The fraction bits of a rate."""
        return tables.GAIN_BITS - 1 + self.shortest

    def params(self, words: Mapping[str, int]) -> Params:
        v, a, e, rate_f = self.motion, self.a, self.error, self._rate_f
        bound_max = 2 * self.velocity.max << GUARD_BITS
        return Params(
            count_width=self.count_width,
            unit=self.unit,
            time_bits=self.time_bits,
            clocks=self.clocks,
            distance_max=self.distance.max,
            place_shift=self.unit - e.f + scale_map.FRACTION_BITS,
            travel_shift=v.f - e.f,
            error_max=e.max,
            alarm_shift=min(e.f - self.columns[tables.ALARM_AT].f, SHIFT_MAX),
            usual_shift=min(e.f - self.columns[tables.USUAL].f, SHIFT_MAX),
            halvings_max=self.halvings_max,
            shortest=self.shortest,
            velocity_shift=e.f + rate_f - v.f,
            bend_shift=v.f + rate_f - a.f,
            turn_shift=a.f - v.f,
            turn_max=(1 << v.width) - 1,
            velocity_max=self.velocity.max << GUARD_BITS,
            acceleration_max=a.max,
            output_shift=GUARD_BITS,
            per_sample=self.per_sample,
            sample_shift=a.f + self.per_sample_f - self.acceleration.f,
            bound=min(math.floor(2 * self._apart * self._per_sample * 2.0**v.f), bound_max << self.time_bits - 1),
            bound_max=bound_max,
            doubt=self.doubt,
            bursts=self.bursts,
            row_bits=self.row_bits,
            limits=self.limits,
            gains=tables.gain_words(),
            scale=scale_map.nothing(),
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: unrounded gains."""
        steepest = 2.0 ** (self.a.i - 1)
        return FloatParams(
            count_width=self.count_width,
            unit=self.unit,
            time_bits=self.time_bits,
            per_sample=self._per_sample,
            bound=2 * self._apart * self._per_sample,
            doubt=self.doubt,
            bursts=self.bursts,
            steepest=steepest,
            row_bits=self.row_bits,
            halvings_max=self.halvings_max,
            limits=self.limit_rates,
            gains=tables.gain_rates(),
            scale=scale_map.nothing(True),
        )

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START
