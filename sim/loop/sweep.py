"""Samples of a handle that sweeps over the scale: counts from cells, without the edges between them.

In the loop the time of every edge is found by Newton's method, and every edge is decoded. A handle in free motion at 10
kHz passes dozens of edges in a sample. Only the count matters if the estimator uses no stamps. The count at a strobe is
a constant plus the number of the cell that held the position one decoder latency earlier. Reason: an edge counts from
`latency` clocks after the clock that first sees it, and a clock sees the position at its own time. So one position a
sample is enough.

That holds for edges that the decoder takes one at a time. So a sample is swept only if, from the last changed drive to
the next,

- the velocity keeps its sign: no turn, no rest, and every level lasts;
- the speed stays so low that, at the closest edges of the scale, each edge is decoded before the next one comes
  (`Sweep.most_m_per_s`);
- the position that is counted is farther from any edge than the rounding of an edge's time;
- the count stays within its range.

All that is known before anything of the sample is done. Samples that are not swept are left to the loop. It needs the
decoder's state, so the edges of the last swept sample are found after all, and decoded from rest.
"""

from typing import NamedTuple

from ...model import stamped
from ...model.axis.axis import step
from ...model.axis.design import change_of, strobe_of
from ...model.encoder import quadrature
from ...model.runtime.compiled import compiled, inlined
from ..world.advance import Interval, Moment, advance
from ..world.encoder import level, locate
from ..world.rigid import Motion, glide, net_force
from .actuation import actuated
from .controllers import taken_off
from .values import Progress

ROUNDING = 2.0**-46
"""More than what the position of an edge, or of the handle there, may be wrong, relative to its size."""


class Swept(NamedTuple):
    """The state after a swept sample, or before the first."""

    sample: int  # number of the sample whose drive has just changed
    motion: Motion
    force_n: float
    state: stamped.State  # with the decoder of before the first
    before: Motion  # at the change of the drive before
    force_before_n: float


@inlined
def sweeps(constants, moment):
    """Return whether it may be worth it to sweep on from a moment; never if the constants are None."""
    if constants is None:
        return False
    speed = abs(moment.motion.velocity_m_per_s)
    return moment.n_edges >= 0 and constants.least_m_per_s < speed < constants.most_m_per_s


@inlined
def _goes_on(constants, first, then):
    """Return whether a motion goes on in its direction, at a speed that the decoder follows edge by edge."""
    product = first.velocity_m_per_s * then.velocity_m_per_s
    return product > 0.0 and abs(then.velocity_m_per_s) < constants.most_m_per_s


@inlined
def _sampled(controller, state, count):
    """Return the controller's state after a sample of this count."""
    fault = quadrature.fault(state.decoder)
    after, velocity, force = step(controller.axis, state.axis, quadrature.seen_count(count), 0, fault, 1)
    return stamped.State(
        after.output.drive, velocity, force, after.flags, state.decoder, after, state.clock, state.level
    )


@inlined
def _count(controller, start, number):
    """Return the count of a cell, which may be beyond the ends of the count's range."""
    return start - number if controller.invert else number - start


@compiled
def _with_edges(world, controller, swept, start, edges):
    """Return (state, moment) after a swept sample, with its edges, as the loop would have left them."""
    timing, motion = world.timing, swept.before
    strobe = strobe_of(timing, swept.sample)
    changed = change_of(timing, swept.sample - 1)
    moment = Moment(motion, locate(world.encoder, motion.position_m), 0)
    pins, count = level(moment.cell.number), _count(controller, start, moment.cell.number)
    old = swept.state
    decoder = quadrature.resting(controller.decoder, old.decoder, count, pins, changed - old.clock)
    state = stamped.State(old.drive, old.velocity, old.force, old.flags, decoder, old.axis, changed, pins)
    interval = Interval(world.before, changed, strobe - changed)
    moment = advance(world.plant, world.encoder, moment, swept.force_before_n, interval, edges)
    state, taken = stamped.decode(controller, state, edges, moment.n_edges, strobe)
    moment = Moment(moment.motion, moment.cell, taken_off(edges, moment.n_edges, taken))
    interval = Interval(world.after, strobe, timing.latency)
    return state, advance(world.plant, world.encoder, moment, swept.force_before_n, interval, edges)


@compiled
def sweep(constants, world, controller, state, progress, memory, first, until):
    """Sweep over samples for as long as that can be; return (state, progress).

    Args:
        constants: the world's `Sweep`; None if nothing is swept, and nothing of this is compiled then.
        world, memory: as in `loop`.
        controller, state: `stamped.Controller` and `stamped.State`.
        progress: the `Progress` right after the change of the drive: `sample` is the sample that it comes from. The
            returned progress is such a one, too; its `taken` is not used.
        first: number of the sample whose place in the arrays is the first.
        until: number of the first sample not to take.
    """
    if constants is None:
        return state, progress
    begin, moment, force_n, taken = progress
    # The cell in which the count is 0, once all edges so far are counted; unless one of them is yet to raise a flag.
    counted = change_of(world.timing, begin) + quadrature.LATENCY + controller.glitch_clocks
    decoder = stamped.decode(controller, state, memory.edges, moment.n_edges, counted)[0].decoder
    if quadrature.fault(decoder) != quadrature.fault(state.decoder):
        return state, progress
    if decoder.illegal_count != state.decoder.illegal_count:
        return state, progress
    start = moment.cell.number + (decoder.count if controller.invert else -decoder.count)
    # No count of a sample, nor that a sample later, is beyond an end of its range: a clock counts one edge at most.
    later = world.timing.clocks_per_sample + quadrature.LATENCY + controller.glitch_clocks
    most = (1 << controller.decoder.count_width - 1) - 1 - later
    swept = Swept(begin, moment.motion, force_n, state, moment.motion, force_n)
    while swept.sample + 1 < until:
        motion, force_n, k = swept.motion, swept.force_n, swept.sample + 1
        net_n = net_force(world.plant.coulomb, motion, force_n)
        at = glide(motion, net_n, world.before)
        after = glide(at, net_n, world.after)
        counted_m = glide(motion, net_n, constants.until_counted).position_m
        cell = locate(world.encoder, counted_m)
        apart_m = min(counted_m - cell.lower_m, cell.upper_m - counted_m)
        unsure_m = constants.margin_m + ROUNDING * abs(counted_m)
        if not (_goes_on(constants, motion, at) and _goes_on(constants, at, after) and apart_m > unsure_m):
            break
        count = _count(controller, start, cell.number)
        if abs(count) > most:
            break
        state = _sampled(controller, swept.state, count)
        swept = Swept(k, after, actuated(world, memory, k - first, k, at, state), state, motion, force_n)
    if swept.sample == begin:
        return state, progress
    state, moment = _with_edges(world, controller, swept, start, memory.edges)
    return state, Progress(swept.sample, moment, swept.force_n, taken)
