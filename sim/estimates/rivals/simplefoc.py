"""SimpleFOC: the speed of its class `Encoder`, or of its base class `Sensor`, through a first-order low pass.

`Encoder` mixes counts and times. In counts and seconds, with t the stamp of the last edge before each reading:

    v = (N - N') / (t - t')    if N changed and t - t' is more than half the period; else v is kept
    v = 0                      from 0.1 s without an edge on

Here N' and t' are of the reading before. `Sensor` has no stamps. Its v is the change of the count over the time since
the last change, at most every 100 us. While the count stays, v stays: at rest `Sensor` keeps its last speed for ever.

The low pass: y <- a y + (1 - a) v, with a = T / (T + period).

Usual: T = 5 ms, and a reading in every turn of the main loop, about 1 ms on a small processor.

Source: SimpleFOC (simplefoc/Arduino-FOC), the classes `Encoder`, `Sensor` and `LowPassFilter`, `defaults.h`, and the
page *Low-pass velocity filter theory* of its documentation.
"""

from typing import NamedTuple

from ....model.runtime.compiled import compiled
from .rival import edge, read, start

FILTER_S = 5e-3
LOOP_S = 1e-3
"""The time of a turn of the main loop; also what the source assumes for a first reading, which has no turn before."""
SILENT_S = 0.1
APART_US = 100
"""The least time of a difference, in the whole microseconds that the source counts."""


class Mixed(NamedTuple):
    """The speed of `Encoder`; `filter_s` is T."""

    filter_s: float


class Pulses(NamedTuple):
    """The state of `Mixed`: the pulses now, at the last reading, and the speeds."""

    number: int
    stamp_s: float
    last_number: int
    last_stamp_s: float
    read_s: float
    velocity: float
    filtered: float


class Differences(NamedTuple):
    """The speed of `Sensor`; `filter_s` is T."""

    filter_s: float


class Angles(NamedTuple):
    """The state of `Differences`: the position now and at the last change, and the speeds."""

    number: int
    last_number: int
    last_s: float
    read_s: float
    velocity: float
    filtered: float


@compiled
def _period_s(time_s, read_s):
    return time_s - read_s if time_s > read_s else LOOP_S


@compiled
def _smooth(filtered, velocity, filter_s, period_s):
    kept = filter_s / (filter_s + period_s)
    return kept * filtered + (1 - kept) * velocity


@start.register(Mixed)
@compiled
def _start(rival, number):
    return Pulses(number, 0.0, number, 0.0, 0.0, 0.0, 0.0)


@edge.register(Mixed)
@compiled
def _edge(rival, state, time_s, number):
    return Pulses(number, time_s, state.last_number, state.last_stamp_s, state.read_s, state.velocity, state.filtered)


@read.register(Mixed)
@compiled
def _read(rival, state, time_s):
    period_s, velocity = _period_s(time_s, state.read_s), state.velocity
    change, apart_s = state.number - state.last_number, state.stamp_s - state.last_stamp_s
    if change != 0 and apart_s > period_s / 2:
        velocity = change / apart_s
    if time_s - state.stamp_s > SILENT_S:
        velocity = 0.0
    filtered = _smooth(state.filtered, velocity, rival.filter_s, period_s)
    return Pulses(state.number, state.stamp_s, state.number, state.stamp_s, time_s, velocity, filtered), filtered


@start.register(Differences)
@compiled
def _start_differences(rival, number):
    return Angles(number, number, 0.0, 0.0, 0.0, 0.0)


@edge.register(Differences)
@compiled
def _edge_differences(rival, state, time_s, number):
    return Angles(number, state.last_number, state.last_s, state.read_s, state.velocity, state.filtered)


@read.register(Differences)
@compiled
def _read_differences(rival, state, time_s):
    last_number, last_s, velocity = state.last_number, state.last_s, state.velocity
    if round((time_s - last_s) * 1e6) >= APART_US and state.number != last_number:
        velocity = (state.number - last_number) / (time_s - last_s)
        last_number, last_s = state.number, time_s
    filtered = _smooth(state.filtered, velocity, rival.filter_s, _period_s(time_s, state.read_s))
    return Angles(state.number, last_number, last_s, time_s, velocity, filtered), filtered
