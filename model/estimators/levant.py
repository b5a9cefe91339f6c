"""Levant's first-order sliding-mode differentiator, explicit Euler, in fixed point.

Per sample, with f the count, x its tracked value, u1 the integral state, all in counts and sample periods:

    e  = x - f
    u  = u1 - lambda sqrt(|e|) sign(e)
    x  <- x + u
    u1 <- u1 - alpha sign(e)                 sign(0) = 0

The tracked x is held as its distance from the last count, `lead = x - f`, so that the count may wrap: e = lead - (new
count - last count). Selectable outputs: `u`, as in the paper, and `u1`, the integral state after this sample's update.

Source: Chawda, Celik, O'Malley, World Haptics 2011, equations of the first-order differentiator; Levant 1998.

Formats, derived. Let lam = lambda tau / sqrt(q) and alp = alpha tau^2 / q be the gains per sample.

- `velocity` SQ(i, f): i holds twice the largest speed, since u oscillates about the true velocity.
- f, the fraction bits of e, u and u1: all alike, so that x + u and u1 - alpha are exact. alpha's word is at least
  2**ALPHA_BITS, so its relative error is at most 2**-(ALPHA_BITS+1). Rounding u to f bits stays within the position
  budget below.
- `root`, the format of sqrt(|e|), and f. The integer root rounds down, so half of its LSB is added back (a constant
  bit below it): no bias, and an error of at most half an LSB. Together with half an LSB of u, rounding changes u by at
  most delta = lam 2**-(root.f+1) + 2**-(f+1). The same u follows exactly from an e smaller or larger by
  eta <= 2 sqrt(|e|) delta / lam + (delta / lam)^2: *the fixed-point estimator is the exact one on a position perturbed
  by eta*. At |e| = 1 count, where quantisation keeps e, either part is held to POSITION_BUDGET / 2 counts.
- `error` SQ(i, f): lam sqrt(e_max) is at least twice the largest speed, so a velocity step across the whole range is
  still followed. e_max is never more than the range of the count. A larger e saturates (flag `error_saturated`), which
  drags x along.
- `lambda` UQ, GAIN_BITS wide, with two bits of headroom above the designed gain for changes at run time; `alpha` has
  the same headroom, and may be lowered by LOWER_BITS.

Range of the gains. Three kinds of words make an estimate that is wrong without a flag, and are refused:

- alpha = 0: u1 never moves.
- a lambda near 0: nothing damps the swing of u1 about a constant speed. The swing falls by a factor of lambda and
  sqrt(alpha) alone. Its last size is some 2 alpha^1.5 / lambda counts a sample: hence UNDAMPED.
- a lambda above 2, for the explicit sign alone. An error below lambda^2 / 4 changes its sign at every sample. So u1
  stands still while it is less than about lambda^2 / 4 counts a sample away from the speed. `LAMBDA_MAX` keeps that to
  a count a sample.

If a design's own gains exceed one of these limits, the limit is at its own gains.

Both states saturate at the velocity format (flag `velocity_saturated`).

Limits. The count may wrap. The first sample, and a sample with `restart`, begin with x = count and u1 = 0. A start from
rest has no transient. A start in motion at u0 has the transient of a step of u0. u overshoots the step by about 40 %
and follows within u0 (1 + p) / (alpha (1 - p)), p = exp(-pi / sqrt(8 alpha / lambda^2 - 1)). With the default gains
this is 1.96 u0 / alpha. It holds for the largest step, too (0.3 m/s with C = 12 m/s^2: 0.42 m/s at most, 43 ms). Up to
the largest speed nothing saturates after that transient. At standstill u and u1 never come to rest but chatter by
lambda sqrt(alpha tau^2) and alpha tau; `levant_semi_implicit` comes to rest.

`levant_semi_implicit` and `levant_implicit` share this module's gains, design and helper functions.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, UQ, bits_for, saturate, shift_floor, shift_round_half_up, wrap
from ..arithmetic.sqrt import isqrt
from ..arithmetic.sqrt import latency as sqrt_latency
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import GAIN_BITS, Word
from .estimate import EstimatorDesign, EstimatorGains, estimate

ALPHA_BITS = 9
"""The designed alpha's word has at least this many bits below its top bit: its error is at most 0.1 %."""
POSITION_BUDGET = 2.0**-5
"""Largest displacement of the position, in counts, by all rounding at |e| = 1 count."""
HEADROOM_BITS = 2
"""A gain may be raised to 2**HEADROOM_BITS times the designed one at run time."""
LOWER_BITS = 4
"""Alpha may be lowered to the designed one 2**-LOWER_BITS."""
UNDAMPED = 64
"""Every lambda that is accepted has a square of at least every alpha / UNDAMPED: the paper's gains have alpha / 1.1."""
LAMBDA_MAX = 2.0
"""The largest lambda of the explicit sign, unless the designed one is larger: see the module's docstring."""
STEPS = 1
"""Clocks of the sequence besides the root: see `hardwall.hdl.estimators.levant`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The gains in SI units: lambda in m^(1/2)/s, alpha in m/s^2."""

    lambda_sqrt_m_per_s: float
    alpha_m_per_s2: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the gains proposed by the paper for |f''| <= C, the axis's bound: lambda = sqrt(C), alpha = 1.1 C."""
        bound = axis.acceleration_max_m_per_s2
        return cls(math.sqrt(bound), 1.1 * bound)


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    lambda_: int
    alpha: int
    output: int
    count_width: int
    fraction: int
    radicand_shift: int
    product_shift: int
    error_max: int
    velocity_max: int


