"""A serial DAC with a clear pin: a frame at every actuation, while ARMED.

With b bits the output has 2**b codes from minus to plus the full scale, the middle one at zero:

    code = min(offset + steps, 2**(b-1) - 1)        or offset - steps for a negative drive

where `steps` is at most 2**(b-1) - |offset|, so that a code is never beyond the lowest.

The frame is, from its first bit on, a header, the code in b bits (offset binary or two's complement), and trailing
zeros. Half a period of the serial clock has H clocks; with F bits a frame takes 2 F + 1 halves, from the fall of the
chip select to its rise; another half later the next frame may begin.

Behind every arming the frames of `setup` go out first, one at an actuation: what a DAC wants to be told before it makes
volts. The clear pin is low unless the axis is ARMED: its level must hold the DAC at the middle code, or its output at
ground, without a frame. An edge is not enough: it may come with the rise of the chip select, behind the last bit.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple, get_args

from ..checks import FieldError, check_int, shown
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from . import scale, stage
from .stage import Amplifier, StageDesign

Coding = Literal["offset-binary", "twos-complement"]
CODINGS: tuple[Coding, ...] = get_args(Coding)
BITS, HEADER_BITS, TRAILING_BITS, SETUP_MAX = (4, 24), (0, 16), (0, 16), 8
MODES = 0, 3
FRAME_BITS_MAX = HEADER_BITS[1] + BITS[1] + TRAILING_BITS[1]


@dataclass(frozen=True, kw_only=True)
class Stage(stage.Stage):
    """A serial DAC.

    Attributes:
        amplifier: the amplifier after the DAC; its full scale belongs to the code -2**(bits - 1).
        bits: bits of the code.
        coding: the coding of a code's value.
        header_bits, header: the bits before the code, and their number.
        trailing_bits: the zeros behind it.
        mode: mode of the SPI. The serial clock rests low in the modes 0 and 1, high in 2 and 3. A bit is taken at the
            first edge of its period in 0 and 2, at the second in 1 and 3.
        serial_hz: the highest frequency of the serial clock.
        setup: whole frames that go out first.
    """

    name: ClassVar[str] = "dac"
    amplifier: Amplifier
    bits: int
    serial_hz: int
    coding: Coding = "offset-binary"
    header_bits: int = 0
    header: int = 0
    trailing_bits: int = 0
    mode: int = 0
    setup: tuple[int, ...] = ()

    @property
    def frame_bits(self) -> int:
        """Bits of a frame."""
        return self.header_bits + self.bits + self.trailing_bits


class Params(NamedTuple):
    """Clocks of half a period of the serial clock; the frame; the mode; the offset, and the frames of the setup."""

    half: int
    frame_bits: int
    bits: int
    trailing_bits: int
    header: int  # in its place in the frame
    flip: int  # what a code is changed by, in its place, to be written
    rest: int  # the level of the serial clock at rest
    late: int  # 1: a bit is taken at the second edge of its period
    offset: int
    setup: tuple[int, ...]
    frames: int  # of the setup
    scaling: scale.Params


class Inputs(NamedTuple):
    """The block's inputs just before a clock edge; `strobe` comes with a new drive."""

    strobe: int = 0
    magnitude: int = 0
    negative: int = 0
    armed: int = 0


class State(NamedTuple):
    """The block's state.

    Attributes:
        ready: the axis was ARMED at the last edge.
        waiting: strobes on their way beside the drive's scaling, the newest in bit 0.
        told: frames of the setup that have gone out.
        place, left: the half of the frame, 0 at rest, and clocks that are left of it.
        word: bits of the frame that are still to go out, the next one uppermost.
        select: the chip select, 1 at rest.
        clock: the serial clock.
        scaled: the registers of the scaling.
    """

    ready: int
    waiting: int
    told: int
    place: int
    left: int
    word: int
    select: int
    clock: int
    scaled: scale.State


