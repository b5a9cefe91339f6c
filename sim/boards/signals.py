"""The signals of `top`, the same on every board: their meaning and their connection."""

from dataclasses import dataclass, replace
from typing import Literal

Outside = Literal["", "1 kΩ to ground", "10 kΩ to 3.3 V"]
DOWN: Outside = "1 kΩ to ground"
UP: Outside = "10 kΩ to 3.3 V"


@dataclass(frozen=True)
class Signal:
    """A pin of `top`.

    Attributes:
        name: its name in the Verilog, and in the constraints.
        out: whether the FPGA drives it.
        what: its meaning, and its connection.
        outside: the resistor that it must have outside the FPGA.
        rest: what a scope shows while nothing but the supply is connected and the axis is DISARMED.
    """

    name: str
    out: bool
    what: str
    outside: Outside = ""
    rest: str = ""


_CHANNEL = "of the encoder, from a receiver of 3.3 V"
_LOOP = "closed to 3.3 V while all is well; open means stop"

_BEFORE = (
    Signal("clk", False, "the board's oscillator", "", "the oscillator's frequency"),
    Signal("rst", False, "resets while high", "", "low; high while the button is pressed"),
    Signal("encoder_a", False, f"channel A {_CHANNEL}", "", "high while nothing is connected"),
    Signal("encoder_a_n", False, f"complement of channel A {_CHANNEL}", "", "high while nothing is connected"),
    Signal("encoder_b", False, f"channel B {_CHANNEL}", "", "high while nothing is connected"),
    Signal("encoder_b_n", False, f"complement of channel B {_CHANNEL}", "", "high while nothing is connected"),
    Signal("encoder_z", False, f"index {_CHANNEL}", "", "the level of its pull"),
    Signal("drive_enable", False, f"loop of the drive's enable, {_LOOP}", DOWN, "low: open"),
    Signal("external_fault", False, f"loop of the amplifier's fault, {_LOOP}", DOWN, "low: open"),
    Signal("emergency_stop", False, f"loop of the emergency stop, {_LOOP}", DOWN, "low: open"),
)
_BEHIND = (
    Signal("alive", True, "square wave while ARMED, to the charge pump of the amplifier's enable", DOWN, "low"),
    Signal("uart_rx", False, "from the board's own USB bridge", "", "high, and bytes of a host"),
    Signal("uart_tx", True, "to the board's own USB bridge", "", "high, and the answers"),
)
OF_STAGE = {
    "pdm": (
        Signal("drive_pdm", True, "pulses whose density is the magnitude of the force, to the amplifier", DOWN, "low"),
        Signal("drive_sign", True, "sign of the force, to the amplifier", DOWN, "low"),
    ),
    "pwm": (
        Signal("gate_high_a", True, "high gate of the bridge's leg A, to its driver", DOWN, "low"),
        Signal("gate_low_a", True, "low gate of leg A, to its driver", DOWN, "low"),
        Signal("gate_high_b", True, "high gate of leg B, to its driver", DOWN, "low"),
        Signal("gate_low_b", True, "low gate of leg B, to its driver", DOWN, "low"),
    ),
    "dac": (
        Signal("dac_clear_n", True, "clear of the DAC, or its reset: low holds it at its middle code", DOWN, "low"),
        Signal("dac_cs_n", True, "chip select of the DAC", UP, "high"),
        Signal("dac_sclk", True, "serial clock of the DAC", DOWN, "the level of its mode"),
        Signal("dac_mosi", True, "serial data of the DAC", DOWN, "low"),
    ),
}
"""The pins of each drive stage; the pin with the safe level comes first."""
USUAL = "pdm"
"""The stage of a scene that has none."""
OF_AXIS = "encoder_a", "encoder_b", "encoder_z", "alive", "drive_pdm", "drive_sign"
"""The signals that each of several axes has."""
SHARED_LOOPS = "drive_enable", "external_fault", "emergency_stop"
"""The loops; all axes share one set."""
EVERY = (*_BEFORE, *(signal for signals in OF_STAGE.values() for signal in signals), *_BEHIND)
"""All signals that any board of ours has."""


def signals_of(stage: str) -> tuple[Signal, ...]:
    """Return the signals of a board with a drive stage, in the order of the tables."""
    return (*_BEFORE, *OF_STAGE[stage], *_BEHIND)


def signals_of_axes(axes: int) -> tuple[Signal, ...]:
    """Return the signals of a board with several axes; an axis's signals end in its number."""
    alone = {signal.name: signal for signal in signals_of(USUAL)}
    theirs = [replace(alone[name], name=f"{name}_{axis}") for axis in range(axes) for name in OF_AXIS]
    once = [alone[name] for name in ("clk", "rst", *SHARED_LOOPS)]
    return (*once, *theirs, alone["uart_rx"], alone["uart_tx"])
