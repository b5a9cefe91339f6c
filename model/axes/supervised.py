"""Several axes with their supervisors, which take turns as the axes do; twin of `hardwall.hdl.axes.supervised`.

Every axis has a supervisor of its own. It acts once a sample, in the axis's turn. The turn of a sample is one clock of
`supervisor`. The monitors have then seen the sample, and the drive is the output stage's for it. What the pins, the
host and the decoder did since the last turn has waited for it. So one `step` is one turn of one axis.

What must act at once does so between the turns: see the hardware. The host, its heartbeat and its watchdog are one for
all axes.
"""

from typing import NamedTuple

from ..arithmetic.fixed import UQ
from ..axis import monitors, supervisor, watchdog
from ..axis.supervised import FIXED
from ..axis.supervisor import ARMED
from ..runtime.compiled import compiled
from ..words import Word, ranges_of
from . import monitors as sampled_monitors
from .axis import AxesSpec

SAMPLE_WORDS = (
    "supervisor_position_low", "supervisor_position_high", "supervisor_velocity_limit", "supervisor_saturated",
    "supervisor_turn", "supervisor_index_tolerance",
)  # fmt: skip
"""Live words that are taken with a sample's velocity; the others with the look."""
LOOK = 2
"""Clocks before a sample's changed drive in which its turn looks at pins, host and decoder."""
LET_OUT = 3
"""Clocks from a sample's changed drive to the drive that is let out."""


class Turn(NamedTuple):
    """The inputs of an axis's supervisor in a turn: the events since the last turn, and its words."""

    seen: sampled_monitors.Inputs
    drive: int = 0  # what the output stage asks for, force LSB
    causes: int = 0  # those that are not the monitors', nor link_timeout
    stamp: int = 0  # the number of the clock in which it is decided
    live: int = 0  # the host's heartbeat is not overdue
    enable: int = 0  # the loop of drive_enable was closed all the time
    referenced: int = 0
    arm: int = 0
    disarm: int = 0
    acknowledge: int = 0
    acknowledged: int = 0
    supervisor_force_limit: int = 0
    supervisor_ramp: int = 0
    supervisor_causes: int = 0
    supervisor_reference: int = 0
    drive_invert: int = 0


class State(NamedTuple):
    """An axis after a turn."""

    monitors: sampled_monitors.State
    supervisor: supervisor.State
    drive_inverted: int


class Params(NamedTuple):
    """The constants of a design."""

    monitors: sampled_monitors.Params
    supervisor: supervisor.Params


START = State(sampled_monitors.START, supervisor.START, 0)


class Design:
    """The designs of the parts, and all run-time words of an axis.

    Attributes:
        spec: the axes.
        monitors, supervisor, watchdog: the designs of the parts.
        live: words of an axis that act in its next turn, without a commit.
        words: every word by its number; the host cannot write the words of `FIXED`.
        ranges: the least and the largest of the words of the supervisor that may not have every value of their formats.
        params: the parameters of `step`.
    """

    def __init__(self, spec: AxesSpec):
        self.spec = spec
        self.monitors = monitors.Design(spec, spec.design.estimator, spec.clocks_per_sample)
        self.supervisor, self.watchdog = supervisor.Design(spec), watchdog.Design(spec)
        doc = "1: the sign of the drive's pins is reversed; taken in every state but ARMED"
        own = [word for word in self.supervisor.words if word.name != self.watchdog.word.name]
        self.live = (*own, *self.monitors.words, Word("drive_invert", UQ(1, 0), 1.0, "", 0, doc))
        self.words = (*spec.design.words, *self.live)
        self.ranges = ranges_of((*self.supervisor.words, *self.monitors.words))
        width, shift = self.monitors.params
        self.params = Params(sampled_monitors.Params(width, shift, spec.clocks_per_sample), self.supervisor.params)

    @property
    def committed(self) -> tuple[Word, ...]:
        """Words that a host may write; they take effect together, at a sample after a commit."""
        return tuple(word for word in self.spec.design.words if word.name not in FIXED)

    @property
    def writable(self) -> tuple[str, ...]:
        """The names of the words that a host may write."""
        return tuple(word.name for word in self.words if word.name not in FIXED)

    @property
    def index_bits(self) -> int:
        """Bits of the count at an index edge that are enough to restore it from a later count within a rota."""
        return min(self.spec.clocks_per_sample.bit_length() + 1, self.spec.count_width)

    @property
    def latency(self) -> int:
        """Clocks from the strobe of an axis to the changed drive that is let out."""
        return self.spec.latency + LET_OUT

    @property
    def turn_clocks(self) -> int:
        """Clocks from the look of a turn to the changed drive that is let out."""
        return LOOK + LET_OUT

    @property
    def trip_clocks(self) -> int:
        """The most clock edges from the first one that sees a cause which waits for its turn, to a drive of zero; both
        included."""
        return self.spec.clocks_per_sample + self.turn_clocks


@compiled
def _with_live(state, live):
    """Return a supervisor's state with what the watchdog says of the host."""
    return supervisor.State(
        driven=state.driven,
        magnitude=state.magnitude,
        negative=state.negative,
        at_limit=state.at_limit,
        state=state.state,
        alive=state.alive,
        live=live,
        ready=state.ready,
        latched=state.latched,
        first=state.first,
        first_stamp=state.first_stamp,
        counts=state.counts,
        before=state.before,
        ceiling=state.ceiling,
        tick=state.tick,
        left=state.left,
        last_beat=state.last_beat,
        pump=state.pump,
    )


@compiled
def step(params, state, turn):
    """Return the state of an axis after one turn.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the axis's last turn.
        turn: its `Turn`.
    """
    watching = sampled_monitors.step(params.monitors, state.monitors, turn.seen, state.supervisor)
    heard = supervisor.Inputs(
        strobe=1,
        drive=turn.drive,
        causes=turn.causes | watching.causes,
        stamp=turn.stamp,
        enable=turn.enable,
        referenced=turn.referenced,
        arm=turn.arm,
        disarm=turn.disarm,
        acknowledge=turn.acknowledge,
        acknowledged=turn.acknowledged,
        heartbeat=0,
        supervisor_force_limit=turn.supervisor_force_limit,
        supervisor_ramp=turn.supervisor_ramp,
        supervisor_watchdog=0,
        supervisor_causes=turn.supervisor_causes,
        supervisor_reference=turn.supervisor_reference,
    )
    supervising = supervisor.step(params.supervisor, _with_live(state.supervisor, turn.live), heard)
    inverted = state.drive_inverted if state.supervisor.state == ARMED else turn.drive_invert
    return State(watching, supervising, inverted)
