"""Gains, formats, tables and state of `edge_kalman`, derived from the axis; `edge_kalman` defines the law.

`edge_kalman` defines the symbols T, M, r, v, a and D. q is a count, s the error of an edge (counts), J and C are the
bounds on jerk and acceleration. Times are in units of 2**`unit` clocks, 1 clock unless the stamp has more than
TIME_BITS bits; D is then the units in a sample.

The rule. A memory M averages over the M / T edges in it, so the place of the axis is known to about s sqrt(T / M).
Within M the motion may change unforeseen: by J M**3 through its jerk, and at an impact by C M**2 through a jump of its
acceleration. At each of the two memories, this change is a constant share of the place's error:

    J M_quiet**3 = QUIET s q sqrt(T / M_quiet)            C M_agile**2 = AGILE s q sqrt(T / M_agile)

and M_agile is at most M_quiet. s combines the bound on an edge's error and, independent of it, the stamp's error at the
largest speed. LEVELS memories are used, with equal ratios from one to the next. Their gains belong to the steady state
at constant T (`riccati`), for a bandwidth of T / M a sample. QUIET, AGILE, ALARM and GROWTH were chosen by measurement,
with the impact's C and the jerk of the paper's swing. They are the same for every axis.

A row of the table is for a level and the top two bits of T. It is computed for the M and T in the middle of the row, at
most a fifth off. K_v T and K_a T**2 are then too large by up to 1.22 and 1.5 at the row's longest T. The filter
tolerates this for T up to 2.6 M, and diverges from 2.8 M on. For ever rarer edges the gains of a white jerk go to K_v T
= 1.73 and K_a T**2 = 1.49. The last three edges give 1.5 and 1. So the gains are limited to those at T / M = INDEX_MAX,
1.46 and 1.08. The columns are words of fixed formats, whose range follows from the largest entry:

- `blend` UQ(0, 16): the share of r in the mean of r; `alarm`: the bound on this mean; `fall` UQ(2, 16): the growth of
  the memory over T, in levels;
- `kx` UQ(0, 18), `kv` of 20 bits and `ka` of 24: the gains. Each resolves its smallest entry, at the shortest T and the
  longest memory, to a few bits: an error of an eighth in a gain has almost no effect.

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
- int64 holds every product: with a time of 26 bits motion has at most 35 and acceleration too, with a gain of 24 bits
  the error at most 38.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

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
GROWTH = 0.25
"""The growth of the memory per time, below 1: the memory never reaches back beyond the alarm."""
INDEX_MAX = 2.0
"""The largest T / M of the gains: at this one the filter is stable, with some room, over all times of a row."""
ROOM = 5.0
"""The excess over a count of the distance of two edges, in errors of an edge."""
LEAST_ROOM = 0.25
"""The least such distance, counts: the line has errors of its own."""
TOLERATED = 0.5
"""The silence between bursts that is tolerated, in memories of the shortest."""
LEVELS = 4
"""Memories: level 0 is the quiet one, the last is the agile one."""
LEVEL_BITS = 16
"""Fraction bits of a level."""
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
BLEND, ALARM_AT, FALL, KX, KV, KA = range(6)
"""The columns of the table."""
WIDTHS = 16, 18, 18, 18, 20, 24
"""Bits of their words."""
STEPS = 40
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

    `table` has the rows' words, and `scale` the errors of the edges' places: none, unless it is replaced.
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
    table: np.ndarray
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
    table: np.ndarray
    scale: scale_map.Params


class State(NamedTuple):
    """The anchor (`known` if its arrival was seen), the motion there, and how long it is remembered.

    `number` and `stamp` (in units) belong to the last edge. `length` is the length of the last interval, bits, and
    `level` the level of the memory. `place` is the place of the axis beside the anchor, `mean` the mean of the
    innovations (float: counts times units a sample). velocity and acceleration are words (float: counts a sample, and
    counts a sample per unit).
    """

    running: int
    known: int
    number: int
    stamp: int
    bound: float
    doubt: int
    level: float
    place: float
    mean: float
    velocity: float
    acceleration: float
    watch: Watch


START = State(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, bursts.NOTHING)
FLOAT_START = State(0, 0, 0, 0, 0.0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, bursts.NOTHING)


class Design(Accelerated):
    """Formats, tables and latency of the filter for an axis, derived as the module says.

    Args:
        axis, gains: as of every estimator.
        scale: the map of the scale that the hardware is to have; None for none.

    Attributes:
        scale: the argument.
        velocity, acceleration: formats of the outputs.
        motion, a, error: formats of v, of a, and of r and the place.
        distance: format of the number of edges passed in an interval.
        unit, time_bits: log2 of the clocks in a unit of time, and the bits of a stamp in units.
        per_sample, per_sample_f: the units in a sample as a word, and the fraction bits of the word.
        row_bits: bits of the part of a row's number that a time gives.
        columns: formats of the table's columns.
        table: the words, shape (rows, columns); a row's number is its level, then what the time gives.
        memories_s: the memory of every row, s, shape (levels, times).

    Raises:
        ValueError: if the rates or ranges fit no format that int64 can hold, with the accepted range.
    """

    name = "edge-kalman"
    gains_class = Gains
    inputs = Seen._fields
    flags = ("error_saturated", "velocity_saturated", "edges_in_bursts")
    latency = STEPS

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
        self._derive_table(axis, gains)
        self.bursts = bursts.limits(axis, TOLERATED * float(self.memories_s.min()))
        self._derive_motion(axis)
        self._derive_words()

    def _errors_counts(self, axis: AxisRequirements, gains: Gains, times_s: np.ndarray) -> np.ndarray:
        """Return the RMS error of an edge by the interval before it, counts: its place, and its time at full speed."""
        return np.full_like(times_s, math.hypot(gains.edge_error_counts, axis.edges_per_clock_max / math.sqrt(12)))

    def _memories(
        self, axis: AxisRequirements, gains: Gains, times_s: np.ndarray, errors_counts: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the quiet and the agile memory for intervals, s."""
        error = errors_counts * axis.count_m * np.sqrt(times_s)
        quiet = (QUIET * error / gains.jerk_m_per_s3) ** (2 / 7)
        agile = (AGILE * error / gains.acceleration_m_per_s2) ** (2 / 5)
        least, most = self._unit_s, self._unit_s * 2.0 ** (self.time_bits - 1)
        quiet = np.clip(quiet, least, most)
        return quiet, np.clip(agile, least, quiet)

    def _derive_table(self, axis: AxisRequirements, gains: Gains) -> None:
        """Derive the gains and bounds of every row, in units of time and counts a sample."""
        numbers = np.arange(1 << self.row_bits)
        # A row is for the times from 2 to 3, or from 3 to 4, times a power of two; the middle is geometric.
        units = 2.0 ** (numbers // 2 - 1) * np.where(numbers % 2, math.sqrt(3), math.sqrt(1.5))
        times_s = units * self._unit_s
        errors = self._errors_counts(axis, gains, times_s)
        quiet, agile = self._memories(axis, gains, times_s, errors)
        share = np.linspace(0, 1, LEVELS)[:, None]
        self.memories_s = quiet ** (1 - share) * agile**share
        index = times_s / self.memories_s
        gain = np.array([steady_state(min(each, INDEX_MAX)) for each in index.ravel()]).reshape(*index.shape, 3)
        blend = np.broadcast_to(-np.expm1(-times_s / agile), index.shape)
        # In the steady state r has the variance s**2 / (1 - K_x), and is white.
        free = np.maximum(1 - gain[..., 0], np.finfo(float).eps)
        alarm = ALARM * errors * np.sqrt(blend / (2 - blend) / free) * self._per_sample
        octaves = np.log2(quiet / agile) / (LEVELS - 1)
        fall = np.minimum(GROWTH * index / math.log(2), (LEVELS - 1) * octaves) / np.where(octaves > 0, octaves, 1)
        fall = np.where(octaves > 0, fall, LEVELS - 1)
        columns = blend, alarm, fall, gain[..., 0], gain[..., 1] / units, gain[..., 2] / units**2
        self.rates = np.stack([column.reshape(-1) for column in columns], 1)

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
        longest = bits_for(self.memories_s.max() / self._unit_s)
        self.a = SQ(i, max(min(self.velocity.f + 2 + longest, MOTION_MAX - i), 2 - i))
        cut = max(self.clocks.bit_length() - self.time_bits, 0)
        self.per_sample, self.per_sample_f = self.clocks >> cut, self.unit - cut
        finest = C_BITS - math.floor(math.log2(bound * tau**2 / q))
        self.acceleration = SQ(i + bits_for(self._per_sample), min(finest, self.a.f + self.per_sample_f))

    def _agile_samples(self, axis: AxisRequirements) -> float:
        """Return the agile memory for an edge a sample, in samples."""
        row = min(2 * bits_for(max(self._per_sample, 1.0)), self.memories_s.shape[1] - 1)
        return float(self.memories_s[-1, row]) * axis.sample_hz

    def _derive_words(self) -> None:
        """Derive the formats of the columns, and round the table to words."""
        top, least = self.rates.max(axis=0), self.rates[:, ALARM_AT].min()
        integer = [bits_for(float(largest)) for largest in top]
        integer[BLEND] = integer[KX] = 0
        integer[FALL] = WIDTHS[FALL] - LEVEL_BITS
        # A bound that is beyond the range of the format is none; the least is resolved to an eighth.
        integer[ALARM_AT] = min(integer[ALARM_AT], WIDTHS[ALARM_AT] - 3 + bits_for(float(least)))
        self.columns = tuple(UQ(i, width - i) for i, width in zip(integer, WIDTHS, strict=True))
        words = [
            np.clip(np.floor(self.rates[:, n] * 2.0**fmt.f + 0.5), 0, fmt.max) for n, fmt in enumerate(self.columns)
        ]
        # A memory that grows at all comes to its end.
        words[FALL] = np.maximum(words[FALL], 1)
        self.table = np.stack(words, 1).astype(np.int64)

    def params(self, words: Mapping[str, int]) -> Params:
        v, a, e = self.motion, self.a, self.error
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
            velocity_shift=e.f + self.columns[KV].f - v.f,
            bend_shift=e.f + self.columns[KA].f - a.f,
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
            table=self.table,
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
            table=self.rates,
            scale=scale_map.nothing(True),
        )

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START
