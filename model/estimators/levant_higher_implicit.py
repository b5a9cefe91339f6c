"""Levant's differentiators of order 2 and 3 by implicit Euler, in fixed point and in float64.

The published scheme, per sample, in counts and sample periods; f is the count, N the order, a plus means after the
sample, and y = |z0+ - f|^(1 / (N + 1)):

    z_j+  =  z_j + z_(j+1)+  -  a_j y^(N-j) S,      a_j = LAMBDA[N][N-j] L^((j+1) / (N+1)),    j = 0 to N - 1
    z_N+  =  z_N             -  a_N S,              S in SGN(z0+ - f), which is anything in [-1, 1] at 0

With b = z0 + ... + zN - f it has a closed form. Within |b| <= a_N, y = 0 and S = b / a_N. Beyond, S is the sign of b,
and y is the positive root of

    y^(N+1) + a_0 y^N + ... + a_(N-1) y + a_N  =  |b|

Prediction and correction. This project computes the same scheme in other states: the derivatives at the sample instead
of backward differences. They are v = z1 + z2 / 2, a = z2 + z3 and z3 (order 2: z3 = 0). Then b is the predicted error,
and every state is a Taylor series, corrected by a term that depends on b alone:

    b   =  b- - (counts moved)
    b-  <- b + v + 3/2 (a + z3)  -  T_0(|b|) sign(b)        T_0 = s_0 + s_1 + ... + s_N
    v   <- v + a + z3 / 2        -  T_1(|b|) sign(b)        T_1 = s_1 + s_2 / 2
    a   <- a + z3                -  T_2(|b|) sign(b)        T_2 = s_2 + s_3
    z3  <- z3                    -  T_3(|b|) sign(b)        T_3 = s_3

with s_j = a_j y^(N-j) + ... + a_N. The output is v, in `State` z1, with a as z2. z1 of the published scheme is half a
sample late: it is off by half of the acceleration, without a bound. v is off by a third of the jerk.

One curve for every bound. With y = L^(1 / (N+1)) rho, rho depends on |b| / L alone, and s_j = L times a polynomial of
rho. So a word that raises L by octaves shifts the argument and the terms. The terms are `arithmetic.curves` of |b|:

- Up to a power of two within a_N, T is |b| times N + 1, 3/2, 1 (order 3: N + 1, 3/2, 2, 1). There the scheme is the
  finite difference of order N, which forgets any error in N + 1 samples: nothing chatters.
- Beyond, T comes from the table: it is the term of a |b| in the same eighth of an octave.
- Far beyond, T is nearly the power of |b| of the explicit form, and the two forms differ by less than a count's error
  does. Where L is far below an LSB of b, as at high rates, the tables have only this part.

Formats, saturation, start and words follow `levant_higher_design`, except:

- `gap` is b, which is larger than z0 - f by the motion that a sample adds at a reversal: AHEAD samples of it.
- L is at most LARGEST_L counts a sample^(order + 1): beyond, nearly all is finite difference.

Limits.

- As in `levant_higher_design`, except for the chatter at standstill, and for overshoot near the largest L.
- A negative b enters as its complement, an LSB less. So b of -1 LSB is corrected by nothing.
- The states of a resting count stay within a few LSBs of b, not at 0: v and a have more fraction bits than b.

Source: Mojallizadeh, Brogliato, Acary, Int. J. Robust and Nonlinear Control 2021, and Carvajal-Rubio, Sanchez-Torres,
Defoort, Djemai, Loukianov, Int. J. Robust and Nonlinear Control 2021, for the scheme of any order; Seeber, arXiv
2404.02770, 2024, for its bias and its chatter, and for outputs that are combinations of the states.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..arithmetic import curves
from ..arithmetic.fixed import shift_round_half_up, wrap
from ..runtime.compiled import compiled
from . import levant_higher_design
from .acceleration import acceleration_of
from .estimate import estimate
from .levant import sign_of
from .levant_higher import acceleration, float_acceleration, held
from .levant_higher_design import LAMBDA, OCTAVES, WIDEST, State

LARGEST_L = 1.0
"""The largest L, in counts a sample^(order + 1)."""
AHEAD = 2.0
"""How much of a reversal's speed b has, in samples, besides the peak of z0 - f."""
ROOT_STEPS = 60
"""Newton's steps for a root in float64, at most: from above they come down to it, and end there."""


@dataclass(frozen=True)
class JerkGains(levant_higher_design.JerkGains):
    """The gain of order 2: the bound L on the jerk, m/s^3."""

    jerk_m_per_s3: float
    largest = LARGEST_L


@dataclass(frozen=True)
class SnapGains(levant_higher_design.SnapGains):
    """The gain of order 3: the bound L on the snap, m/s^4."""

    snap_m_per_s4: float
    largest = LARGEST_L


class Params(NamedTuple):
    """Words, limits and shifts of the integer kernel; see `Design` for the formats."""

    order: int
    count_width: int
    octaves: int
    fractions: tuple[int, ...]
    """Of b, z1, z2, z3."""
    limits: tuple[int, ...]
    """The largest words of b, z1, z2, z3; the least is one less than the negative."""
    half: int
    output_shift: int
    acceleration_shift: int
    curves: curves.Params


class FloatParams(NamedTuple):
    order: int
    count_width: int
    lipschitz: float
    gains: tuple[float, ...]
    """LAMBDA, by the power of rho."""


@compiled
def root(gains, beta):
    """Return rho >= 0, at which rho^(N+1) + LAMBDA_N rho^N + ... + LAMBDA_0 is beta; beta is at least LAMBDA_0."""
    n = len(gains)
    rho = beta ** (1 / n)
    for _ in range(ROOT_STEPS):
        value, slope = 1.0, 0.0
        for j in range(n):
            slope = slope * rho + value
            value = value * rho + gains[n - 1 - j]
        lower = rho - (value - beta) / slope
        if lower >= rho:
            break
        rho = lower
    return max(rho, 0.0)


