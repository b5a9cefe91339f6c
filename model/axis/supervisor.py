"""The supervisor, the only way of a drive to the output; twin of `hardwall.hdl.axis.supervisor`.

The drive is zero unless the supervisor is ARMED. It starts DISARMED. The host's arm takes it to ARMED. A cause of
`CAUSES` takes it from any state to TRIPPED. It leaves TRIPPED for DISARMED only when the host acknowledges exactly the
latched causes. One `step` is one clock:

    standing   = causes that are present, enabled and watched in this state; link_timeout is made here
    state      <- TRIPPED if standing; else as `State` says
    ceiling    <- 0 unless ARMED; else the lower of ceiling and force limit, and at every strobe + ramp
    drive      <- 0 unless ARMED; else drive within +-min(ceiling, force limit)
    at_limit   <- 1 where the drive is as large as that, and not 0

so a lower limit acts at the next clock, and under a higher one the drive may grow no faster than after arming. A new
wall leaves the ceiling alone: a host may move it as often as it likes. The drive is zero after the first clock edge at
which a cause stands or the enable is low.
"""

from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import UQ, bits_for, saturate
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word

DISARMED, ARMED, TRIPPED = range(3)
COUNT_BITS = 4
"""Bits of the count of every cause, which saturates: a second occurrence matters, a twentieth does not."""
WATCHDOG_MS = 50, 2000
"""The least and the largest time without a beat of the host, ms: USB pauses for 16, people notice 2000."""
WATCHDOG_RESET_MS = 200
RAMP_S = 0.5
"""The time in which the limit rises to the largest force after arming, at reset: a hand feels it come."""
RAMP_S_MAX = 10.0
"""The longest such time, which the format of the ramp resolves."""
BEAT_BITS = 16
"""Bits of the word of a beat: a register."""
PUMP_HZ = 12_500
"""The rate of `alive`: charge pumps of amplifiers want 10 kHz and more."""


@dataclass(frozen=True)
class Cause:
    """A reason to trip.

    Attributes:
        name: the field's word for it.
        always: watched in every state; the others only while ARMED, when they can do harm.
        required: cannot be disabled.
        doc: what is present when the cause is.
    """

    name: str
    always: bool
    required: bool
    doc: str


CAUSES = (
    Cause("encoder_illegal", True, True, "both channels of the encoder changed at once: the position is unknown"),
    Cause("encoder_overspeed", True, True, "edges came faster than the filter passes: the position is unknown"),
    Cause("encoder_loss", True, False, "a channel and its complement are equal for longer than an edge takes"),
    Cause("index_spacing", True, False, "two index pulses are no multiple of the counts of a turn apart"),
    Cause("position_range", False, False, "the count is beyond the range that the host has set"),
    Cause("position_wrap", False, True, "the count is about to wrap, or has wrapped: the position is then unknown"),
    Cause("velocity_limit", False, False, "the estimated speed is beyond the limit that the host has set"),
    Cause("runaway", False, False, "the drive is at its limit and the handle moves with it: polarity is reversed"),
    Cause("estimator_saturated", False, False, "the estimator's output is saturated for longer than the host allows"),
    Cause("strobe_busy", True, True, "a sample began before the last one had left: the hardware is misused"),
    Cause("word_range", True, True, "a parameter in use is beyond its range: the configuration is damaged"),
    Cause("link_timeout", False, True, "the host's heartbeat has stopped"),
    Cause("external_fault", True, False, "the amplifier's fault loop is open"),
    Cause("emergency_stop", True, True, "the loop of the emergency stop is open"),
)
COUNT = len(CAUSES)
LINK = next(bit for bit, cause in enumerate(CAUSES) if cause.name == "link_timeout")
ALL = (1 << COUNT) - 1
ALWAYS = sum(1 << bit for bit, cause in enumerate(CAUSES) if cause.always)
REQUIRED = sum(1 << bit for bit, cause in enumerate(CAUSES) if cause.required)
OFF_AT_RESET = ("encoder_loss", "index_spacing")
"""Causes that need more than every axis has: the encoder's complementary wires, and the counts of its turn."""
ENABLED = ALL & ~sum(1 << bit for bit, cause in enumerate(CAUSES) if cause.name in OFF_AT_RESET)


def names(causes: int) -> list[str]:
    """Return the names of the causes whose bits are set."""
    return [cause.name for bit, cause in enumerate(CAUSES) if causes >> bit & 1]


class Params(NamedTuple):
    """The constants of a design."""

    ramp_fraction: int  # fraction bits of the ceiling
    pump_clocks: int  # clocks for which `alive` keeps a level
    tick_turns: int  # times so many clocks in a tick of the watchdog, 1 ms


class Inputs(NamedTuple):
    """The inputs of the hardware just before a clock edge, by the same names."""

    strobe: int = 0
    drive: int = 0
    causes: int = 0
    stamp: int = 0
    enable: int = 0
    referenced: int = 0
    arm: int = 0
    disarm: int = 0
    acknowledge: int = 0
    acknowledged: int = 0
    heartbeat: int = 0
    supervisor_force_limit: int = 0
    supervisor_ramp: int = 0
    supervisor_watchdog: int = 0
    supervisor_causes: int = 0
    supervisor_reference: int = 0


