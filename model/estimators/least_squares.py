"""The velocity of the polynomial that fits past counts best, in fixed point: a FIR filter of counts over fixed time.

With f the count, T the spacing of the points in samples and D_i = f_k - f_{k-iT}, i = 1 ... n:

    p   the polynomial of degree `order`, 1 to 3, with the least sum of squares to the n + 1 counts f_k ... f_{k-nT}
    v = p'(k) = (c_1 D_1 + ... + c_n D_n) / T                counts a sample

The slope is that at the newest count. It is linear in the counts, with weights of sum 0, so the c_i are rational
numbers that follow from order and points alone. **With `order` + 1 points the polynomial passes through all of them**:
that is the Taylor-series expansion of the same order, with weights 1, -1; 3/2, -2, 1/2; 11/6, -3, 3/2, -1/3. Order 1
with two points is the plain difference of `window`.

Orders. A fit is exact on polynomials of its order: at constant acceleration order 1 is late by half of its window,
n T / 2, and orders 2 and 3 are not late. It is paid for in noise: see the numbers below.

Guarantee. Let W = n T be the window, and |f''| <= c counts/sample^2. Let the count be the position displaced by at most
eps in either direction. With w_i the weights of the counts for T = 1, the error of v is at most

    B c W + A eps / W         A = n sum |w_i|,    B = (1/n) integral |sum_{i > t} w_i (i - t)| dt
    least, 2 sqrt(A B eps c), at W = sqrt(A eps / (B c))

by Taylor's formula with Peano's kernel. A B is 1 for two points, and 1.41 for a line through 16; 3.9 and 7.8 for orders
2 and 3. **So under a bound of the acceleration alone order 1 guarantees the most on every axis, and is the default**;
its window is that minimax one, with eps half a count as in `window`. More points do not improve the guarantee, but the
RMS: independent errors of counts add up to an RMS of S / W, S = n sqrt(sum w_i^2 / 12); S is 0.41 counts for two
points, 0.23 for a line through 16. Orders 2 and 3 are for a motion whose jerk has a bound, which allows a longer
window. With |f'''| <= j the error is B' j W^2 + A eps / W, least at W = (A eps / (2 B' j))^(1/3). `numbers` has A, B,
B' and S.

Points. `POINTS` of them unless the samples have fewer clocks or the window fewer samples: each takes a clock.

Past counts come from `history`. It defines four cases: a window that is not yet full, a wrap of the count, a speed
beyond the largest, and storage of only every M-th position. Then T is a multiple of M, and v is held between.

Formats, derived:

- The sum of c_i D_i is computed in whole numbers, as a_i / den = c_i with the least common denominator, and divided by
  den T: v is the exact rational number, rounded toward zero. A constant speed reads exactly.
- |D_i| <= i T times the largest change of a sample, so the running sum is at most `largest_sum`, which has at most
  `SUM_BITS`: a longer window is refused with the range. The divisor is then below 2**35, and 2**20 its factor.
- `velocity` SQ(i, f): v is a weighted sum of the changes over T. The weights' absolute values add up to `gain`: 1 for
  order 1, below 2 and 10/3 for orders 2 and 3. i holds `gain` times the largest change, so v cannot overflow.
- f: rounding by less than 2**-ROUNDING_BITS counts over the window, as in `window`; the errors of counts have an RMS of
  0.16 and more.

Limits. Standing for the window gives exactly 0. After the first sample or a restart in motion the axis counts as having
stood, as after a step of velocity: an order above 1 then overshoots, to `gain` times the speed at most.

Source: R. H. Brown, S. C. Schneider, M. G. Mulligan, Analysis of Algorithms for Velocity Estimation from Discrete
Position Versus Time Data, IEEE Transactions on Industrial Electronics 39(1), 1992: Taylor-series expansions and
least-squares fits over fixed time. The spacing T, and the rule for the window, are this project's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import SQ, bits_for
from ..arithmetic.signed_divide import divide
from ..arithmetic.signed_divide import latency as divide_latency
from ..checks import NUMBERS, FieldError, check_number, check_range, shown
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import history
from .estimate import EstimatorDesign, EstimatorGains, estimate
from .history import Held, change_over, take
from .window import EPS_COUNTS, ROUNDING_BITS

ORDER_MAX = 3
POINTS_MAX = 32
POINTS = 16
"""Points of a fit unless a number is given."""
SUM_BITS = 62
"""Bits of the largest sum of products, which int64 holds with its sign."""
STEPS = 3
"""Clocks of the sequence besides history, one a tap, and division: see `hardwall.hdl.estimators.least_squares`."""


@cache
def weights(order: int, points: int) -> tuple[Fraction, ...]:
    """Return the weights of counts at 0, -1, ... that give the slope at 0 of the least-squares polynomial.

    They are a polynomial of the same degree in the place of the point; its coefficients solve the normal equations.
    """
    sums = [Fraction(sum((-place) ** power for place in range(points))) for power in range(2 * order + 1)]
    rows = [[*sums[power : power + order + 1], Fraction(power == 1)] for power in range(order + 1)]
    # Sums of even powers are positive and the matrix is a Gram matrix: no pivot is 0.
    for pivot in range(order + 1):
        rows[pivot] = [value / rows[pivot][pivot] for value in rows[pivot]]
        for other in set(range(order + 1)) - {pivot}:
            share = rows[other][pivot]
            rows[other] = [value - share * of for value, of in zip(rows[other], rows[pivot], strict=True)]
    return tuple(sum(row[-1] * (-place) ** power for power, row in enumerate(rows)) for place in range(points))


class Numbers(NamedTuple):
    """The module's numbers: `noise` is A, `of_acceleration` B, `of_jerk` B' (0 for order 1), and `rms` S."""

    noise: float
    of_acceleration: float
    of_jerk: float
    rms: float


@cache
def numbers(order: int, points: int) -> Numbers:
    """Return the numbers of the guarantee, which belong to order and points alone."""
    taps, values = points - 1, [float(weight) for weight in weights(order, points)]
    # Peano's kernels are polynomials between points, whose signs may change there: a fine grid is good to four digits.
    time = (np.arange(1024 * taps) + 0.5) / 1024
    past = np.maximum(np.arange(points)[:, None] - time, 0)
    acceleration, jerk = (np.abs(values @ past**power).mean() / power for power in (1, 2))
    return Numbers(
        taps * sum(map(abs, values)),
        float(acceleration),
        float(jerk) / taps if order > 1 else 0.0,
        taps * math.sqrt(sum(value * value for value in values) / 12),
    )


def minimax_window_s(axis: AxisRequirements, order: int, points: int) -> float:
    """Return the window with the least guaranteed error under the axis's bound on the acceleration, s."""
    noise, of_acceleration, _, _ = numbers(order, points)
    return math.sqrt(noise * EPS_COUNTS / of_acceleration * axis.count_m / axis.acceleration_max_m_per_s2)


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The degree of the polynomial, the number of points, and the time from the oldest to the newest of them, s.

    Raises:
        ValueError: if the degree is not 1 to 3, or the points are not more than that and at most 32.
    """

    order: float
    points: float
    window_s: float

    def __post_init__(self):
        check_number("window_s", self.window_s)
        check_range("window_s", self.window_s, *NUMBERS)
        _check_whole("order", self.order, 1, ORDER_MAX)
        _check_whole("points", self.points, self.order + 1, POINTS_MAX)

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return a line through `POINTS` points, or as many as the clocks allow, over the minimax window."""
        for points in range(POINTS, 2, -1):
            gains = cls(1, points, minimax_window_s(axis, 1, points))
            if Design(axis, gains).latency <= axis.clocks_per_sample:
                return gains
        return cls(1, 2, minimax_window_s(axis, 1, 2))


