"""The four gates of an H-bridge: pulses of a fixed frequency, with a dead time in each leg.

A period has P clocks. At its end the drive is taken, in steps of full scale / P, as the width of the next pulse:

    width <- steps, or 0 unless ARMED          leg A pulses if the drive is positive, leg B if it is negative

The leg that pulses is high for exactly `width` clocks of the period, and otherwise low; the other leg is low. From one
gate of a leg to the other both are off for D clocks, the dead time: after the low gate is off, and again after the high
one is. A motor current with the sign of the drive flows on through the diode of the low gate meanwhile. So the mean
voltage is width / P of the supply, and the dead time costs nothing of it. A drive of zero while ARMED is 0 V, a brake:
both low gates on. Not ARMED all gates are off, and the motor coasts.

The width is at most P - 3 D. So the low gate of the pulsing leg is on for at least D clocks in every period; a driver
with a bootstrap needs this, too.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from ..checks import FieldError, check_int, check_number, check_range
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import scale, stage
from .stage import Amplifier, StageDesign

STEPS_MIN = 8
"""The fewest steps of a pulse."""
DEAD_TIME_S = 1e-9, 1e-3


@dataclass(frozen=True, kw_only=True)
class Stage(stage.Stage):
    """The gates of an H-bridge.

    Attributes:
        amplifier: bridge and motor; its full scale is the supply's voltage, for a bridge that is always on.
        pwm_hz: frequency of the pulses; divides the clock.
        dead_time_s: the least time from one gate of a leg to the other; rounded up to clocks.
    """

    name: ClassVar[str] = "pwm"
    amplifier: Amplifier
    pwm_hz: int
    dead_time_s: float


class Params(NamedTuple):
    """Clocks of a period and of the dead time, and the scaling."""

    period: int
    dead: int
    scaling: scale.Params


class Inputs(NamedTuple):
    """The block's inputs just before a clock edge."""

    magnitude: int = 0
    negative: int = 0
    armed: int = 0


class Leg(NamedTuple):
    """A leg: the gate that is on or comes next (1: the high one), the clocks until it is on, and both gates."""

    side: int
    left: int
    high: int
    low: int


class State(NamedTuple):
    """The clock of the period, the width and the sign of its pulse, both legs, and the registers of the scaling."""

    phase: int
    width: int
    negative: int
    a: Leg
    b: Leg
    scaled: scale.State


class Design(StageDesign):
    """Numbers of the bridge for an axis.

    Attributes:
        period, dead: clocks of a period, and of the dead time.
        scale: the scaling of the drive.
        params, start: for `step`. A reset, too, is followed by a dead time.
    """

    stage_class = Stage
    pins = "gate_high_a", "gate_low_a", "gate_high_b", "gate_low_b"
    safe = "all four gates are low"

    def __init__(self, axis: AxisRequirements, stage: Stage):
        super().__init__(axis, stage)
        check_int("stage.pwm_hz", stage.pwm_hz, 1)
        check_number("stage.dead_time_s", stage.dead_time_s)
        check_range("stage.dead_time_s", stage.dead_time_s, *DEAD_TIME_S)
        self.period, rest = divmod(axis.clock_hz, stage.pwm_hz)
        if rest or self.period < STEPS_MIN:
            raise FieldError(
                "stage.pwm_hz",
                f"must be clock_hz {axis.clock_hz} divided by a whole number from {STEPS_MIN}, not {stage.pwm_hz!r}",
            )
        # A dead time of a whole number of clocks is that number, however it was computed.
        self.dead = max(-int(-stage.dead_time_s * axis.clock_hz * (1 - 1e-12) // 1), 1)
        self.steps, self.most = self.period, self.period - 3 * self.dead
        if self.most < 1:
            raise FieldError(
                "stage.dead_time_s",
                f"must be less than a third of the {self.period} clocks of a period, not {self.dead} clocks",
            )
        amplifier = stage.amplifier
        if amplifier.offset:
            raise FieldError("stage.offset", f"must be 0 with a bridge, not {amplifier.offset!r}")
        self.full_scale_n = amplifier.full_scale_n
        self.check_deliverable(axis, self.most * self.step_n)
        self.scale = scale.for_stage(self.magnitude.width, axis.force_resolution_n, self.step_n, self.most)
        self.params = Params(self.period, self.dead, self.scale.params)
        off = Leg(0, self.dead, 0, 0)
        self.start = State(0, 0, 0, off, off, scale.START)

    @property
    def latency(self) -> int:
        """The most: a drive that just missed the end of a period waits for the next, and for the dead time."""
        return self.scale.latency + self.period + self.dead + 1


@compiled
def _leg(leg, high, armed, dead):
    """Return a leg after one clock edge, if its high gate is wanted on, or else its low one."""
    if not armed:
        return Leg(0, dead, 0, 0)
    if high != leg.side:
        return Leg(high, dead - 1, 0, 0)
    if leg.left:
        return Leg(high, leg.left - 1, 0, 0)
    return Leg(high, 0, high, 1 - high)


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge.

    Args:
        params: the `params` of a `Design`.
        state: the `start` of the design, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    on = state.width > 0 and state.phase < state.width + params.dead
    a = _leg(state.a, int(on and not state.negative), inputs.armed, params.dead)
    b = _leg(state.b, int(on and state.negative), inputs.armed, params.dead)
    width, negative, phase = state.width, state.negative, state.phase + 1
    if phase == params.period:
        width, negative, phase = state.scaled.steps, state.scaled.negative, 0
    if not inputs.armed:
        width = 0
    scaled = scale.step(params.scaling, state.scaled, inputs.magnitude, inputs.negative)
    return State(phase, width, negative, a, b, scaled)


def pins(_: Design, state: State, permitted: int) -> dict[str, int]:
    """Return the levels of the pins; `permitted` acts on them without a clock."""
    gates = state.a.high, state.a.low, state.b.high, state.b.low
    return dict(zip(Design.pins, (gate & permitted for gate in gates), strict=True))
