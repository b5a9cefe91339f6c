"""The pins of an encoder in the loop: its edges, or what its lines make of them."""

from ...model.runtime.compiled import inlined
from ..world.advance import Moment
from ..world.lines import carry


@inlined
def shown(waiting, lines, clock_hz, before, moment, interval):
    """Return the `Moment` after an interval with the edges that the pins show up to its end.

    Without lines no array is passed: it would cost as much as a moving handle.

    Args:
        waiting: the `Waiting` of the encoder's lines; None without lines, and the moment is as it was.
        lines: the `Lines`; None without.
        clock_hz: frequency of the clock.
        before: how many edges there were before the interval.
        moment: the `Moment` after the interval, with the edges that the handle passed.
        interval: the `Interval`.
    """
    if waiting is None:
        return moment
    n_edges = carry(lines, waiting, before, moment.n_edges, interval, clock_hz)
    return Moment(moment.motion, moment.cell, n_edges)
