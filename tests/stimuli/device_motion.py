"""A device moved for an interval by the code under test, where no encoder edge is near."""

from hardwall.model.stamped import room_for
from hardwall.sim.world.advance import Interval, Moment, advance
from hardwall.sim.world.device import train
from hardwall.sim.world.encoder import Encoder, locate
from hardwall.sim.world.linear import State

COARSE = Encoder(1e9, 1e6)  # so coarse that no edge is near
ANYWHERE = locate(COARSE, 0.5e9)._replace(lower_m=-1e18)
"""The encoder's cell in which every device of the tests starts."""
NO_EDGES = room_for(0)


def after(plant, motion, force_n, length, clock=0, clocks=1, encoder=COARSE):
    """Return the motion after an interval of any plant."""
    moment, interval = Moment(motion, ANYWHERE, 0), Interval(length, clock, clocks)
    return advance(plant, encoder, moment, force_n, interval, NO_EDGES).motion


def moved(device, state, command, seconds):
    """Return the state after an interval, by the code under test."""
    return after(train(device, seconds), State(*state), command, seconds)