def _check_whole(name: str, value: float, least: float, most: int) -> None:
    check_number(name, value)
    if not (least <= value <= most and value % 1 == 0):
        raise FieldError(name, f"must be a whole number of {least:g} to {most}, not {shown(value)}")


class Params(NamedTuple):
    """Parameters of the integer kernel: a_i, den T in stored positions, T, and the quotient's `fraction` bits."""

    history: history.Params
    coefficients: np.ndarray
    spacing: int
    divisor: int
    fraction: int


class FloatParams(NamedTuple):
    """Parameters of the float64 kernel: c_i / T, with T in samples, and T in stored positions."""

    history: history.Params
    coefficients: np.ndarray
    spacing: int


class Design(EstimatorDesign):
    """Formats, coefficients and latency of a fit for an axis, derived as the module says.

    Attributes:
        history: the `history.Design`.
        taps: the number of differences, one less than the points.
        spacing: T, in stored positions.
        gain: the largest velocity, in largest changes of a sample.
        coefficients, denominator: a_i and den.
        largest_sum: the largest running sum of products.
        velocity: format of v.
        fraction: fraction bits of the quotient of a sum by `divisor`, den T in stored positions.

    Raises:
        ValueError: if the window is too long for int64, with the accepted range.
    """

    name = "least-squares"
    gains_class = Gains

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        order, points = int(gains.order), int(gains.points)
        # A window of few samples has fewer points, but as many as the polynomial needs.
        self.taps = max(order, min(points - 1, round(min(gains.window_s * axis.sample_hz, points))))
        self.history = history.Design(axis, gains.window_s, self.taps)
        self.spacing = self.history.longest // self.taps
        of_counts = weights(order, self.taps + 1)
        self.denominator = math.lcm(*(weight.denominator for weight in of_counts))
        self.coefficients = [int(-weight * self.denominator) for weight in of_counts[1:]]
        self.gain = sum(abs(total) for total in accumulate(of_counts[:-1]))
        reach = sum(age * abs(value) for age, value in enumerate(self.coefficients, 1)) * self.history.change.max
        self.largest_sum = reach * self.spacing * self.history.every
        if self.largest_sum.bit_length() > SUM_BITS:
            most = 2.0**SUM_BITS / reach * self.taps / axis.sample_hz
            raise FieldError(
                "window_s", f"must be more than 0 and at most {most:g} with these points, not {gains.window_s!r}"
            )
        i = 1 + bits_for(math.floor(self.gain * self.history.change.max) + 1)
        self.velocity = SQ(i, axis.shrunk(self.history.fraction + ROUNDING_BITS))
        self.fraction = axis.shrunk(self.history.age_bits + ROUNDING_BITS)
        self.divisor = self.denominator * self.spacing
        self._whole = np.array(self.coefficients, np.int64)
        self._exact = self._whole / (self.divisor * self.history.every)

    @property
    def fastest(self) -> int:
        """The velocity's word at a change of the count that is limited at every sample."""
        return self.history.change.max << self.velocity.f

    @property
    def latency(self) -> int:
        return STEPS + self.history.latency + self.taps + divide_latency(self.velocity.width - 1)

    def start(self, floating: bool = False) -> Held:
        """Return the state before the first sample, with a memory of its own."""
        return self.history.start_at_rest(floating)

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(self.history.params(), self._whole, self.spacing, self.divisor, self.fraction)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: the same points, spaced by the same whole number of samples."""
        return FloatParams(self.history.params(floating=True), self._exact, self.spacing)


@compiled
def _weighed(params, past):
    """Return the sum of the changes over 1, 2, ... spacings, each by its coefficient."""
    coefficients, spacing = params.coefficients, params.spacing
    total = coefficients[0] * change_over(params.history, past, spacing)
    for tap in range(1, len(coefficients)):
        total += coefficients[tap] * change_over(params.history, past, (tap + 1) * spacing)
    return total


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    past, stored, limited = take(params.history, state.history, seen.count, restart)
    velocity = state.velocity
    if stored:
        velocity = divide(_weighed(params, past), params.divisor, params.fraction)
    return Held(past, velocity), velocity, int(limited)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unlimited and unrounded: the same algorithm."""
    past, stored, _ = take(params.history, state.history, seen.count, restart)
    velocity = state.velocity
    if stored:
        velocity = _weighed(params, past)
    return Held(past, velocity), velocity, 0