class State(NamedTuple):
    """The state; `lead` and `u1` have the velocity's fraction bits (float: counts), `count` is the last count."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    lead: float
    u1: float


class FloatParams(NamedTuple):
    lambda_: float
    alpha: float
    output: int
    count_width: int


START = State(0, 0, 0, 0)
FLOAT_START = State(0, 0, 0.0, 0.0)


class Design(EstimatorDesign):
    """Formats, run-time words and latency of the differentiator for an axis, derived as the module says.

    The designs of the other kernels of the family override the attributes of the class and the methods that begin with
    one underscore.

    Attributes:
        steps: clocks of the sequence besides the root.
        roundings: number of roundings of u to its fraction bits.
        velocity, error, root, radicand: formats of u and u1, e, sqrt(|e|), and the root's integer radicand.
        product: fraction bits of lambda times twice the root.
        words: `levant_lambda`, `levant_alpha`, `levant_output`.

    Raises:
        ValueError: if the gains fit no format that int64 can hold, with the accepted range.
    """

    name = "levant"
    gains_class = Gains
    outputs = ("u", "u1")
    flags = ("error_saturated", "velocity_saturated")
    steps = STEPS
    roundings = 1

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        tau, q = 1 / axis.sample_hz, axis.count_m
        lam = gains.lambda_sqrt_m_per_s * tau / math.sqrt(q)
        alpha = gains.alpha_m_per_s2 * tau**2 / q
        speed = axis.speed_max_counts_per_sample

        i = 1 + bits_for(max(2 * speed, 2.0))
        # A gain may not move u across its whole range in a sample; a gain too small needs more bits than int64 has.
        f_max = 60 - max(axis.count_width, i)
        largest = 2.0 ** (i - 1)
        least_lam, least_alpha = self._least(f_max)
        _check(gains.lambda_sqrt_m_per_s, "lambda_sqrt_m_per_s", least_lam, largest, lam)
        _check(gains.alpha_m_per_s2, "alpha_m_per_s2", least_alpha, largest, alpha)

        lam_i = HEADROOM_BITS + bits_for(lam)
        self.lambda_ = UQ(lam_i, GAIN_BITS - lam_i)
        error_i = 1 + min(max(bits_for(self._catch(2 * speed, lam)), 1), axis.count_width - 1)
        radicand_i = self._radicand_i(error_i)
        # A radicand has at most 62 bits.
        root_f = min(bits_for(self._position_per_root(lam) / POSITION_BUDGET), (62 - radicand_i) // 2)
        root_f = max(root_f - axis.estimator_bits_dropped, 0)
        self.product = self.lambda_.f + root_f + 1
        f = axis.shrunk(self._fraction(axis, lam, alpha, f_max))
        self.velocity = SQ(i, f)
        self.alpha = UQ(HEADROOM_BITS + bits_for(alpha), f)
        self.error = SQ(error_i, f)
        self.radicand = UQ(radicand_i, 2 * root_f)
        self.root = UQ((self.radicand.width + 1) // 2 - root_f, root_f)
        # The step of u before its limit, and one more bit, must fit int64.
        _check(
            gains.lambda_sqrt_m_per_s,
            "lambda_sqrt_m_per_s",
            least_lam,
            2.0 ** (61 - f - self.root.i - HEADROOM_BITS),
            lam,
        )

        self.words = self._words(lam, alpha, tau, q)

    def _words(self, lam: float, alpha: float, tau: float, q: float) -> tuple[Word, ...]:
        """Return the run-time words for the designed gains per sample, with the ranges that the module derives."""
        prefix = self.name.replace("-", "_")
        of_root, of_sign = self.lambda_.from_real(lam), self.alpha.from_real(alpha)
        damped = math.sqrt(self.alpha.to_real(self.alpha.max) / UNDAMPED)
        least_root = max(min(math.ceil(damped * 2**self.lambda_.f), of_root), 1)
        most_sign = math.floor(UNDAMPED * self.lambda_.to_real(least_root) ** 2 * 2**self.alpha.f)
        roots = least_root, self._most(of_root)
        signs = max(of_sign >> LOWER_BITS, 1), min(max(most_sign, of_sign), self.alpha.max)
        doc, unit = "gain of the square-root term", "m^(1/2)/s"
        return (
            Word(f"{prefix}_lambda", self.lambda_, math.sqrt(q) / tau, unit, of_root, doc, *roots),
            Word(f"{prefix}_alpha", self.alpha, q / tau**2, "m/s^2", of_sign, "gain of the sign term", *signs),
            Word(self.output_word(), UQ(1, 0), 1.0, "", 0, "velocity output: 0 for u, 1 for u1"),
        )

    def _most(self, designed: int) -> int:
        """Return the largest word of lambda, from the word of the designed lambda."""
        return max(designed, min(math.floor(LAMBDA_MAX * 2**self.lambda_.f), self.lambda_.max))

    def _least(self, f_max: int) -> tuple[float, float]:
        """Return the least lambda and alpha, per sample, that `f_max` fraction bits can hold."""
        return self.roundings * 2 / (2.0**f_max * POSITION_BUDGET), 2.0 ** (ALPHA_BITS - f_max)

    def _position_per_root(self, lam: float) -> float:
        """Return the displacement of the position, in counts, by an error of 1 in the root at |e| = 1 count."""
        return 2.0

    def _fraction(self, axis, lam: float, alpha: float, f_max: int) -> int:
        """Return the fraction bits of e, u and u1."""
        rounding = self.roundings * self._position_per_root(lam) / (lam * POSITION_BUDGET)
        return max(ALPHA_BITS - math.floor(math.log2(alpha)), bits_for(rounding), 0)

    def _catch(self, step: float, lam: float) -> float:
        """Return the error, in counts, that makes u step by `step`."""
        return (step / lam) ** 2

    def _radicand_i(self, error_i: int) -> int:
        """Return the integer bits of the radicand for an error of `error_i` integer bits."""
        return error_i - 1

    @property
    def latency(self) -> int:
        return self.steps + sqrt_latency(self.radicand.width)

    def params(self, words: Mapping[str, int]) -> tuple:
        return self._common(words)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> tuple:
        return self._float_common(gains, output, si)

    def _common(self, words: Mapping[str, int]) -> Params:
        """Return the parameters that all integer kernels of the family share."""
        lam, alpha, output = (words[word.name] for word in self.words)
        return Params(
            lambda_=lam,
            alpha=alpha,
            output=output,
            count_width=self.count_width,
            fraction=self.velocity.f,
            radicand_shift=self.velocity.f - self.radicand.f,
            product_shift=self.product - self.velocity.f,
            error_max=self.error.max,
            velocity_max=self.velocity.max,
        )

    def _float_common(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the parameters that all float64 kernels of the family share, with gains per sample."""
        lam, alpha, _ = self.words
        return FloatParams(
            lambda_=si.get(lam.name, gains.lambda_sqrt_m_per_s) / lam.si_per_unit,
            alpha=si.get(alpha.name, gains.alpha_m_per_s2) / alpha.si_per_unit,
            output=self.outputs.index(output),
            count_width=self.count_width,
        )

    def start(self, floating: bool = False) -> tuple:
        return FLOAT_START if floating else START


