"""Levant's differentiator with gains that adapt to the signal, in fixed point.

The algorithm is `levant_semi_implicit` with gains that depend on a level j of -RAISED to `levels`: with
L_max = alpha / 1.1,

    L = L_max 2**-j,     alpha_j = alpha 2**-j,     lambda_j = lambda 2**(-j/2)

Level 0 is the fixed-gain estimator for the axis's bound C. Every further level reduces the noise of a count, about
sqrt(L q), by sqrt(2), and makes the estimator slower. The levels below 0 are for an impact beyond C. All times below
are in samples, all lengths in counts:

1. *Time on one side*: t counts the samples since b last changed its sign (`elapsed`). `reached` is the last level whose
   L explains an excursion of LOST counts in t: L >= EXCESS LOST / t^2. t starts again at 0 with every change of sign.
2. *Lost*: |b| >= LOST, more than quantisation of one count can cause. Then j falls at once to `reached`, if j is above.
   Each time |b| has doubled again, j falls to `reached` or by two, whichever is lower: two levels multiply L by 4 and
   lambda by 2. The first doubling leads no further than level 0, because any acceleration up to C may need level 0.
   Later doublings lead down to -RAISED.
3. *Calm*: if |b| < LOST for HOLD windows of 2 / sqrt(L), with L of the present level, j rises by one. From level 0 to
   the last level this takes less than 3.5 times the hold of the last level. From -RAISED to 0 it takes less than 2
   holds of level 0.

The law needs no divider and no table. Levels are a factor of 2 apart, so alpha_j is a shift. lambda_j is a shift too;
for odd j it takes the root of half the radicand. The time thresholds are two constants, shifted, with TIME_BITS
fraction bits.

*Guarantee.* Let a signal with |f''| <= A start from a state without error. Until b is lost, the error of u grows by at
most A tau a sample, since both corrections pull back. Its sum, the position error, is at most LOST + 1 counts. So *the
error of u is at most sqrt(2 (LOST + 1) A q) = 2.45 sqrt(A q) until the loss. An acceleration A out of rest is seen
within sqrt(2 (LOST + 1) q / A) = 2.45 sqrt(q / A)*. Both take a sample longer, and neither depends on L. Fixed gains
for exactly that A give errors up to 1.7 sqrt(A q). If the sign changed when the acceleration began, the required L is
at least EXCESS LOST / (2 (LOST + 1)) A = 2.7 A. This is enough. At the loss u steps by lambda_j sqrt(beyond). Its error
may then become lambda_j sqrt(LOST + 1) on the other side: at most the largest error that the fixed gains of level 0 can
make.

*Beyond C.* Let A be up to 4^m 1.1 L_max, with 1 <= m < RAISED / 2. Level -2m is reached once |b| is B = LOST 2^(m+1).
Up to there the error of u is at most sqrt(2 (B + 1) A q), as above. There alpha_j >= A. So the error of u falls with
sqrt(|b|) at the rate lambda_j, and u steps by half of lambda_j sqrt(B). In these terms, with lambda_j >= 0.95 sqrt(A)
and B >= 8, the error is then at most 1.02 sqrt(B A q). It is 0.63 sqrt(B A q) when |b| has doubled. The next step, of
1.35 sqrt(B A q), turns the error round. So |b| <= 2 B, and *the error of u is at most sqrt(2 (B + 1) A q); on the other
side it is at most the whole lambda_j sqrt(2 B + 1) of level j = -2m - 2*. Both take a sample longer. For an impact of
51 m/s^2 with C = 12, A = 4.4 C, these largest errors are 30 and 57 mm/s. Measured was 27 (25 impacts from 0.01 to 0.6
m/s, 1 MHz). With the gains of level 0 the error grows until the motion ends, to 237 mm/s then. With m = RAISED / 2, up
to 17.6 C, there is no further level, and |b| may reach 4.2 B. Measured was 57 mm/s at 190 m/s^2.

*Limitations.* (a) The transient above is up to sqrt(2) times larger than with fixed gains. (b) Out of rest the sign
often changes with the first count, not with the acceleration. Then t is too short, L too large, and u overshoots: 6.6
sqrt(A q) at A = 1 m/s^2 with C = 12; with fixed gains 4.0 (measured, largest of 24 steps out of rest and slow motion,
100 kHz). (c) If b was on the side of the acceleration long before, t is too long, and only the doublings raise L. (d) A
signal that is calm and lost in turn keeps changing L, for instance a sine whose |f''| passes 0. u1 carries the
excursions and may be worse than with fixed gains (table). So u is the default output. (e) |f''| > 2**RAISED L_max is
not followed, as |f''| > L_max with fixed gains. (f) Below about sqrt(L_max / q) samples a second, an acceleration moves
b by more than LOST counts in a sample: the additional sample is then the main part of the bounds. (g) Noise of LOST
counts keeps L large.

Laws compared: RMS (largest) error of u, mm/s, at 100 kHz in float64, q = 1 um. Paper's signal over 1 to 3 s; a hit at
0.3 m/s on 10 kN/m with 0.35 kg, deceleration up to 51 m/s^2, C = 55; a step of 10 m/s^2 after 0.5 s of rest, C = 12:

    law                                      paper, C 1.68  C 12      hit        step       0.1, 1, 10 mm/s, C 12
    fixed gains: `levant`                    0.64 (2)       1.71 (4)  2.34 (9)   1.17 (4)   0.68 1.94 1.71
    lost: L by 4 each time |b| doubles       0.32 (3)       0.31 (2)  4.06 (30)  2.32 (23)  0.03 0.03 0.03
    L from t and doubling, steps of 2         0.30 (2)       0.32 (2)  0.80 (10)  1.29 (7)   0.03 0.03 0.03

u1 of the last law: 0.41, 0.39, 1.47, 2.82; of `levant`: 0.15, 0.36, 1.39, 1.62. With an explicit sign it locks up at
1 kHz, where the chatter alone is LOST counts: 1.97 and 13.98 on the paper's signal, against 0.41 and 0.39.

Source: the paper leaves adaptation open. Levant and Livne (2012, 2018) show that a differentiator of variable gain
keeps its accuracy; the law is this project's.

Formats are as in `levant_semi_implicit`, except:

- `levels`: the number of halvings of L, at most LEVELS: noise then spans a factor of 64. L has no window longer than
  the time to the largest speed, 2 sqrt(q / L) = speed_max / C, since a slower estimate averages whole strokes. The
  fraction bits of int64 are a third limit.
- f, the fraction bits of b, u and u1: alpha at the last level has at least LEAST_ALPHA_BITS below its top bit. Its
  shift rounds down, and so changes it by at most 2**-LEAST_ALPHA_BITS. The position budget holds for lambda at the last
  level. The product of lambda and root is shifted by the level without loss, and then rounded. At odd levels the root
  is taken of half the radicand, so delta = lambda_j sqrt(2) 2**-(root.f+1) + 2**-(f+1) there.
- `elapsed` and `calm` stop once they can change no decision, so they cannot overflow. The thresholds follow the
  designed gains, not those set at run time; at the first sample j is 0.
- A single rounding may decide a loss, so fixed-point and real trajectories diverge. Below 1 MHz the RMS of a single
  0.5 s run differs by 2 to 8 %, in either direction and whatever the word length; over many runs by less than 1 %.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ..arithmetic.fixed import bits_for, saturate, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import isqrt
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import levant, levant_semi_implicit
from .estimate import estimate
from .levant import HEADROOM_BITS, POSITION_BUDGET, Gains, arrive, sign_of
from .levant_semi_implicit import band, float_settle, settle

STEPS = 15
"""Clocks of the sequence besides the root: see `hardwall.hdl.estimators.levant_adaptive`."""
LEVELS = 12
"""Largest number of halvings of L: noise, which is proportional to sqrt(L), then spans a factor of 64."""
RAISED = 4
"""Number of doublings of L beyond the axis's, 16 C: for an impact. It is even, so that a shift makes lambda of it."""
LOST = 2
"""Counts of |b| at which sliding is lost: quantisation explains one count, and tracking may use one more."""
EXCESS = 8
"""A loss requires L >= EXCESS LOST / t^2. LOST counts in t take 2 LOST / t^2, or 3 with a count of rounding."""
HOLD = 4
"""Windows of calm before L is halved."""
RATIO = 1.1
"""The ratio alpha / L of the gains that the paper proposes."""
TIME_BITS = 4
"""Fraction bits of the time thresholds, which are in samples."""
LEAST_ALPHA_BITS = 5
"""alpha at the last level has at least this many bits below its top bit: rounding it down costs 3 % at most."""


