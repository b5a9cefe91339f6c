"""The watchdog of a device of several axes: whether its one host still beats; twin of `hardwall.hdl.axis.watchdog`.

It is what `supervisor` has for a single axis, alone: the host is live from a change of `heartbeat` until so many ticks
later as `supervisor_watchdog` says. The square wave that an axis shows while it is ARMED runs freely here.
"""

from typing import NamedTuple

from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word
from . import supervisor


class Params(NamedTuple):
    """The constants of a design."""

    pump_clocks: int  # clocks for which the wave keeps a level
    tick_turns: int  # times so many clocks in a tick, 1 ms


class Inputs(NamedTuple):
    """The inputs of the hardware just before a clock edge, by the same names."""

    heartbeat: int = 0
    supervisor_watchdog: int = 0


class State(NamedTuple):
    """Every register; the first two are the outputs of the hardware, by the same names."""

    live: int  # the host's heartbeat is not overdue
    wave: int  # a square wave of `supervisor.PUMP_HZ`
    pump: int
    tick: int  # turns of the pump
    left: int  # ms until the heartbeat is overdue
    last_beat: int


START = State(*(0 for _ in State._fields))


class Design:
    """The divider of a device's clock, and the word of its watchdog, both from an axis's supervisor."""

    def __init__(self, axis: AxisRequirements):
        design = supervisor.Design(axis)
        self.params = Params(design.params.pump_clocks, design.params.tick_turns)
        self.word: Word = next(word for word in design.words if word.name == "supervisor_watchdog")


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    turns = state.pump == params.pump_clocks - 1
    ticks = turns and state.tick == params.tick_turns - 1
    left = max(state.left - 1, 0) if ticks else state.left
    if inputs.heartbeat != state.last_beat:
        left = inputs.supervisor_watchdog
    return State(
        live=int(left > 0),
        wave=state.wave ^ int(turns),
        pump=0 if turns else state.pump + 1,
        tick=0 if ticks else state.tick + int(turns),
        left=left,
        last_beat=inputs.heartbeat,
    )
