"""Quadrature decoder: pins to count, clock stamps, index and faults; twin of `hardwall.hdl.encoder.quadrature`.

One `step` is one clock: it takes the levels of the pins just before the clock edge and returns the state of the
registers just after it. Words of one bit per channel hold A in bit 0, B in bit 1 and Z in bit 2. The module
`quadrature_speed` says how fast the encoder may turn.
"""

from typing import Any, NamedTuple

import numpy as np

from ..arithmetic.fixed import wrap
from ..runtime.compiled import compiled, inlined


class Params(NamedTuple):
    """Widths of the registers, in bits; `count_width` and `stamp_width` are at most 62."""

    count_width: int
    stamp_width: int
    fault_width: int


class Inputs(NamedTuple):
    """Pins and settings in a clock, or for as long as they are constant: inputs of the hardware, by the same names.

    The pins have their levels just before the clock edge. Compiled code passes all five fields.
    """

    a: int
    b: int
    z: int
    glitch_clocks: int = 0
    invert: int = 0


class Strobes(NamedTuple):
    """The host's requests to the decoder in a clock: inputs of the hardware, by the same names."""

    preload: int = 0
    preload_count: int = 0
    arm: int = 0
    clear: int = 0
    origin_shift: int = 0
    slip: int = 0


class State(NamedTuple):
    """Every register of the decoder; those up to `illegal_count` are also its outputs, by the same names."""

    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    index_count: int
    index_armed: int
    index_latched: int
    referenced: int  # the origin was moved since the index was latched, and nothing has made either void
    stamp: int
    stamp_a_rise: int
    stamp_b_rise: int
    stamp_a_fall: int
    stamp_b_fall: int
    stepped: int
    indexed: int
    edge: int  # kind of the last counted edge: A_RISE, B_RISE, A_FALL or B_FALL
    down: int  # whether that edge counted -1
    run: int  # successive edges that counted in that direction, at most RUN_MAX; 0: none, or the past is not known
    illegal: int
    overspeed: int
    wrapped: int  # the count has gone beyond an end of its range, since the last clear
    illegal_count: int
    first: int  # stages of the synchronisers
    second: int
    previous: int  # the second stage of A and B, a clock ago
    level: int  # filtered levels
    moved: int  # channels whose filtered level has just changed
    up: int  # whether that change was an edge of increasing count, before `invert`
    pending: int  # channels that have left their filtered level
    held_a: int  # clocks since the channel left its filtered level
    held_b: int
    held_z: int
    inverted: int  # `invert` of the last clock
    known: int  # there was an edge, and no slip since
    below: int  # Z on the lower side of the last edge
    crossed: int  # pending channels, of A and B, with an edge of the other channel since they became pending
    starting: int  # clocks until the synchronisers are filled


ILLEGAL, WRAPPED = 1, 1 << 2
"""The sticky flags `illegal` and `wrapped` in the word of `fault`."""
A_RISE, B_RISE, A_FALL, B_FALL = range(4)
RUN_MAX = 4
"""Edges in a full cycle of the encoder: after this many in one direction, all four stamps are of the last cycle."""


class Seen(NamedTuple):
    """The outputs of the decoder that an estimator may use at a strobe, by the names of the hardware.

    The last edge is of kind `edge` and is number `count + down` on the scale (cell n lies between edges n and n + 1).
    It was decoded at the stamp of its kind, `stamp` less that stamp clocks ago, modulo the stamp's width. The `run - 1`
    edges before it are one count farther back at a time, and their kinds and stamps go back likewise.
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


NO_STROBES = Strobes()
START = State(*(3 if name == "starting" else 0 for name in State._fields))


@compiled
def seen(state: State) -> Seen:
    """Return the part of a decoder's `state` that an estimator sees."""
    return Seen(
        count=state.count,
        stamp=state.stamp,
        stamp_a_rise=state.stamp_a_rise,
        stamp_b_rise=state.stamp_b_rise,
        stamp_a_fall=state.stamp_a_fall,
        stamp_b_fall=state.stamp_b_fall,
        edge=state.edge,
        down=state.down,
        run=state.run,
    )


@compiled
def fault(state):
    """Return the sticky flags of a state as a word, `illegal` first."""
    return state.illegal | state.overspeed << 1 | (WRAPPED if state.wrapped else 0)


