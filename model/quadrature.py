"""Quadrature decoder: pins to count, clock stamps, index and faults; twin of `hardwall.hdl.quadrature`.

One `step` is one clock: the pins are those just before the clock edge, the returned state is that of the registers
just after it. Words of one bit per channel hold A in bit 0, B in bit 1 and Z in bit 2.

How fast an encoder may turn
----------------------------
With rate r in edges (of A and B together) a clock, each level of A and of B lasts 2/r clocks, and one edge follows the
other after 1/r. A level is accepted if it is seen at glitch_clocks + 1 clocks, which is certain from that many clocks
of length; two edges are seen apart, in their order, if they are at least one clock apart. Every accepted edge is
delayed alike, so the count is exact for r <= 1 / max(1, (glitch_clocks + 1) / 2): `max_edge_rate`.

What is promised beyond it, for any motion, steady or not, in which each level of A and of B lasts a clock or more (for
ideal quadrature: below 2 edges a clock), for any glitch lengths, also if they change on the way: *no count is wrong
before a flag is up*. For then every edge is seen, and there are three ways to lose one. Two edges accepted in
one clock are `illegal` in the clock in which they are not counted. A pulse on one channel that the filter rejects, with
an edge of the other between its two ends, is `overspeed` as it ends; the edge within it is counted later than that. A
pulse that is rejected without such an edge came and went at one level of the other channel: there and back, nothing is
lost, no flag. (A flag may thus rise with no count lost, if noise on one channel meets an edge of the other.)

Sampled quadrature at r and at r - 4 edges a clock is the same record. So no synchronous decoder can tell a motion
within `max_edge_rate` of a multiple of 4 edges a clock from a slow one; at every other steady rate of ideal
quadrature a flag is up within `clocks_to_fault`.
"""

import math
from typing import NamedTuple

import numpy as np

from .arithmetic.fixed import wrap
from .compiled import compiled


class Params(NamedTuple):
    """Widths of the registers, in bits: `count_width` and `stamp_width` at most 62."""

    count_width: int
    stamp_width: int
    fault_width: int


class State(NamedTuple):
    """Every register of the decoder; up to `illegal_count` also its outputs, by the same names."""

    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    index_count: int
    index_armed: int
    index_latched: int
    stamp: int
    stamp_a_rise: int
    stamp_b_rise: int
    stamp_a_fall: int
    stamp_b_fall: int
    stepped: int
    edge: int  # of the last counted edge: A_RISE, B_RISE, A_FALL or B_FALL
    down: int  # whether it counted -1
    run: int  # edges in a row that counted that way, at most RUN_MAX; 0: none, or what came before is not known
    illegal: int
    overspeed: int
    illegal_count: int
    first: int  # stages of the synchronisers
    second: int
    previous: int  # the second stage of A and B, a clock ago
    level: int  # filtered
    moved: int  # channels whose filtered level has just changed
    up: int  # whether that was an edge of increasing count, before `invert`
    pending: int  # channels that have left their filtered level
    held_a: int  # for how many clocks
    held_b: int
    held_z: int
    crossed: int  # pending channels that have seen an edge of the other one of A and B since
    starting: int  # clocks until the synchronisers are filled


A_RISE, B_RISE, A_FALL, B_FALL = range(4)
RUN_MAX = 4
"""A full cycle of the encoder: with so many edges one way, each of the four stamps is of this cycle."""
N_OUTPUTS = State._fields.index("first")


class Seen(NamedTuple):
    """What an estimator may use of the decoder at a strobe: outputs of the hardware, by the same names.

    The last edge stands at the scale's edge number `count + down` (cell n lies between edges n and n + 1), and was
    decoded at the stamp of its kind, `stamp - that` clocks ago, modulo the stamp's width; of kind `edge`. The `run - 1`
    edges before it stand a count each farther back, and their kinds and stamps go back likewise.
    """

    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    stamp: int
    stamp_a_rise: int
    stamp_b_rise: int
    stamp_a_fall: int
    stamp_b_fall: int
    edge: int
    down: int
    run: int


START = State(*(3 if name == "starting" else 0 for name in State._fields))


@compiled
def seen(state: State) -> Seen:
    """Return what an estimator sees of a decoder's `state`."""
    return Seen(
        state.count,
        state.stamp,
        state.stamp_a_rise,
        state.stamp_b_rise,
        state.stamp_a_fall,
        state.stamp_b_fall,
        state.edge,
        state.down,
        state.run,
    )


