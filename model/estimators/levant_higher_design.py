"""Levant's differentiators of order 2 and 3, with and without filtering, explicit, in fixed point.

Per sample, with f the count, in counts and sample periods. z0 is the tracked count, z1 the velocity (the output), z2
the acceleration and z3 the jerk; N is the order, one more with filtering, and r = |e|^(1 / (N + 1)):

    without filtering, e = z0 - f:            with filtering, e = w:
                                              w  <- w + (z0 - f)            - c_N     r^N     sign(e)
    z0 <- z0 + z1 + z2 / 2  - c_N     r^N     sign(e)           the powers of r one less in each
    z1 <- z1 + z2 + z3 / 2  - c_(N-1) r^(N-1) sign(e)           line, to r^0 = 1 in the last one
    z2 <- z2 + z3           - c_(N-2) r^(N-2) sign(e)
    z3 <- z3                - ...                               sign(0) = 0

All gains follow from one number, L. It bounds the derivative after the last one that is tracked: the jerk for order 2,
the snap (the derivative of the jerk) for order 3. c_n = LAMBDA[N][n] L^((N + 1 - n) / (N + 1)), in counts and samples.
The steps have the terms of Taylor's series, so the scheme is homogeneous. z3 / 6 in z0 is left out. It moves the
position by T^-3 / 6 counts a sample (T: see below). This changes the errors by less than a hundredth at 1 kHz.

Sources: Levant, International Journal of Control 76 (2003), 924, the differentiator of any order; Livne and Levant,
Automatica 50 (2014), 2089, the homogeneous discretisation; Levant and Livne, European Journal of Control 55 (2020), 33,
filtering and the table of LAMBDA.

Scales. T = L^(-1 / (order + 1)) samples is the differentiator's own time: in T, L moves one count. An error of a count
corrects the n-th derivative by some T^-(n + 1) a sample, and w by one. w is some T counts times samples.

Powers. The terms c_n r^n come from the leading bits of |e| (`hardwall.model.arithmetic.powers`), wrong by 3 % at most
in r: a homogeneous differentiator converges with any gains near its own. A negative e enters as its complement.

Formats, derived.

- Fractions: a count's error corrects z_n by at least 2**RESOLUTION_BITS of its LSB, with the designed L.
- Integers: `gap` (z0 - f), `w` and the z_n hold reversals between the largest speeds, at any times. A velocity that
  switches by V has the peaks of `PEAKS`, times V tau^(1 - n), with tau = (V / L)^(1 / order). The least L counts for
  gap and w, the largest for the others. NOISE times the scale of a count's error is added.
- Saturation, with a flag: gap and w (`error_saturated`), z1 (`velocity_saturated`), z2 and z3 (`state_saturated`). At
  the end of z1, z2 and z3 begin again from 0: they would go on pushing.
- `velocity`: z1 rounded half up to an LSB of sqrt(C') 2**-OUTPUT_BITS, with C' the bound C in counts a sample^2. Half
  of this LSB is added to the state z1, so the output is its floor.
- `acceleration`, the second output: z2, rounded down to `acceleration.WIDTH` bits where z2 has more.

Range of the gains. The word is the number of octaves by which L is raised. So every accepted word has the gains of one
L. L is at most LARGEST_L counts a sample^(order + 1): T is at least 2 samples then, and the steps are still small. The
default for order 2 is the axis's bound J on the jerk. For order 3 it is SNAP_SHARE J (J / q)^(1/3): J changes in the
time in which it moves a count. At low rates it is LARGEST_L if that is less.

Limits.

- The count may wrap.
- The first sample, and a sample with `restart`, begin with z0 = f and all else 0. A start from rest has no transient. A
  start in motion at V has the transient of a step by V. It overshoots by 38 to 57 % and is within 0.5 % after 2.8 to
  3.6 tau.
- Near LARGEST_L the discrete steps overshoot more than the differential equation: reversals between the largest speeds
  may saturate z1.
- The estimate lags while the derivative that L bounds is larger than L, as in an impact.
- At standstill the states chatter by some c_n.
- Where counts come in a short pattern, such as half a count a sample, z1 locks to the pattern. Its mean is off by up to
  MEAN_ERROR counts in T, as far as its own error. The published algorithm has the same mean in float64. z0 alone never
  drifts from the count.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..arithmetic import powers
from ..arithmetic.fixed import SQ, bits_for
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..words import Word
from .acceleration import WIDTH, Accelerated
from .estimate import EstimatorGains, fraction_bits

LAMBDA = {2: (1.1, 2.12, 2.0), 3: (1.1, 3.06, 4.16, 3.0), 4: (1.1, 4.57, 9.30, 10.03, 5.0)}
"""The coefficients by N, from the power 0 up."""
PEAKS = {
    (2, 0): (0.0, 0.365, 0.99, 1.23),
    (2, 1): (0.088, 0.535, 1.13, 1.25),
    (3, 0): (0.0, 0.385, 1.41, 2.09, 1.57),
    (3, 1): (0.05, 0.475, 1.44, 2.14, 1.46),
}
"""The peaks of |w|, |z0 - f|, |z1| and so on by order and filtering, with L = 1. The velocity switches between 1/2 and
-1/2 any number of times, at any times: a little more than a random search finds."""
NOISE = 4.0
"""What an error of a count makes beside a motion, at most, in its scale: counts for z0, T**-n for z_n, T for w."""
MEAN_ERROR = {(2, 0): 0.5, (3, 0): 1.1, (2, 1): 0.55, (3, 1): 2.1}
"""How far the mean of z1 may be from a steady speed, in counts a time T, by order and filtering."""
RESOLUTION_BITS = 9
"""Bits of the correction for an error of one count, with the designed L."""
OUTPUT_BITS = 11
"""The output LSB is at most sqrt(C') 2**-OUTPUT_BITS."""
OCTAVES = -4, 4
"""L may be set to the designed one times 2**-4 to 2**4 at run time."""
LARGEST_L = 2.0**-4
"""The largest L, in counts a sample^(order + 1)."""
LEAST_OCTAVE = -1000
"""Where the search for the least L begins: no format is as long as its words, and its powers are no zeros."""
SNAP_SHARE = 2.0**-5
"""The snap that is expected, of J in the time in which J moves a count."""
WIDEST = 60
"""The most bits of a state: sums of them fit int64."""
STEPS = 3
"""Clocks of the sequence besides the powers: see `hardwall.hdl.estimators.levant_higher`."""
FILTERING_STEPS = 1
"""The same with filtering, where the powers begin with the strobe: their error is known before it."""


@dataclass(frozen=True)
class JerkGains(EstimatorGains):
    """The gain of order 2: the bound L on the jerk, m/s^3."""

    jerk_m_per_s3: float
    largest = LARGEST_L

    @classmethod
    def default(cls, axis: AxisRequirements) -> "JerkGains":
        return cls(min(axis.jerk_bound_m_per_s3, cls.largest * axis.count_m * float(axis.sample_hz) ** 3))


@dataclass(frozen=True)
class SnapGains(EstimatorGains):
    """The gain of order 3: the bound L on the snap, m/s^4."""

    snap_m_per_s4: float
    largest = LARGEST_L

    @classmethod
    def default(cls, axis: AxisRequirements) -> "SnapGains":
        """Return a part of the jerk's bound J in the time in which J moves a count, (q / J)^(1/3)."""
        jerk = axis.jerk_bound_m_per_s3
        bound = SNAP_SHARE * jerk * (jerk / axis.count_m) ** (1 / 3)
        return cls(min(bound, cls.largest * axis.count_m * float(axis.sample_hz) ** 4))


class Params(NamedTuple):
    """Words, limits and shifts of the integer kernel; see `Design` for the formats."""

    order: int
    filtering: int
    count_width: int
    octaves: int
    relays: np.ndarray
    """The correction of the last state by octave."""
    least_octave: int
    """The octave of the first relay."""
    fractions: tuple[int, ...]
    """Of w, z0, z1, z2, z3."""
    limits: tuple[int, ...]
    """The largest words of w, z0 - f, z1, z2, z3; the least is one less than the negative."""
    half: int
    output_shift: int
    acceleration_shift: int
    powers: powers.Params


class State(NamedTuple):
    """The state, in words (float: counts and samples); `lead` is z0 - `count`, the last count."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    w: float
    lead: float
    z1: float
    z2: float
    z3: float


class FloatParams(NamedTuple):
    order: int
    filtering: int
    count_width: int
    gains: tuple[float, ...]
    """c_N to c_0."""


class Design(Accelerated):
    """Formats, run-time word and latency of the differentiator for an axis, derived as the module says.

    Attributes of the class:
        order: the number of derivatives that are tracked.
        filtering: 1 with filtering, else 0.
        ahead: samples of a reversal by which `gap` is larger than the peak of z0 - f.
        levels: octaves by which the form that adapts may lower L.
        noise: what an error of the count makes beside a motion, as NOISE.

    Attributes:
        lipschitz: the designed L, counts a sample^(order + 1).
        w, gap, z: formats of w, z0 - f, and (z1, z2, z3); those that the order has not are a bit wide.
        half: half of the output's LSB, in words of z1.
        powers: the design of the terms c_n r^n, n = N to 1.
        relays: the words of c_0 by octave, in the fraction of the last state.
        velocity, acceleration: formats of the outputs.
        words: `levant_2_octaves` and so on, by the name.

    Raises:
        ValueError: if the gain fits no format that int64 can hold, with the accepted range.
    """

    outputs = ("z1",)
    flags = ("error_saturated", "velocity_saturated", "state_saturated")
    gains_class: ClassVar[type[JerkGains | SnapGains]]
    order: ClassVar[int]
    filtering: ClassVar[int] = 0
    powers: Any
    ahead: ClassVar[float] = 0.0
    levels: ClassVar[int] = 0
    noise: float = NOISE

    def __init__(self, axis: AxisRequirements, gains: JerkGains | SnapGains):
        super().__init__(axis, gains)
        ((field, bound),) = vars(gains).items()
        self._per_l = per_l = axis.count_m * float(axis.sample_hz) ** (self.order + 1)
        self.lipschitz, largest = bound / per_l, self.gains_class.largest
        if not 0 < self.lipschitz <= largest or not self._fit(axis, self.lipschitz):
            most = round(math.log2(largest))
            least = next((n for n in range(LEAST_OCTAVE, most + 1) if self._fit(axis, 2.0**n)), None)
            if least is None:
                short = " with so many bits dropped" if axis.estimator_bits_dropped else ""
                raise FieldError("estimator", f"{self.name} has no words for the largest speed at this rate{short}")
            raise FieldError(
                field, f"must be {2.0**least * per_l:g} to {largest * per_l:g} at these rates, not {bound!r}"
            )
        self._formats(axis, self.lipschitz)
        high = min(OCTAVES[1], math.floor(math.log2(largest / self.lipschitz)))
        doc = "octaves by which the bound L is raised"
        self.words = (Word(f"{self.name.replace('-', '_')}_octaves", SQ(4, 0), 1.0, "", 0, doc, OCTAVES[0], high),)

    @property
    def degree(self) -> int:
        """N + 1, the root that is taken of |e|."""
        return self.order + self.filtering + 1

    def _fit(self, axis: AxisRequirements, bound: float) -> bool:
        """Return whether the formats for a bound L, in counts and samples, fit int64."""
        try:
            self._formats(axis, bound)
        except ValueError:
            return False
        return True

    def _formats(self, axis: AxisRequirements, bound: float) -> None:
        """Derive the formats."""
        order, top = self.order, min(OCTAVES[1], math.floor(math.log2(self.gains_class.largest / bound)))
        low, high = bound * 2.0 ** OCTAVES[0], bound * 2.0**top
        step, lowered = 2 * axis.speed_max_counts_per_sample, 2.0**-self.levels
        own, slowest, fastest = (each ** (-1 / (order + 1)) for each in (bound * lowered, low * lowered, high))
        tau_low, tau_high = ((step / each) ** (1 / order) for each in (low, high))
        peaks = PEAKS[order, self.filtering]

        def fraction(scale: float) -> int:
            return axis.shrunk(max(RESOLUTION_BITS - math.floor(math.log2(scale)), 0))

        def state(peak: float, scale: float) -> SQ:
            f = fraction(scale)
            i = 1 + bits_for(peak)
            if not 1 <= i + f <= WIDEST:
                raise ValueError("a state is too wide")
            return SQ(i, f)

        gap = state((peaks[1] * tau_low + self.ahead) * step + self.noise, 1 / own)
        if axis.count_width + 1 + gap.f > WIDEST:
            raise ValueError("a count is too wide")
        self.gap = gap
        self.w = state(peaks[0] * step * tau_low**2 + self.noise * slowest, 1.0) if self.filtering else SQ(1, 0)
        z = [state(max(step * peaks[2], 1.0) + self.noise / fastest, own**-2)]
        for n in range(2, order + 1):
            peak = peaks[n + 1] * step * tau_high ** (1 - n) + self.noise * fastest**-n
            z.append(state(peak, own ** -(n + 1)))
        self.z = tuple(z) + (SQ(1, 0),) * (3 - order)

        self.velocity = SQ(z[0].i, min(z[0].f, axis.shrunk(fraction_bits(axis, OUTPUT_BITS))))
        self.half = 1 << (z[0].f - self.velocity.f) >> 1
        self.acceleration = SQ(z[1].i, min(z[1].f, WIDTH - z[1].i))
        self._units(bound, top)

    def _units(self, bound: float, top: int) -> None:
        """Derive the terms for a bound L, which may be raised by `top` octaves."""
        error = self.w if self.filtering else self.gap
        z = self.z[: self.order]
        places = ([self.w.f] if self.filtering else []) + [self.gap.f, *(each.f for each in z)]
        n_max = self.degree - 1
        gains = [LAMBDA[n_max][n] * bound ** ((self.degree - n) / self.degree) for n in range(n_max, -1, -1)]
        terms = tuple(powers.Term(n_max - j, gains[j], places[j]) for j in range(n_max))
        octaves = OCTAVES[0] - self.levels, top
        self.powers = powers.Design(error.width - 1, error.f, self.degree, terms, octaves)
        last = round(gains[-1] * 2.0 ** places[-1])
        self.relays = {k: last << k if k > 0 else last >> -k for k in range(octaves[0], top + 1)}
        if max(self.powers.widths) > WIDEST or not self.relays[octaves[0]]:
            raise ValueError("a term is too wide")

    @property
    def latency(self) -> int:
        return (FILTERING_STEPS if self.filtering else STEPS) + self.powers.latency

    def params(self, words: Mapping[str, int]) -> tuple:
        return self._common(words)

    def float_params(self, gains: JerkGains | SnapGains, output: str, si: Mapping[str, float]) -> tuple:
        return self._float_common(gains, si)

    def _common(self, words: Mapping[str, int]) -> Params:
        """Return the parameters that the integer kernels share."""
        (octaves,) = (words[word.name] for word in self.words)
        fractions = self.w.f, self.gap.f, *(each.f for each in self.z)
        limits = self.w.max, self.gap.max, *(each.max for each in self.z)
        return Params(
            order=self.order,
            filtering=self.filtering,
            count_width=self.count_width,
            octaves=octaves,
            relays=np.array([*self.relays.values()], np.int64),
            least_octave=min(self.relays),
            fractions=fractions,
            limits=limits,
            half=self.half,
            output_shift=self.z[0].f - self.velocity.f,
            acceleration_shift=self.z[1].f - self.acceleration.f,
            powers=self.powers.params,
        )

    def _float_common(self, gains: JerkGains | SnapGains, si: Mapping[str, float]) -> FloatParams:
        """Return the parameters that the float64 kernels share, with gains per sample."""
        ((_, bound),) = vars(gains).items()
        (word,) = self.words
        lipschitz = bound / self._per_l * 2.0 ** si.get(word.name, 0)
        n_max = self.degree - 1
        return FloatParams(
            order=self.order,
            filtering=self.filtering,
            count_width=self.count_width,
            gains=tuple(
                LAMBDA[n_max][n] * lipschitz ** ((self.degree - n) / self.degree) for n in range(n_max, -1, -1)
            ),
        )

    def start(self, floating: bool = False) -> tuple:
        return State(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0) if floating else State(0, 0, 0, 0, 0, 0, 0)
