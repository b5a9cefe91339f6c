"""Gains, formats, run-time words and state of `levant_edge`, derived from the axis; `levant_edge` defines the law.

`levant_edge` defines the symbols v, a, E, T, L, D and C; q is a count, u the velocity output.

- `velocity` SQ(i, f): i holds twice the largest speed. f resolves sqrt(C q), the speed that C gives within half a
  count, to 2**-SPEED_BITS, and at least the slowest edges. `a` has the same width, so that one multiplier suffices
  for both, and its i holds 2**ACCELERATION_BITS C. Both have at most WIDTH_MAX bits, and no more than let their
  product with a time fit int64.
- `acceleration`, the second output, in counts a sample^2: a D, rounded down. i holds the largest a, f resolves C to
  2**-C_BITS.
- `mantissa`: number of top bits of a time that multiply and divide. If T is cut to these bits, its relative error is
  2**(1 - mantissa). This changes D/T, the speed of one count in it, by at most 4 LSB of velocity. Times of at least
  four samples and four shortest intervals are exact.
- `error`, E over 2**k if k bits are cut. i holds |v| 2**mantissa and the place from which it is subtracted. f is less
  than velocity's by the bits of the shortest interval less one: half an LSB of velocity after the division.
- `place`: half a count, in steps of 2**-PLACE_BITS. `distance`: edges at twice the largest speed in two samples and two
  shortest intervals; a larger number saturates.
- `radicand`, `root`: the least error that lambda limits, lambda^2 T^3 at the shortest T, is resolved in its root to
  2**-ROOT_BITS.
- `lambda`, `alpha` UQ, GAIN_BITS wide, with HEADROOM_BITS above the designed gain for changes at run time.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.divide import latency as divide_latency
from ..arithmetic.fixed import SQ, UQ, bits_for, shift_floor
from ..arithmetic.sqrt import latency as sqrt_latency
from ..checks import FieldError
from ..encoder.quadrature import Seen
from ..requirements import AxisRequirements
from ..words import GAIN_BITS, Word
from . import bursts
from .acceleration import Accelerated
from .bursts import Limits, Watch, doubt_samples
from .estimate import EstimatorGains

HEADROOM_BITS = 2
"""A gain may be raised to 2**HEADROOM_BITS times the designed one at run time."""
SPEED_BITS = 18
"""The velocity resolves sqrt(C q), the speed that C gives within half a count, to 2**-SPEED_BITS."""
WIDTH_MAX = 40
"""Largest width of velocity and acceleration, bits."""
ACCELERATION_BITS = 3
"""The acceleration may reach 2**ACCELERATION_BITS C, since an impact exceeds the C of a motion."""
C_BITS = 20
"""The acceleration that is given out resolves C to 2**-C_BITS."""
ROOT_BITS = 5
"""The root of the least error that it limits is resolved to 2**-ROOT_BITS."""
LEARN_SHIFT = 5
"""An edge's error depends on two places, and moves each by 2**-LEARN_SHIFT of itself."""
PLACE_BITS = 21
"""Places of edges resolve 2**-PLACE_BITS counts."""
QUOTIENT_BITS = 2
"""Quotient bits a clock."""
STEPS = 20
"""Clocks of the sequence besides the root's or the quotient's: see `hardwall.hdl.estimators.levant_edge`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The gains in SI units: lambda in m^(1/2)/s^(3/2), alpha in m/s^3."""

    lambda_sqrt_m_per_s3: float
    alpha_m_per_s3: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return alpha = 2 C / sqrt(q / C) and Levant's lambda = 1.5 sqrt(alpha), with C and q of the axis."""
        bound = axis.acceleration_max_m_per_s2
        alpha = 2 * bound * math.sqrt(bound / axis.count_m)
        return cls(1.5 * math.sqrt(alpha), alpha)


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    lambda_: int
    alpha: int
    count_width: int
    stamp_width: int
    clocks: int
    shortest: int
    mantissa: int
    distance_max: int
    place_fraction: int
    place_shift: int
    turn_shift: int
    turn_span: int
    error_shift: int
    quotient_width: int
    radicand_shift: int
    limit_shift: int
    slope_shift: int
    alpha_shift: int
    learn_shift: int
    learn_max: int
    place_max: int
    lost: int
    bound: int
    bound_max: int
    doubt: int
    bursts: Limits
    velocity_max: int
    acceleration_max: int
    sample_shift: int


class FloatParams(NamedTuple):
    lambda_: float
    alpha: float
    count_width: int
    stamp_width: int
    clocks: int
    shortest: int
    mantissa: int
    doubt: int
    bursts: Limits
    steepest: float
    learn_max: float
    place_max: float


