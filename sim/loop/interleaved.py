"""The closed loops of several axes around one piece of hardware, whose loops take turns sample by sample.

The hardware runs up to the clock at which the drive of one axis changes. It must then have the edges of all other axes
up to that clock. So a loop is a generator. It stops when it has given its edges up to its own next change, and waits
until the other loops have given theirs. In the order of the rota, the hardware is never ahead of an edge.

    for done in zip(*(turns(...) for each axis)): ...
"""

from ...model.axis.design import change_of, overlap_of, strobe_of
from ...model.runtime.compiled import compiled, inlined
from ..rtl.c_function import call
from ..rtl.verilated import RtlState
from ..world.advance import Interval, Moment, advance, advance_quietly
from .actuation import actuated
from .pins import shown

# The values that `axes_read` of sim/rtl/axes_library.cpp returns, by number.
READ_VELOCITY, READ_FLAGS = 0, 1


@inlined
def _advanced(world, memory, moment, force_n, interval):
    encoder = world.encoder
    after, quiet = advance_quietly(world.plant, moment, force_n, interval)
    after = after if quiet else advance(world.plant, encoder, moment, force_n, interval, memory.edges)
    return shown(memory.waiting, encoder.lines, encoder.clock_hz, moment.n_edges, after, interval)


@inlined
def _give(controller, moment, edges):
    """Give all edges to the hardware; return the moment without them."""
    if moment.n_edges > 0:
        clocks, levels = edges.clocks.ctypes.data, edges.levels.ctypes.data
        call(controller.give, controller.context, controller.axis, clocks, levels, moment.n_edges)
    return Moment(moment.motion, moment.cell, 0)


@compiled
def _sampled(controller, changed):
    """Return the hardware's outputs for the sample whose drive changes at that clock."""
    context, axis = controller.context, controller.axis
    drive = call(controller.drive, context, axis, changed, 0, 0)
    velocity = call(controller.read, context, axis, READ_VELOCITY, 0, 0)
    return RtlState(drive, velocity, call(controller.read, context, axis, READ_FLAGS, 0, 0))


@compiled
def turns(world, controller, progress, memory, flags, samples):
    """Run the loop of one axis; yield the number of samples that are done, from the first one on, with the edges given
    up to the next change of the drive. The loop ends early if edges were lost.

    Args:
        world, progress, memory: as in `loop`; sample k is at place k modulo the arrays' length.
        controller: the `RtlAxis`.
        flags: an array whose element 0 becomes the axis's flags.
        samples: number of samples to take.
    """
    timing, edges = world.timing, memory.edges
    overlap, room = overlap_of(timing), len(memory.positions)
    k, moment, force_n, at = progress
    while k < samples:
        # As in `loop.run`: from the strobe until the drive changes the old force acts, then the new one.
        strobe, changed, now = strobe_of(timing, k + overlap), change_of(timing, k), moment.motion
        moment = _advanced(world, memory, moment, force_n, Interval(world.after, strobe, changed - strobe))
        if moment.n_edges < 0:
            return
        moment = _give(controller, moment, edges)
        yield k
        state = _sampled(controller, changed)
        flags[0] = state.flags
        force_n = actuated(world, memory, k % room, k, at[0], state)
        interval = Interval(world.before, changed, strobe_of(timing, k + 1 + overlap) - changed)
        moment = _advanced(world, memory, moment, force_n, interval)
        newest = now if overlap else moment.motion
        at = at[1:] + (newest,)  # noqa: RUF005  (Numba joins tuples, and unpacks none)
        k += 1
    yield k
