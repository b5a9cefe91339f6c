"""A velocity estimator of the hardware for records of counts, whole or in pieces."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .counter import check_span, cure, modulus_of, unwrapped
from .encoder.quadrature import seen_count
from .estimators import registry
from .estimators.acceleration import Accelerated, Motions, Velocities, keep
from .estimators.estimate import EstimatorDesign, EstimatorGains, estimate
from .motion import Motion
from .record_axis import axis_of
from .record_time import RecordTime
from .runtime.compiled import compiled

BACKENDS = "fixed", "float"
"""The hardware's words, and the same algorithm in float64 with unrounded gains."""


@compiled
def run(params: tuple, state: tuple, counts: np.ndarray, made: Velocities | Motions) -> tuple[tuple, int]:
    """Fill `made` with the words of a record of counts; return the state and the flags that were raised."""
    flags = 0
    for k in range(len(counts)):
        state, velocity, raised = estimate(params, state, seen_count(counts[k]), 0)
        keep(made, k, velocity, params, state)
        flags |= raised
    return state, flags


def is_floating(backend: str) -> bool:
    """Return whether a backend computes in float64.

    Raises:
        ValueError: if there is no such backend.
    """
    if backend not in BACKENDS:
        raise checks.FieldError("backend", f"must be one of {', '.join(BACKENDS)}, not {checks.shown(backend)}")
    return backend == "float"


def output_of(estimator: str, output: str | None) -> str:
    """Return the name of an estimator's output, its first for None.

    Raises:
        ValueError: if a name is unknown.
    """
    outputs = registry.design_of(estimator).outputs
    if output is not None and output not in outputs:
        raise checks.FieldError("output", f"of {estimator} must be one of {', '.join(outputs)}, not {output!r}")
    return outputs[0] if output is None else output


def check_of_counts(estimator: str) -> None:
    """Raise ValueError if there is no such estimator, or it needs the edges."""
    if registry.design_of(estimator).uses_stamps():
        raise checks.FieldError(
            "estimator",
            f"must be one that needs only counts, not {estimator!r}: velocity_of_edges and "
            "velocity_and_acceleration_of_edges take the edges",
        )


def check_accelerated(estimator: str) -> None:
    """Raise ValueError if there is no such estimator, or it has no acceleration."""
    if not issubclass(registry.design_of(estimator), Accelerated):
        names = [name for name, kind in registry.ESTIMATORS.items() if issubclass(kind, Accelerated)]
        raise checks.FieldError(
            "estimator", f"must be one with an acceleration ({', '.join(names)}), not {checks.shown(estimator)}"
        )


def units_of(design: EstimatorDesign, floating: bool, count: float, sample_hz: float) -> tuple[float, ...]:
    """Return what one of a velocity's word is worth, unit/s, and one of the acceleration's, unit/s^2, if there is one.

    Args:
        design: the design of the estimator.
        floating: whether the outputs are float64, in counts and samples.
        count: size of a count, in the unit.
        sample_hz: sample rate, Hz.
    """
    formats = design.velocity, *((design.acceleration,) if isinstance(design, Accelerated) else ())
    lsbs = (1.0 if floating else fmt.lsb for fmt in formats)
    return tuple(lsb * count * sample_hz**power for power, lsb in enumerate(lsbs, 1))