class Law(NamedTuple):
    """Parameters of the adaptation: the last level, and the time thresholds of `Design` for even and for odd levels."""

    levels: int
    reach_even: int
    reach_odd: int
    hold_even: int
    hold_odd: int


class Params(NamedTuple):
    """Parameters of `levant` and of the adaptation, and the bits that the largest shift takes from the product."""

    levant: levant.Params
    law: Law
    spare: int


class FloatParams(NamedTuple):
    """Parameters of `levant` and of the adaptation."""

    levant: levant.FloatParams
    law: Law


class State(NamedTuple):
    """The state: `lead`, `u1` and `count` as in `levant.State`; the other fields are the adaptation's."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    lead: float
    u1: float
    level: int  # from -RAISED on
    side: int  # the last sign of b that was not 0
    elapsed: int  # samples since that sign changed; stops when `reached` is the last level
    reached: int
    limit: int  # counts of |b| at which the level falls next
    calm: int  # samples of calm


START = State(0, 0, 0, 0, 0, 0, 0, 0, LOST, 0)
FLOAT_START = State(0, 0, 0.0, 0.0, 0, 0, 0, 0, LOST, 0)


class Design(levant_semi_implicit.Design):
    """Formats, run-time words and latency for an axis, as in `levant.Design` except where the module says otherwise.

    Attributes:
        levels: the last level.
        reach, hold: first thresholds of the time on one side, and of calm, for even and for odd levels, in samples.
    """

    name = "levant-adaptive"
    steps = STEPS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self._check_raised(gains)
        most = gains.alpha_m_per_s2 / RATIO / axis.sample_hz**2 / axis.count_m
        self.reach = _times(math.sqrt(EXCESS * LOST / most))
        self.hold = _times(HOLD * 2 / math.sqrt(most))

    def _least(self, f_max: int) -> tuple[float, float]:
        # The least gains of level 0: if there is room for no further level, it is the only level.
        return super()._least(f_max)[0], 2.0 ** (LEAST_ALPHA_BITS - f_max)

    def _fraction(self, axis, lam: float, alpha: float, f_max: int) -> int:
        def bits(levels: int) -> int:
            rounding = self._position_per_root(lam) * 2 ** (levels / 2) / (lam * POSITION_BUDGET)
            return max(LEAST_ALPHA_BITS + levels - math.floor(math.log2(alpha)), bits_for(rounding), 0)

        slowest = axis.speed_max_m_per_s**2 / (4 * axis.count_m * axis.acceleration_max_m_per_s2)
        self.levels = max(min(LEVELS, math.floor(math.log2(slowest))), 0)
        while self.levels and bits(self.levels) > f_max:
            self.levels -= 1
        return bits(self.levels)

    def _check_raised(self, gains: Gains) -> None:
        """Refuse gains that overflow int64 at a level other than 0: alpha, and the step of u before its limit."""
        limits = self.root.i + RAISED // 2, RAISED
        for word, (name, value), bits in zip(self.words, vars(gains).items(), limits, strict=False):
            most = 2.0 ** (61 - HEADROOM_BITS - self.velocity.f - bits) * word.si_per_unit
            if value > most:
                raise FieldError(name, f"must be at most {most:g} at these rates, not {value!r}")

    @property
    def spare(self) -> int:
        """Bits that the product loses by the largest shift of lambda."""
        return self.levels // 2

    def reach_samples(self, level: int) -> int:
        """Return the number of samples on one side, 1 or more, that reach `level`."""
        return -(-_threshold(*self.reach, level) >> TIME_BITS)

    def hold_samples(self, level: int) -> int:
        """Return the number of samples of calm after which j leaves `level`."""
        return -(-_threshold(*self.hold, level) >> TIME_BITS)

    @property
    def law(self) -> Law:
        """The adaptation's parameters, the same for either kernel."""
        return Law(self.levels, *self.reach, *self.hold)

    def params(self, words: Mapping[str, int]) -> tuple:
        return Params(self._common(words), self.law, self.spare)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> tuple:
        return FloatParams(self._float_common(gains, output, si), self.law)

    def start(self, floating: bool = False) -> tuple:
        return FLOAT_START if floating else START


