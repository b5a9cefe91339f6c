"""The closed loop: plant and encoder, a controller, and the force that goes back to the plant.

Time is the FPGA's clock. Sample k is taken at the strobe, clock (k + 1) D - 1, at time k / sample_hz; the drive that
follows from it changes `latency` clocks later, on every backend. The plant is advanced exactly over the two intervals
between those instants, under a constant force in each.
"""

from ...model.compiled import compiled
from ...model.design import strobe_of
from ..world.advance import Interval, Moment, advance, advance_quietly
from .actuation import actuated
from .controllers import sample, sample_quietly, taken_off
from .sweep import sweep, sweeps
from .values import Progress


@compiled
def run(world, controller, state, progress, memory, until):
    """Run the loop up to sample `until`; return (state, progress).

    Args:
        world: a `World`.
        controller, state: as in `sim.loop.controllers`.
        progress: a `Progress`.
        memory: a `Memory`.
        until: number of the first sample not to take, within the arrays' length. The run stops early if edges were
            lost.
    """
    plant, timing, edges = world.plant, world.timing, memory.edges
    first, moment, force_n = progress
    k = first
    while k < until and moment.n_edges >= 0:
        strobe = strobe_of(timing, k)
        at = moment.motion

        # From the strobe until the drive changes, the old force acts.
        interval = Interval(world.after, strobe, timing.latency)
        after, quiet = advance_quietly(plant, moment, force_n, interval)
        moment = after if quiet else advance(plant, world.encoder, moment, force_n, interval, edges)

        if moment.n_edges > 0:
            state, taken = sample(controller, state, edges, moment.n_edges, strobe)
            moment = Moment(moment.motion, moment.cell, taken_off(edges, moment.n_edges, taken))
        else:
            state = sample_quietly(controller, state, strobe)
        force_n = actuated(world, memory, k - first, k, at, state)

        if sweeps(world.sweep, moment):
            state, (k, moment, force_n) = sweep(
                world.sweep, world, controller, state, Progress(k, moment, force_n), memory, first, until
            )
        changed = strobe_of(timing, k) + timing.latency
        interval = Interval(world.before, changed, timing.clocks_per_sample - timing.latency)
        after, quiet = advance_quietly(plant, moment, force_n, interval)
        moment = after if quiet else advance(plant, world.encoder, moment, force_n, interval, edges)
        k += 1
    return state, Progress(k, moment, force_n)
