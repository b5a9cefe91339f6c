"""The finite difference behind a second-order Butterworth low pass, in fixed point.

Per sample, with d the difference of the last two counts, in counts and sample periods:

    x  = (d + 2 d' + d'') / 4            the last three differences: the double zero at half the sampling rate
    w <- w + gamma (x - y) - beta w
    y <- y + gamma w                     the velocity, output `u`; with the new w

Let g = tan(pi f_c / f_s) and D = 1 + sqrt(2) g + g^2. Let gamma = 2 g / sqrt(D) and beta = 2 sqrt(2) g / D. Then this
is the bilinear transform, prewarped, of 1 / (s^2 + sqrt(2) s + 1). Eliminating w gives y[k] - (2 - beta - gamma^2)
y[k-1] + (1 - beta) y[k-2] = gamma^2 x[k]. Before the first sample the filter is at rest at velocity 0.

Source: Chawda, Celik, O'Malley, World Haptics 2011, "FDM" with a Butterworth filter; Butterworth 1930.

Structure. A direct form rounds y, while the signal is in the differences between values of y: at gamma = 2e-4 an LSB
there appears at the output 1/gamma^2 times. The delta form, which has w in units of gamma, still has 1/gamma^2. Here
the two states are of the same size, both coefficients are of the same order, and
- *operands*: the multiplications take w and x - y without their last bits (floor). This is a change of w and of y
  before the filter, which returns it with a gain of order 1 whatever gamma: OPERAND_NORM LSB at most.
- *accumulators* keep the bits that an operand drops, and the products are floored to the accumulators' LSB. Such an
  error appears at the output of order 1/gamma times: PRODUCT_NORM max(1/gamma, 2) LSB at most, and only adders need
  the additional bits.

The norms are sums of the absolute impulse responses from each place to y, the largest over all cutoffs up to
CUTOFF_MAX. STATE_NORM is the same from x to w and y. No input makes w or y larger.

Formats, derived. C' = C tau^2 / q is the bound on the acceleration in counts a sample^2.

- d is held within `step_max`: the counts that twice the largest speed moves in a sample, begun within a count, and one
  count for an edge out of place. A larger d saturates (flag `velocity_saturated`), and the excess is lost.
- f, fraction bits of the velocity: an LSB is at most sqrt(C') 2**-RESOLUTION_BITS. sqrt(C') is half of the minimax
  bound 2 sqrt(C eps), eps one count.
- operands have GUARD_BITS more, which makes OPERAND_NORM of their LSB 0.38 of an LSB of the velocity.
- accumulators have another `reach` bits, 1/gamma at the least cutoff as a power of two, no less than 2: their errors
  add up to 0.1. The total is less than a half: *under a constant difference n, y settles within half an LSB of n and
  the velocity, rounded half up, is n exactly*; 0 at standstill. The velocity has no limit cycle, and its gain at DC is
  exactly 1.
- i holds STATE_NORM times `step_max`, plus one. With the coefficients of any single cutoff nothing else saturates;
  while the host changes them, or with coefficients that belong to no cutoff, w or y may (flag `state_saturated`).
- `frequency` and `damping`, run-time words, are gamma and beta with a common exponent, value = word 16**-exponent,
  UQ(1, GAIN_BITS - 1): they keep 12 bits at any cutoff. The three belong together: `Design.words_for` makes them.
- They hold any cutoff from the default one / 2**RANGE_BITS, or the designed one if that is lower, to CUTOFF_MAX.
- int64 holds 62 bits: if the formats do not fit, first the range of cutoffs is reduced, then f.

Range of the words. The poles are the roots of z^2 - (2 - beta - gamma^2) z + 1 - beta. By Jury's criterion they are
stable if and only if 0 < beta, 0 < gamma and gamma^2 + 2 beta < 4.

- Both mantissas begin at LEAST, below which no cutoff has any. 0 is refused: it would hold the velocity, or leave an
  oscillation without damping.
- With an exponent of 1 or more both coefficients are below 1/8, and stable.
- With exponent 0 no ranges of single words hold every cutoff and no unstable pair. So a pair with
  2 beta + gamma >= 4 or 2 beta + 3 gamma >= 6 raises the flag `gains_unstable` at every sample. Every unstable pair
  does, since gamma^2 is at most gamma below 1, and at most 3 gamma - 2 from 1 to 2. A cutoff has 5.98 and less.

Restart and the first sample: d = 0 and all states 0; the count may wrap. A start from rest has no transient; a start in
motion has the filter's step response, as for any step of velocity: 4.3 % overshoot, settled in about 1 / cutoff.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, UQ, bits_for, saturate, shift_floor, shift_round_half_up, wrap
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import GAIN_BITS, Word
from .estimate import EstimatorDesign, EstimatorGains, estimate, fraction_bits, largest_step

CUTOFF_MAX = 0.4
"""Highest cutoff, as a fraction of the sampling rate."""
RESOLUTION_BITS = 10
"""The output LSB is at most sqrt(C') 2**-RESOLUTION_BITS."""
RANGE_BITS = 6
"""The host may lower the cutoff at least to the default one 2**-RANGE_BITS: from 780 to 12 Hz."""
GUARD_BITS = 6
"""Bits of an operand below the output LSB."""
EXPONENT_STEP = 4
"""Bits by which one step of the common exponent shifts the coefficients: few exponents, at little loss of precision."""
LEAST = 1 << GAIN_BITS - 1 - EXPONENT_STEP
"""The least word of a coefficient: a smaller one would have a larger exponent, or be below the least cutoff."""
STATE_NORM = 1.75
OPERAND_NORM = 24.0
PRODUCT_NORM = 6.3
"""Largest norms at y: see the module's docstring."""
STEPS = 15
"""Clocks of the sequence: see `hardwall.hdl.estimators.butterworth`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The cutoff of the low pass, Hz."""

    cutoff_hz: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the cutoff whose delay is sqrt(q / C) = sqrt(2) / (2 pi f_c)."""
        return cls(min(_default_hz(axis), CUTOFF_MAX * axis.sample_hz))


def _default_hz(axis) -> float:
    return math.sqrt(2 * axis.acceleration_max_m_per_s2 / axis.count_m) / (2 * math.pi)


def coefficients(ratio: float) -> tuple[float, float]:
    """Return gamma and beta for a cutoff of `ratio` times the sampling rate."""
    g = math.tan(math.pi * ratio)
    d = 1 + math.sqrt(2) * g + g * g
    return 2 * g / math.sqrt(d), 2 * math.sqrt(2) * g / d


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    frequency: int
    damping: int
    product_shift: int
    count_width: int
    step_max: int
    operand_fraction: int
    operand_shift: int
    output_shift: int
    state_max: int
    unstable: int


class State(NamedTuple):
    """The state: `w` and `y` have the accumulators' fraction bits (float: counts a sample), `d1`, `d2` the last d."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    d1: int
    d2: int
    w: float
    y: float


class FloatParams(NamedTuple):
    gamma: float
    beta: float
    count_width: int


START = State(0, 0, 0, 0, 0, 0)
FLOAT_START = State(0, 0, 0, 0, 0.0, 0.0)


class Design(EstimatorDesign):
    """Formats, run-time words and latency of the filter for an axis, derived as the module says.

    Attributes:
        step_max: largest difference of counts.
        velocity, operand, state: formats of the output, of the operands x - y and w, and of w and y.
        coefficient: format of the two coefficient words.
        exponent_max: largest exponent; a larger word acts as this one.
        cutoff_min_hz, cutoff_max_hz: range of cutoffs that the words hold.
        words: `butterworth_frequency`, `butterworth_damping`, `butterworth_exponent`.

    Raises:
        ValueError: if the cutoff is above CUTOFF_MAX of the rate, or too low for int64, with the accepted range.
    """

    name = "butterworth"
    gains_class = Gains
    flags = ("velocity_saturated", "state_saturated", "gains_unstable")
    latency = STEPS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self._sample_hz = axis.sample_hz
        self.step_max = largest_step(axis)
        self.coefficient = UQ(1, GAIN_BITS - 1)
        self.cutoff_max_hz = CUTOFF_MAX * axis.sample_hz
        i = 1 + bits_for(STATE_NORM * self.step_max + 1)

        # The widest sums have three bits more than a state: 63 with the sign.
        room = 60 - i - GUARD_BITS
        least = 2.0**-room * axis.sample_hz / (2 * math.pi)
        self.cutoff_min_hz = least
        self._check(gains.cutoff_hz)
        f = min(fraction_bits(axis, RESOLUTION_BITS), 62 - GAIN_BITS - GUARD_BITS - 1 - i)
        needed = self._reach(gains.cutoff_hz)
        wanted = self._reach(min(_default_hz(axis) / 2**RANGE_BITS, gains.cutoff_hz))
        reach = max(needed, min(wanted, room - f))
        f = min(f, room - reach)
        self.cutoff_min_hz = gains.cutoff_hz if reach == needed else 2.0**-reach * axis.sample_hz / (2 * math.pi)
        self.cutoff_min_hz = max(self.cutoff_min_hz, least)

        f = axis.shrunk(f)
        self.velocity = SQ(i, f)
        self.operand = SQ(i + 1, f + GUARD_BITS)
        self.state = SQ(i, f + GUARD_BITS + reach)
        self.exponent_max = self._exponent(*coefficients(self.cutoff_min_hz / axis.sample_hz))
        reset = self.words_for(gains.cutoff_hz)
        mantissa = "coefficient {} times 16**butterworth_exponent"
        self.words = tuple(
            Word(name, fmt, 1.0, "", fmt.from_real(reset[name]), doc, least)
            for name, fmt, doc, least in (
                ("butterworth_frequency", self.coefficient, mantissa.format("gamma"), LEAST),
                ("butterworth_damping", self.coefficient, mantissa.format("beta"), LEAST),
                (
                    "butterworth_exponent",
                    UQ(max(self.exponent_max.bit_length(), 1), 0),
                    "common exponent of the coefficients",
                    None,
                ),
            )
        )

    def _reach(self, cutoff_hz: float) -> int:
        return max(bits_for(1 / coefficients(min(cutoff_hz / self._sample_hz, CUTOFF_MAX))[0]), 1)

    def _exponent(self, *pair: float) -> int:
        # The limit is the largest word, just under a power of two, so that rounding cannot exceed it.
        largest = self.coefficient.to_real(self.coefficient.max)
        return max(math.floor(math.log2(largest / max(pair)) / EXPONENT_STEP), 0)

    def _check(self, cutoff_hz: float):
        low, high = self.cutoff_min_hz, self.cutoff_max_hz
        if not low * (1 - 1e-9) <= cutoff_hz <= high * (1 + 1e-9):
            raise FieldError("cutoff_hz", f"must be {low:g} to {high:g} at these rates, not {cutoff_hz!r}")

    def words_for(self, cutoff_hz: float) -> dict[str, float]:
        """Return the three words, by name, as numbers for `Axis`; the fixed-point axis rounds them.

        Raises:
            ValueError: if the cutoff is outside `cutoff_min_hz` to `cutoff_max_hz`.
        """
        self._check(cutoff_hz)
        pair = coefficients(cutoff_hz / self._sample_hz)
        exponent = min(self._exponent(*pair), self.exponent_max)
        scale = 2.0 ** (EXPONENT_STEP * exponent)
        return {
            "butterworth_frequency": pair[0] * scale,
            "butterworth_damping": pair[1] * scale,
            "butterworth_exponent": exponent,
        }

    def product_shift(self, exponent: int) -> int:
        """Return the right shift of a product, with coefficients of this exponent, to the LSB of the states."""
        shift = self.operand.f + self.coefficient.f - self.state.f
        return shift + EXPONENT_STEP * min(exponent, self.exponent_max)

    def unstable(self, frequency: int, damping: int, exponent: int) -> bool:
        """Return whether the flag `gains_unstable` is up with these words."""
        one = 1 << self.coefficient.f
        far = 2 * damping + frequency >= 4 * one or 2 * damping + 3 * frequency >= 6 * one
        return far and min(exponent, self.exponent_max) == 0

    @property
    def fastest(self) -> int:
        """The velocity's word at a difference of counts that is limited at every sample."""
        return self.step_max << self.velocity.f

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(
            words["butterworth_frequency"],
            words["butterworth_damping"],
            self.product_shift(words["butterworth_exponent"]),
            self.count_width,
            self.step_max,
            self.operand.f,
            self.state.f - self.operand.f,
            self.state.f - self.velocity.f,
            self.velocity.max << (self.state.f - self.velocity.f),
            int(self.unstable(*(words[word.name] for word in self.words))),
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: coefficients from `si` where given, else from `gains`."""
        value = {**self.words_for(gains.cutoff_hz), **si}
        scale = 2.0 ** -(EXPONENT_STEP * min(value["butterworth_exponent"], self.exponent_max))
        return FloatParams(
            value["butterworth_frequency"] * scale, value["butterworth_damping"] * scale, self.count_width
        )

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    fresh = restart or not state.running
    moved = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    d1 = 0 if fresh else state.d1
    d2 = 0 if fresh else state.d2
    w = 0 if fresh else state.w
    y = 0 if fresh else state.y

    d = saturate(moved, -params.step_max, params.step_max)
    error = ((d + 2 * d1 + d2) << (params.operand_fraction - 2)) - (y >> params.operand_shift)
    push = shift_floor(params.frequency * error, params.product_shift)
    drag = shift_floor(params.damping * (w >> params.operand_shift), params.product_shift)
    far_w = w + push - drag
    w = saturate(far_w, -params.state_max, params.state_max)
    far_y = y + shift_floor(params.frequency * (w >> params.operand_shift), params.product_shift)
    y = saturate(far_y, -params.state_max, params.state_max)

    flags = int(d != moved) | int(w != far_w or y != far_y) << 1 | params.unstable << 2
    return State(1, seen.count, d, d1, w, y), shift_round_half_up(y, params.output_shift), flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same filter, as a reference for the cost of fixed point."""
    fresh = restart or not state.running
    d = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    d1 = 0 if fresh else state.d1
    d2 = 0 if fresh else state.d2
    w = 0.0 if fresh else state.w
    y = 0.0 if fresh else state.y

    w += params.gamma * ((d + 2 * d1 + d2) / 4 - y) - params.beta * w
    y += params.gamma * w
    return State(1, seen.count, d, d1, w, y), y, 0
