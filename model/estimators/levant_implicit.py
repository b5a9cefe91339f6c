"""Levant's differentiator by implicit Euler, for both the sign and the square root, in fixed point.

The algorithm is `levant_semi_implicit`, but the root, too, is of the error after the step. Per sample, in counts and
sample periods; f is the count, x its tracked value, u1 the integral state, and a plus means after the sample:

    e+  =  x + u1 - f  -  lambda sqrt(|e+|) sign(e+)  -  alpha S,      S in SGN(e+)
    u1+ =  u1 - alpha S
    u   =  u1+ - lambda sqrt(|e+|) sign(e+),      x+ = x + u = f + e+

SGN is set-valued at 0: anything in [-1, 1]. With b = x + u1 - f, the closed form has two cases. Within |b| <= alpha,
e+ = 0 and alpha S = b solve it: S is a linear function of b, which is why nothing chatters. Beyond, e+ has the sign of
b, and z = sqrt(|e+|) is the positive root of z^2 + lambda z = |b| - alpha. Together, as in `levant_semi_implicit`,

    near = min(|b|, alpha),  beyond = |b| - near,      g = lambda z = lambda (sqrt(beyond + lambda^2/4) - lambda/2)
    u1+ = u1 - sign(b) near,   u = u1+ - sign(b) g,    e+ = sign(b) (beyond - g)

a continuous map of b, in which g never exceeds beyond. The outputs are u, the corrected velocity, and u1, the integral
state. The statements of `levant_semi_implicit` on standstill, constant speed, low and high rates hold here too. In the
band both outputs are exactly the finite difference. Outside it g is smaller, so this estimator is the smoother of the
two between 1 and 100 kHz. (Here e+ is not 0 in some cases where it is 0 there, so a constant count takes some samples
more.)

Source: implicit Euler for the super-twisting algorithm, Acary, Brogliato 2010 and 2012; Brogliato, Polyakov, Efimov,
IEEE Trans. Automatic Control 2020; closed form for the differentiator, Mojallizadeh, Brogliato, Acary, Int. J. Robust
and Nonlinear Control 2021; Koch, Reichhartinger 2018 for the class to which it belongs.

Formats are as in `levant_semi_implicit`, except:

- g = lambda root - lambda^2/2, root = sqrt(beyond + lambda^2/4): the same multiplier makes lambda^2, used twice, and
  lambda times the root. `radicand` has room for lambda^2/4 at the largest word. In the radicand, lambda^2/4 is rounded
  down to the LSB, a position of 2**-(2 root.f); in g, lambda^2/2 is rounded to f bits.
- With the root's half LSB as in `levant`, the error of g is at most delta = lambda 2**-(root.f+1) + 2 * 2**-(f+1). The
  same u follows exactly from a displaced beyond. The displacement is at most eta = 2 sqrt(beyond + lambda^2/4) delta /
  lambda + (delta / lambda)^2 + 2**-(2 root.f). At beyond = 1 count the slope is sqrt(4 + lambda^2): each part of delta
  is held to POSITION_BUDGET / 2 there. At low rates this takes a root of more bits than in the explicit estimator. (If
  lambda is in the thousands, the radicand would exceed int64: the root then has the remaining bits, and delta grows.) g
  is held within 0 to beyond.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ..arithmetic.fixed import saturate, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import isqrt
from ..runtime.compiled import compiled
from . import levant, levant_semi_implicit
from .estimate import estimate
from .levant import State, arrive
from .levant_semi_implicit import band, float_settle, settle


class Params(NamedTuple):
    """Parameters of `levant`, and the shifts of lambda^2 to the radicand's and to the velocity's fraction bits."""

    levant: levant.Params
    quarter_shift: int
    half_shift: int


class FloatParams(NamedTuple):
    """Parameters of `levant`, in a separate class that selects this kernel."""

    levant: levant.FloatParams


class Design(levant_semi_implicit.Design):
    """Formats, run-time words and latency for an axis, as in `levant.Design` except where the module says otherwise.

    Attributes:
        quarter_shift, half_shift: fraction bits of lambda^2 / 4 beyond the radicand's, of lambda^2 / 2 beyond u's.
    """

    name = "levant-implicit"
    roundings = 2

    def _position_per_root(self, lam: float) -> float:
        return math.sqrt(4 + lam**2)

    def _radicand_i(self, error_i: int) -> int:
        return max(error_i - 1, 2 * self.lambda_.i - 2) + 1

    @property
    def quarter_shift(self) -> int:
        return 2 * self.lambda_.f + 2 - self.radicand.f

    @property
    def half_shift(self) -> int:
        return 2 * self.lambda_.f + 1 - self.velocity.f

    def params(self, words: Mapping[str, int]) -> tuple:
        return Params(self._common(words), self.quarter_shift, self.half_shift)

    def float_params(self, gains: levant.Gains, output: str, si: Mapping[str, float]) -> tuple:
        return FloatParams(self._float_common(gains, output, si))


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    family = params.levant
    moved, lead, u1 = arrive(family, state, seen, restart)
    distance = lead - (moved << family.fraction)
    error = saturate(distance, -family.error_max, family.error_max)
    sign, near, beyond = band(error, family.alpha)
    square = family.lambda_ * family.lambda_
    root = isqrt(shift_floor(beyond, family.radicand_shift) + shift_floor(square, params.quarter_shift))
    full = shift_round_half_up(family.lambda_ * (2 * root + 1), family.product_shift)
    correction = saturate(full - shift_round_half_up(square, params.half_shift), 0, beyond)
    lead, u1, velocity, far = settle(family, u1, sign, near, beyond, correction)
    return State(1, seen.count, lead, u1), velocity, int(error != distance) | far << 1


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    family = params.levant
    moved, lead, u1 = arrive(family, state, seen, restart)
    sign, near, beyond = band(lead - moved, family.alpha)
    half = family.lambda_ / 2
    # This form of the difference of the two roots has no cancellation.
    correction = family.lambda_ * beyond / (math.sqrt(beyond + half * half) + half)
    lead, u1, velocity = float_settle(family, u1, sign, near, beyond, correction)
    return State(1, seen.count, lead, u1), velocity, 0
