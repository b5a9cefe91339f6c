"""A watch over the stamps of edges: whether an encoder emits its edges in bursts, as no handle moves.

Some interpolators emit their edges on a clock of their own, several at once. Neither the time between two edges nor a
silence then says how fast the axis is. The watch tells such an encoder from others by an acceleration:

    a silence     the age of the last edge at the last sample before the next edge
    a jolt        soon after a silence, three edges in one direction within `span` clocks, which is less than a quarter
                  of the silence
    bursts        EVENTS jolts after silences longer than the estimator tolerates, each within MEMORY_S of the one
                  before; until none comes for that time

Derivation. A is STEEPER times the axis's bound on the acceleration, and q a count. Edges are in places that the decoder
accepts: two neighbours are less than 2 q apart, and three span more than q. Then:

- In a silence of S the axis stays within 2 q, so it is at some time no faster than 2 q / S. Until the end of the
  silence it gains at most 2 sqrt(A q), because it has at most 2 q for this; and until t later A t more.
- Three edges in a time of T < S / 4 mean a speed above q / T. 2 q / S is less than half of it.
- So a motion with less than A has T > q / (4 sqrt(A q) + 2 A t) after every silence. `span` is this bound, with t the
  `window` of samples in which the three edges must come; the window is as long as the bound for t = 0, and a sample.

Stamps are late by less than a clock, which is taken off. At a constant speed no edges are a jolt, wherever they are. An
encoder whose bursts have two edges or none is not told from one with edges out of place: its edges are at most two
counts from their place. An estimator with a memory or a window reads the mean of bursts that are short against it, and
tolerates their silence. Where bursts are found, its estimate is not valid.

An estimator that bounds the speed by silence ignores silence for `doubt_samples` after a burst. A restart, and the
first sample, forget everything.
"""

import math
from typing import NamedTuple

from ..arithmetic.fixed import wrap
from ..encoder.quadrature import stamp_of
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled

STEEPER = 100
"""The acceleration that no axis has, in its own bound."""
EDGES = 3
"""The edges of a jolt."""
EVENTS = 3
"""Jolts that are bursts."""
MEMORY_S = 0.25
"""How long a jolt is remembered."""
MOVED_BITS = 8
"""Bits of the counts since a silence, which are compared with EDGES."""
DOUBT_S, DOUBT_SAMPLES = 1e-3, 16
"""How long silence is no evidence after it was refuted: so long, and at least so many samples."""
LATENCY = 3
"""Clocks from the strobe to the result: see `hardwall.hdl.estimators.bursts`."""


class Limits(NamedTuple):
    """The limits of the watch: bits of count and stamp; clocks of three edges, and of a silence; samples."""

    count_width: int
    stamp_width: int
    span: int
    tolerated: int
    window: int
    memory: int


class Watch(NamedTuple):
    """The state: the last sample, and the edges and counts before the ones that are judged.

    `stamp`, `edge` and `count` are of the last sample, `quiet` is the age of its last edge. `silence` and `base` are
    the quiet and the count before the edges of the last `window` samples. `events` is the number of remembered jolts;
    `left` is the number of samples until they are forgotten. Ages are cut off at what every jolt has.
    """

    running: int
    stamp: int
    edge: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    quiet: int
    silence: int
    base: int
    window: int
    events: int
    left: int
    jolt: int  # whether this sample has one


NOTHING = Watch(*(0 for _ in Watch._fields))


def doubt_samples(axis: AxisRequirements) -> int:
    """Return for how many samples silence is no evidence after it was refuted."""
    return max(round(DOUBT_S * axis.sample_hz), DOUBT_SAMPLES)


def limits(axis: AxisRequirements, tolerated_s: float = 0.0) -> Limits:
    """Return the watch's limits for an axis, derived as the module says, and the silence that is tolerated."""
    steepest, q = STEEPER * axis.acceleration_max_m_per_s2, axis.count_m
    gained = 4 * math.sqrt(steepest * q)
    # The edges of a window are younger than half of the stamp's range.
    most = max((1 << axis.stamp_width - 1) // axis.clocks_per_sample, 1)
    window = min(1 + math.ceil(q / gained * axis.sample_hz), most)
    span_s = q / (gained + 2 * steepest * window / axis.sample_hz)
    span = min(math.floor(span_s * axis.clock_hz), 1 << axis.stamp_width - 3)
    memory = max(round(MEMORY_S * axis.sample_hz), 1)
    tolerated = min(round(tolerated_s * axis.clock_hz), 1 << axis.stamp_width - 1)
    return Limits(axis.count_width, axis.stamp_width, max(span - 1, 0), tolerated, window, memory)


@compiled
def longest(limits):
    """Return the age at which silences are cut off: any three edges after it are a jolt."""
    return max(4 * limits.span + 5, limits.tolerated + 1)


@compiled
def watch(limits, state, seen, restart):
    """Take a sample: return (state, whether edges come in bursts)."""
    modulus = (1 << limits.stamp_width) - 1
    stamp, before = stamp_of(seen, seen.edge), stamp_of(seen, seen.edge ^ 2)
    quiet = min((seen.stamp - stamp) & modulus, longest(limits))
    if restart or not state.running:
        return Watch(1, stamp, seen.edge, seen.count, quiet, 0, 0, 0, 0, 0, 0), 0
    silence, base, window = state.silence, state.base, max(state.window - 1, 0)
    left = max(state.left - 1, 0)
    events = state.events if left else 0
    news = stamp != state.stamp or seen.edge != state.edge
    if news and (not window or state.quiet > silence):
        silence, base, window = state.quiet, state.count, limits.window
    span = (stamp - before) & modulus
    moved = wrap(seen.count - base, min(MOVED_BITS, limits.count_width))
    close = span <= limits.span and 4 * (span + 1) < silence
    jolt = int(news and window and seen.run >= EDGES and abs(moved) >= EDGES and close)
    if jolt:
        if silence > limits.tolerated:
            events, left = min(events + 1, EVENTS), limits.memory
        silence, window = 0, 0
    after = Watch(1, stamp, seen.edge, seen.count, quiet, silence, base, window, events, left, jolt)
    return after, int(events == EVENTS)