@compiled
def stamp_of(record, kind):
    """Return the last stamp of a kind of edge from a `Seen`, or from any record with the same four fields."""
    low = record.stamp_b_rise if kind & 1 else record.stamp_a_rise
    high = record.stamp_b_fall if kind & 1 else record.stamp_a_fall
    return high if kind & 2 else low


@compiled
def seen_count(count: int) -> Seen:
    """Return the `Seen` for an estimator that uses the count alone."""
    return Seen(count, 0, 0, 0, 0, 0, 0, 0, 0)


LATENCY = 4
"""The latency without a glitch filter: see `latency`."""


def latency(glitch_clocks: int) -> int:
    """Return the number of clock edges from the first that sees a changed pin to the setting of the new count, both
    included.

    The synchroniser takes two, the filter `glitch_clocks` + 1, and decoding and adding one.
    """
    return LATENCY + glitch_clocks


@compiled
def _filtered(state, inputs):
    """Filter glitches from the synchronised pins: return (level, accepted, pending, crossing, outrun).

    `level` is the level accepted before this clock. `outrun` is high if a pulse is rejected, and the other channel had
    an edge during it.
    """
    # While the synchronisers fill, their output counts as accepted already.
    level = state.second if state.starting > 0 else state.level
    # A channel is accepted at the (glitch_clocks + 1)th clock in a row away from its level.
    differs = state.second ^ level
    ripe = (
        int(state.held_a >= inputs.glitch_clocks)
        | int(state.held_b >= inputs.glitch_clocks) << 1
        | int(state.held_z >= inputs.glitch_clocks) << 2
    )
    # A pulse is rejected when its channel returns to its level while still pending.
    edges = (state.second ^ state.previous) & 3
    crossing = state.crossed | (edges & 1) << 1 | edges >> 1
    outrun = int((state.pending & ~differs & crossing) != 0)
    return level, differs & ripe, differs & ~ripe, crossing, outrun


@compiled
def _either(condition, new, old):
    """Return `new` if the condition holds, else `old`; Numba accepts no conditional in the keywords of a call."""
    return new if condition else old


@compiled
def _index(state, inputs, strobes, one, down, fault):
    """Return (whether the count loses its scale in a clock, Z on the lower side of an edge, whether that finds an
    index)."""
    slipped = fault | strobes.slip | (state.inverted ^ inputs.invert)
    # Z on the lower side of this edge: before this clock if the count goes up, else at it.
    below = state.level >> 2 ^ (state.moved >> 2 & ~down)
    onward = state.known and state.down == down and state.below == down
    return slipped, below, int(one and onward and below != down and not slipped)


