"""The axis for a recording, in units of its own, and the run of recorded counts through it on any backend.

In its `AxisSpec` a metre is a *recorded count* and a second is `SECOND` *sample periods* (a time in which no stamp of
an edge wraps), so the same hardware serves any recording. If the counts were divided by N, the axis' count is N
recorded counts.

The ranges of the axis follow from the recording, each rounded up to a power of two:

- travel: the span of the recording, at most that of a 32-bit count; beyond it the count wraps, which is no fault;
- speed: the largest change in a sample, plus one count;
- clocks a sample: enough for the force path, and for the fastest change through the decoder
  (`quadrature_speed.max_edge_rate`).

The backends `float` and `fixed` take the counts as they are. The backend `rtl`, and any estimator that uses the stamps
of edges, gets them through the pins (`through_pins`).
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...model.arithmetic.fixed import bits_for
from ...model.encoder.quadrature_speed import max_edge_rate
from ...model.estimators import registry
from ...model.spec import AxisSpec
from ..loop.backends import opened, whole
from ..world.encoder import level
from .through_pins import DECODER_CLOCKS, GLITCH_CLOCKS, run_pins

SECOND = 1 << 10
"""The number of sample periods in a second of the axis."""
TRAVEL_MAX = 2.0**29
"""The travel, in counts, of an axis with a 32-bit count."""
ACCELERATION_RANGE = 2.0**48
"""The largest ratio of travel or speed to C, in counts and samples, at which no estimator's words exceed int64."""


def _power_of_two(value: float) -> float:
    """Return the least power of two that is at least `value`."""
    return 2.0 ** bits_for(value)


def _ranges(counts: np.ndarray) -> tuple[float, float]:
    """Return the travel (counts) and the speed (counts a sample) of the axis for a recording."""
    span = int(counts.max()) - int(counts.min())
    fastest = int(np.abs(np.diff(counts)).max())
    return min(_power_of_two(max(span, 1)), TRAVEL_MAX), _power_of_two(fastest + 1)


def least_bound(counts: np.ndarray) -> float:
    """Return the least C (counts a sample^2) that a recording can give."""
    return max(2 / len(counts) ** 2, max(_ranges(counts)) / ACCELERATION_RANGE)


def axis_spec(counts: np.ndarray, count: int, acceleration_max: float, estimator: str) -> AxisSpec:
    """Return the specification of the axis for a recording.

    Args:
        counts: the counts that the axis sees.
        count: size of such a count, in recorded counts.
        acceleration_max: C, in recorded counts a sample^2.
        estimator: name of the velocity estimator.
    """
    fastest = int(np.abs(np.diff(counts)).max())
    travel, speed = _ranges(counts)
    # The wall and the output stage are idle, so their ranges do not matter.
    spec = AxisSpec(
        clock_hz=SECOND << 16,
        sample_hz=SECOND,
        actuation_hz=SECOND,
        count_m=float(count),
        travel_m=travel * count,
        speed_max_m_per_s=speed * count * SECOND,
        acceleration_max_m_per_s2=acceleration_max * SECOND**2,
        force_max_n=1.0,
        force_resolution_n=1.0,
        stiffness_max_n_per_m=1.0 / count,
        damping_max_n_s_per_m=1.0 / count / SECOND,
        glitch_clocks=GLITCH_CLOCKS,
        estimator=estimator,
    )
    # The edges of an interval begin before its strobe, and must not overlap the force path of the previous interval.
    path = spec.design.latency_to_drive + DECODER_CLOCKS
    clocks = max(path, fastest / max_edge_rate(1.0, GLITCH_CLOCKS))
    return replace(spec, clock_hz=int(_power_of_two(clocks)) * SECOND)


def needs_pins(estimator: str, backend: str) -> bool:
    """Return whether the counts must go through pins: for the RTL, or for an estimator that uses stamps."""
    return backend == "rtl" or registry.design_of(estimator).uses_stamps()


def run(
    spec: AxisSpec,
    counts: np.ndarray,
    backend: str,
    output: str,
    progress: Callable[[int], None] | None = None,
) -> tuple[np.ndarray, int, float]:
    """Run counts through an axis; return (velocity words, or float counts a sample; flags; seconds).

    Args:
        spec: specification of the axis, with enough clocks in a sample for the largest change.
        counts: the counts that the axis sees, int64.
        backend: one of `backends.BACKENDS`.
        output: the estimator's output.
        progress: function called with the number of samples done.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    choice = spec.design.estimator.choose(output)
    if needs_pins(spec.estimator, backend):
        with opened(spec, backend, choice, int(level(0)), short=True) as (controller, state, _):
            return run_pins(controller, state, spec.design.timing, counts, progress)
    axis = whole(spec, backend, choice)
    axis.run(counts[:0])  # compiles, outside the measured time
    began = time.perf_counter()
    # Where a recording has its origin is nothing to a velocity: in the middle, no count wraps.
    record = axis.run(counts - (counts.min() // 2 + counts.max() // 2))
    seconds = time.perf_counter() - began
    if progress:
        progress(len(counts))
    return record.velocity, int(record.flags[-1]), seconds