class Design(StageDesign):
    """Numbers of the DAC for an axis.

    Attributes:
        frame_clocks: clocks from the beginning of a frame to the next that may begin.
        scale: the scaling of the drive.
        params, start: for `step`.
    """

    stage_class = Stage
    pins = "dac_cs_n", "dac_sclk", "dac_mosi", "dac_clear_n"
    safe = "dac_clear_n is low, and holds the DAC at its middle code"

    def __init__(self, axis: AxisRequirements, stage: Stage):
        super().__init__(axis, stage)
        self._check(stage)
        half = max(-(-axis.clock_hz // (2 * stage.serial_hz)), 1)
        self.frame_clocks = half * (2 * stage.frame_bits + 2)
        between = axis.clock_hz // axis.actuation_hz
        if self.frame_clocks > between:
            raise FieldError(
                "actuation_hz",
                f"must be at most {axis.clock_hz // self.frame_clocks}, for a frame of the DAC has {self.frame_clocks} "
                f"clocks, not {axis.actuation_hz!r}",
            )
        amplifier = stage.amplifier
        self.steps = 1 << stage.bits - 1
        self.full_scale_n = amplifier.full_scale_n
        self.offset = round(amplifier.offset / amplifier.full_scale * self.steps)
        self.most = self.steps - abs(self.offset)
        self.check_deliverable(axis, self.most * self.step_n)
        self.scale = scale.for_stage(self.magnitude.width, axis.force_resolution_n, self.step_n, self.most)
        self.params = Params(
            half,
            stage.frame_bits,
            stage.bits,
            stage.trailing_bits,
            stage.header << stage.bits + stage.trailing_bits,
            (1 << stage.bits - 1 if stage.coding == "offset-binary" else 0) << stage.trailing_bits,
            stage.mode >> 1,
            stage.mode & 1,
            self.offset,
            # A tuple of the compiled kernel is never empty.
            stage.setup or (0,),
            len(stage.setup),
            self.scale.params,
        )
        self.start = State(0, 0, 0, 0, 0, 0, 1, stage.mode >> 1, scale.START)

    @staticmethod
    def _check(stage: Stage) -> None:
        check_int("stage.bits", stage.bits, *BITS)
        check_int("stage.serial_hz", stage.serial_hz, 1)
        check_int("stage.header_bits", stage.header_bits, *HEADER_BITS)
        check_int("stage.header", stage.header, 0, (1 << stage.header_bits) - 1)
        check_int("stage.trailing_bits", stage.trailing_bits, *TRAILING_BITS)
        check_int("stage.mode", stage.mode, *MODES)
        if stage.coding not in CODINGS:
            raise FieldError("stage.coding", f"must be one of {', '.join(CODINGS)}, not {shown(stage.coding)}")
        if not isinstance(stage.setup, tuple) or len(stage.setup) > SETUP_MAX:
            raise FieldError("stage.setup", f"must be a tuple of at most {SETUP_MAX} frames, not {shown(stage.setup)}")
        for frame in stage.setup:
            check_int("stage.setup", frame, 0, (1 << stage.frame_bits) - 1)

    @property
    def highest(self) -> int:
        """The largest code is a step below the full scale."""
        return min(self.most, self.steps - 1 - self.offset)

    @property
    def latency(self) -> int:
        """From the strobe to the rise of the chip select, at which the DAC has the code."""
        return self.scale.latency + 1 + self.params.half * (2 * self.params.frame_bits + 1)


def frame(design: Design, code: int) -> int:
    """Return the frame of a code."""
    params = design.params
    return params.header | ((code & ((1 << params.bits) - 1)) << params.trailing_bits) ^ params.flip


@compiled
def _code(params, scaled):
    """Return the code for the scaled drive."""
    steps = -scaled.steps if scaled.negative else scaled.steps
    return min(params.offset + steps, (1 << (params.bits - 1)) - 1)


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge.

    Args:
        params: the `params` of a `Design`.
        state: the `start` of the design, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    last = 2 * params.frame_bits + 1
    told, place, left, word = state.told, state.place, state.left, state.word
    ends = left == 0
    if place > 0:
        left = left - 1
        if ends:
            place, left = (place + 1 if place <= last else 0), params.half - 1
            # The first bit is there from the beginning.
            begins = 3 if params.late else 2
            if place > begins and (place - begins) % 2 == 1 and place <= last:
                word = word << 1
    if place == 0 and state.waiting >> 1 & 1 and state.ready:
        place, left = 1, params.half - 1
        code = _code(params, state.scaled) & ((1 << params.bits) - 1)
        word = params.header | (code << params.trailing_bits) ^ params.flip
        if told < params.frames:
            word, told = params.setup[told], told + 1
    word = word & ((1 << params.frame_bits) - 1)
    if not inputs.armed:
        told, place = 0, 0
    halves = place - 1
    select = int(not 0 <= halves < last)
    clock = params.rest ^ int(select == 0 and halves % 2 == 1)
    scaled = scale.step(params.scaling, state.scaled, inputs.magnitude, inputs.negative)
    waiting = (state.waiting << 1 | inputs.strobe) & 3
    return State(inputs.armed, waiting, told, place, left, word, select, clock, scaled)


def pins(design: Design, state: State, permitted: int) -> dict[str, int]:
    """Return the levels of the pins; `permitted` acts on them without a clock."""
    clear_n = state.ready & permitted
    bit = state.word >> design.params.frame_bits - 1
    return dict(zip(Design.pins, (state.select | (1 - permitted), state.clock, bit, clear_n), strict=True))