@compiled
def parts(gains, beta):
    """Return (T_0, T_1, T_2, T_3) at |b| = beta, for L = 1; T_3 of order 2 is 0."""
    order, rho = len(gains) - 1, root(gains, max(beta, gains[0]))
    s_3 = min(beta, gains[0]) if order == 3 else 0.0
    s_2 = s_3 + gains[1] * rho if order == 3 else min(beta, gains[0])
    s_1 = s_2 + gains[order - 1] * rho ** (order - 1)
    s_0 = s_1 + gains[order] * rho**order
    return s_0 + s_1 + s_2 + s_3, s_1 + s_2 / 2, s_2 + s_3, s_3


class Design(levant_higher_design.Design):
    """Formats, run-time word and latency of the implicit differentiator for an axis, derived as the module says.

    Attributes:
        powers: the design of the terms T_0 to T_N.
    """

    ahead = AHEAD

    def _units(self, bound: float, top: int) -> None:
        order, gains = self.order, LAMBDA[self.order]

        def curve(number: int, double: int, power: int, fraction: int) -> curves.Curve:
            return curves.Curve(lambda size: bound * parts(gains, size / bound)[number], double, power, fraction)

        # Above the first power of two within a_N, twice the multiples below it.
        first = math.floor(math.log2(gains[0] * bound))
        doubles = [2 * (order + 1), 3, 4, 2] if order == 3 else [2 * (order + 1), 3, 2]
        powers = [order, order - 1, order - 2, 0]
        places = [self.gap.f, *(each.f for each in self.z[:order])]
        terms = tuple(curve(n, doubles[n], powers[n], places[n]) for n in range(order + 1))
        self.powers = curves.Design(self.gap.width - 1, self.gap.f, self.degree, terms, first, (OCTAVES[0], top))
        if max(self.powers.widths) > WIDEST:
            raise ValueError("a term is too wide")

    def params(self, words: Mapping[str, int]) -> Params:
        (octaves,) = (words[word.name] for word in self.words)
        return Params(
            order=self.order,
            count_width=self.count_width,
            octaves=octaves,
            fractions=(self.gap.f, *(each.f for each in self.z)),
            limits=(self.gap.max, *(each.max for each in self.z)),
            half=self.half,
            output_shift=self.z[0].f - self.velocity.f,
            acceleration_shift=self.z[1].f - self.acceleration.f,
            curves=self.powers.params,
        )

    def float_params(self, gains: Any, output: str, si: Mapping[str, float]) -> FloatParams:
        ((_, bound),) = vars(gains).items()
        (word,) = self.words
        lipschitz = bound / self._per_l * 2.0 ** si.get(word.name, 0)
        return FloatParams(self.order, self.count_width, lipschitz, LAMBDA[self.order])


class Order2(Design):
    """Order 2."""

    name = "levant-2-implicit"
    gains_class = JerkGains
    order = 2


class Order3(Design):
    """Order 3."""

    name = "levant-3-implicit"
    gains_class = SnapGains
    order = 3


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    if restart or not state.running:
        return State(1, seen.count, 0, 0, params.half, 0, 0), 0, 0
    moved = wrap(seen.count - state.count, params.count_width)
    f_0, f_1, f_2, f_3 = params.fractions
    most_gap, most_1, most_2, most_3 = params.limits
    terms, octaves = params.curves, params.octaves

    far_gap = state.lead - (moved << f_0)
    gap = held(far_gap, most_gap)
    size = ~gap if gap < 0 else gap
    away = -sign_of(gap)

    z2 = state.z2 + shift_round_half_up(state.z3, f_3 - f_2)
    onward = state.z1 - params.half + shift_round_half_up(3 * z2, f_2 - f_1 + 1)
    lead = gap + shift_round_half_up(onward, f_1 - f_0) + away * curves.term(terms, 0, size, octaves)
    more = state.z2 + shift_round_half_up(state.z3, f_3 - f_2 + 1)
    far_1 = state.z1 + shift_round_half_up(more, f_2 - f_1) + away * curves.term(terms, 1, size, octaves)
    far_2 = z2 + away * curves.term(terms, 2, size, octaves)
    far_3 = state.z3 + away * curves.term(terms, 3, size, octaves) if params.order == 3 else 0

    next_1, next_2, next_3 = held(far_1, most_1), held(far_2, most_2), held(far_3, most_3)
    flags = int(gap != far_gap) | int(next_1 != far_1) << 1 | int(next_2 != far_2 or next_3 != far_3) << 2
    if next_1 != far_1:
        next_2 = next_3 = 0
    return State(1, seen.count, 0, lead, next_1, next_2, next_3), next_1 >> params.output_shift, flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample by the closed form in float64, unsaturated: the reference for the cost of fixed point."""
    if restart or not state.running:
        return State(1, seen.count, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0
    gap = state.lead - wrap(seen.count - state.count, params.count_width)
    away, bound = -sign_of(gap), params.lipschitz
    t_0, t_1, t_2, t_3 = parts(params.gains, abs(gap) / bound)
    ahead = state.z2 + state.z3
    lead = gap + state.z1 + 1.5 * ahead + away * bound * t_0
    z1 = state.z1 + state.z2 + state.z3 / 2 + away * bound * t_1
    z2, z3 = ahead + away * bound * t_2, state.z3 + away * bound * t_3
    return State(1, seen.count, 0.0, lead, z1, z2, z3), z1, 0


acceleration_of.register(Params)(acceleration)
acceleration_of.register(FloatParams)(float_acceleration)
