"""The past positions of an axis in block RAM, from which an estimator takes the change over a window.

A position is the sum of the count's changes since the start, every change limited to +-`change.max`:

    position_k = position_{k-1} + limit(count_k - count_{k-1})         modulo 2**width; 0 at the first sample

Every `every`-th position is stored, beginning with the first. The position `age` stored positions before the newest
reads as 0, the position at the start, if there is none yet: **before the start the axis counts as standing where it was
first seen**. A window that begins before the start therefore estimates too little, never too much, and a start from
rest has no transient.

Formats, derived:

- `change` SQ(i, 0), the change of the count in a sample: i holds twice the largest speed (a loop that overshoots is
  still read correctly), and at least three counts: see `estimate.whole_counts`. A larger change
  is limited (flag `velocity_saturated`) and the rest of that step is forgotten. So the change over a window always
  fits, and a motion that is too fast reads as the largest velocity, not as an alias.
- `age_bits`: the fewest bits that hold the window's length in stored positions. The memory has 2**age_bits words.
- `width`: the change over the longest window is less than 2**(i-1) 2**age_bits every. So one more bit, the sign, makes
  the difference of two positions exact modulo 2**width: i + age_bits + log2(every). The total travel of the axis and
  the number of wraps of its count do not matter.
- `every`, a power of two: 1, unless 2**age_bits words of `width` bits are more than `MEMORY_BITS`. Otherwise estimates
  are made every `every` samples and held between. So a window remains a whole number of stored positions, and the
  difference over it exact. The hold adds at most every - 1 samples to the age of a window of thousands of samples.
"""

from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import saturate, wrap
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from .estimate import whole_counts

MEMORY_BITS = 1 << 16
"""Largest memory: 16 of the 30 blocks of 4 kbit in an iCE40UP5K, 4 of the 56 of 18 kbit in an ECP5-25F."""
LATENCY = 3
"""Clocks from the strobe to `valid`: see `hardwall.hdl.estimators.history`."""
WIDTH_MAX = 48
"""Largest `width`, which leaves room in int64 for the fraction bits, weights and sums of an estimator."""
UNLIMITED = 1 << 40
"""A limit larger than any change of a 32-bit count, for the float64 algorithm."""


class Params(NamedTuple):
    count_width: int
    change_max: int
    every: int
    width: int


class State(NamedTuple):
    """The state: `head` is the place of the newest stored position, `known` the number of those before it (saturates).

    `positions` belongs to one run and is written in place.
    """

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    position: int
    phase: int
    head: int
    known: int
    positions: np.ndarray


class Held(NamedTuple):
    """The state of an estimator of past counts: their history, and its velocity, which is held between stored ones."""

    history: State
    velocity: float


class Design:
    """Formats of the history for an axis and a window.

    Args:
        axis: the `requirements.AxisRequirements`.
        window_s: longest time to look back, s.
        steps: the window is a multiple of this number of samples.

    Attributes:
        change, every, age_bits, width: formats and sizes that the module derives.
        longest: the window in stored positions.

    Raises:
        ValueError: if the window is too long for the estimator's arithmetic in int64, with the accepted range.
    """

    latency = LATENCY

    def __init__(self, axis: AxisRequirements, window_s: float, steps: int = 1):
        self.count_width = axis.count_width
        self.change = whole_counts(axis)
        # Rounding to whole steps may lengthen a window by half, or to the least length of one step.
        most = 2.0 ** (WIDTH_MAX - 1 - self.change.i) / axis.sample_hz
        if not 0 < window_s <= most:
            raise FieldError("window_s", f"must be more than 0 and at most {most:g} at these rates, not {window_s!r}")
        samples = steps * max(1, round(window_s * axis.sample_hz / steps))
        for shift in range(WIDTH_MAX):
            self.every = 1 << shift
            self.longest = max(1, round(samples / self.every))
            self.age_bits = self.longest.bit_length()
            self.width = self.change.i + self.age_bits + shift
            if self.width << self.age_bits <= MEMORY_BITS:
                break

    @property
    def age_max(self) -> int:
        """The largest age that can be read, in stored positions."""
        return (1 << self.age_bits) - 1

    @property
    def fraction(self) -> int:
        """Fraction bits of counts a sample whose LSB is less than one count over the longest window."""
        return self.age_bits + self.every.bit_length() - 1

    def params(self, floating: bool = False) -> Params:
        """Return the kernels' parameters; if `floating`, nothing is limited and no word is too narrow."""
        if floating:
            return Params(self.count_width, UNLIMITED, self.every, 62)
        return Params(self.count_width, self.change.max, self.every, self.width)

    def start(self) -> State:
        """Return the state before the first sample, with a memory of its own."""
        return State(0, 0, 0, 0, 0, 0, np.zeros(1 << self.age_bits, np.int64))

    def start_at_rest(self, floating: bool = False) -> Held:
        """Return the state of an estimator before the first sample, with a memory of its own."""
        return Held(self.start(), 0.0 if floating else 0)


@compiled
def take(params, state, count, restart):
    """Take one sample: return (state, whether its position was stored, whether its change was limited).

    Args:
        params: what `Design.params` returns.
        state: what `Design.start` or the previous call returned.
        count: a signed word that may have wrapped.
        restart: true to forget the past: this sample counts as the first.
    """
    # Unpack once: every access to an array in a state costs the compiled closed loop its reference counting.
    running, last_count, position, phase, head, known, positions = state
    last = len(positions) - 1
    limited = False
    if restart or not running:
        position, phase, known = 0, 0, 0
    else:
        moved = wrap(count - last_count, params.count_width)
        change = saturate(moved, -params.change_max, params.change_max)
        position = wrap(position + change, params.width)
        phase = (phase + 1) & (params.every - 1)
        known = min(known + 1, last) if phase == 0 else known
        limited = change != moved
    if phase == 0:
        head = (head + 1) & last
        positions[head] = position
    return State(1, count, position, phase, head, known, positions), phase == 0, limited


@compiled
def change_over(params, state, age):
    """Return the change since `age` stored positions ago, 1 to `Design.age_max`, at a sample that is stored."""
    if age > state.known:
        return state.position
    positions = state.positions
    older = positions[(state.head - age) & (len(positions) - 1)]
    return wrap(state.position - older, params.width)