class State(NamedTuple):
    """The anchor (`known` if its arrival was seen), the motion there, and the places of the four kinds of edges.

    Velocity, acceleration and places are words (float: counts a sample, counts a sample per clock, counts times clocks
    a sample); `length` is the length of the last interval in use, bits.
    """

    running: int
    known: int
    number: int
    stamp: int
    kind: int
    bound: float
    doubt: int
    velocity: float
    acceleration: float
    places: tuple
    watch: Watch


START = State(0, 0, 0, 0, 0, 0, 0, 0, 0, (0, 0, 0, 0), bursts.NOTHING)
FLOAT_START = State(0, 0, 0, 0, 0, 0.0, 0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0), bursts.NOTHING)


class Design(Accelerated):
    """Formats, run-time words and latency of the differentiator for an axis, derived as the module says.

    Attributes:
        velocity, acceleration: formats of the outputs; velocity is also the format of v.
        a, error, place: formats of a, E over 2**k, and an edge's place times D.
        mantissa: bits of a time when it multiplies and divides.
        shortest: log2 of the shortest interval in use, clocks.
        distance: format of the number of edges passed in an interval.
        root, radicand: formats of the root and of its integer radicand.
        lambda_, alpha: gain formats.
        words: `levant_edge_lambda`, `levant_edge_alpha`.

    Raises:
        ValueError: if the gains or the rates fit no format that int64 can hold, with the accepted range.
    """

    name = "levant-edge"
    gains_class = Gains
    inputs = Seen._fields
    flags = ("error_saturated", "velocity_saturated", "edges_in_bursts")

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self.clocks, self.doubt = axis.clocks_per_sample, doubt_samples(axis)
        if 4 * self.clocks > 1 << axis.stamp_width:
            raise FieldError("sample_hz", f"must be 4 or more for stamps that last a second, not {axis.sample_hz!r}")
        self._derive_times(axis)
        # Bursts are read as long as an interval in use has several.
        self.bursts = bursts.limits(axis, 2.0 ** (self.shortest - 2) / axis.clock_hz)
        self._derive_motion(axis)
        self._derive_places(axis)
        self._derive_gains(axis, gains)

    def _derive_times(self, axis: AxisRequirements) -> None:
        """Derive the width of a time, in clocks, when it multiplies and divides."""
        clock, bound, q = axis.clock_hz, axis.acceleration_max_m_per_s2, axis.count_m
        window = clock * min(math.sqrt(axis.speed_max_m_per_s / (clock * bound)), math.sqrt(q / bound) / 4)
        self.shortest = min(max(math.floor(math.log2(max(window, 2.0))), 1), axis.stamp_width - 3)
        within_count = clock * math.sqrt(q / bound)
        exact = bits_for(math.sqrt(within_count * 2.0 ** (SPEED_BITS - 2)))
        self.mantissa = min(max(exact, bits_for(4 * max(self.clocks, 1 << self.shortest))), axis.stamp_width - 1)
        self.turn_span = max(axis.stamp_width - 1 - self.mantissa, 0)

    def _derive_motion(self, axis: AxisRequirements) -> None:
        """Derive the formats of velocity and acceleration."""
        tau, q, bound = 1 / axis.sample_hz, axis.count_m, axis.acceleration_max_m_per_s2
        i = 1 + bits_for(max(2 * axis.speed_max_counts_per_sample, 2.0))
        least = math.sqrt(bound / q) * tau
        slowest = self.clocks * 2.0 ** (1 - axis.stamp_width)
        f = max(SPEED_BITS - math.floor(math.log2(least)), 1 - math.floor(math.log2(slowest)), 0)
        f = min(f, WIDTH_MAX - i, 60 - self.mantissa - i)
        self.velocity = SQ(i, axis.shrunk(f))
        i = 1 + ACCELERATION_BITS + bits_for(bound * tau / q / axis.clock_hz)
        self.a = SQ(i, self.velocity.width - i)
        finest = C_BITS - math.floor(math.log2(bound * tau**2 / q))
        self.acceleration = SQ(i + bits_for(self.clocks), min(finest, self.a.f))

    def _derive_places(self, axis: AxisRequirements) -> None:
        """Derive the formats of errors and places, in counts times D, and of the number of edges passed."""
        f = self.velocity.f
        self.error = SQ(self.velocity.i + self.mantissa + 2, f - min(max(self.shortest - 1, 0), f))
        fine = PLACE_BITS - math.floor(math.log2(self.clocks))
        self.place = SQ(max(bits_for(self.clocks / 2), 0) + 1, max(fine, 0))
        passed = 2 * axis.speed_max_counts_per_sample * (2 + (2 << self.shortest) / self.clocks) + 1
        self.distance = SQ(min(1 + bits_for(passed), axis.count_width), 0)

    def _derive_gains(self, axis: AxisRequirements, gains: Gains) -> None:
        """Derive the formats of the gains and of the root, and the run-time words."""
        tau, q, clock = 1 / axis.sample_hz, axis.count_m, axis.clock_hz
        alpha = gains.alpha_m_per_s3 * tau / q / clock**2
        lam = gains.lambda_sqrt_m_per_s3 * math.sqrt(tau / q) / clock
        self.alpha = _gain("alpha_m_per_s3", gains.alpha_m_per_s3, alpha)
        self.lambda_ = _gain("lambda_sqrt_m_per_s3", gains.lambda_sqrt_m_per_s3, lam)
        limited = lam**2 * 8.0**self.shortest
        root_f = max(bits_for(2.0**ROOT_BITS / math.sqrt(limited)), 0)
        self.radicand = UQ(self.error.i - 1, 2 * min(root_f, (self.error.f + 1) // 2))
        self.root = UQ((self.radicand.width + 2) // 2 - self.radicand.f // 2, self.radicand.f // 2)
        self.words = (
            Word(
                "levant_edge_lambda",
                self.lambda_,
                math.sqrt(q / tau) * clock,
                "m^(1/2)/s^(3/2)",
                self.lambda_.from_real(lam),
                "gain of the square-root term",
            ),
            Word(
                "levant_edge_alpha",
                self.alpha,
                q / tau * clock**2,
                "m/s^3",
                self.alpha.from_real(alpha),
                "gain of the sign term",
            ),
        )

    @property
    def latency(self) -> int:
        return STEPS + max(self.quotient_latency, sqrt_latency(self.radicand.width + 1))

    @property
    def quotient_latency(self) -> int:
        """Clocks of the division."""
        return divide_latency(self.velocity.width - 1, QUOTIENT_BITS)

    def params(self, words: Mapping[str, int]) -> Params:
        f, a_f, e_f = self.velocity.f, self.a.f, self.error.f
        return Params(
            lambda_=words["levant_edge_lambda"],
            alpha=words["levant_edge_alpha"],
            count_width=self.count_width,
            stamp_width=self.stamp_width,
            clocks=self.clocks,
            shortest=self.shortest,
            mantissa=self.mantissa,
            distance_max=self.distance.max,
            place_fraction=self.place.f,
            place_shift=e_f - self.place.f,
            turn_shift=a_f - f - self.turn_span,
            turn_span=self.turn_span,
            error_shift=f - e_f,
            quotient_width=self.velocity.width - 1,
            radicand_shift=e_f - self.radicand.f,
            limit_shift=self.lambda_.f + self.root.f - f,
            slope_shift=f - a_f,
            alpha_shift=self.alpha.f - a_f,
            learn_shift=e_f - self.place.f + LEARN_SHIFT,
            learn_max=(1 << bits_for(self.clocks / 4) + e_f) - 1,
            place_max=self.place.max,
            lost=shift_floor(self.clocks, -e_f),
            bound=shift_floor(5 * self.clocks, 1 - f),
            bound_max=2 * self.velocity.max + 1,
            doubt=self.doubt,
            bursts=self.bursts,
            velocity_max=self.velocity.max,
            acceleration_max=self.a.max,
            sample_shift=a_f - self.acceleration.f,
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: unrounded gains, from `si` where given, else as designed."""
        lam, alpha = self.words
        return FloatParams(
            si.get("levant_edge_lambda", gains.lambda_sqrt_m_per_s3) / lam.si_per_unit,
            si.get("levant_edge_alpha", gains.alpha_m_per_s3) / alpha.si_per_unit,
            self.count_width,
            self.stamp_width,
            self.clocks,
            self.shortest,
            self.mantissa,
            self.doubt,
            self.bursts,
            2.0 ** (self.a.i - 1),
            2.0 ** bits_for(self.clocks / 4),
            2.0 ** (self.place.i - 1),
        )

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


def _gain(name: str, value: float, scaled: float) -> UQ:
    """Return the format of a gain: `value` in SI units, `scaled` in counts, samples and clocks."""
    if not 2.0**-60 <= scaled <= 2.0**20:
        unit = value / scaled
        raise FieldError(name, f"must be {2.0**-60 * unit:g} to {2.0**20 * unit:g} at these rates, not {value!r}")
    i = HEADROOM_BITS + bits_for(scaled)
    return UQ(i, GAIN_BITS - i)
