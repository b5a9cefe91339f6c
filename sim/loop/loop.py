"""The closed loop: plant and encoder, a controller, and the force that goes back to the plant.

Time is the FPGA's clock. Sample k is taken at the strobe, clock (k + 1) D - 1, at time k / sample_hz; the drive that
follows from it changes `latency` clocks later, on every backend. The plant is advanced exactly over the two intervals
between those instants, under a constant force in each.

What a scene lacks is None here (`converter`, `delay`, a record), and is not in the machine code.
"""

from typing import NamedTuple

import numpy as np

from ...model.compiled import compiled
from ..world.advance import advance, advance_quietly
from ..world.converter import Converter, converted
from ..world.encoder import Cell, Encoder
from ..world.euler import Stepped
from ..world.rigid import Motion, Rigid, Span
from ..world.taylor import State, Train
from .controllers import sample, sample_quietly
from .record import keep

EDGE_CAPACITY = 1 << 14
"""Edges that one sample may bring before the loop gives up: with any decoder, far beyond its limit."""


class World(NamedTuple):
    """What the controller is connected to, and when.

    `before` is the span from a changed drive to the next strobe, `after` that from the strobe to the changed drive.
    """

    plant: Rigid | Train | Stepped
    encoder: Encoder
    converter: Converter | None
    push_n: float  # of the motor, besides the wall
    force_lsb_n: float
    clocks_per_sample: int
    latency: int  # clocks
    before: Span | float  # a `Span` for a `Rigid`, else s
    after: Span | float


class Delay(NamedTuple):
    """An amplifier that passes on the drive some samples late: the last `len(drives)` ones, by sample number."""

    drives: np.ndarray


class Progress(NamedTuple):
    """Where the loop stands: between the drive's change after sample `sample - 1`, and the strobe of `sample`."""

    sample: int
    motion: Motion | State
    cell: Cell
    force_n: float
    n_edges: int  # not yet taken by the controller; negative: edges were lost


@compiled
def _delayed(delay, k, drive):
    if delay is None:
        return drive
    slot = k % len(delay.drives)
    late = delay.drives[slot]
    delay.drives[slot] = drive
    return late


@compiled
def run(world, controller, state, progress, delay, records, edges, positions, drives, until):
    """Run the loop up to sample `until`; return (state, progress).

    Args:
        world: a `World`.
        controller, state: of `sim.loop.controllers`.
        progress: a `Progress`.
        delay: a `Delay`, or None.
        records: a pair of `Record`s, or None for either.
        edges: a pair of int64 arrays, the encoder's edges on their way to the controller.
        positions: float64 array that takes the position (m) at each sample of this call.
        drives: array that takes the drive (force LSB) after each.
        until: number of the first sample not to take, within what the arrays hold. Stops early if edges were lost.
    """
    edge_clocks, edge_levels = edges
    first, motion, cell, force_n, n_edges = progress
    k = first
    before_clocks = world.clocks_per_sample - world.latency
    while k < until and n_edges >= 0:
        strobe = (k + 1) * world.clocks_per_sample - 1
        at = motion
        positions[k - first] = motion.position_m

        # From the strobe until the drive changes, the old force acts.
        moved, quiet = advance_quietly(world.plant, motion, cell, force_n, world.after)
        if quiet:
            motion = moved
        else:
            motion, cell, n_edges = advance(
                world.plant, world.encoder, motion, cell, force_n, world.after,
                strobe, world.latency, edge_clocks, edge_levels, n_edges,
            )  # fmt: skip

        if n_edges > 0:
            state, taken = sample(controller, state, edge_clocks, edge_levels, n_edges, strobe, strobe + world.latency)
            n_edges -= taken
            for i in range(n_edges):
                edge_clocks[i] = edge_clocks[taken + i]
                edge_levels[i] = edge_levels[taken + i]
        else:
            state = sample_quietly(controller, state, strobe, strobe + world.latency)
        drives[k - first] = state.drive
        force_n = converted(world.converter, world.push_n + world.force_lsb_n * _delayed(delay, k, state.drive))
        keep(records[0], k, at, state.velocity, state.drive)
        keep(records[1], k, at, state.velocity, state.drive)

        moved, quiet = advance_quietly(world.plant, motion, cell, force_n, world.before)
        if quiet:
            motion = moved
        elif n_edges >= 0:
            motion, cell, n_edges = advance(
                world.plant, world.encoder, motion, cell, force_n, world.before,
                strobe + world.latency, before_clocks, edge_clocks, edge_levels, n_edges,
            )  # fmt: skip
        k += 1
    return state, Progress(k, motion, cell, force_n, n_edges)
