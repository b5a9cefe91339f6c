"""A capture of edges through an axis, on any backend: their clocks, the axis' clock, and the reference through them.

The clock of the axis is as fast as the ticks of the capture, at most `CLOCK_MAX_HZ`. So a stamp of an edge is as fine
as the capture has it, and two edges never fall into one clock: closer ones than `CLOCK_MAX_HZ` allows are refused.

The reference. At an edge the position is known to a tick: it is the place of the edge on the scale. A cubic curve goes
from edge to edge, with the slope of a parabola through each edge and those beside it. The curve is monotone between two
places; where the motion turns, between two edges at one place, it rises by a count at most, as the motion does. Its
derivative is filtered forward and backward, as for sampled counts (`reference`).
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from ...model.encoder.level import level
from ...model.estimators.acceleration import Motions, Velocities, part, room_of
from ...model.record_axis import DECODER_CLOCKS
from ...model.spec import AxisSpec
from ...model.stamped import Edges
from ..loop.backends import number_of, opened
from ..recordings.recording import EdgeRecord
from .playback import CHUNK, take_all

CLOCK_MAX_HZ = 100e6
"""The fastest clock of a replay; edges that are closer are a fault of the recording, not a motion."""

STEEPEST = 3.0
"""The steepest slope of a monotone cubic at its end, in slopes of its chord."""
HIGHEST = 4.0
"""The slope times the time at which a cubic between two equal places rises by a count."""


def coarse(edges: EdgeRecord, coarsen: int) -> EdgeRecord:
    """Return the edges of an encoder with counts that are so many times coarser (floor division)."""
    counts, start = edges.counts // coarsen, edges.start // coarsen
    kept = np.diff(counts, prepend=start) != 0
    return EdgeRecord(edges.tick_hz, edges.ticks[kept], counts[kept], start)


def closest_s(edges: EdgeRecord) -> float:
    """Return the shortest time between two edges, s; infinite for fewer than two."""
    return float(np.diff(edges.ticks).min()) / edges.tick_hz if len(edges.ticks) > 1 else np.inf


def with_clock(spec: AxisSpec, edges: EdgeRecord, rate_hz: float) -> AxisSpec:
    """Return the axis with a clock that suits the edges, at least its own.

    Args:
        spec: the axis, in units of its own (`replay_axis`).
        edges: the edges, no two within one clock at `CLOCK_MAX_HZ`.
        rate_hz: the sample rate.

    Raises:
        ValueError: if the estimator has no words for so many clocks in a sample; the message names the field.
    """
    wanted = min(edges.tick_hz, CLOCK_MAX_HZ) / rate_hz
    clocks = 1 << max(int(np.ceil(np.log2(wanted))), 0)
    return replace(spec, clock_hz=max(clocks, spec.clocks_per_sample) * spec.sample_hz)


def position_counts(edges: EdgeRecord, rate_hz: float, samples: int) -> np.ndarray:
    """Return the position at every sample, counts, by a curve from edge to edge."""
    if len(edges.ticks) < 2:
        return np.full(samples, float(edges.counts[-1] if len(edges.ticks) else edges.start))
    down = np.diff(edges.counts, prepend=edges.start) < 0
    times_s, places = edges.ticks / edges.tick_hz, (edges.counts + down).astype(np.float64)
    curve = scipy.interpolate.CubicHermiteSpline(times_s, places, _slopes(times_s, places))
    return curve(np.clip(np.arange(samples) / rate_hz, times_s[0], times_s[-1]))


def _slopes(times_s: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the slope of the curve at every edge, counts/s. It is the slope of the parabola through the edge and its
    two neighbours. It is limited: the curve stays monotone between two places, and within a count where the motion
    turns."""
    apart_s = np.diff(times_s)
    between = np.diff(places) / apart_s
    steepest = np.where(between == 0, HIGHEST / apart_s, STEEPEST * np.abs(between))
    limit = np.minimum(np.append(steepest, np.inf), np.insert(steepest, 0, np.inf))
    return np.clip(np.gradient(places, times_s), -limit, limit)


def run_edges(
    spec: AxisSpec,
    edges: EdgeRecord,
    rate_hz: float,
    samples: int,
    backend: str,
    output: str,
    progress: Callable[[int], None] | None = None,
) -> tuple[Velocities | Motions, int, float]:
    """Run edges through an axis's pins; return (outputs in words, or float counts and samples; flags; seconds).

    Args:
        spec: the axis, from `with_clock`.
        edges: the edges that it sees.
        rate_hz: the sample rate.
        samples: number of samples to take.
        backend: one of `backends.BACKENDS`.
        output: the estimator's output.
        progress: function called with the number of samples done.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    timing = spec.design.timing
    # An edge at the time of a sample is the last that is counted at its strobe. Rounding moves none beyond it.
    clocks = np.ceil(edges.ticks / edges.tick_hz * rate_hz * timing.clocks_per_sample * (1 - 1e-15)).astype(np.int64)
    passed = Edges(clocks + (timing.strobe - DECODER_CLOCKS), level(edges.counts))
    made = room_of(spec.design.estimator, (samples,), number_of(backend))
    with opened(spec, backend, spec.design.estimator.choose(output), int(level(edges.start)), short=True) as axis:
        state, taken = axis.state, 0
        # A call with no samples compiles the function, outside the measured time.
        take_all(axis.controller, state, timing, passed, taken, 0, part(made, slice(0)))
        began = time.perf_counter()
        for first in range(0, samples, CHUNK):
            last = min(first + CHUNK, samples)
            some = part(made, slice(first, last))
            state, taken = take_all(axis.controller, state, timing, passed, taken, first, some)
            if progress:
                progress(last)
        seconds = time.perf_counter() - began
        return made, int(state.flags), seconds
