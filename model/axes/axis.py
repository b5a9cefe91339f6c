"""Several axes through one pipeline: one specification for all of them, and for each axis words of its own.

Every axis equals a single one (`axis`) with its words, sample for sample. All sample at one rate, in turn: in a rota of
`clocks_per_sample` clocks, clock i takes a sample of axis i. A rota has at least `slots` clocks: one for every axis,
and no fewer than the recurrence. The recurrence is the clocks until the state that a sample leaves for the next sample
of its axis is stored.

The latency from a sample to its drive may exceed the rota: several samples of an axis are then under way at once.

    axes = Axes(spec, [{"wall_stiffness": 20e3}, {"wall_stiffness": 5e3, "wall_left": 1}])
    record = axes.run(counts)           # one row for each axis
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import checks
from ..arithmetic.divide import latency as divide_latency
from ..arithmetic.signed_divide import BITS_PER_CLOCK
from ..axis.axis import Record, run
from ..axis.design import Timing
from ..axis.designed import DesignedAxis
from ..axis.virtual_mass import FIELD
from ..checks import FieldError, check_int
from ..drive import registry
from ..drive.pdm import USUAL
from ..drive.stage import Stage, StageDesign
from ..encoder.quadrature import ILLEGAL, WRAPPED
from ..estimators.acceleration import Velocities

AXES_MAX = 32
"""The most axes of one pipeline."""
ROOT_BITS = 2
"""Bits of a root that a stage of the pipeline makes."""
FRONT_LATENCY = 2
"""Clocks from the strobe to the count in the pipeline: the choice among many decoders takes two."""
WALL_LATENCY = 5
"""Clocks from the velocity to the wall's force."""
OUTPUT_LATENCY = 4
"""Clocks from the wall's force to the changed drive, which is also the output stage's recurrence."""


class Pipeline(NamedTuple):
    """The clocks from a count to its velocity, and the fewest from a count to the next one of the same axis."""

    latency: int
    recurrence: int