@compiled
def step(params, state, inputs, strobes):
    """Return the state after one clock of `Inputs` and `Strobes`."""
    level, accepted, pending, crossing, outrun = _filtered(state, inputs)

    # Decode. An edge is counted only if exactly one of A and B has moved.
    one = (state.moved ^ state.moved >> 1) & 1
    both = state.moved & state.moved >> 1 & 1
    base = strobes.preload_count if strobes.preload else state.count + strobes.origin_shift * strobes.preload_count
    down = ~(state.up ^ inputs.invert) & 1
    onward = base + one * (1 - 2 * down)
    count = wrap(onward, params.count_width)
    one_a = one & state.moved
    one_b = one & state.moved >> 1
    risen = level & state.moved & 3
    kind = one_b + 2 * int(risen == 0)
    run = min(state.run + 1, RUN_MAX) if state.down == down else 1
    slipped, below, indexed = _index(state, inputs, strobes, one, down, both | outrun)
    latches = state.index_armed & ~strobes.arm & indexed
    place = wrap(base, params.count_width)
    moved_place = wrap(state.index_count + strobes.origin_shift * strobes.preload_count, params.count_width)
    beyond = int(count != onward)
    void = strobes.arm | strobes.preload | slipped | beyond
    illegal_count = (0 if strobes.clear else state.illegal_count) + both
    return State(
        count=count,
        index_count=_either(latches, place, moved_place),
        index_armed=strobes.arm | (state.index_armed & ~latches),
        index_latched=(latches & ~beyond) | (state.index_latched & ~void),
        referenced=(state.referenced | (strobes.origin_shift & state.index_latched)) & ~void,
        stamp=(state.stamp + 1) & ((1 << params.stamp_width) - 1),
        stamp_a_rise=_either(one_a & level, state.stamp, state.stamp_a_rise),
        stamp_b_rise=_either(one_b & level >> 1, state.stamp, state.stamp_b_rise),
        stamp_a_fall=_either(one_a & ~level, state.stamp, state.stamp_a_fall),
        stamp_b_fall=_either(one_b & ~(level >> 1), state.stamp, state.stamp_b_fall),
        stepped=one,
        indexed=indexed,
        edge=_either(one, kind, state.edge),
        down=_either(one, down, state.down),
        run=_either(one, run, _either(both, 0, state.run)),
        illegal=both | (state.illegal & ~strobes.clear),
        overspeed=outrun | (state.overspeed & ~strobes.clear),
        wrapped=beyond | (state.wrapped & ~strobes.clear),
        illegal_count=min(illegal_count, (1 << params.fault_width) - 1),
        first=inputs.a | inputs.b << 1 | inputs.z << 2,
        second=state.first,
        previous=state.second & 3,
        level=level ^ accepted,
        moved=accepted,
        up=(state.level ^ accepted ^ state.level >> 1) & 1,
        pending=pending,
        held_a=(state.held_a + 1) * (pending & 1),
        held_b=(state.held_b + 1) * (pending >> 1 & 1),
        held_z=(state.held_z + 1) * (pending >> 2 & 1),
        inverted=inputs.invert,
        known=(one | state.known) & ~slipped & 1,
        below=_either(one, below, state.below),
        crossed=pending & crossing & 3,
        starting=state.starting - int(state.starting > 0),
    )


@compiled
def settled(state, pins):
    """Return whether constant `pins` (a word of A, B, Z), not inverted anew, can change only the clock stamp from here
    on."""
    away = (state.first ^ pins) | (state.second ^ pins) | (state.level ^ pins)
    return (away | state.moved | state.pending | state.starting) == 0


@compiled
def resting(params, state, count, pins, clocks):
    """Return the settled state `clocks` clocks, 1 or more, later, if the edges until then led to this count and these
    pins; of their kinds and stamps it knows nothing."""
    return State(
        count=count,
        index_count=state.index_count,
        index_armed=state.index_armed,
        index_latched=state.index_latched,
        referenced=state.referenced,
        stamp=(state.stamp + clocks) & ((1 << params.stamp_width) - 1),
        stamp_a_rise=state.stamp_a_rise,
        stamp_b_rise=state.stamp_b_rise,
        stamp_a_fall=state.stamp_a_fall,
        stamp_b_fall=state.stamp_b_fall,
        stepped=0,
        indexed=0,
        edge=state.edge,
        down=state.down,
        run=state.run,
        illegal=state.illegal,
        overspeed=state.overspeed,
        wrapped=state.wrapped,
        illegal_count=state.illegal_count,
        first=pins,
        second=pins,
        previous=pins & 3,
        level=pins,
        moved=0,
        up=(pins ^ pins >> 1) & 1,
        pending=0,
        held_a=0,
        held_b=0,
        held_z=0,
        inverted=state.inverted,
        known=state.known,
        below=state.below,
        crossed=0,
        starting=0,
    )


@compiled
def _lone(state, pins, inputs, clocks):
    """Return whether a settled state meets an edge of one channel, A or B, that finds no index and is decoded and
    settled in `clocks`."""
    changed, still = state.level ^ pins, state.inverted == inputs.invert and settled(state, state.level)
    return 0 < changed < 3 and clocks > LATENCY + inputs.glitch_clocks and still and state.below == state.level >> 2


