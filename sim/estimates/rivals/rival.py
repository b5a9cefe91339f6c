"""The common form of the rivals: three kernels each, and the loop that shows a rival the edges of an encoder.

Rivals are velocity estimators that other projects publish. Each is written anew here from what its project says of it,
in float64. A rival is a NamedTuple of its settings; `start`, `edge` and `read` choose their body by its class.
Positions are numbers of cells of the scale, times are seconds, velocities are counts per second.

All rivals get the stamps of this project's clock. Most have a coarser clock of their own, so none loses by this.
"""

from typing import NamedTuple

import numpy as np

from ....model.runtime.compiled import by_type, compiled
from ...world.encoder import level
from ..motions import Encoded


class Seen(NamedTuple):
    """The edges that an estimator sees, in order of time."""

    start: int  # the number of the cell at time 0
    times_s: np.ndarray  # float64, shape (edges,): the stamps
    numbers: np.ndarray  # int64, shape (edges,): the cell after each edge, one above or one below the cell before it


def seen_of(encoded: Encoded, clock_hz: float) -> Seen:
    """Return the edges of an encoder as seen at its pins; a change of both pins at once counts nothing."""
    quarter = {int(level(number)): number & 3 for number in range(4)}
    place = np.array([quarter[pins] for pins in range(4)])
    quarters = place[encoded.edges.levels]
    turns = np.diff(quarters, prepend=place[encoded.start_level]) & 3
    steps = np.where(turns == 3, -1, np.where(turns == 1, 1, 0))
    kept = steps != 0
    times_s = encoded.edges.clocks[kept] / clock_hz
    return Seen(encoded.start_cell, times_s, encoded.start_cell + np.cumsum(steps[kept]))


@by_type
def start(rival, number):
    """Return the state at time 0, in the cell of a number, before any edge."""


@by_type
def edge(rival, state, time_s, number):
    """Return the state after an edge at a time, which leads into the cell of a number."""


@by_type
def read(rival, state, time_s):
    """Read the rival at a time, after all edges up to it: return (state, velocity in counts/s)."""


@compiled
def estimates(rival, seen, sample_hz, every, out):
    """Fill `out` with the velocities (counts/s) at every sample; sample k is at time k / `sample_hz`.

    Args:
        rival: one of the rivals.
        seen: the edges; an edge at the time of a sample is before it.
        sample_hz: the sample rate.
        every: the number of samples from one reading to the next, at least 1; between them the velocity is held.
        out: float64 array, shape (samples,).
    """
    state, taken, velocity = start(rival, seen.start), 0, 0.0
    for k in range(len(out)):
        if k % every == 0:
            now_s = k / sample_hz
            while taken < len(seen.times_s) and seen.times_s[taken] <= now_s:
                state = edge(rival, state, seen.times_s[taken], seen.numbers[taken])
                taken += 1
            state, velocity = read(rival, state, now_s)
        out[k] = velocity
