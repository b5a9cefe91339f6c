"""Facts on a board's drive stage before an amplifier is connected: its newtons, its safe pins, and its signals."""

from collections.abc import Callable
from typing import cast

from ...model.axes.axis import AxesSpec
from ...model.drive import dac, pwm
from ...model.drive.stage import Amplifier, StageDesign
from ...model.spec import AxisSpec


def drive(spec: AxisSpec | AxesSpec) -> str:
    """Return the lines of Markdown about the drive stage of an axis, or of each of several."""
    design = spec.drive
    clocks = f"{design.safe_latency} clock{'s' * (design.safe_latency > 1)}"
    lines = [
        WHAT[spec.stage.name](spec),
        f"**Safe** is: {design.safe}. An open `drive_enable` or `emergency_stop` reaches it through a gate alone, "
        "without a clock; so does a clock that stops, when the oscillator has found that out; and an axis that is not "
        f"ARMED after {clocks}.",
        f"**Newtons**: {newtons(design)} A step is {design.step_n:.4g} N.",
    ]
    if spec.stage.amplifier is not None:
        lines.append(f"**The amplifier** is {_amplifier(spec.stage.amplifier)}.")
    return "".join(f"- {line}\n" for line in lines)


def newtons(design: StageDesign) -> str:
    """Return a sentence on the force of the full scale."""
    end = {
        "pdm": "pulses without a pause are",
        "pwm": "a bridge that is on all the time is",
        "dac": "the full scale is",
    }
    most = f", of which at most {design.most * design.step_n:.6g} N are made" if design.stage.name == "pwm" else ""
    return f"{end[design.stage.name]} {design.full_scale_n:.6g} N{most}."


def _amplifier(amplifier: Amplifier) -> str:
    unit, offset = amplifier.unit, amplifier.offset
    scale = f"{amplifier.newtons_per_unit:g} N/{unit} at the handle and {amplifier.full_scale:g} {unit}"
    said = f"one of {scale} at the full scale"
    if amplifier.inverted:
        said += ", inverted: `drive_invert` is 1 after a reset"
    if offset:
        left_n = -offset * amplifier.newtons_per_unit
        said += (
            f". It has no force at {offset:g} {unit}: at safe pins {left_n:.3g} N are left until `alive` has taken its "
            "enable away"
        )
    return said


def _pdm(_: AxisSpec | AxesSpec) -> str:
    return (
        "Pulses at `drive_pdm` and a sign at `drive_sign`. On a scope `drive_pdm` is low at rest; while ARMED in the "
        "wall, pulses of one clock come the denser the larger the force."
    )


def _pwm(spec: AxisSpec | AxesSpec) -> str:
    design = cast(pwm.Design, spec.drive)
    dead_ns = 1e9 * design.dead / spec.clock_hz
    return (
        f"Four gates of an H-bridge at {spec.clock_hz / design.period:g} Hz. All four are low at rest, and both low "
        "gates high while ARMED without a force, which brakes. On a scope look at the two gates of a leg: between them "
        f"both are low for {design.dead} clocks, {dead_ns:g} ns, at every change; the driver must not take more from "
        "it than the transistors leave. For a positive force leg A pulses."
    )


def _dac(spec: AxisSpec | AxesSpec) -> str:
    design = cast(dac.Design, spec.drive)
    stage = design.stage
    setup = f" Behind every arming {len(stage.setup)} frames of setup go first." if stage.setup else ""
    serial_hz = spec.clock_hz / (2 * design.params.half)
    return (
        f"A DAC of {stage.bits} bits, frames of {stage.frame_bits} bits at {serial_hz / 1e6:.4g} MHz in mode "
        f"{stage.mode}, {design.frame_clocks} clocks each, one at an actuation.{setup} At rest `dac_clear_n` is low "
        "and the chip select high. The level of `dac_clear_n` must hold the DAC at its middle code, or its output at "
        "ground: an input that acts at the edge alone is overtaken by a frame that ends with it. A load pin is tied to "
        "act at once. On a scope the output goes to the middle when `dac_clear_n` falls, in the middle of a frame, too."
    )


WHAT: dict[str, Callable[[AxisSpec | AxesSpec], str]] = {"pdm": _pdm, "pwm": _pwm, "dac": _dac}
"""The text on a stage and its signals, by its name."""
