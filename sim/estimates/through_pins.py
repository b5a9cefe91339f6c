"""Recorded counts through a controller's pins.

The change from one sample to the next becomes edges, spread evenly over the interval and moved by the decoder's
latency. So the count at every strobe is the recorded count. The decoder starts at the first sample.
"""

import time
from collections.abc import Callable

import numpy as np

from ...model.axis.design import Timing, strobe_of
from ...model.encoder.level import level
from ...model.estimators.acceleration import Motions, Velocities
from ...model.record_axis import DECODER_CLOCKS
from ...model.runtime.compiled import compiled
from ...model.stamped import room_for
from ..loop.controllers import sample, sample_quietly, taken_off
from .outputs import write

CHUNK_CLOCKS = 1 << 20
"""The number of clocks between two reports of progress."""


@compiled
def _append_edges(count, next_count, start, clocks, edges, n_edges):
    """Append the edges between two counts, spread over clocks start + 1 to start + clocks; return the new `n_edges`."""
    change = next_count - count
    total, direction = abs(change), 1 if change > 0 else -1
    for i in range(total):
        count += direction
        edges.clocks[n_edges] = start + 1 + (2 * i + 1) * clocks // (2 * total)
        edges.levels[n_edges] = level(count)
        n_edges += 1
    return n_edges


@compiled
def through_pins(controller, state, timing, counts, made, edges, n_edges, first, until):
    """Run samples `first` to `until` of a record through a controller's pins; return (state, number of edges left).

    Args:
        controller, state: the controller and its state (`sim.loop.controllers`).
        timing: a `design.Timing` whose sample has clocks enough for the largest change and for both latencies together.
        counts: int64 array; the pins begin at the level of count 0, so the first count must be 0.
        made: `Velocities` or `Motions` with room for every sample.
        edges: `Edges` that the controller has not taken yet, with room for twice the largest change.
        n_edges: number of these edges.
        first, until: the samples to run.
    """
    for k in range(first, until):
        strobe = strobe_of(timing, k)
        if k + 1 < len(counts):
            start = strobe - DECODER_CLOCKS
            n_edges = _append_edges(counts[k], counts[k + 1], start, timing.clocks_per_sample, edges, n_edges)
        if n_edges > 0:
            state, taken = sample(controller, state, edges, n_edges, strobe)
            n_edges = taken_off(edges, n_edges, taken)
        else:
            state = sample_quietly(controller, state, strobe)
        write(made, k, controller, state)
    return state, n_edges


def run_pins(
    controller,
    state,
    timing: Timing,
    counts: np.ndarray,
    made: Velocities | Motions,
    progress: Callable[[int], None] | None = None,
) -> tuple[int, float]:
    """Run a whole record through a controller's pins, and fill `made`; return (flags, seconds)."""
    relative = counts - counts[0]
    edges = room_for(2 * int(np.abs(np.diff(relative)).max()) + 1)
    # A call with no samples compiles the function, outside the measured time.
    through_pins(controller, state, timing, relative, made, edges, 0, 0, 0)
    began, n_edges = time.perf_counter(), 0
    chunk = max(1, CHUNK_CLOCKS // timing.clocks_per_sample)
    for first in range(0, len(counts), chunk):
        until = min(first + chunk, len(counts))
        state, n_edges = through_pins(controller, state, timing, relative, made, edges, n_edges, first, until)
        if progress:
            progress(until)
    return int(state.flags), time.perf_counter() - began
