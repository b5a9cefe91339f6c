"""The way from one instant of the loop to the next: the plant, its encoder, and the lines from there to the pins."""

from ...model.compiled import inlined
from ..world.advance import Moment, advance, advance_quietly
from ..world.lines import carry


@inlined
def onwards(world, memory, moment, force_n, interval):
    """Return the `Moment` after an `Interval` of constant force: as of `advance`, with edges as the pins show them.

    Args:
        world, memory: as in `loop`.
        moment: the `Moment` at the start.
        force_n: force of motor and wall together, N.
        interval: the `Interval`.
    """
    after, quiet = advance_quietly(world.plant, moment, force_n, interval)
    after = after if quiet else advance(world.plant, world.encoder, moment, force_n, interval, memory.edges)
    return _shown(world.encoder.lines, world.encoder, memory, moment.n_edges, after, interval)


@inlined
def _shown(lines, encoder, memory, before, moment, interval):
    """Return a moment with the edges that the pins show; `before` is how many there were before the interval."""
    if lines is None:
        return moment
    n_edges = carry(lines, memory.waiting, memory.edges, before, moment.n_edges, interval, encoder.clock_hz)
    return Moment(moment.motion, moment.cell, n_edges)
