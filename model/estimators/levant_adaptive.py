"""Levant's differentiator of order 3 with filtering, whose bound L follows the signal, in fixed point and in float64.

`levant_higher_design` has the equation. Its gains follow from L, a bound on the snap. Here L has levels: at level j it
is the largest L times 2**-j. A low L reads a smooth motion with little noise, a high one follows an impact. The
distance of a sample from the count, |z0 - f|, decides on the level of the next sample:

1. *Lost*. At LOST counts L is too low. The level falls by FALL, and falls again each time the distance has doubled.
   FALL octaves of L halve the differentiator's own time, T = L^(-1/4).
2. *Calm*. After HOLD times T without a loss the level rises by one. Then T is 2^(1/4) times as long. Below level FALL,
   less than 2 LOST counts is calm, too: at low rates a count that flickers moves z0 so far there.

L settles where the signal is lost about once in HOLD T. The first sample, and a sample with `restart`, begin at level
0: a start in motion settles as fast as the largest L can. The law has no multiplication. Its thresholds are shifts of
LOST, and a table has HOLD T for every level.

*LOST* is the least power of two from BLUR + SPREAD s counts on, with the axis's bound s on the RMS error of an edge. It
is at most 2**LOST_BITS_MAX. A count alone is off by half a count at most. Edges that err by more than the axis
says keep L high, and the estimate noisy.

*The largest L* is STEEPEST C^2 / q, with the axis's bound C on the acceleration and the count q. C / (q / C) is the
snap of an acceleration C that comes and goes in about the time in which it moves a count. This L may be far too large
or too small, because the levels find what a signal needs. At low rates it is at most LARGEST_L.

*What the levels cost.* Below LOST counts the law is blind. A smaller vibration is averaged away after some T. Near LOST
the levels hunt: the error of the velocity may be twice LOST counts times the angular frequency. An impact that ends
within a few times LOST counts is over before the level has fallen. Within a level every limit of `levant_higher_design`
holds.

Formats are as in `levant_higher_design`, except:

- The fraction bits follow from the last level: a count's error corrects z_n by at least 2**RESOLUTION_BITS there.
- A reversal has its peaks at level 0, to which a few doublings lead. `w` has room for the noise of the last level.
- NOISE has the factor LOST / 2.
- The word `levant_adaptive_octaves` raises or lowers all levels together, and the holds follow it.

Source: Levant, Livne, IEEE Transactions on Automatic Control 57 (2012), 2964, for an L that varies; the law is this
project's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arithmetic.fixed import bits_for, wrap
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import levant_higher_design
from .acceleration import acceleration_of
from .estimate import estimate
from .levant_higher import acceleration, advance, distance, float_acceleration, float_advance
from .levant_higher_design import NOISE

BLUR = 1.5
"""Counts of LOST that a count needs whose edges are in their places."""
SPREAD = 5.0
"""Standard deviations of an edge in LOST."""
LOST_BITS_MAX = 2
"""log2 of the largest LOST: edges that err by half a count may change their order."""
FALL = 4
"""Levels by which L rises at once: they halve T."""
HOLD = 64
"""How many times T without a loss a level takes."""
LEVELS = 25
"""Levels beside level 0."""
STEEPEST = 32.0
"""The largest L, in C^2 / q."""
LARGEST_L = 2.0**-7
"""The largest L, in counts a sample^4."""


@dataclass(frozen=True)
class Gains(levant_higher_design.SnapGains):
    """The gain: the largest bound L on the snap, m/s^4, which level 0 has."""

    snap_m_per_s4: float
    largest = LARGEST_L

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return STEEPEST C^2 / q, or LARGEST_L if that is less."""
        steepest = STEEPEST * axis.acceleration_max_m_per_s2**2 / axis.count_m
        return cls(min(steepest, cls.largest * axis.count_m * float(axis.sample_hz) ** 4))


