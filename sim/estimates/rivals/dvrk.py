"""dVRK, the da Vinci Research Kit: the time of the last full cycle, and a prediction from two cycles.

Its FPGA keeps the times q1 to q5 of the last five quarter cycles; q1 is the newest. Each has its direction and its kind
of edge. In counts and seconds, with r the time since the last edge and d the direction:

    P        = q1 + q2 + q3 + q4            the time between two edges of one kind
    measured = d 4 / P                      0 if a direction of the four differs, or P overflows
    a        = d 8 (q5 - q1) / (P P' (q1 + q5)),   P' = q2 + q3 + q4 + q5
    predicted = measured + a (P / 2 + r)    never of the other sign, and at most 1 / r

A full cycle is free of the errors that repeat every four edges. The acceleration is the difference of two cycles'
velocities over the time between their middles. It is 0 if q1 and q5 are of different edges or directions.

At rest `measured` keeps its last value until the next edge. `predicted` is at most 1 / r, so at most 0.73 counts/s
where the counter of r ends; after braking it reaches 0. After a reversal both are 0 until four quarters are of one
direction.

It uses the stamps of edges. It has no setting: counters of 26 bits at 49.152 MHz give the longest time. The host takes
`predicted`, which the source calls the most accurate.

Source: the firmware's `EncPeriod.v` (jhu-cisst/mechatronics-firmware, Rev 7 and later) and `EncoderVelocity` of
jhu-cisst/mechatronics-software; J. Y. Wu, Z. Chen, A. Deguet, P. Kazanzides, *FPGA-Based Velocity Estimation for
Control of Robots with Low-Resolution Encoders*, IROS 2018.
"""

import math
from typing import NamedTuple

from ....model.runtime.compiled import compiled
from .rival import edge, read, start

MEASURED, PREDICTED, ACCELERATION = range(3)
LONGEST_S = ((1 << 26) - 1) / 49.152e6
"""The longest time that a counter holds."""


class Dvrk(NamedTuple):
    """The estimator of dVRK; `output` is `MEASURED`, `PREDICTED` or `ACCELERATION` (counts/s^2)."""

    output: int


class Quarters(NamedTuple):
    """The last five quarter cycles, the newest first."""

    number: int
    edge_s: float
    times_s: tuple[float, float, float, float, float]
    ways: tuple[int, int, int, int, int]  # 1 up, -1 down
    kinds: tuple[int, int, int, int, int]  # 0 to 3: A rises, B rises, A falls, B falls; -1: no edge yet


@start.register(Dvrk)
@compiled
def _start(rival, number):
    longest = (LONGEST_S, LONGEST_S, LONGEST_S, LONGEST_S, LONGEST_S)
    return Quarters(number, -math.inf, longest, (1, 1, 1, 1, 1), (-1, -1, -1, -1, -1))


@edge.register(Dvrk)
@compiled
def _edge(rival, state, time_s, number):
    way = 1 if number > state.number else -1
    # Upwards edge n leads into cell n. Downwards, edge n leads out of cell n, and its level changes the other way.
    kind = number & 3 if way > 0 else (number + 3) & 3
    times_s, ways, kinds = state.times_s, state.ways, state.kinds
    return Quarters(
        number,
        time_s,
        (min(time_s - state.edge_s, LONGEST_S), times_s[0], times_s[1], times_s[2], times_s[3]),
        (way, ways[0], ways[1], ways[2], ways[3]),
        (kind, kinds[0], kinds[1], kinds[2], kinds[3]),
    )


@compiled
def _cycle_s(state):
    return state.times_s[0] + state.times_s[1] + state.times_s[2] + state.times_s[3]


@compiled
def _measured(state):
    ways, cycle_s = state.ways, _cycle_s(state)
    same = ways[0] == ways[1] and ways[0] == ways[2] and ways[0] == ways[3]
    return ways[0] * 4.0 / cycle_s if same and cycle_s <= LONGEST_S else 0.0


@compiled
def _acceleration(state):
    newest_s, oldest_s, cycle_s = state.times_s[0], state.times_s[4], _cycle_s(state)
    other_edge = state.kinds[0] != state.kinds[4] or state.ways[0] != state.ways[4]
    if cycle_s > LONGEST_S or other_edge:
        return 0.0
    before_s = LONGEST_S if oldest_s >= LONGEST_S else cycle_s - newest_s + oldest_s
    return state.ways[0] * 8.0 * (oldest_s - newest_s) / (cycle_s * before_s * (newest_s + oldest_s))


@compiled
def _predicted(state, time_s):
    velocity, since_s = _measured(state), min(time_s - state.edge_s, LONGEST_S)
    if velocity == 0.0:
        return 0.0
    way = 1.0 if velocity > 0 else -1.0
    speed = way * (velocity + _acceleration(state) * (_cycle_s(state) / 2 + since_s))
    speed = max(speed, 0.0)
    return way * (1 / since_s if speed * since_s > 1 else speed)


@read.register(Dvrk)
@compiled
def _read(rival, state, time_s):
    if rival.output == MEASURED:
        return state, _measured(state)
    return state, _predicted(state, time_s) if rival.output == PREDICTED else _acceleration(state)