def _levant(design: Any) -> Pipeline:
    """Distance, limit, magnitude, root, product, sum and limit; the tracked position is read in the second of these."""
    roots = -(-((design.radicand.width + 1) // 2) // ROOT_BITS)
    return Pipeline(7 + roots, 7 + roots)


def _window(design: Any) -> Pipeline:
    """Change, limit, position, place, memory, difference and magnitude, quotient, sign."""
    return Pipeline(6 + divide_latency(design.velocity.width - 1, BITS_PER_CLOCK), 1)


PIPELINES: dict[str, Callable[[Any], Pipeline]] = {
    "fdm": lambda design: Pipeline(2, 1),
    "levant": _levant,
    "window": _window,
}
"""The pipelines of estimators, by the estimator's name."""


@dataclass(frozen=True, kw_only=True)
class AxesSpec(DesignedAxis):
    """The requirements of every one of the axes, their number and their estimator.

    Attributes:
        axes: the number of axes, 1 to `AXES_MAX`.

    The other attributes are in `designed.DesignedAxis`, the errors in `requirements.AxisRequirements`. The estimator is
    one of `PIPELINES`; the words of an axis may say other gains.
    """

    axes: int

    def __post_init__(self) -> None:
        check_int("axes", self.axes, 1, AXES_MAX)
        super().__post_init__()
        if self.passivity:
            raise FieldError("passivity", "must be False: axes that share their logic have no such controller")
        if self.coupling:
            raise FieldError("coupling", "must be False: axes that share their logic have no moving surfaces")
        if self.virtual_mass_max_kg is not None:
            raise FieldError(FIELD, "must be None: axes that share their logic have no acceleration")
        if self.estimator not in PIPELINES:
            raise FieldError("estimator", f"must be one of {', '.join(PIPELINES)}, not {self.estimator!r}")
        if self.clocks_per_sample < self.slots:
            raise FieldError(
                "sample_hz",
                f"must leave {self.slots} clocks for {self.axes} axes in turn, so at most "
                f"{self.clock_hz // self.slots} at clock_hz {self.clock_hz}, not {self.sample_hz!r}",
            )

    @property
    def stage(self) -> Stage:
        """The drive stage that a board gives to every axis: pulses and a sign."""
        return USUAL

    @cached_property
    def drive(self) -> StageDesign:
        """The design of that stage."""
        return registry.design_of(self, self.stage)

    @cached_property
    def pipeline(self) -> Pipeline:
        """The pipeline of the estimator."""
        return PIPELINES[self.estimator](self.design.estimator)

    @property
    def slots(self) -> int:
        """The fewest clocks of a rota."""
        return max(self.axes, self.pipeline.recurrence, OUTPUT_LATENCY)

    @property
    def latency(self) -> int:
        """Clocks from the strobe of an axis to its changed drive."""
        return FRONT_LATENCY + self.pipeline.latency + WALL_LATENCY + OUTPUT_LATENCY

    @property
    def rotas_to_write(self) -> int:
        """The rotas from a reset until all words of all axes may be in use: no word is taken in the first one, then one
        a clock, and two clocks commit them. The rota after these is one at which the drives follow the force."""
        clocks = self.clocks_per_sample + self.axes * len(self.design.words) + 2
        actuations = -(-clocks // (self.clocks_per_sample * self.samples_per_actuation))
        return actuations * self.samples_per_actuation

    def timing(self, axis: int, rota: int = 0) -> Timing:
        """Return when an axis samples, and when its drive changes, from a rota on."""
        return Timing(self.clocks_per_sample, rota * self.clocks_per_sample + axis, self.latency)


class Axes:
    """Axes with their run-time parameters set, in SI units by the name of the word; see `Design.words`.

    Args:
        spec: the axes.
        si: for every axis its run-time parameters, e.g. `{"wall_stiffness": 20e3}` (N/m); the others keep their reset
            values (the wall is off).

    Attributes:
        spec, design: the `AxesSpec`, and the `design.Design` of every axis.
        words: for every axis its run-time words by name.
        params: for every axis the parameters of `axis.step`.

    Raises:
        TypeError: if `spec` is not an AxesSpec, or a value is not a number.
        ValueError: if there are not as many sets of parameters as axes, a name is unknown or a value is out of range.
    """

    def __init__(self, spec: AxesSpec, si: Sequence[Mapping[str, float]]):
        if not isinstance(spec, AxesSpec):
            raise TypeError(f"spec must be an AxesSpec, not {spec!r}")
        if len(si) != spec.axes:
            raise ValueError(f"si must have parameters for each of the {spec.axes} axes, not for {len(si)}")
        self.spec, self.design = spec, spec.design
        self.words = [self.design.encode(**given) for given in si]
        self.params = [self.design.params(words) for words in self.words]

    def run(self, counts: ArrayLike) -> Record:
        """Run a record of counts of every axis from the start state.

        Args:
            counts: integers, shape (axes, samples). A count may exceed the count's width: it wraps, as in the hardware,
                and from there on the flag count_wrapped is up and the drive is zero. If a count changes by more than
                the clocks of a sample, the encoder's flag of an illegal step is up in the same way. It may not jump by
                half of its range.

        Raises:
            TypeError: if the counts are not integers.
            ValueError: if the counts have no row for every axis, or jump.
        """
        spec = self.spec
        lanes, wrapped, outrun = checks.lanes_of_counts(counts, spec.count_width, spec.clocks_per_sample)
        if lanes.ndim != 2 or len(lanes) != spec.axes:
            raise ValueError(f"counts must have a row for each of the {spec.axes} axes, not the shape {lanes.shape}")
        faults = wrapped * WRAPPED | outrun * ILLEGAL
        velocity, force, drive, flags = (np.zeros(lanes.shape, np.int64) for _ in range(4))
        for lane, params in enumerate(self.params):
            made = Velocities(velocity[lane]), force[lane], drive[lane], flags[lane]
            run(params, self.design.start(), lanes[lane], faults[lane], *made)
        return Record(self.design, velocity, force, drive, flags)
