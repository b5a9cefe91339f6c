"""The axis for a recording, in units of its own, and the run of recorded counts through it on any backend.

In its `AxisSpec` a metre is a *recorded count*, and a second is one of `hardwall.model.record_time`. So the same
hardware serves any recording. If the counts were divided by N, the axis' count is N recorded counts.

Travel and speed of the axis follow from the recording (`hardwall.model.motion.ranges`), and the clocks of a sample from
the fastest change (`hardwall.model.record_axis`).

The backends `float` and `fixed` take the counts as they are. The backend `rtl`, and any estimator that uses the stamps
of edges, gets them through the pins (`through_pins`).
"""

import time
from collections.abc import Callable

import numpy as np

from ...model.encoder.level import level
from ...model.estimators import registry
from ...model.estimators.acceleration import Motions, Velocities, room_of
from ...model.motion import ranges
from ...model.record_axis import idle_axis
from ...model.record_time import RecordTime
from ...model.spec import AxisSpec
from ..loop.backends import number_of, opened, whole
from .through_pins import run_pins


def axis_spec(counts: np.ndarray, count: int, acceleration_max: float, estimator: str, time: RecordTime) -> AxisSpec:
    """Return the specification of the axis for a recording.

    Args:
        counts: the counts that the axis sees.
        count: size of such a count, in recorded counts.
        acceleration_max: C, in recorded counts a sample^2.
        estimator: name of the velocity estimator.
        time: the recording's sample rate.
    """
    travel, speed = ranges(counts)
    return idle_axis(
        time,
        int(np.abs(np.diff(counts)).max()),
        count_m=float(count),
        travel_m=travel * count,
        speed_max_m_per_s=speed * count * time.second,
        acceleration_max_m_per_s2=acceleration_max * time.second**2,
        estimator=estimator,
    )


def needs_pins(estimator: str, backend: str) -> bool:
    """Return whether the counts must go through pins: for the RTL, or for an estimator that uses stamps."""
    return backend == "rtl" or registry.design_of(estimator).uses_stamps()


def run(
    spec: AxisSpec,
    counts: np.ndarray,
    backend: str,
    output: str,
    progress: Callable[[int], None] | None = None,
) -> tuple[Velocities | Motions, int, float]:
    """Run counts through an axis; return (outputs in words, or float counts and samples; flags; seconds).

    Args:
        spec: specification of the axis, with enough clocks in a sample for the largest change.
        counts: the counts that the axis sees, int64.
        backend: one of `backends.BACKENDS`.
        output: the estimator's output.
        progress: function called with the number of samples done.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    design = spec.design.estimator
    choice = design.choose(output)
    if needs_pins(spec.estimator, backend):
        made = room_of(design, counts.shape, number_of(backend))
        with opened(spec, backend, choice, int(level(0)), short=True) as (controller, state, _):
            return made, *run_pins(controller, state, spec.design.timing, counts, made, progress)
    axis = whole(spec, backend, choice)
    axis.run(counts[:0])  # compiles, outside the measured time
    began = time.perf_counter()
    # Where a recording has its origin is nothing to a velocity: in the middle, no count wraps.
    centred = counts - (counts.min() // 2 + counts.max() // 2)
    record = axis.run(centred)
    seconds = time.perf_counter() - began
    if progress:
        progress(len(counts))
    made = Velocities(record.velocity) if record.acceleration is None else Motions(record.velocity, record.acceleration)
    return made, int(record.flags[-1]), seconds
