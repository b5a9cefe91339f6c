"""The edges in use of `levant_edge`: the edges that correct its velocity, and the edge that becomes the anchor.

A stamp is off by up to a clock, so the velocity over T is off by speed / T. Intervals shorter than 2**shortest clocks
are not used. 2**shortest is the T at which, at the largest speed, this error equals the change of velocity by C over T:
sqrt(speed / (clock C)). It is at most a quarter of the time in which C moves a count, sqrt(q / C). An edge too close to
the anchor stays unused: the next edge is taken with the interval from the anchor.
"""

from ..arithmetic.fixed import wrap
from ..encoder.quadrature import stamp_of
from ..runtime.compiled import compiled
from .bursts import NOTHING
from .levant_edge_design import State

ANCHOR, FIRST, TIMED, LOOSE = range(4)
"""The last edge is: the anchor itself; the first known edge; an edge to correct by; an edge too close to the anchor."""


@compiled
def number_of(params, seen):
    """Return the number of the last edge on the scale."""
    return wrap(seen.count + seen.down, params.count_width)


@compiled
def kind_of(seen):
    """Return the kind that the last edge has in upward motion, one of the four in a cycle of the scale."""
    return seen.edge ^ seen.down << 1


@compiled
def started(params, seen, zero):
    """Return the state at a first sample: time and position count from its last edge, whose arrival was not seen."""
    number, stamp, kind = number_of(params, seen), stamp_of(seen, seen.edge), kind_of(seen)
    return State(1, 0, number, stamp, kind, zero, 0, zero, zero, (zero, zero, zero, zero), NOTHING)


@compiled
def meet(params, state, seen):
    """Return (what the last edge is, ANCHOR to LOOSE; clocks from the anchor to it; edges from the anchor to it)."""
    mask = (1 << params.stamp_width) - 1
    interval = (stamp_of(seen, seen.edge) - state.stamp) & mask
    passed = wrap(number_of(params, seen) - state.number, params.count_width)
    if interval == 0 and passed == 0:
        return ANCHOR, interval, passed
    if not state.known or interval >> (params.stamp_width - 1):
        return FIRST, interval, passed
    if interval >> params.shortest:
        return TIMED, interval, passed
    return LOOSE, interval, passed


@compiled
def anchored(params, state, seen, met):
    """Return (number, stamp, kind) of the anchor from this sample on, and the clocks since that anchor."""
    number, stamp, kind = state.number, state.stamp, state.kind
    if met not in (ANCHOR, LOOSE):
        number, stamp, kind = number_of(params, seen), stamp_of(seen, seen.edge), kind_of(seen)
    return number, stamp, kind, (seen.stamp - stamp) & ((1 << params.stamp_width) - 1)
