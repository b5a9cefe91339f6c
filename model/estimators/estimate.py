"""The contract of a velocity estimator in the model: its gains, its design, and one step of its kernel.

`EstimatorGains` and `EstimatorDesign` are the contract. `estimate` is the kernel. Every estimator registers two
variants of it: one for the integer words of the hardware, and one for the same algorithm in float64. To add an
estimator, see `registry`.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from ..arithmetic.fixed import SQ, bits_for
from ..checks import NUMBERS, check_number, check_range
from ..requirements import AxisRequirements
from ..runtime.compiled import by_type
from ..words import Word


@dataclass(frozen=True)
class EstimatorGains(ABC):
    """The gains of an estimator in SI units; the name of every field ends in its unit.

    Raises:
        TypeError: if a field is not a number.
        ValueError: if a field is not within `checks.NUMBERS`.
    """

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            check_number(name, value)
            check_range(name, value, *NUMBERS)

    @classmethod
    @abstractmethod
    def default(cls, axis: AxisRequirements) -> Self:
        """Return the default gains for an axis, from its rates, ranges and count size alone."""


class EstimatorDesign(ABC):
    """Formats, run-time words and latency of an estimator, derived from an axis and gains.

    Attributes of the class:
        name: name in the registry; the names of the estimator's words begin with it, hyphens as underscores.
        gains_class: the estimator's `EstimatorGains`.
        outputs: names of the selectable outputs, the default first; the word `output_word()` selects one of several.
        inputs: names of the fields of `quadrature.Seen` that the estimator uses.
        flags: names of the saturation flags, bit 0 first.

    Attributes:
        count_width, stamp_width: bits of the decoder's count and of its stamps.
        velocity: format of the velocity, counts a sample.
        words: the run-time words, in the order of the hardware's ports.
        latency: clocks from the strobe to `valid`.
        interval: the fewest clocks from a strobe to the next, not below `latency`.

    Raises:
        ValueError: if the gains or the axis do not fit what int64 and the hardware hold, with the accepted range.
    """

    name: ClassVar[str]
    gains_class: ClassVar[type[EstimatorGains]]
    outputs: ClassVar[tuple[str, ...]] = ("u",)
    inputs: ClassVar[tuple[str, ...]] = ("count",)
    flags: ClassVar[tuple[str, ...]] = ("velocity_saturated",)
    velocity: SQ
    words: tuple[Word, ...] = ()

    def __init__(self, axis: AxisRequirements, gains: Any):
        self.count_width, self.stamp_width = axis.count_width, axis.stamp_width

    @property
    @abstractmethod
    def latency(self) -> int:
        """Clocks from the strobe to `valid`."""

    @property
    def fastest(self) -> int:
        """The velocity's word at the largest steady speed, which no faster one makes smaller: the format's largest."""
        return self.velocity.max

    @property
    def interval(self) -> int:
        """The fewest clocks from a strobe to the next, which may come with `valid`."""
        return self.latency

    @abstractmethod
    def params(self, words: Mapping[str, int]) -> tuple:
        """Return the integer kernel's parameters for the given run-time words."""

    @abstractmethod
    def float_params(self, gains: Any, output: str, si: Mapping[str, float]) -> tuple:
        """Return the float64 kernel's parameters: unrounded gains, from `si` by word where given, else from `gains`."""

    @abstractmethod
    def start(self, floating: bool = False) -> tuple:
        """Return the state before the first sample, for one run only: the run may write to arrays in it."""

    @classmethod
    def uses_stamps(cls) -> bool:
        """Return whether the estimator needs the clock stamps of edges besides the count."""
        return cls.inputs != ("count",)

    @classmethod
    def output_word(cls) -> str:
        """Return the name of the run-time word that selects among several outputs."""
        return f"{cls.name.replace('-', '_')}_output"

    @classmethod
    def choose(cls, output: str) -> dict[str, int]:
        """Return the run-time word, by name, that selects an output; empty if the estimator has only one output.

        Raises:
            ValueError: if there is no such output.
        """
        if output not in cls.outputs:
            raise ValueError(f"output of {cls.name} must be one of {', '.join(cls.outputs)}, not {output!r}")
        return {cls.output_word(): cls.outputs.index(output)} if len(cls.outputs) > 1 else {}


def largest_step(axis: AxisRequirements) -> int:
    """Return the largest difference of two counts that a filter of counts takes.

    It is the motion of a sample at twice the largest speed, begun within a count, and one count for an edge out of
    place. It is at most half of the count's range, because two counts differ by no more.
    """
    return min(math.floor(2 * axis.speed_max_counts_per_sample) + 2, 1 << (axis.count_width - 1))


def whole_counts(axis: AxisRequirements) -> SQ:
    """Return the format of a whole number of counts a sample that holds twice the largest speed.

    It holds at least three counts: two come in a sample at any speed, with an edge out of place.
    """
    return SQ(1 + max(2, bits_for(math.floor(2 * axis.speed_max_counts_per_sample) + 1)), 0)


def fraction_bits(axis: AxisRequirements, resolution_bits: int) -> int:
    """Return the fraction bits of a velocity whose LSB is at most sqrt(C') 2**-resolution_bits.

    C' is the axis's bound on the acceleration in counts a sample^2. sqrt(C') is half of the minimax bound of a velocity
    from counts, 2 sqrt(C eps), with eps a count.
    """
    root = math.sqrt(axis.acceleration_max_m_per_s2 / axis.count_m) / axis.sample_hz
    return max(resolution_bits - math.floor(math.log2(root)), 0)


@by_type
def estimate(params, state, seen, restart):
    """Take one sample: return (state, velocity, flags).

    Args:
        params: what a design's `params` (integer words) or `float_params` (the same algorithm in float64) returns.
        state: the state from `start` or from the previous call; an array in it is written in place.
        seen: the decoder's outputs; the count is a signed word and may have wrapped.
        restart: true to forget the past: this sample counts as the first.

    Returns:
        The new state; the velocity in words of the design's `velocity` format (float: counts a sample); and the
        flags that this sample raised, one bit each.
    """
