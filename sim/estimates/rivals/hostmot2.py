"""LinuxCNC's hostmot2: the counts between two readings, over the time between the stamps of their last edges.

The driver reads count N and the stamp t of the last edge in every period of its servo thread. In counts and seconds:

    N changed:    v = (N - N') / (t - t')         N', t' at the last change
                  v = 0                           if N - N' is one count against the change before
    N unchanged:  |v| is at most 1 / (now - t')   because the next edge has not come

At rest v falls as 1 / time, and is 0 from `timeout_s` on. The first edge after that only sets N' and t'. A count that
flickers about an edge reads 0.

It uses the count and the stamp of the last edge. Usual: a period of 1 ms, and a timeout of 0.5 s.

Source: LinuxCNC, its manual page hostmot2(9), and the driver `mesa-hostmot2/encoder.c`.
"""

from typing import NamedTuple

from ....model.runtime.compiled import compiled
from .rival import edge, read, start

TIMEOUT_S = 0.5


class Hostmot2(NamedTuple):
    """The estimator of hostmot2."""

    timeout_s: float


class Registers(NamedTuple):
    """What the hardware holds, and what the driver keeps of its last change."""

    number: int
    stamp_s: float
    last_number: int
    last_stamp_s: float
    last_change: int  # counts
    moving: bool
    velocity: float


@start.register(Hostmot2)
@compiled
def _start(rival, number):
    return Registers(number, 0.0, number, 0.0, 0, False, 0.0)


@edge.register(Hostmot2)
@compiled
def _edge(rival, state, time_s, number):
    kept = state.last_number, state.last_stamp_s, state.last_change, state.moving, state.velocity
    return Registers(number, time_s, kept[0], kept[1], kept[2], kept[3], kept[4])


@compiled
def _held(state, velocity, moving):
    """Return the state with no change of the count, and its velocity."""
    number, stamp_s = state.last_number, state.last_stamp_s
    return Registers(state.number, state.stamp_s, number, stamp_s, state.last_change, moving, velocity), velocity


@read.register(Hostmot2)
@compiled
def _read(rival, state, time_s):
    change, velocity = state.number - state.last_number, state.velocity
    if change == 0:
        since_s = time_s - state.last_stamp_s
        if not state.moving or since_s >= rival.timeout_s:
            return _held(state, 0.0, False)
        if since_s > 0 and abs(velocity) * since_s > 1:
            velocity = (1.0 if velocity > 0 else -1.0) / since_s
        return _held(state, velocity, True)
    if not state.moving:
        change = 0
    elif abs(change) == 1 and change * state.last_change < 0:
        velocity = 0.0
    elif state.stamp_s > state.last_stamp_s:
        velocity = change / (state.stamp_s - state.last_stamp_s)
    return Registers(state.number, state.stamp_s, state.number, state.stamp_s, change, True, velocity), velocity
