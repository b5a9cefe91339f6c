"""Levant's differentiator with an implicit sign and an explicit square root, in fixed point.

The explicit `levant` evaluates sign(e) before it knows whether its step crosses e = 0. At low rates the step alpha is
not small against a count, and it crosses at every sample: numerical chatter. Here the sign is taken of the error
*after* the step. It is set-valued at 0, so a step that would cross 0 stops there. Per sample, in counts and sample
periods; f is the count, x its tracked value, u1 the integral state, and a plus means after the sample:

    e+  =  x + u1 - f  -  g sign(e+)  -  alpha S,      S in SGN(e+): sign(e+), or anything in [-1, 1] where e+ = 0
    u1+ =  u1 - alpha S
    u   =  u1+ - g sign(e+),      x+ = x + u = f + e+

Before the step b = x + u1 - f is known, and e+ has the sign of b or is 0. So the generalised equation is solved by a
projection: alpha S takes as much of b as it can, near = min(|b|, alpha), and the root term acts on the rest,
beyond = |b| - near,

    u1+ = u1 - sign(b) near          g = min(lambda sqrt(beyond), beyond)
    u   = u1+ - sign(b) g            e+ = sign(b) (beyond - g)

with an explicit root, of the part of b that alpha leaves; the projection keeps the root term, too, from crossing. For
the fully implicit root see `levant_implicit`. u, the corrected velocity, moves the tracked x; u1, the integral state,
is the quieter output.

- *Standstill and constant speed.* In the band |b| <= alpha, e+ = 0 and u1+ = (f - last f) - (last e): from the second
  successive sample within the band, both outputs are exactly the finite difference, without memory or rounding. In the
  band, therefore, fixed point and real numbers agree word for word. A constant count leads into the band from any
  state, at every rate, and there u is exactly 0. With C = 1.6785 m/s^2 it was measured after 32 ms from 30 mm/s, and
  after 0.22 s from 0.3 m/s: about 2 u / alpha. `levant` never gets there.
- *Low rates.* If alpha is a count or more, the estimator is the finite difference, limited in acceleration: 0.42 mm/s
  RMS on the paper's signal at 1 kHz, where the explicit estimator has 1.95. There the lack of chatter does not make it
  better than the finite difference; and a larger C only makes it more similar.
- *High rates.* With alpha and lambda^2 much less than a count, every count is an excursion beyond both projections. The
  estimator then equals the explicit one, and the noise of the count remains (at 1 MHz 0.649; explicit: 0.647). In
  between, at 5 to 100 kHz, u is worse by up to a fifth (at 10 kHz 0.740; explicit: 0.626). u1 is better or equal
  (0.280; explicit: 0.290).

Source: the implicit sign of Acary, Brogliato, Orlov, IEEE Trans. Automatic Control 2012; semi-implicit differentiators,
whose projectors split S differently, Michel, Ghanes, Plestan, Aoustin, Barbot, CDC 2021, and as compared by
Mojallizadeh, Brogliato, Acary, Int. J. Robust and Nonlinear Control 2021. The split above, alpha first, is this
project's: it needs no divider.

Formats are as in `levant`, with beyond instead of |e|, except:

- b is held as `lead - moved`, lead = e+ + u1+ of the last sample; it saturates at the `error` format (flag
  `error_saturated`). To let the root step across the whole speed range, lambda sqrt(beyond) and beyond must both reach
  it: the range holds (2 speed / lambda)^2 + 2 speed.
- b, alpha, u1 and e+ have the same fraction bits: the whole projection is exact, and only g is rounded. Its error is at
  most delta = lambda 2**-(root.f+1) + 2**-(f+1), without a bias. g never exceeds its limit, so e+ keeps its sign. g
  grows with beyond, at the rate lambda / (2 sqrt(beyond)) or 1. So the same u follows exactly from a displaced beyond.
  The displacement is at most eta = 2 sqrt(beyond) delta / lambda + (delta / lambda)^2, or delta where this is larger.
- u saturates at the output, u1 in the state (flag `velocity_saturated`); e+ depends on neither limit, so a saturated u
  does not drag x.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ..arithmetic.fixed import saturate, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import isqrt
from ..runtime.compiled import compiled
from . import levant
from .estimate import estimate
from .levant import State, arrive, sign_of

STEPS = 10
"""Clocks of the sequence besides the root: see `hardwall.hdl.estimators.levant_semi_implicit`."""


class Params(NamedTuple):
    """Parameters of the integer kernel: as of `levant`, in a separate class, which selects this kernel."""

    levant: levant.Params


class FloatParams(NamedTuple):
    """Parameters of the float64 kernel: as of `levant`, in a separate class, which selects this kernel."""

    levant: levant.FloatParams


class Design(levant.Design):
    """Formats, run-time words and latency for an axis, as in `levant.Design` except where the module says otherwise."""

    name = "levant-semi-implicit"
    steps = STEPS

    def _most(self, designed: int) -> int:
        # The projection keeps the root term from crossing, however large lambda is.
        return self.lambda_.max

    def _catch(self, step: float, lam: float) -> float:
        return (step / lam) ** 2 + step

    def params(self, words: Mapping[str, int]) -> tuple:
        return Params(self._common(words))

    def float_params(self, gains: levant.Gains, output: str, si: Mapping[str, float]) -> tuple:
        return FloatParams(self._float_common(gains, output, si))


@compiled
def band(error, alpha):
    """Return (sign, near, beyond): the sign of an error, the part that alpha takes, and the rest; for either kernel."""
    near = min(abs(error), alpha)
    return sign_of(error), near, abs(error) - near


@compiled
def settle(params, u1, sign, near, beyond, correction):
    """Return (lead, u1, velocity, flag) after a sample, held within their formats; the flag says if one was limited."""
    far_u1 = u1 - sign * near
    u1 = saturate(far_u1, -params.velocity_max, params.velocity_max)
    far_u = u1 - sign * correction
    u = saturate(far_u, -params.velocity_max, params.velocity_max)
    return sign * (beyond - correction) + u1, u1, u1 if params.output else u, int(u != far_u or u1 != far_u1)


@compiled
def float_settle(params, u1, sign, near, beyond, correction):
    """Return (lead, u1, velocity) after a sample."""
    u1 = u1 - sign * near
    u = u1 - sign * correction
    return sign * (beyond - correction) + u1, u1, u1 if params.output else u


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    family = params.levant
    moved, lead, u1 = arrive(family, state, seen, restart)
    distance = lead - (moved << family.fraction)
    error = saturate(distance, -family.error_max, family.error_max)
    sign, near, beyond = band(error, family.alpha)
    root = isqrt(shift_floor(beyond, family.radicand_shift))
    correction = min(shift_round_half_up(family.lambda_ * (2 * root + 1), family.product_shift), beyond)
    lead, u1, velocity, far = settle(family, u1, sign, near, beyond, correction)
    return State(1, seen.count, lead, u1), velocity, int(error != distance) | far << 1


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    family = params.levant
    moved, lead, u1 = arrive(family, state, seen, restart)
    sign, near, beyond = band(lead - moved, family.alpha)
    correction = min(family.lambda_ * math.sqrt(beyond), beyond)
    lead, u1, velocity = float_settle(family, u1, sign, near, beyond, correction)
    return State(1, seen.count, lead, u1), velocity, 0
