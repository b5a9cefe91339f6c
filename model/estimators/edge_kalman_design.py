"""Gains, formats, tables and state of `edge_kalman`, derived from the axis; `edge_kalman` defines the law.

`edge_kalman` defines the symbols T, M, r, v, a and D. q is a count, s the error of an edge (counts), J and C are the
bounds on jerk and acceleration. Times are in units of 2**`unit` clocks, 1 clock unless the stamp has more than
TIME_BITS bits; D is then the units in a sample.

The rule. A memory M averages over the M / T edges in it, so the place of the axis is known to about s sqrt(T / M).
Within M the motion may change unforeseen: by J M**3 through its jerk, and at an impact by C M**2 through a jump of its
acceleration. At each of the two memories, this change is a constant share of the place's error:

    J M_quiet**3 = QUIET s q sqrt(T / M_quiet)            C M_agile**2 = AGILE s q sqrt(T / M_agile)

and M_agile is at most M_quiet. Neither is below T / 2. s combines the edge's own error and, independent of it, the
stamp's error: 1 / sqrt(12) of the counts that pass in a unit at that T, and no more than at the largest speed. The
shares, ALARM, GROWTH and what decides on the error were chosen by measurement, with the impact's C and the jerk of the
paper's swing. They are the same for every axis.

Two tables. T is known by its top two bits, that is to half an octave: a row stands for the times from 2 to 3, or from 3
to 4, times a power of two. It is computed for the geometric middle, sqrt(3/2) / 2 * 2**(row / 2) units. A memory is
counted in the same half octaves, with MEMORY_BITS fraction bits; the nearest whole one gives the gains.

`limits`, by the number of halvings of the edge's error and the row of T:

- `blend` UQ(0, 16): the share of r in the mean z. It is T's share of an agile memory.
- `alarm`, 18 bits: the bound on |z|. In the steady state r has the variance s**2 / (1 - K_x), and is white.
- `usual`, 18 bits: the mean of |r|, sqrt(2 / pi) s / sqrt(1 - K_x). Both take the K_x of the quiet memory.
- `quiet` and `agile` UQ(6, 4): the memories.

`gains`, by T / M to half an octave, and by the parity of the memory's half octaves:

- `grow` UQ(1, 16): the growth of the memory over T, in half octaves.
- `kx` UQ(0, 18). The gains belong to the steady state at constant T (`riccati`), for a bandwidth of T / M a sample.
- `kv` and `ka` UQ(1, 11): K_v M / K_x and K_a M / K_v, which are almost constant. Each is shifted by the whole octaves
  of M into a word of GAIN_BITS bits, a rate. So v is corrected by a share of the place's correction, and a by a share
  of v's.

K_v T and K_a T**2 are too large by up to 1.22 and 1.5 at a row's longest T. The filter tolerates this for T up to 2.6
M, and diverges from 2.8 M on. For ever rarer edges the gains of a white jerk go to K_v T = 1.73 and K_a T**2 = 1.49.
The last three edges give 1.5 and 1. With M at least T / INDEX_MAX they end at 1.46 and 1.08.

Formats.

- `velocity` SQ(i, f): i holds twice the largest speed; f resolves sqrt(C q), the speed that C gives within half a
  count, to 2**-SPEED_BITS, and at least the slowest edges.
- `motion`, the state v: GUARD_BITS more: corrections are rounded, and a rounding error stays for a whole memory.
- `error`, r, and the state's place x: edges times D. i holds the edges that twice the largest speed makes in two
  samples and two agile memories: a start in motion is caught up in this time. f is one more than the velocity's, less
  the bits of D: a place off by half an LSB at every edge is a velocity off by a quarter of the output's LSB.
- `a`, in counts a sample per unit: i holds 2**ACCELERATION_BITS C, f turns the velocity by a quarter of its LSB over
  the longest memory.
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

from ..arithmetic.fixed import SQ, UQ, bits_for
from ..checks import FieldError
from ..encoder import scale_map
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from . import bursts
from .acceleration import Accelerated
from .bursts import Limits, Watch, doubt_samples
from .estimate import EstimatorGains
from .riccati import steady_state

QUIET = 1.6
"""The largest change of place by the jerk within the quiet memory, in errors of the place."""
AGILE = 28.0
"""The largest change of place by the acceleration within the agile memory, in errors of the place."""
ALARM = 4.0
"""The mean of r that raises an alarm, in its own standard deviations."""
GROWTH = 0.125
"""The growth of the memory per time, below 1: the memory never reaches back beyond the alarm."""
INDEX_MAX = 2.0
"""The largest T / M of the gains: at this one the filter is stable, with some room, over all times of a row."""
HALVINGS = 7
"""The most halvings of an edge's error, where it is learned."""
LEARN_BITS = 6
"""An edge has 2**-LEARN_BITS of the share of the edges with an innovation larger than usual."""
SHARE_BITS = 10
"""Fraction bits of this share."""
USUAL_SHARE, WORSE, BETTER = 448, 704, 160
"""The share that a change begins with, and those above and below which the error is doubled and halved."""
ROOM = 5.0
"""The excess over a count of the distance of two edges, in errors of an edge."""
LEAST_ROOM = 0.25
"""The least such distance, counts: the line has errors of its own."""
TOLERATED = 0.5
"""The silence between bursts that is tolerated, in memories of the shortest."""
MEMORY_BITS = 16
"""Fraction bits of a memory, which is counted in half octaves."""
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
MOTION_MAX, ERROR_MAX = 35, 38
"""Largest widths of velocity and acceleration, and of the error, bits."""
BLEND, ALARM_AT, USUAL, QUIET_AT, AGILE_AT = range(5)
"""The columns of `limits`."""
LIMIT_WIDTHS = 16, 18, 18, 10, 10
"""Bits of their words."""
LENGTH = UQ(6, 4)
"""The format of a memory in the table."""
GROW, KX, KV, KA = range(4)
"""The columns of `gains`."""
GAIN_FORMATS = UQ(1, 16), UQ(0, 18), UQ(1, 11), UQ(1, 11)
GAIN_ROWS = 64
"""The values of T / M: from INDEX_MAX down, by half octaves."""
GAIN_BITS = 24
"""Bits of a rate, which `kv` and `ka` are shifted to."""
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
        gain_words: the words of the gains, shape (rows, columns); a row's number is INDEX_MAX M / T in half
            octaves, then the parity of M's half octaves.
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
        self._derive_limits(axis, gains)
        self._derive_gains()
        self.bursts = bursts.limits(axis, TOLERATED * float(self.agile_s[0].min()))
        self._derive_motion(axis)
        self._derive_words()

    def _stamp_errors_counts(self, axis: AxisRequirements, times_s: np.ndarray) -> np.ndarray:
        """Return the RMS error of an edge by the interval before it that its time makes, counts."""
        return np.minimum(self._unit_s / times_s, axis.edges_per_clock_max) / math.sqrt(12)

    def _memories(
        self, axis: AxisRequirements, gains: Gains, times_s: np.ndarray, errors_counts: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the quiet and the agile memory for intervals, s."""
        error = errors_counts * axis.count_m * np.sqrt(times_s)
        quiet = (QUIET * error / gains.jerk_m_per_s3) ** (2 / 7)
        agile = (AGILE * error / gains.acceleration_m_per_s2) ** (2 / 5)
        least = np.maximum(self._unit_s, times_s / INDEX_MAX)
        quiet = np.clip(quiet, least, self._unit_s * 2.0 ** (self.time_bits - 1))
        return quiet, np.clip(agile, least, quiet)

    def _derive_limits(self, axis: AxisRequirements, gains: Gains) -> None:
        """Derive the memories and bounds by the error and the time; lengths are in half octaves."""
        times_s = _middles(np.arange(1 << self.row_bits)) * self._unit_s
        own = gains.edge_error_counts * 2.0 ** -np.arange(self.halvings_max + 1)[:, None]
        errors = np.hypot(own, self._stamp_errors_counts(axis, times_s))
        self.quiet_s, self.agile_s = self._memories(axis, gains, times_s, errors)
        blend = -np.expm1(-times_s / self.agile_s)
        kx = [steady_state(index)[0] for index in (times_s / self.quiet_s).ravel().tolist()]
        free = np.maximum(1 - np.reshape(kx, errors.shape), np.finfo(float).eps)
        usual = errors / np.sqrt(free) * self._per_sample
        alarm = ALARM * usual * np.sqrt(blend / (2 - blend))
        lengths = [2 * np.log2(memory / self._unit_s / _middles(0)) for memory in (self.quiet_s, self.agile_s)]
        columns = blend, alarm, math.sqrt(2 / math.pi) * usual, *lengths
        self.limit_rates = np.stack([column.ravel() for column in columns], 1)

    def _derive_gains(self) -> None:
        """Derive the gains by T / M: they need no axis."""
        index = INDEX_MAX * 2.0 ** (-np.arange(GAIN_ROWS) / 2)
        gain = np.array([steady_state(each) for each in index.tolist()])
        grow = 2 * GROWTH / math.log(2) * index
        rates = gain[:, 1:] / gain[:, :-1] / index[:, None]
        # The words of M's parity: 1 / M is 2**(-parity / 2) / _middles(0), but for whole octaves.
        parity = 2.0 ** (-np.arange(2) / 2) / _middles(0)
        columns = [np.repeat(column, 2) for column in (grow, gain[:, 0])]
        columns += [np.outer(column, parity).ravel() for column in rates.T]
        self.gain_rates = np.stack(columns, 1)

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
        self.distance = SQ(min(1 + bits_for(reach), axis.count_width), 0)

        i = 1 + ACCELERATION_BITS + bits_for(bound * tau * self._unit_s / q)
        longest = bits_for(self.quiet_s.max() / self._unit_s)
        self.a = SQ(i, max(min(self.velocity.f + 2 + longest, MOTION_MAX - i), 2 - i))
        cut = max(self.clocks.bit_length() - self.time_bits, 0)
        self.per_sample, self.per_sample_f = self.clocks >> cut, self.unit - cut
        finest = C_BITS - math.floor(math.log2(bound * tau**2 / q))
        self.acceleration = SQ(i + bits_for(self._per_sample), min(finest, self.a.f + self.per_sample_f))

    def _agile_samples(self, axis: AxisRequirements) -> float:
        """Return the agile memory for an edge a sample, in samples."""
        row = min(2 * bits_for(max(self._per_sample, 1.0)), self.agile_s.shape[1] - 1)
        return float(self.agile_s[0, row]) * axis.sample_hz

    def _derive_words(self) -> None:
        """Derive the formats of the columns, and round the tables to words."""
        integer = [0]
        for column in (ALARM_AT, USUAL):
            top, least, width = (
                self.limit_rates[:, column].max(),
                self.limit_rates[:, column].min(),
                LIMIT_WIDTHS[column],
            )
            # A bound that is beyond the range of the format is none; the least is resolved to an eighth.
            integer.append(min(bits_for(float(top)), width - 3 + bits_for(float(least))))
        integer += [LENGTH.i, LENGTH.i]
        self.columns = tuple(UQ(i, width - i) for i, width in zip(integer, LIMIT_WIDTHS, strict=True))
        self.limits = _words(self.limit_rates, self.columns)
        self.gain_words = _words(self.gain_rates, GAIN_FORMATS)
        # A memory that grows at all comes to its end.
        self.gain_words[:, GROW] = np.maximum(self.gain_words[:, GROW], 1)
        half = 1 << (LENGTH.f - 1)
        self.shortest = int((self.limits[:, AGILE_AT].min() + half >> LENGTH.f) // 2)

    def params(self, words: Mapping[str, int]) -> Params:
        v, a, e, rate_f = self.motion, self.a, self.error, GAIN_BITS - 1 + self.shortest
        return Params(
            count_width=self.count_width,
            unit=self.unit,
            time_bits=self.time_bits,
            clocks=self.clocks,
            distance_max=self.distance.max,
            place_shift=self.unit - e.f + scale_map.FRACTION_BITS,
            travel_shift=v.f - e.f,
            error_max=e.max,
            alarm_shift=e.f - self.columns[ALARM_AT].f,
            usual_shift=e.f - self.columns[USUAL].f,
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
            bound=math.floor(2 * self._apart * self._per_sample * 2.0**v.f),
            bound_max=2 * self.velocity.max << GUARD_BITS,
            doubt=self.doubt,
            bursts=self.bursts,
            row_bits=self.row_bits,
            limits=self.limits,
            gains=self.gain_words,
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
            gains=self.gain_rates,
            scale=scale_map.nothing(True),
        )

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


def _middles(rows: np.ndarray | int) -> np.ndarray:
    """Return the geometric middle of the times of a row, units: from 2 to 3, or from 3 to 4, times a power of two."""
    return math.sqrt(1.5) / 2 * 2.0 ** (np.asarray(rows) / 2)


def _words(rates: np.ndarray, formats: tuple[UQ, ...]) -> np.ndarray:
    """Return the words of a table's columns, rounded half up, and held within their formats."""
    words = [np.clip(np.floor(rates[:, n] * 2.0**fmt.f + 0.5), 0, fmt.max) for n, fmt in enumerate(formats)]
    return np.stack(words, 1).astype(np.int64)