class Law(NamedTuple):
    """What the law needs."""

    holds: np.ndarray
    """Samples of calm by level, from the highest word of octaves at level 0 on."""
    ahead: int
    """The place of level 0 in `holds`, at the present word."""
    lost_bits: int


class Params(NamedTuple):
    """Parameters of the integer kernel."""

    levant: levant_higher_design.Params
    law: Law


class FloatParams(NamedTuple):
    """Parameters of the float64 kernel."""

    levant: levant_higher_design.FloatParams
    law: Law


class State(NamedTuple):
    """The states of `levant_higher`, and the law's: the level, the samples of calm, the doublings of a loss."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    w: float
    lead: float
    z1: float
    z2: float
    z3: float
    level: int
    calm: int
    doublings: int


class Design(levant_higher_design.Design):
    """Formats, run-time word and latency for an axis, derived as the module says.

    Attributes:
        holds: samples of calm after which a level rises, from the highest word of octaves at level 0 on.
        lost_bits: log2 of LOST.
    """

    name = "levant-adaptive"
    gains_class = Gains
    order, filtering = 3, 1
    levels = LEVELS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        self.lost_bits = min(bits_for(BLUR + SPREAD * axis.edge_error_max_counts), LOST_BITS_MAX)
        self.noise = NOISE * 2.0 ** (self.lost_bits - 1)
        super().__init__(axis, gains)
        (word,) = self.words
        octaves = range(word.high, word.low - LEVELS - 1, -1)
        holds = [math.ceil(HOLD * (self.lipschitz * 2.0**k) ** (-1 / 4)) for k in octaves]
        self.holds = np.array(holds, np.int64)

    def _law(self, octaves: int) -> Law:
        return Law(self.holds, self.words[0].high - octaves, self.lost_bits)

    def params(self, words: Mapping[str, int]) -> tuple:
        (octaves,) = (words[word.name] for word in self.words)
        return Params(self._common(words), self._law(octaves))

    def float_params(self, gains: Any, output: str, si: Mapping[str, float]) -> tuple:
        octaves = round(si.get(self.words[0].name, 0))
        return FloatParams(self._float_common(gains, si), self._law(octaves))

    def start(self, floating: bool = False) -> tuple:
        zero = 0.0 if floating else 0
        return State(0, 0, zero, zero, zero, zero, zero, 0, 0, 0)


@compiled
def adapt(law, state, far):
    """Return (level, calm, doublings) after a sample; `far` is |z0 - f| in multiples of LOST, rounded down."""
    level, calm, doublings = state.level, state.calm, state.doublings
    if not far >> int(level < FALL):
        if level == LEVELS:
            return level, 0, 0
        if calm + 1 < law.holds[law.ahead + level]:
            return level, calm + 1, 0
        return level + 1, 0, 0
    if level and far >> doublings:
        return max(level - FALL, 0), 0, doublings + 1
    return level, 0, doublings


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    family = params.levant
    if restart or not state.running:
        return State(1, seen.count, 0, 0, family.half, 0, 0, 0, 0, 0), 0, 0
    far_gap, gap = distance(family, state, seen)
    size = ~gap if gap < 0 else gap
    adapted = adapt(params.law, state, size >> family.fractions[1] + params.law.lost_bits)
    moved, velocity, flags = advance(family, state, far_gap, gap, family.octaves - state.level)
    return State(1, seen.count, *moved, *adapted), velocity, flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm."""
    family = params.levant
    if restart or not state.running:
        return State(1, seen.count, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0), 0.0, 0
    gap = state.lead - wrap(seen.count - state.count, family.count_width)
    adapted = adapt(params.law, state, int(abs(gap)) >> params.law.lost_bits)
    moved = float_advance(family, state, gap, 2.0 ** (-state.level / 5))
    return State(1, seen.count, *moved, *adapted), moved[2], 0


@acceleration_of.register(Params)
@compiled
def fixed_acceleration(params, state):
    return acceleration(params.levant, state)


acceleration_of.register(FloatParams)(float_acceleration)