@compiled
def stamp_of(record, kind):
    """Return the last stamp of a kind of edge, of a `Seen` or what else has the four fields."""
    low = record.stamp_b_rise if kind & 1 else record.stamp_a_rise
    high = record.stamp_b_fall if kind & 1 else record.stamp_a_fall
    return high if kind & 2 else low


@compiled
def seen_count(count: int) -> Seen:
    """Return what an estimator sees that uses the count alone."""
    return Seen(count, 0, 0, 0, 0, 0, 0, 0, 0)


def latency(glitch_clocks: int) -> int:
    """Return the clock edges from the first that sees a pin changed to the new count, both included.

    Two in the synchroniser, `glitch_clocks` + 1 in the filter, one to decode and add.
    """
    return glitch_clocks + 4


def max_edge_rate(clock_hz: float, glitch_clocks: int, edge_error: float = 0.0) -> float:
    """Return the highest steady rate of edges, in Hz, at which the count is exact and no flag rises.

    `edge_error` is how far, in counts, the encoder's edges may be from their ideal places. It shortens the shortest
    level from 2 to 2 - 2 `edge_error` counts, the least distance of two edges from 1 to 1 - 2 `edge_error`.

    Raises:
        ValueError: if `edge_error` is not from 0 to less than 0.5.
    """
    if not 0 <= edge_error < 0.5:
        raise ValueError(f"edge_error must be from 0 to less than 0.5 counts, not {edge_error!r}")
    apart = 1 / (1 - 2 * edge_error)
    long = (glitch_clocks + 1) / (2 - 2 * edge_error)
    return clock_hz / max(apart, long)


def clocks_to_fault(edges_per_clock: float, glitch_clocks: int) -> float:
    """Return within how many clocks a flag is up at a steady rate; infinite where there may be none.

    Holds for ideal quadrature of any rate, and with edges out of place as long as each level lasts a clock or more.
    The record has rate s, the distance of `edges_per_clock` from the nearest multiple of 4. With a filter: m (even)
    levels of a channel in a row last 2m/s clocks and hold fewer than 2m/s + 1 samples, so not all can be seen at
    glitch_clocks + 1 clocks once m >= 1 / (glitch_clocks + 1 - 2/s); one that is running at the start and one
    out of place come before. Without: m clocks hold more than ms - 2 edges, so one has two once m >= 2 / (s - 1).
    Two clocks in the synchroniser, one in the filter and one to decode follow.
    """
    rate = abs(edges_per_clock - 4 * round(edges_per_clock / 4))
    if rate <= max_edge_rate(1.0, glitch_clocks):
        return math.inf
    if glitch_clocks == 0:
        return math.ceil(2 / (rate - 1)) + 4
    levels = 2 * math.ceil(0.5 / (glitch_clocks + 1 - 2 / rate)) + 2
    return math.ceil(levels * 2 / rate) + 4


@compiled
def step(params, state, a, b, z, glitch_clocks=0, invert=0, preload=0, preload_count=0, arm=0, clear=0):
    """Return the state after one clock.

    a, b, z: the pins just before the clock edge. The controls are the inputs of the hardware, by the same names.
    """
    seen = state.second
    # While the synchronisers fill, what they show is taken for what has been accepted already.
    level = seen if state.starting > 0 else state.level

    # Filter. A channel is accepted at the (glitch_clocks + 1)th clock in a row away from its level.
    differs = seen ^ level
    ripe = (
        int(state.held_a >= glitch_clocks)
        | int(state.held_b >= glitch_clocks) << 1
        | int(state.held_z >= glitch_clocks) << 2
    )
    accepted = differs & ripe
    pending = differs & ~ripe

    # A pulse is rejected when its channel comes back still pending.
    edges = (seen ^ state.previous) & 3
    crossing = state.crossed | (edges & 1) << 1 | edges >> 1
    outrun = int((state.pending & ~differs & crossing) != 0)

    # Decode. Exactly one of A and B has moved, or nothing is counted.
    one = (state.moved ^ state.moved >> 1) & 1
    both = state.moved & state.moved >> 1 & 1
    base = preload_count if preload else state.count
    down = ~(state.up ^ invert) & 1
    count = wrap(base + one * (1 - 2 * down), params.count_width)
    one_a = one & state.moved
    one_b = one & state.moved >> 1
    risen = level & state.moved & 3
    kind = one_b + 2 * int(risen == 0)
    run = min(state.run + 1, RUN_MAX) if state.down == down else 1
    indexed = state.index_armed & ~arm & (state.moved & level) >> 2
    illegal_count = (0 if clear else state.illegal_count) + both
    return State(
        count,
        count if indexed else state.index_count,
        arm | (state.index_armed & ~indexed),
        ~arm & (state.index_latched | indexed),
        (state.stamp + 1) & ((1 << params.stamp_width) - 1),
        state.stamp if one_a & level else state.stamp_a_rise,
        state.stamp if one_b & level >> 1 else state.stamp_b_rise,
        state.stamp if one_a & ~level else state.stamp_a_fall,
        state.stamp if one_b & ~(level >> 1) else state.stamp_b_fall,
        one,
        kind if one else state.edge,
        down if one else state.down,
        run if one else (0 if both else state.run),
        both | (state.illegal & ~clear),
        outrun | (state.overspeed & ~clear),
        min(illegal_count, (1 << params.fault_width) - 1),
        a | b << 1 | z << 2,
        state.first,
        seen & 3,
        level ^ accepted,
        accepted,
        (state.level ^ accepted ^ state.level >> 1) & 1,
        pending,
        (state.held_a + 1) * (pending & 1),
        (state.held_b + 1) * (pending >> 1 & 1),
        (state.held_z + 1) * (pending >> 2 & 1),
        pending & crossing & 3,
        state.starting - int(state.starting > 0),
    )


