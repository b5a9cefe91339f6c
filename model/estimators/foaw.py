"""First-order adaptive windowing (FOAW): the longest window over which the counts are a line, in fixed point.

Per sample, with f the count, d the band, T the spacing of the taps in samples and D_i = f_k - f_{k-iT}:

    the line from f_{k-nT} to f_k passes within d of every count between, if
        (D_i - d) / i <= D_n / n <= (D_i + d) / i                 for i = 1 ... n - 1
    n: one less than the smallest that fails, at least 1 and at most N (as published: the search ends there)

    end-fit    v = D_n / (n T)
    best-fit   v = 6 sum_i (2 i - n) D_i / (n (n + 1) (n + 2) T)  the least-squares line's slope

Both outputs use the window that the check of the end-fit gives. (A check of the least-squares line itself would take
work that grows with the square of n. It gave no smaller error on the paper's signal at 1 and 10 kHz.) Continuing the
search to the largest n that passes, as the definition may be read, gave the same error or a larger one.

`band_counts`, d: **a count is the position rounded down: the counts of a uniform motion stay within one count of the
line through any two of them**. A smaller band does not suffice: two roundings in [0, 1) differ by less than 1. With
half a count, uniform motion itself shortens the window. So d = 1; an encoder whose edges are displaced needs a band
larger by that displacement.

`window_s`, N T: a line through the ends of a parabola |f''| = C departs from it by C n^2 / 8. This is d / 2 at n = 2
sqrt(d / C): half of the band is for curvature, half for the rounding. In a longer window only an accidental fit passes
the check. At high rates the window is thousands of samples: `TAPS` of them, T apart, are searched, anew at every
sample.

Past counts come from `history`. It defines four cases: a window that is not yet full, a wrap of the count, a speed
beyond the largest, and storage of only every M-th position.

Formats, derived:

- Slopes are compared in units of 1 / lcm(1 ... TAPS), in which D_i / i are whole: **the check is exact**. D_i's weight
  then has 15 bits, one multiplier of either device. This is why TAPS is 12: with 13 the weight would have 19 bits.
- `foaw_band` UQ(4, 2): quarter counts, to nearly four periods of the encoder.
- `foaw_window`: N at run time, in taps; 0 counts as 1, more than TAPS as TAPS.
- `velocity` SQ(i, f): i as in `history.change`, since both fits are averages of the changes with positive weights.
- f: rounding toward zero, by less than 2**-ROUNDING_BITS of a count over the longest window, as in `window`.

Limits. Standing for the window gives exactly 0. A step of more than two bands leaves one tap: it reads as its counts /
T for T samples, then as 0. Of a step beyond twice the largest speed, only the part up to that speed counts. After the
first sample or a restart in motion the axis counts as having stood, as after a step of velocity.

Source: Janabi-Sharifi, Hayward, Chen, Discrete-time adaptive windowing for velocity estimation, IEEE Transactions on
Control Systems Technology 2000.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import SQ, UQ
from ..arithmetic.signed_divide import divide
from ..arithmetic.signed_divide import latency as divide_latency
from ..checks import NUMBERS, FieldError, check_number, check_range, shown
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word
from . import history
from .estimate import EstimatorDesign, EstimatorGains, estimate
from .history import Held, change_over, take

TAPS = 12
"""Largest number of steps back that are searched, one a clock."""
UNIT = math.lcm(*range(1, TAPS + 1))
"""Slopes are compared in units of 1 / UNIT."""
BAND_COUNTS = 1.0
BAND = UQ(4, 2)
ROUNDING_BITS = 8
"""An LSB of the velocity is less than 2**-ROUNDING_BITS counts over the longest window."""
STEPS = 6
"""Clocks of the sequence besides the history, one a tap, and the division: see `hardwall.hdl.estimators.foaw`."""
WEIGHTS = np.array([0, *(UNIT // i for i in range(1, TAPS + 1))])
"""Weights of D_i in 1 / UNIT, by i."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The band, counts, and the longest window, s.

    Raises:
        ValueError: if the band does not fit its word, or the window is not within `checks.NUMBERS`.
    """

    band_counts: float
    window_s: float

    def __post_init__(self):
        band, window = self.band_counts, self.window_s
        most = BAND.to_real(BAND.max)
        if not (isinstance(band, int | float) and 0 <= band <= most):
            raise FieldError("band_counts", f"must be 0 to {most:g}, not {shown(band)}")
        check_number("window_s", window)
        check_range("window_s", window, *NUMBERS)

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return a band of one count, and the window in which the largest acceleration takes half of that band."""
        return cls(BAND_COUNTS, 2 * math.sqrt(BAND_COUNTS * axis.count_m / axis.acceleration_max_m_per_s2))


