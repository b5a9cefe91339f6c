"""Training passes of an encoder, and the map of its scale that they give: swings by hand, seen by their edges alone.

A pass is a swing from the middle of the scale. The encoder's seed and the number of the pass determine amplitude,
decay, frequency and direction. The jitter is drawn anew for each pass. Only the axis's decoded edges with their stamps
are used. The count is referenced at the start, as by homing.
"""

from typing import NamedTuple

from ...model.encoder import scale_map
from ...model.encoder.scale_fit import Fit
from ...model.spec import AxisSpec
from ..world.chance import uniform
from ..world.encoder import Errors
from .edge_limit import edges_of
from .motions import DecayingSine
from .signals import Signal

PASSES_MAX = 100
ESTIMATOR = "edge-kalman"
"""The estimator that takes a map."""
SECONDS = 5.0
AMPLITUDES_M = 45e-3, 65e-3
DECAYS_PER_S = 0.5, 1.5
FREQUENCIES_HZ = 0.7, 1.3
SWINGS, JITTERS = 5, 6
"""The streams of the passes' random numbers."""
REACH_COUNTS = 1 << 16
"""How far bins go to both sides of the start, at most: more than any swing in counts of a micrometre."""
BIN_BITS = 4
LIMIT_COUNTS = 16.0


def bins_of(spec: AxisSpec) -> scale_map.Design:
    """Return the bins of a map about the start of the count, as far as the count goes."""
    reach = min(REACH_COUNTS, 1 << (spec.count_width - 1))
    return scale_map.Design(spec.count_width, -reach, BIN_BITS, 2 * reach >> BIN_BITS, LIMIT_COUNTS)


class Passes(NamedTuple):
    """Training passes: the seed of the encoder, by which they are drawn, and how many there are."""

    seed: int
    number: int


def swing(seed: int, number: int) -> Signal:
    """Return the motion of a training pass, by the encoder's seed and the number of the pass."""

    def between(place: int, least: float, most: float) -> float:
        return least + (most - least) * uniform(seed, SWINGS, number, place)

    amplitude_m = between(0, *AMPLITUDES_M) * (1 if uniform(seed, SWINGS, number, 1) < 0.5 else -1)
    motion = DecayingSine(amplitude_m, between(2, *DECAYS_PER_S), between(3, *FREQUENCIES_HZ))
    return Signal("swing", motion, SECONDS, 0.0, 1.0)


def train(fit: Fit, spec: AxisSpec, errors: Errors, seed: int, number: int) -> None:
    """Add training pass `number` of an encoder with these errors to a fit."""
    lines = errors.lines and errors.lines._replace(seed=int(uniform(seed, JITTERS, number, 0) * 2.0**32))
    times_s, places = edges_of(swing(seed, number), spec, errors.offsets, errors.scale, lines)
    fit.add(times_s, places.astype(int))


def learned(spec: AxisSpec, errors: Errors, passes: Passes, floating: bool) -> scale_map.Params:
    """Return the map of an encoder with these errors after training passes, in words or in float64."""
    bins = bins_of(spec)
    fit = Fit(bins)
    for number in range(passes.number):
        train(fit, spec, errors, passes.seed, number)
    return bins.params(fit.errors(), floating)


def check(passes: int, estimator: str, backend: str) -> None:
    """Raise ValueError unless there is a map, from so many training passes, for an estimator on a backend."""
    if isinstance(passes, bool) or not isinstance(passes, int) or not 1 <= passes <= PASSES_MAX:
        raise ValueError(f"encoder.learned_passes must be a whole number from 1 to {PASSES_MAX}, not {passes!r}")
    if estimator != ESTIMATOR:
        raise ValueError(
            f"encoder.learned_passes must be for {ESTIMATOR}, which takes a map of the scale, not for {estimator!r}"
        )
    if backend == "rtl":
        raise ValueError("encoder.learned_passes must be on float or fixed: the RTL of an axis has no port for a map")