class State(NamedTuple):
    """Every register; those up to `counts` are also outputs of the hardware, by the same names."""

    driven: int  # the drive that is let out, force LSB
    magnitude: int  # its magnitude
    negative: int  # whether it, or the drive before its limit was 0, is negative
    at_limit: int  # whether it is as large as it may be, and not 0
    state: int
    alive: int
    live: int  # the host's heartbeat is not overdue
    ready: int  # an arm at the last clock would have armed
    latched: int  # causes since the last acknowledgement
    first: int  # causes of the clock that led to the last trip
    first_stamp: int  # the stamp of that clock
    counts: int  # occurrences of every cause since reset, `COUNT_BITS` each, the first cause lowest
    before: int  # the causes that stood at the last clock
    ceiling: int
    tick: int  # turns of the pump
    left: int  # ms until the heartbeat is overdue
    last_beat: int
    pump: int


START = State(*(0 for _ in State._fields))._replace(state=DISARMED)


class Design:
    """Formats and run-time words of an axis's supervisor.

    The ramp's word is the rise of the ceiling in a sample, with as many fraction bits as `RAMP_S_MAX` needs.
    """

    def __init__(self, axis: AxisRequirements):
        r, most = axis.force_resolution_n, axis.force_limit_word
        self.force, self.stamp_width = axis.force, axis.stamp_width
        self.limit = UQ(axis.force.width - 2, 0)
        fraction = max(bits_for(RAMP_S_MAX * axis.sample_hz / most), 0)
        self.ramp = UQ(axis.force.width - 2, fraction)
        pump_clocks = max(axis.clock_hz // (2 * PUMP_HZ), 1)
        self.params = Params(fraction, pump_clocks, max(axis.clock_hz // 1000 // pump_clocks, 1))
        ramp = most / (RAMP_S * axis.sample_hz) * 2**fraction
        self.words = (
            Word(
                "supervisor_force_limit", self.limit, r, "N", most,
                "largest drive, either way; holds at the next clock without a commit",
                0, most,
            ),
            Word(
                "supervisor_ramp", self.ramp, r * axis.sample_hz, "N/s",
                max(min(int(ramp), self.ramp.max), 1),
                "rise of the limit after arming",
                1, self.ramp.max,
            ),
            Word(
                "supervisor_watchdog", UQ(11, 0), 1e-3, "s", WATCHDOG_RESET_MS,
                f"longest time between beats of the host; {WATCHDOG_MS[0]} to {WATCHDOG_MS[1]} ms, "
                "any other word is the cause word_range",
                *WATCHDOG_MS,
            ),
            Word(
                "supervisor_causes", UQ(COUNT, 0), 1.0, "", ENABLED,
                "causes that trip, a bit each; those that are required trip whatever is written",
            ),
            Word(
                "supervisor_reference", UQ(1, 0), 1.0, "", 0,
                "1: arming needs a reference, found at the index",
            ),
        )  # fmt: skip


@compiled
def _counted(counts, raised):
    """Return the counts, each one more where its cause is raised, saturated."""
    top = (1 << COUNT_BITS) - 1
    for bit in range(COUNT):
        shift = bit * COUNT_BITS
        if raised >> bit & 1 and (counts >> shift) & top != top:
            counts += 1 << shift
    return counts


@compiled
def _watch(params, state, inputs, turns):
    """Return the turns of the pump in this ms, and the ms that are left to the host, after a clock edge."""
    tick, left = state.tick, state.left
    if turns and tick == params.tick_turns - 1:
        tick, left = 0, max(left - 1, 0)
    elif turns:
        tick += 1
    return tick, inputs.supervisor_watchdog if inputs.heartbeat != state.last_beat else left


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    armed = state.state == ARMED
    watched = (inputs.supervisor_causes | REQUIRED) & (ALL if armed else ALWAYS)
    present = (inputs.causes & ~(1 << LINK)) | (0 if state.live else 1 << LINK)
    standing = present & watched
    allowed = inputs.enable and state.live and (inputs.referenced or not inputs.supervisor_reference)
    ready = state.state == DISARMED and not standing and allowed

    now, latched = state.state, state.latched | standing
    if standing:
        now = TRIPPED
    elif state.state == TRIPPED:
        if inputs.acknowledge and inputs.acknowledged == state.latched:
            now, latched = DISARMED, 0
    elif not inputs.enable or inputs.disarm:
        now = DISARMED
    elif inputs.arm and ready:
        now = ARMED

    bound, part = state.ceiling >> params.ramp_fraction, state.ceiling & (1 << params.ramp_fraction) - 1
    limit = min(bound, inputs.supervisor_force_limit)
    ceiling = (limit << params.ramp_fraction | part) + (inputs.supervisor_ramp if inputs.strobe else 0)

    go = armed and now == ARMED
    turns = state.pump == params.pump_clocks - 1
    tick, left = _watch(params, state, inputs, turns)
    first, first_stamp = state.first, state.first_stamp
    if standing and state.state != TRIPPED:
        first, first_stamp = standing, inputs.stamp
    driven = saturate(inputs.drive, -limit, limit) if go else 0
    at_limit = int(go and limit > 0 and abs(inputs.drive) >= limit)
    alive = state.alive ^ int(turns) if go else 0
    pump = 0 if turns else state.pump + 1
    return State(
        driven=driven,
        magnitude=abs(driven),
        negative=int(go) & int(inputs.drive < 0),
        at_limit=at_limit,
        state=now,
        alive=alive,
        live=int(left > 0),
        ready=int(ready),
        latched=latched,
        first=first,
        first_stamp=first_stamp,
        counts=_counted(state.counts, standing & ~state.before),
        before=standing,
        ceiling=ceiling * int(go),
        tick=tick,
        left=left,
        last_beat=inputs.heartbeat,
        pump=pump,
    )
