"""Recorded counts through a controller's pins.

The change from one sample to the next becomes edges that are spread evenly over the interval, each moved by the
decoder's latency so that the count at every strobe is the recorded one. The first sample is where the decoder starts.
"""

import time
from collections.abc import Callable

import numpy as np

from ...model import quadrature
from ...model.compiled import compiled
from ...model.spec import AxisSpec
from ..loop.controllers import sample, sample_quietly
from ..world.encoder import level

GLITCH_CLOCKS = 0
DECODER_CLOCKS = quadrature.latency(GLITCH_CLOCKS)
"""An edge this long before a strobe is the last that is counted at it."""
CHUNK_CLOCKS = 1 << 20
"""Clocks between two looks at progress."""


@compiled
def _append_edges(count, next_count, start, clocks, edge_clocks, edge_levels, n_edges):
    """Append the edges from one count to another, spread over clocks start + 1 to start + clocks; return how many."""
    change = next_count - count
    total, direction = abs(change), 1 if change > 0 else -1
    for i in range(total):
        count += direction
        edge_clocks[n_edges] = start + 1 + (2 * i + 1) * clocks // (2 * total)
        edge_levels[n_edges] = level(count)
        n_edges += 1
    return n_edges


@compiled
def through_pins(controller, state, counts, clocks, latency, edges, n_edges, velocity, first, until):
    """Take samples `first` to `until` of a record through a controller's pins; return (state, edges left).

    Args:
        controller, state: of `sim.loop.controllers`.
        counts: int64 array; the pins begin at the level of count 0, so the first count is to be 0.
        clocks: clocks a sample; at least the largest change, and `latency` and the decoder's latency together.
        latency: clocks from the strobe to the changed drive.
        edges: a pair of int64 arrays for twice the largest change: edges on their way to the controller.
        n_edges: edges in them, not yet taken.
        velocity: array that takes the velocity of every sample.
    """
    edge_clocks, edge_levels = edges
    for k in range(first, until):
        strobe = (k + 1) * clocks - 1
        if k + 1 < len(counts):
            start = strobe - DECODER_CLOCKS
            n_edges = _append_edges(counts[k], counts[k + 1], start, clocks, edge_clocks, edge_levels, n_edges)
        if n_edges > 0:
            state, taken = sample(controller, state, edge_clocks, edge_levels, n_edges, strobe, strobe + latency)
            n_edges -= taken
            for i in range(n_edges):
                edge_clocks[i] = edge_clocks[taken + i]
                edge_levels[i] = edge_levels[taken + i]
        else:
            state = sample_quietly(controller, state, strobe, strobe + latency)
        velocity[k] = state.velocity
    return state, n_edges


def run_pins(controller, state, spec: AxisSpec, counts: np.ndarray, progress: Callable[[int], None] | None = None):
    """Take a whole record through a controller's pins: return (velocity words, flags, seconds)."""
    relative = counts - counts[0]
    velocity = np.zeros(len(counts), np.asarray(state.velocity).dtype)
    room = 2 * int(np.abs(np.diff(relative)).max()) + 1
    edges = np.zeros(room, np.int64), np.zeros(room, np.int64)
    fixed = spec.clocks_per_sample, spec.design.latency_to_drive, edges
    # Compiling is not running: a call with nothing to do keeps it out of the time.
    through_pins(controller, state, relative, *fixed, 0, velocity, 0, 0)
    began, n_edges = time.perf_counter(), 0
    chunk = max(1, CHUNK_CLOCKS // spec.clocks_per_sample)
    for first in range(0, len(counts), chunk):
        until = min(first + chunk, len(counts))
        state, n_edges = through_pins(controller, state, relative, *fixed, n_edges, velocity, first, until)
        if progress:
            progress(until)
    return velocity, int(state.flags), time.perf_counter() - began
