"""Times of whole encoder cycles from the clock stamps of their edges, exact to the stamps.

An encoder's cycle has four edges: A rise, B rise, A fall, B fall. They may be out of place, each kind by its own error.
But an edge is exactly 4 counts from the edge of its kind in the next cycle. So the time of a cycle is the time between
two edges of one kind. `observe` subtracts, from the stamp of the last edge, the stamp of its kind at the previous
sample. The difference spans a whole number of cycles only if all edges between went in one direction. Samples show this
if the direction did not change and the decoder's run covers the counts between.

A stamp wraps after 2**stamp_width clocks. An edge is forgotten in the last quarter of that time: after AGE_LIMIT of it,
when the two top bits of its age are set. So a sample must be at most as long as that quarter; older edges cannot alias.
At the first sample, and with a restart, all edges are forgotten: an edge is known once its stamp has changed since
then. An illegal transition ends the run of known edges; if four more edges follow it within its sample, only the
decoder's flag shows it.

Source: Brown, Schneider, Mulligan, IEEE Trans. Industrial Electronics 1992, fixed-position methods.
"""

from typing import NamedTuple

from ..arithmetic.fixed import wrap
from ..encoder.quadrature import RUN_MAX, stamp_of
from ..runtime.compiled import compiled

AGE_LIMIT = 0.75
"""Part of the stamp's range after which an edge is forgotten: the two top bits of its age are set."""
LATENCY = 6
"""Clocks from the strobe to the `Times`: see `hardwall.hdl.estimators.cycle_times`."""


class Memory(NamedTuple):
    """The fields kept from the last sample's `Seen`; bit k of `fresh`: the stamp of kind k is known and not too old."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    down: int
    run: int
    stamp_a_rise: int
    stamp_b_rise: int
    stamp_a_fall: int
    stamp_b_fall: int
    fresh: int


class Times(NamedTuple):
    """Times and numbers of cycles from a sample's stamps; times in clocks, 0 if not known."""

    news: int  # whether there is a new edge
    cycles: int  # number of whole cycles in the time `cycle`
    cycle: int
    gap: int  # time between the last two edges
    age: int  # age of the last edge
    cycle_age: int  # age of the edge three before the last


NOTHING = Memory(0, 0, 0, 0, 0, 0, 0, 0, 0)


@compiled
def observe(params, memory, seen, restart):
    """Take the stamps of a sample, a `quadrature.Seen`: return (memory, `Times`).

    `params` may be any tuple with `count_width` and `stamp_width`.
    """
    modulus = (1 << params.stamp_width) - 1
    first = restart or not memory.running
    fresh = 0
    for kind in range(4):
        stamp = stamp_of(seen, kind)
        old = (seen.stamp - stamp) & modulus >= modulus - (modulus >> 2)
        if not first and (stamp != stamp_of(memory, kind) or (memory.fresh >> kind & 1 and not old)):
            fresh |= 1 << kind
    kind, left, right = seen.edge, (seen.edge - 1) & 3, (seen.edge + 1) & 3
    period = (stamp_of(seen, kind) - stamp_of(memory, kind)) & modulus
    age = (seen.stamp - stamp_of(seen, kind)) & modulus
    left_age = (seen.stamp - stamp_of(seen, left)) & modulus
    right_age = (seen.stamp - stamp_of(seen, right)) & modulus
    left_known, right_known = fresh >> left & 1, fresh >> right & 1

    # The two kinds next to the last edge's belong to the edge before it and to the edge three before it. The ages tell
    # which is which.
    left_first = left_known and not (right_known and right_age < left_age)
    before = left_age if left_first else right_age
    run = seen.run if fresh >> kind & 1 else 0
    gap = (before - age) & modulus if run >= 2 and (left_known or right_known) else 0
    cycle_age = max(left_age, right_age) if run == RUN_MAX and left_known and right_known else 0

    moved = wrap(seen.count - memory.count, params.count_width)
    forward = -moved if seen.down else moved
    one_way = seen.down == memory.down and forward > 0 and (run == RUN_MAX or run == memory.run + forward)
    # The edge of this kind that the last sample knew is (-forward & 3) counts before the last edge of that sample.
    known = memory.fresh >> kind & 1 and -forward & 3 < memory.run
    cycles = (forward + 3) >> 2 if one_way and known else 0

    memory = Memory(
        1,
        seen.count,
        seen.down,
        seen.run,
        seen.stamp_a_rise,
        seen.stamp_b_rise,
        seen.stamp_a_fall,
        seen.stamp_b_fall,
        fresh,
    )
    return memory, Times(int(period != 0), cycles, period, gap, age if run else 0, cycle_age)
