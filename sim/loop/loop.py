"""The closed loop: plant and encoder, a controller, and the force that goes back to the plant.

Time is the FPGA's clock. Sample k is taken at the strobe, clock (k + 1) D - 1, at time k / sample_hz; the drive that
follows from it changes `latency` clocks later, on every backend. The plant is advanced exactly over the two intervals
between those instants, under a constant force in each.

A part that a scene lacks (`converter`, `delay`, what is kept) is None here, and has no machine code.
"""

from typing import NamedTuple

import numpy as np

from ...model.compiled import compiled
from ...model.design import Timing, strobe_of
from ...model.stamped import Edges
from ..world.advance import Interval, Moment, advance, advance_quietly
from ..world.converter import Converter, converted
from ..world.encoder import Encoder
from ..world.euler import Stepped
from ..world.rigid import Rigid, Span
from ..world.taylor import Train
from .controllers import sample, sample_quietly, taken_off
from .record import Kept, keep

EDGE_CAPACITY = 1 << 14
"""The most edges in one sample before the loop gives up, far beyond the limit of any decoder."""


class World(NamedTuple):
    """The plant and parts that the controller is connected to, with their timing.

    `before` is the time from a changed drive to the next strobe, `after` the time from the strobe to the changed drive.
    """

    plant: Rigid | Train | Stepped
    encoder: Encoder
    converter: Converter | None
    push_n: float  # steady push of the motor, added to the wall's force
    force_lsb_n: float
    timing: Timing
    before: Span | float  # a `Span` for a `Rigid`, else s
    after: Span | float


class Progress(NamedTuple):
    """The state of the loop between the drive's change after sample `sample - 1` and the strobe of `sample`."""

    sample: int
    moment: Moment
    force_n: float


class Memory(NamedTuple):
    """The arrays that a run writes to.

    They are apart from the values that it returns, because returning an array for every sample would cost more than the
    sample.
    """

    edges: Edges  # the edges on their way to the controller
    delay: np.ndarray | None  # the drives that a late amplifier still holds, by sample number
    overview: Kept | None
    detail: Kept | None
    positions: np.ndarray  # float64: the position (m) at each sample of a call
    drives: np.ndarray  # the drive (force LSB) after each


@compiled
def _delayed(delay, k, drive):
    """Return the drive that a late amplifier passes on; its delay in samples is the length of `delay`."""
    if delay is None:
        return drive
    slot = k % len(delay)
    late = delay[slot]
    delay[slot] = drive
    return late


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
        changed = strobe + timing.latency
        at = moment.motion
        memory.positions[k - first] = at.position_m

        # From the strobe until the drive changes, the old force acts.
        interval = Interval(world.after, strobe, timing.latency)
        after, quiet = advance_quietly(plant, moment, force_n, interval)
        moment = after if quiet else advance(plant, world.encoder, moment, force_n, interval, edges)

        if moment.n_edges > 0:
            state, taken = sample(controller, state, edges, moment.n_edges, strobe)
            moment = Moment(moment.motion, moment.cell, taken_off(edges, moment.n_edges, taken))
        else:
            state = sample_quietly(controller, state, strobe)
        memory.drives[k - first] = state.drive
        drive = _delayed(memory.delay, k, state.drive)
        force_n = converted(world.converter, world.push_n + world.force_lsb_n * drive)
        keep(memory.overview, k, at, state.velocity, state.drive)
        keep(memory.detail, k, at, state.velocity, state.drive)

        interval = Interval(world.before, changed, timing.clocks_per_sample - timing.latency)
        after, quiet = advance_quietly(plant, moment, force_n, interval)
        moment = after if quiet else advance(plant, world.encoder, moment, force_n, interval, edges)
        k += 1
    return state, Progress(k, moment, force_n)
