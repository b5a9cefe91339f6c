"""The finite difference over a chosen window, in fixed point: no multiplier, no square root.

    v = (f_k - f_{k-n}) / n                  counts a sample; f the count, n the window in samples

Guarantee. Let |f''| <= c counts/sample^2 and let the count be the position displaced by at most eps in either
direction. Then the error of v is at most

    c n / 2 + 2 eps / n                      least, 2 sqrt(c eps), at n = 2 sqrt(eps / c)

and no causal estimator can guarantee less than this minimum. **A count is the position rounded down**, in [0, 1) below
it: a constant half count, which adds no velocity, and eps = 1/2 count in either direction. So the designed window,
`window_s`, is 2 sqrt(eps / C) = sqrt(2 q / C), rounded to n >= 1 whole samples. An encoder whose edges are displaced by
h counts has eps = (1 + h) / 2, where h is the largest difference of two displacements.

Past counts come from `history`, which defines the behaviour during the first n samples, at a wrap of the count, and
beyond the largest speed. If it stores only every M-th position, n is a multiple of M and v is held between. This adds
at most c (M - 1) to the error: a fraction 1 / (n / M) of it or less, and n / M is a thousand or more.

Formats, derived:

- `window_length`, n / M, is a run-time word; `history.age_max` is its largest value, and 0 counts as 1. v is *divided*
  by n (`divide`), so this word alone changes the window: no reciprocal has to change with it.
- `velocity` SQ(i, f): i as in `history.change`, whose range no average of changes can exceed, so v cannot overflow.
- f: v is rounded toward zero, an error of less than an LSB, in RMS 0.58 LSB. Quantisation alone gives v an RMS error of
  0.41 / n (two independent errors of a uniform count). n_max is the longest window that the word can set. An LSB of
  2**-ROUNDING_BITS / n_max keeps rounding below 0.6 % of that for every n. A count of motion over the window is never
  less than 2**ROUNDING_BITS LSB, so there is no dead zone; standing for n samples gives exactly 0.

Limits. v never leaves its format. A step reads as its counts / n for n samples, then 0; of a step beyond twice the
largest speed, only the part up to that is read. After the first sample or a restart in motion v is too small for n
samples, in proportion to the motion seen.

Source: elementary; the bound follows from Taylor's formula and the triangle inequality.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, UQ
from ..arithmetic.signed_divide import divide
from ..arithmetic.signed_divide import latency as divide_latency
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word
from . import history
from .estimate import EstimatorDesign, EstimatorGains, estimate
from .history import Held, change_over, take

EPS_COUNTS = 0.5
"""Largest distance, counts, between the position and the count plus half a count."""
ROUNDING_BITS = 8
"""An LSB of the velocity is less than 2**-ROUNDING_BITS counts over the longest window."""
STEPS = 2
"""Clocks of the sequence besides history and division: see `hardwall.hdl.estimators.window`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The length of the window, s."""

    window_s: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the minimax window for |f''| <= C, the axis's bound: 2 sqrt(eps / C)."""
        return cls(2 * math.sqrt(EPS_COUNTS * axis.count_m / axis.acceleration_max_m_per_s2))


class Params(NamedTuple):
    """Parameters of the integer kernel: `length` in stored positions, and the quotient's `fraction` bits."""

    history: history.Params
    length: int
    fraction: int


class FloatParams(NamedTuple):
    """Parameters of the float64 kernel: `length` in stored positions, `samples` the same length in samples."""

    history: history.Params
    length: int
    samples: float


class Design(EstimatorDesign):
    """Formats, run-time word and latency of the window for an axis, derived as the module says.

    Attributes:
        history: the `history.Design`.
        velocity: format of v.
        fraction: fraction bits of the quotient of a change by `window_length`.
        words: `window_length`.

    Raises:
        ValueError: if the window is too long for int64, with the accepted range.
    """

    name = "window"
    gains_class = Gains

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self.history = history.Design(axis, gains.window_s)
        self.velocity = SQ(self.history.change.i, axis.shrunk(self.history.fraction + ROUNDING_BITS))
        self.fraction = axis.shrunk(self.history.age_bits + ROUNDING_BITS)
        self.words = (
            Word(
                "window_length",
                UQ(self.history.age_bits, 0),
                self.history.every / axis.sample_hz,
                "s",
                self.history.longest,
                "length of the window",
            ),
        )

    @property
    def fastest(self) -> int:
        """The velocity's word at a change of the count that is limited at every sample."""
        return self.history.change.max << self.velocity.f

    @property
    def latency(self) -> int:
        return STEPS + self.history.latency + divide_latency(self.velocity.width - 1)

    def start(self, floating: bool = False) -> Held:
        """Return the state before the first sample, with a memory of its own."""
        return self.history.start_at_rest(floating)

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(self.history.params(), max(words["window_length"], 1), self.fraction)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: whole samples as in the integer kernel, from `si` where given."""
        (word,) = self.words
        length = max(word.from_si(si["window_length"]) if "window_length" in si else word.reset, 1)
        return FloatParams(self.history.params(floating=True), length, float(length * self.history.every))


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    past, stored, limited = take(params.history, state.history, seen.count, restart)
    velocity = state.velocity
    if stored:
        velocity = divide(change_over(params.history, past, params.length), params.length, params.fraction)
    return Held(past, velocity), velocity, int(limited)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unlimited and unrounded: the same algorithm."""
    past, stored, _ = take(params.history, state.history, seen.count, restart)
    velocity = state.velocity
    if stored:
        velocity = change_over(params.history, past, params.length) / params.samples
    return Held(past, velocity), velocity, 0
