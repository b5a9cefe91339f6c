"""The closed loop: plant and encoder, a controller, and the force that goes back to the plant.

Time is the FPGA's clock. Sample k is taken at its strobe (`design.strobe_of`), at time k / sample_hz; the drive that
follows from it changes `latency` clocks later, on every backend. The plant is advanced exactly over the two intervals
between those instants, under a constant force in each.

Where samples overlap, one or several strobes come before that. The plant is then so many strobes ahead of the sample
whose drive changes. A model leaves the edges in between to the next samples.
"""

from ...model.axis.design import change_of, overlap_of, strobe_of
from ...model.runtime.compiled import compiled
from ..world.advance import Interval, Moment, advance, advance_quietly
from .actuation import actuated
from .controllers import sample, sample_quietly, taken_off
from .pins import shown
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
    plant, encoder, timing, edges = world.plant, world.encoder, world.timing, memory.edges
    overlap = overlap_of(timing)
    first, moment, force_n, at = progress
    k = first
    while k < until and moment.n_edges >= 0:
        strobe, changed = strobe_of(timing, k + overlap), change_of(timing, k)
        now = moment.motion

        # From the strobe until the drive changes, the old force acts.
        interval = Interval(world.after, strobe, changed - strobe)
        after, quiet = advance_quietly(plant, moment, force_n, interval)
        after = after if quiet else advance(plant, encoder, moment, force_n, interval, edges)
        moment = shown(memory.waiting, encoder.lines, encoder.clock_hz, moment.n_edges, after, interval)

        if moment.n_edges > 0:
            state, taken = sample(controller, state, edges, moment.n_edges, strobe_of(timing, k))
            moment = Moment(moment.motion, moment.cell, taken_off(edges, moment.n_edges, taken))
        else:
            state = sample_quietly(controller, state, strobe_of(timing, k))
        force_n = actuated(world, memory, k - first, k, at[0], state)

        if sweeps(world.sweep, moment):
            state, (k, moment, force_n, at) = sweep(
                world.sweep, world, controller, state, Progress(k, moment, force_n, at), memory, first, until
            )
        changed = change_of(timing, k)
        interval = Interval(world.before, changed, strobe_of(timing, k + 1 + overlap) - changed)
        after, quiet = advance_quietly(plant, moment, force_n, interval)
        after = after if quiet else advance(plant, encoder, moment, force_n, interval, edges)
        moment = shown(memory.waiting, encoder.lines, encoder.clock_hz, moment.n_edges, after, interval)
        k += 1
        newest = now if overlap else moment.motion
        at = at[1:] + (newest,)  # noqa: RUF005  (Numba joins tuples, and unpacks none)
    return state, Progress(k, moment, force_n, at)
