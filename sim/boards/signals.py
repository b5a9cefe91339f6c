"""The signals of `top`, the same on every board: what each is, and what it is to be connected to."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Signal:
    """A pin of `top`.

    Attributes:
        name: its name in the Verilog, and in the constraints.
        out: whether the FPGA drives it.
        what: what it is, and what to connect it to.
        pulled_down: whether it must have a pull-down outside the FPGA.
        rest: what a scope shows while nothing but the supply is connected and the axis is DISARMED.
    """

    name: str
    out: bool
    what: str
    pulled_down: bool = False
    rest: str = ""


_CHANNEL = "of the encoder, from a receiver of 3.3 V"
_LOOP = "closed to 3.3 V while all is well; open means stop"

SIGNALS = tuple(
    Signal(*each)
    for each in (
        ("clk", False, "the board's oscillator", False, "the oscillator's frequency"),
        ("rst", False, "resets while high", False, "low; high while the button is pressed"),
        ("encoder_a", False, f"channel A {_CHANNEL}", False, "high while nothing is connected"),
        ("encoder_a_n", False, f"complement of channel A {_CHANNEL}", False, "high while nothing is connected"),
        ("encoder_b", False, f"channel B {_CHANNEL}", False, "high while nothing is connected"),
        ("encoder_b_n", False, f"complement of channel B {_CHANNEL}", False, "high while nothing is connected"),
        ("encoder_z", False, f"index {_CHANNEL}", False, "the level of its pull"),
        ("drive_enable", False, f"loop of the drive's enable, {_LOOP}", True, "low: open"),
        ("external_fault", False, f"loop of the amplifier's fault, {_LOOP}", True, "low: open"),
        ("emergency_stop", False, f"loop of the emergency stop, {_LOOP}", True, "low: open"),
        ("drive_pdm", True, "pulses whose density is the magnitude of the force, to the amplifier", True, "low"),
        ("drive_sign", True, "sign of the force, to the amplifier", True, "low"),
        ("alive", True, "square wave while ARMED, to the charge pump of the amplifier's enable", True, "low"),
        ("uart_rx", False, "from the board's own USB bridge", False, "high, and bytes of a host"),
        ("uart_tx", True, "to the board's own USB bridge", False, "high, and the answers"),
    )
)
"""All pins, in the order of the tables."""
