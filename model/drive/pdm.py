"""Pulses and a sign: first-order sigma-delta modulation of the drive.

With N bits of the drive's magnitude, per clock

    sum <- sum mod 2**N + amount        pulse = (sum >= 2**N)

so the density of ones is exactly amount / 2**N. Without an amplifier in the stage, `amount` is the drive's magnitude,
and full density is 2**N force LSB. With an amplifier, `amount` is the magnitude in steps of the amplifier's full scale
/ 2**N, by `scale`.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import scale, stage
from .stage import Amplifier, StageDesign


@dataclass(frozen=True, kw_only=True)
class Stage(stage.Stage):
    """Pulses and a sign; without an amplifier full density is 2**N force LSB."""

    name: ClassVar[str] = "pdm"
    amplifier: Amplifier | None = None


USUAL = Stage()
"""The default stage of an axis."""


class Params(NamedTuple):
    """The bits N; the scaling, and whether there is one."""

    bits: int
    scaled: int
    scaling: scale.Params


class Inputs(NamedTuple):
    """The block's inputs just before a clock edge."""

    magnitude: int = 0
    negative: int = 0
    armed: int = 0


class State(NamedTuple):
    """The sum, whose upper bit is the pulse; the sign; and the registers of the scaling."""

    total: int = 0
    sign: int = 0
    scaled: scale.State = scale.START


START = State()


class Design(StageDesign):
    """Numbers of the pulses for an axis; `scale` is None without an amplifier; `params` and `start` are for `step`."""

    stage_class = Stage
    pins = "drive_pdm", "drive_sign"
    safe = "drive_pdm is low"

    def __init__(self, axis: AxisRequirements, stage: Stage):
        super().__init__(axis, stage)
        bits, amplifier = self.magnitude.width, stage.amplifier
        self.steps, self.most, self.start = 1 << bits, (1 << bits) - 1, START
        self.scale: scale.Design | None = None
        if amplifier is None:
            self.full_scale_n = axis.force_resolution_n * self.steps
        else:
            if amplifier.offset:
                raise FieldError("stage.offset", f"must be 0 with pulses, not {amplifier.offset!r}")
            self.full_scale_n = amplifier.full_scale_n
            self.check_deliverable(axis, self.full_scale_n)
            self.scale = scale.for_stage(bits, axis.force_resolution_n, self.step_n, self.most)
        self.params = Params(
            bits, int(self.scale is not None), self.scale.params if self.scale else scale.Params(1, 1, 1)
        )

    @property
    def latency(self) -> int:
        return 1 + (self.scale.latency if self.scale else 0)


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    amount, sign, scaled = inputs.magnitude, inputs.negative, state.scaled
    if params.scaled:
        amount, sign = scaled.steps * inputs.armed, scaled.negative
        scaled = scale.step(params.scaling, scaled, inputs.magnitude, inputs.negative)
    return State((state.total & ((1 << params.bits) - 1)) + amount, sign, scaled)


def pins(design: Design, state: State, permitted: int) -> dict[str, int]:
    """Return the levels of the pins; `permitted` acts on them without a clock."""
    return {"drive_pdm": state.total >> design.params.bits & permitted, "drive_sign": state.sign}