def _check(value: float, name: str, low: float, high: float, scaled: float) -> None:
    """Raise ValueError, in the units of `value`, unless `scaled` (the gain per sample) is within `low` to `high`."""
    if not low <= scaled <= high:
        unit = value / scaled
        raise FieldError(name, f"must be {low * unit:g} to {high * unit:g} at these rates, not {value!r}")


@compiled
def sign_of(value):
    """Return the sign of `value`: -1, 0 or 1."""
    # int() is for plain Python on numpy scalars, whose bools cannot be subtracted.
    return int(value > 0) - int(value < 0)


@compiled
def arrive(params, state, seen, restart):
    """Return (counts moved since the last sample, lead, u1), all 0 at the first sample, for either kernel."""
    fresh = restart or not state.running
    moved = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    return moved, 0 if fresh else state.lead, 0 if fresh else state.u1


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    moved, lead, u1 = arrive(params, state, seen, restart)

    distance = lead - (moved << params.fraction)
    error = saturate(distance, -params.error_max, params.error_max)
    sign = sign_of(error)
    root = isqrt(shift_floor(abs(error), params.radicand_shift))
    far_u = u1 - sign * shift_round_half_up(params.lambda_ * (2 * root + 1), params.product_shift)
    u = saturate(far_u, -params.velocity_max - 1, params.velocity_max)
    far_u1 = u1 - sign * params.alpha
    u1 = saturate(far_u1, -params.velocity_max - 1, params.velocity_max)

    flags = int(error != distance) | int(u != far_u or u1 != far_u1) << 1
    return State(1, seen.count, error + u, u1), u1 if params.output else u, flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample by the paper's algorithm in float64, unsaturated: the reference for the cost of fixed point."""
    moved, lead, u1 = arrive(params, state, seen, restart)

    error = lead - moved
    sign = sign_of(error)
    u = u1 - params.lambda_ * math.sqrt(abs(error)) * sign
    u1 = u1 - params.alpha * sign
    return State(1, seen.count, error + u, u1), u1 if params.output else u, 0