@compiled
def _edge(params, state, inputs, pins, clocks):
    """Return the state `clocks` clocks after a `_lone` edge: what `step` makes of it, in closed form."""
    changed = state.level ^ pins
    mask = (1 << params.stamp_width) - 1
    decoded = (state.stamp + LATENCY + inputs.glitch_clocks - 1) & mask
    down = ~(pins ^ state.level >> 1 ^ inputs.invert) & 1
    kind = (changed >> 1) + 2 * int((changed & pins) == 0)
    onward = state.count + 1 - 2 * down
    count = wrap(onward, params.count_width)
    beyond = int(count != onward)
    return State(
        count=count,
        index_count=state.index_count,
        index_armed=state.index_armed,
        index_latched=state.index_latched & ~beyond,
        referenced=state.referenced & ~beyond,
        stamp=(state.stamp + clocks) & mask,
        stamp_a_rise=_either(kind == A_RISE, decoded, state.stamp_a_rise),
        stamp_b_rise=_either(kind == B_RISE, decoded, state.stamp_b_rise),
        stamp_a_fall=_either(kind == A_FALL, decoded, state.stamp_a_fall),
        stamp_b_fall=_either(kind == B_FALL, decoded, state.stamp_b_fall),
        stepped=0,
        indexed=0,
        edge=kind,
        down=down,
        run=_either(state.down == down, min(state.run + 1, RUN_MAX), 1),
        illegal=state.illegal,
        overspeed=state.overspeed,
        wrapped=state.wrapped | beyond,
        illegal_count=state.illegal_count,
        first=pins,
        second=pins,
        previous=pins & 3,
        level=pins,
        moved=0,
        up=(pins ^ pins >> 1) & 1,
        pending=0,
        held_a=0,
        held_b=0,
        held_z=0,
        inverted=state.inverted,
        known=1,
        below=state.below,
        crossed=0,
        starting=0,
    )


@compiled
def _settle(params, state, inputs, pins, clocks):
    if _lone(state, pins, inputs, clocks):
        return _edge(params, state, inputs, pins, clocks)
    while clocks > 0 and (state.inverted != inputs.invert or not settled(state, pins)):
        state = step(params, state, inputs, NO_STROBES)
        clocks -= 1
    return resting(params, state, state.count, pins, clocks) if clocks > 0 else state


@inlined
def advance(params, state, inputs, clocks):
    """Return the state after `clocks` steps with constant `Inputs` and no strobes; 0 <= clocks < 2**62.

    The result equals repeated calls of `step` exactly, in at most `latency` calls. The settled case is separate because
    it is the common one: it compiles to a few instructions in the caller's loop.
    """
    pins = inputs.a | inputs.b << 1 | inputs.z << 2
    if clocks > 0 and state.inverted == inputs.invert and settled(state, pins):
        return resting(params, state, state.count, pins, clocks)
    return _settle(params, state, inputs, pins, clocks)


@compiled
def _run(params, start, inputs, strobes, record):
    """Fill `record` (field, lane, clock) from `Inputs` and `Strobes` whose fields are arrays (lane, clock)."""
    for lane in range(record.shape[1]):
        state = start
        for clock in range(record.shape[2]):
            at = lane, clock
            given = Inputs(inputs.a[at], inputs.b[at], inputs.z[at], inputs.glitch_clocks[at], inputs.invert[at])
            preload, shift = strobes.preload[at], strobes.origin_shift[at]
            asked = Strobes(
                preload, strobes.preload_count[at], strobes.arm[at], strobes.clear[at], shift, strobes.slip[at]
            )
            state = step(params, state, given, asked)
            for field, value in enumerate(state):
                record[field, lane, clock] = value


def run(params: Params, inputs: Inputs, strobes: Strobes = NO_STROBES, start: State = START) -> State:
    """Return the state after every clock of a record of `inputs` and `strobes`, as a State of int64 arrays.

    Every field of `inputs` and `strobes` is a scalar or an array; together they broadcast to (clocks,) or
    (lanes, clocks), the shape of the returned arrays. Every lane begins in `start`.
    """
    broadcast = np.broadcast_arrays(*(np.asarray(column, np.int64) for column in (*inputs, *strobes)))
    shape = broadcast[0].shape
    lanes = (1, *shape) if len(shape) == 1 else shape
    # The fields of `Inputs` and `Strobes` are numbers of one clock elsewhere, and arrays here.
    columns: list[Any] = [np.ascontiguousarray(column).reshape(lanes) for column in broadcast]
    record = np.empty((len(State._fields), *lanes), np.int64)
    _run(params, start, Inputs(*columns[: len(inputs)]), Strobes(*columns[len(inputs) :]), record)
    return State(*record.reshape(len(record), *shape))