@compiled
def settled(state, pins):
    """Return whether constant `pins` (a word of A, B, Z) can change nothing more but the clock stamp."""
    away = (state.first ^ pins) | (state.second ^ pins) | (state.level ^ pins)
    return (away | state.moved | state.pending | state.starting) == 0


@compiled
def _rest(params, state, pins, clocks):
    """Return a settled state some clocks, 1 or more, later."""
    return State(
        state.count,
        state.index_count,
        state.index_armed,
        state.index_latched,
        (state.stamp + clocks) & ((1 << params.stamp_width) - 1),
        state.stamp_a_rise,
        state.stamp_b_rise,
        state.stamp_a_fall,
        state.stamp_b_fall,
        0,
        state.edge,
        state.down,
        state.run,
        state.illegal,
        state.overspeed,
        state.illegal_count,
        pins,
        pins,
        pins & 3,
        pins,
        0,
        (pins ^ pins >> 1) & 1,
        0,
        0,
        0,
        0,
        0,
        0,
    )


@compiled
def _settle(params, state, a, b, z, clocks, glitch_clocks, invert):
    pins = a | b << 1 | z << 2
    while clocks > 0 and not settled(state, pins):
        state = step(params, state, a, b, z, glitch_clocks, invert)
        clocks -= 1
    return _rest(params, state, pins, clocks) if clocks > 0 else state


@compiled
def advance(params, state, a, b, z, clocks, glitch_clocks=0, invert=0):
    """Return the state after `clocks` steps with constant pins and no strobes; 0 <= clocks < 2**62.

    Exactly that of `step` repeated, in no more steps than `latency`. The settled case stands alone because it is the
    common one: it compiles to a few instructions in the caller's loop.
    """
    pins = a | b << 1 | z << 2
    if clocks > 0 and settled(state, pins):
        return _rest(params, state, pins, clocks)
    return _settle(params, state, a, b, z, clocks, glitch_clocks, invert)


@compiled
def _run(params, start, inputs, record):
    """Fill `record` (field, lane, clock) from `inputs` (argument of `step`, lane, clock)."""
    for lane in range(inputs.shape[1]):
        state = start
        for clock in range(inputs.shape[2]):
            now = inputs[:, lane, clock]
            state = step(params, state, now[0], now[1], now[2], now[3], now[4], now[5], now[6], now[7], now[8])
            for field, value in enumerate(state):
                record[field, lane, clock] = value


def run(params, a, b, z, glitch_clocks=0, invert=0, preload=0, preload_count=0, arm=0, clear=0, start=START) -> State:
    """Return, as a State of int64 arrays, the state after every clock of a record of the pins and controls.

    Each argument is a scalar or an array; together they broadcast to (clocks,) or (lanes, clocks), the shape of what
    is returned. Every lane begins in `start`.
    """
    arguments = (a, b, z, glitch_clocks, invert, preload, preload_count, arm, clear)
    columns = np.broadcast_arrays(*(np.asarray(argument, np.int64) for argument in arguments))
    shape = columns[0].shape
    lanes = (1, *shape) if len(shape) == 1 else shape
    inputs = np.stack(columns).reshape(len(columns), *lanes)
    record = np.empty((len(State._fields), *lanes), np.int64)
    _run(params, start, inputs, record)
    return State(*record.reshape(len(record), *shape))
