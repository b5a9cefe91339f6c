"""A capture of edges through an axis, on any backend: their clocks, the axis' clock, and the reference through them.

The clock of the axis is as fast as the ticks of the capture, at most `CLOCK_MAX_HZ`, and fast enough for two edges
never to fall into one clock. So a stamp of an edge is as fine as the capture has it.

The reference. At an edge the position is known to a tick: it is the place of the edge on the scale. The position at a
sample is that on the straight line through the edges on either side. Its derivative is filtered forward and backward as
that of sampled counts is (`reference`).
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...model.spec import AxisSpec
from ...model.stamped import Edges
from ..loop.backends import number_of, opened
from ..recordings.recording import EdgeRecord
from ..world.encoder import level
from .playback import CHUNK, take_all
from .replay_axis import SECOND
from .through_pins import DECODER_CLOCKS

CLOCK_MAX_HZ = 100e6
"""The fastest clock of a replay; edges that are closer are a fault of the recording, not a motion."""


def coarse(edges: EdgeRecord, coarsen: int) -> EdgeRecord:
    """Return the edges of an encoder with counts that are so many times coarser (floor division)."""
    counts, start = edges.counts // coarsen, edges.start // coarsen
    kept = np.diff(counts, prepend=start) != 0
    return EdgeRecord(edges.tick_hz, edges.ticks[kept], counts[kept], start)


def closest_s(edges: EdgeRecord) -> float:
    """Return the shortest time between two edges, s; infinite for fewer than two."""
    return float(np.diff(edges.ticks).min()) / edges.tick_hz if len(edges.ticks) > 1 else np.inf


def with_clock(spec: AxisSpec, edges: EdgeRecord, rate_hz: float) -> AxisSpec:
    """Return an axis with a clock for the edges, at least that which it has.

    Args:
        spec: the axis, in units of its own (`replay_axis`).
        edges: the edges, no two within one clock at `CLOCK_MAX_HZ`.
        rate_hz: the sample rate.
    """
    wanted = max(min(edges.tick_hz, CLOCK_MAX_HZ), 1 / closest_s(edges)) / rate_hz
    clocks = 1 << max(int(np.ceil(np.log2(wanted))), 0)
    return replace(spec, clock_hz=max(clocks, spec.clocks_per_sample) * SECOND)


def position_counts(edges: EdgeRecord, rate_hz: float, samples: int) -> np.ndarray:
    """Return the position at every sample, counts, by straight lines from edge to edge."""
    if not len(edges.ticks):
        return np.full(samples, float(edges.start))
    down = np.diff(edges.counts, prepend=edges.start) < 0
    return np.interp(np.arange(samples) / rate_hz, edges.ticks / edges.tick_hz, edges.counts + down)


def run_edges(
    spec: AxisSpec,
    edges: EdgeRecord,
    rate_hz: float,
    samples: int,
    backend: str,
    output: str,
    progress: Callable[[int], None] | None = None,
) -> tuple[np.ndarray, int, float]:
    """Run edges through the pins of an axis; return (velocity words, or float counts a sample; flags; seconds).

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
    velocity = np.zeros(samples, number_of(backend))
    with opened(spec, backend, spec.design.estimator.choose(output), int(level(edges.start)), short=True) as axis:
        state, taken = axis.state, 0
        # A call with no samples compiles the function, outside the measured time.
        take_all(axis.controller, state, timing, passed, taken, 0, velocity[:0])
        began = time.perf_counter()
        for first in range(0, samples, CHUNK):
            part = velocity[first : first + CHUNK]
            state, taken = take_all(axis.controller, state, timing, passed, taken, first, part)
            if progress:
                progress(first + len(part))
        seconds = time.perf_counter() - began
        return velocity, int(state.flags), seconds