class Params(NamedTuple):
    """Parameters of the integer kernel: `band` in 1 / `scale` counts, `spacing` in stored positions."""

    history: history.Params
    output: int
    band: int
    scale: int
    window: int
    spacing: int
    fraction: int


class FloatParams(NamedTuple):
    """Parameters of the float64 kernel: `band` in counts, so `scale` is 1; `samples` is `spacing` in samples."""

    history: history.Params
    output: int
    band: float
    scale: float
    window: int
    spacing: int
    samples: float


class Design(EstimatorDesign):
    """Formats, run-time words and latency of FOAW for an axis, derived as the module says.

    Attributes:
        history: the `history.Design`.
        spacing: T, in stored positions.
        velocity: format of v.
        fraction: fraction bits of a quotient by taps and spacing.
        words: `foaw_output`, `foaw_band`, `foaw_window`.

    Raises:
        ValueError: if the window is too long for int64, with the accepted range.
    """

    name = "foaw"
    gains_class = Gains
    outputs = ("end-fit", "best-fit")

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self.history = history.Design(axis, gains.window_s, TAPS)
        self.spacing = self.history.longest // TAPS
        self.velocity = SQ(self.history.change.i, axis.shrunk(self.history.fraction + ROUNDING_BITS))
        self.fraction = axis.shrunk(self.history.age_bits + ROUNDING_BITS)
        tap_s = self.spacing * self.history.every / axis.sample_hz
        window = min(max(round(gains.window_s / tap_s), 1), TAPS)
        band = BAND.from_real(gains.band_counts)
        self.words = (
            Word("foaw_output", UQ(1, 0), 1.0, "", 0, "velocity output: 0 for end-fit, 1 for best-fit"),
            Word("foaw_band", BAND, axis.count_m, "m", band, "how far from the line a count may be"),
            Word("foaw_window", UQ(TAPS.bit_length(), 0), tap_s, "s", window, "longest window"),
        )

    @property
    def fastest(self) -> int:
        """The velocity's word at a change of the count that is limited at every sample."""
        return self.history.change.max << self.velocity.f

    @property
    def latency(self) -> int:
        return STEPS + self.history.latency + TAPS + divide_latency(self.velocity.width - 1)

    def start(self, floating: bool = False) -> Held:
        """Return the state before the first sample, with a memory of its own."""
        return self.history.start_at_rest(floating)

    def params(self, words: Mapping[str, int]) -> Params:
        window = min(max(words["foaw_window"], 1), TAPS)
        output, band = words["foaw_output"], words["foaw_band"]
        return Params(self.history.params(), output, band, 1 << BAND.f, window, self.spacing, self.fraction)

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: the same taps, the band unrounded, from `si` where given."""
        _, band, window = self.words
        taps = window.from_si(si["foaw_window"]) if "foaw_window" in si else window.reset
        return FloatParams(
            self.history.params(floating=True),
            self.outputs.index(output),
            si["foaw_band"] / band.si_per_unit if "foaw_band" in si else gains.band_counts,
            1.0,
            min(max(taps, 1), TAPS),
            self.spacing,
            float(self.spacing * self.history.every),
        )


@compiled
def _fit(params, past):
    """Return the slope over the longest fitting window, in counts a tap, as (numerator, denominator)."""
    newest = change_over(params.history, past, params.spacing)
    taps, last, total, sums = 1, newest, newest, 0
    slope, margin = params.scale * newest * UNIT, params.band * UNIT
    low, high = slope - margin, slope + margin
    for i in range(2, params.window + 1):
        change = change_over(params.history, past, i * params.spacing)
        weight = WEIGHTS[i]
        slope, margin = params.scale * change * weight, params.band * weight
        if not low <= slope <= high:
            break
        low, high = max(low, slope - margin), min(high, slope + margin)
        # total is D_1 + ... + D_i, sums is the sum of the earlier totals: i total - 2 sums = sum_j (2 j - i) D_j.
        sums += total
        total += change
        taps, last = i, change
    if params.output:
        return taps * total - 2 * sums, taps * (taps + 1) * (taps + 2) // 6
    return last, taps


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    past, stored, limited = take(params.history, state.history, seen.count, restart)
    velocity = state.velocity
    if stored:
        change, taps = _fit(params, past)
        velocity = divide(change, taps * params.spacing, params.fraction)
    return Held(past, velocity), velocity, int(limited)


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unlimited and unrounded; its slopes are whole too, so its windows are the same."""
    past, stored, _ = take(params.history, state.history, seen.count, restart)
    velocity = state.velocity
    if stored:
        change, taps = _fit(params, past)
        velocity = change / (taps * params.samples)
    return Held(past, velocity), velocity, 0
