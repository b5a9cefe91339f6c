"""The Verilog around `board` on a part: its clock from the board's oscillator, the internal one, and the pads."""

import re
from collections.abc import Iterable
from typing import NamedTuple

from .description import Description
from .signals import OF_AXIS, OF_STAGE, SHARED_LOOPS, USUAL, Signal, signals_of, signals_of_axes

MODULE = "top"
INSIDE = {"oscillator", "outputs_enable"}
"""Ports of `board` that are no pins."""
HEAD = re.compile(r"\ufeff?// (.+): the clock of `board` is (\d+) Hz, its drive (.+?)\.")
"""How a file with `top` begins, perhaps behind the mark of UTF-8: the board, the clock of the axis, and its drive."""
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
    pads, names = pads_of(stage), [signal.name for signal in signals_of(stage)]
    held = "pull-downs" if stage == USUAL else "resistors"
    connected = {name: name for name in names} | pads
    return _verilog(Top(board, clock_hz, stage, signals_of(stage), pads, connected, held))


def top_of_axes(board: Description, clock_hz: int, axes: int) -> str:
    """Return the Verilog of `top` with several axes, and of the two modules that make its clocks.

    Raises:
        ClockError: if the board cannot make the clock.
    """
    wires = {"drive_pdm": "pdm", "drive_sign": "sign", "alive": "pump"}
    pads = {f"{name}_{axis}": f"{wire}_{axis}" for axis in range(axes) for name, wire in wires.items()}
    connected = {name: name for name in ("uart_rx", "uart_tx", *SHARED_LOOPS)}
    for name in OF_AXIS:
        pins = (f"{name}_{axis}" for axis in reversed(range(axes)))
        connected[name] = f"{{{', '.join(pads.get(pin, pin) for pin in pins)}}}"
    drive = drive_of_axes(axes)
    return _verilog(Top(board, clock_hz, drive, signals_of_axes(axes), pads, connected, "pull-downs"))


class Made(NamedTuple):
    """The board, clock and drive of a `top`.

    Attributes:
        board: the title of the board.
        clock_hz: the clock of `board`.
        drive: the drive stage; of several axes, what `drive_of_axes` returns.
    """

    board: str
    clock_hz: int
    drive: str


def made_for(text: str) -> Made | None:
    """Return the board, clock and drive of a `top` written by this module; None for any other text."""
    found = HEAD.match(text)
    return Made(found[1], int(found[2]), found[3]) if found else None


def drive_of_axes(axes: int) -> str:
    """Return the drive of several axes as a head names it: one axis of several has other ports than an axis alone."""
    return f"{USUAL} of axis 0 to {axes - 1}"


class Top(NamedTuple):
    """The parts of a `top`.

    Attributes:
        board: the board.
        clock_hz: the clock of `board`.
        drive: its drive, as in `Made`.
        signals: its pins.
        pads: pins with buffers, and the wires behind these.
        connected: the connections of the ports of `board`, except clock, reset and inner signals.
        held: what holds the pins of the drive outside.
    """

    board: Description
    clock_hz: int
    drive: str
    signals: tuple[Signal, ...]
    pads: dict[str, str]
    connected: dict[str, str]
    held: str


def _verilog(top: Top) -> str:
    """Return the Verilog of a top."""
    board, clock_hz, pads, held = top.board, top.clock_hz, top.pads, top.held
    setting = board.setting(clock_hz)
    if setting is None:
        how, cell = "The clock is the oscillator's own.", WITHOUT_PLL
    else:
        dividers = ", ".join(f"{name} {number}" for name, number in setting.dividers)
        how = f"The clock is made of {board.oscillator_hz} Hz by {dividers}; VCO {setting.vco / 1_000_000} MHz."
        cell = board.part.pll.cell(board.oscillator_hz, setting)
    own = {"clk": "clock", "rst": "rst | ~locked", "oscillator": "oscillator", "outputs_enable": "outputs_enable"}
    connected = top.connected | own
    return f"""\
// {board.title}: the clock of `board` is {clock_hz} Hz, its drive {top.drive}. {how}
// Generated; the pins are in the file of constraints beside it, and what to connect to them in WIRING.md.

module top (
{_ports(top.signals)}
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


def _ports(signals: Iterable[Signal]) -> str:
    return ",\n".join(f"    {'output' if signal.out else 'input'} {signal.name}" for signal in signals)


def _connections(connected: dict[str, str]) -> str:
    return ",\n".join(f"        .{port}({wire})" for port, wire in connected.items())
