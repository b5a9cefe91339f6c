"""The Verilog around `board` on a part: its clock from the board's oscillator, the internal one, and the pads."""

from .description import Description
from .signals import OF_STAGE, USUAL, signals_of

MODULE = "top"
INSIDE = {"oscillator", "outputs_enable"}
"""Ports of `board` that are no pins."""
WITHOUT_PLL = """\
    assign clk = pin;
    assign locked = 1'b1;
"""


def pads_of(stage: str) -> dict[str, str]:
    """Return the pins of a drive stage and of the charge pump, and the wires behind their buffers."""
    return {signal.name: signal.name.partition("_")[2] for signal in OF_STAGE[stage]} | {"alive": "pump"}


def top_verilog(board: Description, clock_hz: int, stage: str = USUAL) -> str:
    """Return the Verilog of `top`, with a drive stage, and of the two modules that make its clocks.

    Raises:
        ClockError: if the board cannot make the clock.
    """
    setting, pads, names = board.setting(clock_hz), pads_of(stage), [signal.name for signal in signals_of(stage)]
    made = f"{board.title}: the clock of `board` is {clock_hz} Hz"
    if setting is None:
        how, cell = f"{made}, the oscillator's own.", WITHOUT_PLL
    else:
        dividers = ", ".join(f"{name} {number}" for name, number in setting.dividers)
        how = f"{made}, from {board.oscillator_hz} Hz by {dividers}; VCO {setting.vco / 1_000_000} MHz."
        cell = board.part.pll.cell(board.oscillator_hz, setting)
    held = "pull-downs" if stage == USUAL else "resistors"
    connected = {"clk": "clock", "rst": "rst | ~locked", "oscillator": "oscillator", "outputs_enable": "outputs_enable"}
    connected = {name: name for name in names} | pads | connected
    return f"""\
// {how}
// Generated; the pins are in the file of constraints beside it, and what to connect to them in WIRING.md.

module top (
{_ports(stage)}
);
    wire clock, locked, oscillator, outputs_enable, {", ".join(pads.values())};

    board_clock board_clock (.pin(clk), .clk(clock), .locked(locked));
    internal_oscillator internal_oscillator (.oscillator(oscillator));

    // A clock that is not locked is a reset.
    board board (
{_connections(connected)}
    );

    // Until the PLL has locked, both clocks run and the reset has ended, the {held} outside hold these.
    wire driven = outputs_enable & locked;
{"".join(f"    assign {pin} = driven ? {wire} : 1'bz;{chr(10)}" for pin, wire in pads.items())}\
endmodule

module board_clock (input pin, output clk, output locked);
{cell}endmodule

module internal_oscillator (output oscillator);
{board.part.oscillator}endmodule
"""


def _ports(stage: str) -> str:
    return ",\n".join(f"    {'output' if signal.out else 'input'} {signal.name}" for signal in signals_of(stage))


def _connections(connected: dict[str, str]) -> str:
    return ",\n".join(f"        .{port}({wire})" for port, wire in connected.items())