class VelocityEstimator:
    """An estimator with its state: counts in, velocities out. A record may come in any number of pieces.

        estimator = VelocityEstimator(10e3, "kalman", Motion(count=1e-6, acceleration_max=12, speed_max=2, travel=0.15))
        first, second = estimator(counts[:500]), estimator(counts[500:])

    `copy.deepcopy` and `pickle` keep the state: use them to continue twice from one point, or in another process.

    Args:
        sample_hz: sample rate, Hz; it need not be whole.
        estimator: name of an estimator that needs only counts: see `estimators.registry`.
        motion: the bounds of the motion; word formats and default gains follow from them.
        output: the estimator's output; None for its first.
        backend: `fixed` for the hardware's words, `float` for the same algorithm in float64 with unrounded gains.
        gains: the estimator's `Gains` in seconds and the motion's unit; None for its default ones.
        count_bits: width of a counter that wraps, bits, 2 to 62: steps are taken modulo its range. None: it does not.
        settings: run-time words by name, as of `set`. Also, in place of `count_bits`, `count_modulus`: the number of
            counts of a counter that wraps, 4 to 2**62, for instance 4000 for counts of 0 to 3999.

    Attributes:
        spec: the axis to which the estimator belongs; its unit of time is explained in `record_time`.
        words: the run-time words by name, with their ranges in seconds.

    Raises:
        TypeError: if an argument is of the wrong type.
        ValueError: if a name is unknown, a value is out of range, or the estimator needs the edges
            (`velocity_of_edges` takes them).
    """

    def __init__(
        self,
        sample_hz: float,
        estimator: str,
        motion: Motion,
        output: str | None = None,
        backend: str = "fixed",
        gains: EstimatorGains | None = None,
        count_bits: int | None = None,
        **settings: ArrayLike,
    ):
        if not isinstance(motion, Motion):
            raise TypeError(f"motion must be a Motion, not {checks.shown(motion)}")
        self._time, self._floating = RecordTime(sample_hz), is_floating(backend)
        check_of_counts(estimator)
        self._output = output_of(estimator, output)
        self._modulus = modulus_of(count_bits, settings.pop("count_modulus", None))
        self.spec = axis_of(motion, self._time, estimator, gains)
        self._design = self.spec.design.estimator
        self.words = self._time.words(word for word in self._design.words if word.name != self._design.output_word())
        self._units = units_of(self._design, self._floating, motion.count, sample_hz)
        self._settings: dict[str, np.ndarray] = {}
        self.reset()
        self.set(**settings)

    def __repr__(self) -> str:
        return f"VelocityEstimator({self._time.sample_hz!r}, {self.spec.estimator!r}, ...)"

    def reset(self) -> None:
        """Forget every count: the next one is the first."""
        self._states: list[tuple] = []
        self._shape: tuple[int, ...] | None = None
        self._last = np.zeros(0, np.int64)
        self._flags = 0

    def set(self, **settings: ArrayLike) -> None:
        """Change run-time words from the next count on, as a host does while the hardware runs.

        Args:
            settings: values by the name of their word, in seconds and the motion's unit. An array has a value for each
                lane: it is broadcast against the shape of the counts without the axis of time.

        Raises:
            TypeError: if a value is not a number.
            ValueError: if a name is no word, or a value does not fit its word; the message says what is accepted.
        """
        arrays = {name: np.array(values) for name, values in settings.items()}
        for name, array in arrays.items():
            if not array.size:
                raise checks.FieldError(name, "must have a value at least")
            for value in array.ravel().tolist():
                self._time.settings(self.words, {name: value})
        self._settings |= arrays

    @property
    def flags(self) -> list[str]:
        """The names of the flags raised in any lane since the start; a flag tells which word saturated."""
        return [name for bit, name in enumerate(self._design.flags) if self._flags >> bit & 1]

    def __call__(self, counts: ArrayLike, axis: int = -1) -> np.ndarray:
        """Return the velocities at further counts, in the motion's unit per second, as float64.

        Args:
            counts: integers; along `axis` they follow one another, and the other axes are independent lanes. The origin
                of a count is free. From one count to the next the change is less than half of the count's range, which
                is eight times the motion's travel.
            axis: the axis of time.

        Returns:
            An array in the shape of the counts; if settings are arrays, in the shape to which both broadcast.

        Raises:
            TypeError: if the counts are not integers.
            ValueError: if the counts have no axis of time, or other lanes than before, or jump.
        """
        (velocity,) = self._taken(counts, axis, Velocities)
        return velocity

    def with_acceleration(self, counts: ArrayLike, axis: int = -1) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocities and the accelerations at further counts; pieces may also be taken in turns with calls.

        Args:
            counts, axis: as of a call.

        Returns:
            Two arrays in the shape that a call returns: velocities in the motion's unit per second, and accelerations
            in the motion's unit per second squared. Both belong to the same moments.

        Raises:
            TypeError: as of a call.
            ValueError: as of a call; and if the estimator has no acceleration, with those that have.
        """
        check_accelerated(self.spec.estimator)
        velocity, acceleration = self._taken(counts, axis, Motions)
        return velocity, acceleration

    def _taken(self, counts: ArrayLike, axis: int, kind: type[Velocities] | type[Motions]) -> tuple[np.ndarray, ...]:
        """Return the outputs of a kind at further counts."""
        counts = np.moveaxis(checks.integers("counts", counts), axis, -1)
        shape = self._lanes(counts.shape[:-1])
        lanes = np.broadcast_to(counts, (*shape, counts.shape[-1]))
        made = kind(*(np.zeros(lanes.shape, np.float64) for _ in kind._fields))
        if lanes.size:
            words = self._in_range(lanes.reshape(-1, lanes.shape[-1]), shape)
            if not self._states:
                self._states = [self._design.start(self._floating) for _ in words]
            for lane, (row, params) in enumerate(zip(words, self._params(shape), strict=True)):
                number = np.float64 if self._floating else np.int64
                words_made = kind(*(np.zeros(len(row), number) for _ in kind._fields))
                self._states[lane], raised = run(params, self._states[lane], row, words_made)
                self._flags |= int(raised)
                for whole, part, unit in zip(made, words_made, self._units, strict=False):
                    whole[np.unravel_index(lane, shape) if shape else ()] = part * unit
        return tuple(np.moveaxis(each, -1, axis) for each in made)

    def _lanes(self, shape: tuple[int, ...]) -> tuple[int, ...]:
        """Return the shape of the lanes of counts and settings together, which is the same in all pieces."""
        shapes = {name: values.shape for name, values in self._settings.items() if values.shape}
        said = "".join(f", and {name} has the shape {each}" for name, each in shapes.items())
        try:
            both = np.broadcast_shapes(shape, *shapes.values())
        except ValueError:
            raise ValueError(f"settings must broadcast: counts have lanes of shape {shape}{said}") from None
        if self._shape not in (None, both):
            raise ValueError(f"lanes must have the shape {self._shape} as before, not {both}{said}")
        return both

    def _in_range(self, counts: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Return counts of shape (lanes, samples) as words of the count's width: steps are taken modulo it."""
        check_span(counts, self._modulus)
        last = counts[:, 0] if self._shape is None else self._last
        whole = unwrapped(np.concatenate([last[:, None], counts], axis=-1), self._modulus)
        half = 1 << (self.spec.count_width - 1)
        steps = np.diff(whole, axis=-1)
        if (wrong := np.argwhere((steps >= half) | (steps < -half))).size:
            lane, sample = wrong[0]
            step = int(steps[lane, sample])
            hint = cure(step) or "; if the counter wraps, give count_bits or count_modulus"
            raise ValueError(
                f"counts must change by less than {half} from sample to sample, half of the range that follows from "
                f"the travel, not by {step} at sample {sample}{f' of lane {lane}' if lane else ''}"
                f"{'' if self._modulus else hint}"
            )
        self._shape, self._last = shape, whole[:, -1].copy()
        return ((whole[:, 1:] + half) & (2 * half - 1)) - half

    def _params(self, shape: tuple[int, ...]) -> list[tuple]:
        """Return the kernel's parameters of every lane."""
        lanes = int(np.prod(shape, dtype=int))
        columns = {name: np.broadcast_to(each, shape).ravel().tolist() for name, each in self._settings.items()}
        if not any(each.shape for each in self._settings.values()):
            return [self._parameters({name: values[0] for name, values in columns.items()})] * lanes
        return [self._parameters({name: values[lane] for name, values in columns.items()}) for lane in range(lanes)]

    def _parameters(self, settings: dict[str, Any]) -> tuple:
        scaled = self._time.settings(self.words, settings)
        if self._floating:
            return self._design.float_params(self.spec.design.gains, self._output, scaled)
        words = {word.name: word.reset for word in self._design.words} | self._design.choose(self._output)
        return self._design.params(words | {name: self.words[name].from_si(settings[name]) for name in settings})
