"""One axis, from counts to drive: estimator, wall, mass, passivity and output stage, wired as the hardware wires them.

For studies in Python, `Axis` takes and returns numpy arrays and SI units:

    axis = Axis(spec, wall_stiffness=20e3, wall_damping=30.0)
    record = axis.run(counts)
    record.velocity_m_per_s, record.drive_n

The closed loop compiles the kernels beneath it into itself: `step` takes one sample, `run` takes records.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import checks
from ..encoder import quadrature
from ..estimators.acceleration import Accelerated, keep, part, room_of
from ..estimators.estimate import estimate
from ..runtime.compiled import compiled, inlined
from . import output, passivity, virtual_mass, wall
from .design import Design, Params, State
from .designed import DesignedAxis


@inlined
def step(
    params: Params, state: State, seen: quadrature.Seen, restart: int, fault: int, enable: int
) -> tuple[State, float, float]:
    """Take one sample: return (state, velocity, force); the drive is `state.output.drive`.

    Args:
        params: what `Design.params` or `Design.float_params` returns.
        state: what `Design.start` or the previous call returned, of the same number type.
        seen: what the decoder shows at the strobe.
        restart: true if the count was preloaded or shifted since the last sample; the estimator then starts afresh.
        fault: the encoder's sticky flags; any of them forces the drive to zero.
        enable: false forces the drive to zero.
    """
    estimator, velocity, estimator_flags = estimate(params.estimator, state.estimator, seen, restart)
    force = wall.render(params.wall, seen.count, velocity)
    borne = virtual_mass.borne(params.mass, params.wall, params.estimator, estimator, seen.count, force)
    observed, given, acted = passivity.step(
        params.passivity, state.passivity, seen.count, restart, velocity, borne, state.output.drive
    )
    driven, output_flags = output.step(params.output, state.output, given, enable and not fault)
    flags = state.flags | fault | estimator_flags << params.estimator_bit
    flags |= output_flags << params.output_bit | acted << params.passivity_bit
    return State(estimator, observed, driven, flags), velocity, force


@compiled
def run(params, state, counts, faults, made, force, drive, flags):
    """Take a record sample by sample, fill the arrays from `made` on (of the same length) and return the state.

    Args:
        params, state: as of `step`.
        counts, faults: the count of every sample, and the encoder's sticky flags.
        made: the room for what the estimator gives, `acceleration.Velocities` or `acceleration.Motions`.
        force, drive, flags: what comes of every sample.
    """
    for k in range(len(counts)):
        state, velocity, force[k] = step(params, state, quadrature.seen_count(counts[k]), 0, faults[k], 1)
        keep(made, k, velocity, params.estimator, state.estimator)
        drive[k] = state.output.drive
        flags[k] = state.flags
    return state


@dataclass(frozen=True)
class Record:
    """The response of an axis to a record of counts, as arrays of the same shape as the counts.

    Attributes:
        velocity: words of `design.estimator.velocity`; or counts a sample (float64) if the axis is floating.
        acceleration: words of `design.estimator.acceleration`, or counts a sample^2; None if the estimator has none.
        force, drive: force on the handle, force LSB: the wall's, and behind the output stage.
        flags: sticky flags after every sample, bits as in `design.flags`.
    """

    design: Design
    velocity: np.ndarray
    force: np.ndarray
    drive: np.ndarray
    flags: np.ndarray
    acceleration: np.ndarray | None = None

    @property
    def velocity_m_per_s(self) -> np.ndarray:
        lsb = 1.0 if self.velocity.dtype == np.float64 else self.design.estimator.velocity.lsb
        return self.velocity * (lsb * self.design.requirements.velocity_unit_m_per_s)

    @property
    def acceleration_m_per_s2(self) -> np.ndarray | None:
        if self.acceleration is None or not isinstance(self.design.estimator, Accelerated):
            return None
        lsb = 1.0 if self.acceleration.dtype == np.float64 else self.design.estimator.acceleration.lsb
        axis = self.design.requirements
        return self.acceleration * (lsb * axis.velocity_unit_m_per_s * axis.sample_hz)

    @property
    def force_n(self) -> np.ndarray:
        return self.force * self.design.requirements.force_resolution_n

    @property
    def drive_n(self) -> np.ndarray:
        return self.drive * self.design.requirements.force_resolution_n


class Axis:
    """An axis with its run-time parameters set, in SI units by port name; see `Design.words`.

    Args:
        spec: the axis, an `AxisSpec`; or the `AxesSpec` of several, for one of them.
        floating: true for the same algorithms in float64, with gains unrounded and the estimator unsaturated.
        si: run-time parameters, e.g. `wall_stiffness=20e3` (N/m); the others keep their reset values (the wall is off).

    Attributes:
        spec, design: the specification, and its `design.Design`.
        words: run-time words by port name.
        params: parameters of `step`.

    Raises:
        TypeError: if `spec` is neither, or a value is not a number.
        ValueError: if a name is unknown or a value is out of range.
    """

    def __init__(self, spec: DesignedAxis, floating: bool = False, **si: float):
        if not isinstance(spec, DesignedAxis):
            raise TypeError(f"spec must be an AxisSpec, not {spec!r}")
        self.spec, self.design = spec, spec.design
        self.words = words = self.design.encode(**si)
        self.floating = floating
        self.params = self.design.float_params(words, si) if floating else self.design.params(words)

    def run(self, counts: ArrayLike) -> Record:
        """Run records of counts from the start state.

        Args:
            counts: integers, shape (samples,), or (lanes, samples) for independent axes side by side. If a count
                exceeds its width it wraps, as in the hardware: from there on the flag count_wrapped is up and the drive
                is zero. If a count changes by more than the clocks of a sample, the flag of an illegal step is up in
                the same way. A count may not jump by half of its range.

        Raises:
            TypeError: if the counts are not integers.
            ValueError: if the counts do not have one or two dimensions, or jump; or if the estimator needs stamps of
                edges: then use `hardwall.model.stamped.run`.
        """
        if self.design.estimator.uses_stamps():
            raise ValueError(
                f"estimator must be one that needs only counts, not {self.spec.estimator!r}; "
                f"hardwall.model.stamped.run takes the edges that it needs"
            )
        spec = self.spec
        checked, wrapped, outrun = checks.lanes_of_counts(counts, spec.count_width, spec.clocks_per_sample)
        lanes = np.atleast_2d(checked)
        faults = np.atleast_2d(wrapped * quadrature.WRAPPED | outrun * quadrature.ILLEGAL)
        number = np.float64 if self.floating else np.int64
        made = room_of(self.design.estimator, lanes.shape, number)
        force, drive = np.zeros(lanes.shape, number), np.zeros(lanes.shape, number)
        flags = np.zeros(lanes.shape, np.int64)
        for lane in range(len(lanes)):
            start = self.design.start(self.floating)
            outputs = part(made, lane), force[lane], drive[lane], flags[lane]
            run(self.params, start, lanes[lane], faults[lane], *outputs)
        shaped = [array.reshape(checked.shape) for array in (made[0], force, drive, flags, *made[1:])]
        return Record(self.design, *shaped)
