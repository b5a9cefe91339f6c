"""The end of a sample: the drive on its way to the plant, and what is kept of the sample."""

from ...model.runtime.compiled import compiled, inlined
from ..world.converter import converted
from .record import keep


@compiled
def _delayed(delay, k, drive):
    """Return the drive that a late amplifier passes on; its delay in samples is the length of `delay`."""
    if delay is None:
        return drive
    slot = k % len(delay)
    late = delay[slot]
    delay[slot] = drive
    return late


@inlined
def actuated(world, memory, place, k, motion, state):
    """Keep sample k, and return the force (N) that acts on the plant from then on.

    Args:
        world, memory: as in `loop`.
        place: the sample's place in the arrays of a call.
        k: number of the sample.
        motion: the plant's motion at its strobe.
        state: the controller's state after it.
    """
    memory.positions[place] = motion.position_m
    memory.drives[place] = state.drive
    keep(memory.overview, k, motion, state.velocity, state.drive)
    keep(memory.detail, k, motion, state.velocity, state.drive)
    drive = _delayed(memory.delay, k, state.drive)
    return converted(world.converter, world.push_n + world.force_lsb_n * drive)
