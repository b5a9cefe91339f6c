"""A device moved for an interval by the code under test, where no encoder edge is near."""

import numpy as np

from hardwall.sim.world.advance import advance
from hardwall.sim.world.device import train
from hardwall.sim.world.encoder import Encoder, locate
from hardwall.sim.world.taylor import State

COARSE = Encoder(1e9, 1e6)  # no edge anywhere
NO_EDGES = np.zeros(0, np.int64), np.zeros(0, np.int64)


def moved(device, state, command, seconds):
    """Return the state after an interval, by the code under test."""
    system = train(device, seconds)
    cell = locate(COARSE, 0.5e9)
    start = State(state.position_m, *state[1:])
    return advance(system, COARSE, start, cell._replace(lower_m=-1e18), command, seconds, 0, 1, *NO_EDGES, 0)[0]