def _times(first: float) -> tuple[int, int]:
    """Return the thresholds of levels 0 and 1 for `first` samples at level 0, with TIME_BITS fraction bits."""
    return math.ceil(first * 2**TIME_BITS), math.ceil(math.sqrt(2) * first * 2**TIME_BITS)


@compiled
def _threshold(even, odd, level):
    return shift_floor(odd if level & 1 else even, -(level >> 1))


@compiled
def adapt(law, state, restart, sign, whole):
    """Return (level, side, elapsed, reached, limit, calm) after a sample whose |b| is `whole` counts, rounded down."""
    fresh = restart or not state.running
    level = 0 if fresh else state.level
    side = 0 if fresh else state.side
    elapsed = 0 if fresh else state.elapsed
    reached = 0 if fresh else state.reached
    limit = LOST if fresh else state.limit
    calm = 0 if fresh else state.calm

    if sign not in (0, side):
        side, elapsed, reached, limit = sign, 0, 0, LOST
    if reached < law.levels:
        elapsed += 1
        if elapsed << TIME_BITS >= _threshold(law.reach_even, law.reach_odd, reached + 1):
            reached += 1
    if whole >= limit:
        if limit > LOST:
            # The first doubling leads down to level 0 at most, which an acceleration of C needs.
            level = min(level, max(level - 2, -RAISED if limit > 2 * LOST else 0))
        level = min(level, reached)
        limit *= 2
    if whole >= LOST:
        calm = 0
    elif level < law.levels:
        calm += 1
        if calm << TIME_BITS >= _threshold(law.hold_even, law.hold_odd, level):
            level += 1
            calm = 0
    return level, side, elapsed, reached, limit, calm


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    family = params.levant
    moved, lead, u1 = arrive(family, state, seen, restart)
    distance = lead - (moved << family.fraction)
    error = saturate(distance, -family.error_max, family.error_max)
    adapted = adapt(params.law, state, restart, sign_of(error), abs(error) >> family.fraction)
    level = adapted[0]
    sign, near, beyond = band(error, shift_floor(family.alpha, level))
    root = isqrt(shift_floor(beyond, family.radicand_shift + (level & 1)))
    product = shift_floor(family.lambda_ * (2 * root + 1) << params.spare, level >> 1)
    correction = min(shift_round_half_up(product, family.product_shift + params.spare), beyond)
    lead, u1, velocity, far = settle(family, u1, sign, near, beyond, correction)
    return State(1, seen.count, lead, u1, *adapted), velocity, int(error != distance) | far << 1


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    family = params.levant
    moved, lead, u1 = arrive(family, state, seen, restart)
    error = lead - moved
    adapted = adapt(params.law, state, restart, sign_of(error), int(abs(error)))
    scale = 2.0 ** -adapted[0]
    sign, near, beyond = band(error, family.alpha * scale)
    correction = min(family.lambda_ * math.sqrt(scale * beyond), beyond)
    lead, u1, velocity = float_settle(family, u1, sign, near, beyond, correction)
    return State(1, seen.count, lead, u1, *adapted), velocity, 0
