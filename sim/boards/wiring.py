"""The wiring of a board, as a page of Markdown: every signal, its pins, its level, and how to check it."""

from collections.abc import Iterable

from ...model.axes.axis import AxesSpec
from ...model.spec import AxisSpec
from .description import Description
from .drive import drive
from .signals import Signal, signals_of, signals_of_axes

PULLS = {"up": "up", "down": "down", "none": ""}
RECEIVERS = """\
- **No pin takes 5 V, and none takes RS-422.** An encoder with differential outputs needs receivers that run from 3.3 V,
  with the encoder's 120 Ω across each pair. Of Texas Instruments: the AM26LV32 (data sheet SLLS202), four in a package,
  to 32 MHz and a common mode of -0.3 to 5.5 V, so with the encoder's ground beside the pairs; or the SN65HVD30 and 33
  (SLLS665), one in a package beside a driver that stays unused, to 25 Mbit/s and a common mode of -7 to 12 V. The
  SN65HVD31 and 34 end at 5, the 32 and 35 at 1 Mbit/s; a bit is two counts.
- **An encoder of 5 V with single outputs** needs inputs that stand 5 V at a supply of 3.3 V: an SN74LVC1G17 (SCES351)
  for each wire, or an SN74LVC14A (SCAS285), six in a package, two in series for each wire because it inverts. One alone
  leaves A and B in their order, but turns the index around. Open-collector outputs need their resistors to 5 V.
- **A complement is a wire of its own.** `encoder_a_n` and `encoder_b_n` come from receivers of their own at the same
  pairs, with their inputs swapped: with the index that is five. Both receivers of a pair that is open, shorted or cut
  are high then, by their fail-safe, and that is what `encoder_loss` sees: it needs receivers that promise it for a pair
  with its 120 Ω, as these do. Without complements leave both open and the cause `encoder_loss` off.
- **Resistors outside**, beside the board, at every pin that the table marks: they hold it low, or high, before the FPGA
  is configured, while it is loaded, and when the board has lost its supply.
- **Loops** close to the board's 3.3 V. What opens them (a button, a relay of the amplifier) stands in series.
- The ground of encoder, receivers and amplifier is the board's, joined beside the header.
"""


def wiring(board: Description, spec: AxisSpec, picture: str) -> str:
    """Return the page for an axis on a board; `picture` is the name of the picture's file beside it."""
    shown = f"![The headers with the signals and the FPGA's pins]({picture})"
    return _page(board, shown, table(board, spec.stage.name), drive(spec))


def wiring_of_axes(board: Description, spec: AxesSpec) -> str:
    """Return the page for several axes on a board, with their pins."""
    said = (
        f"{spec.axes} axes, each with six pins that end in its number. The loops are there once, for all of them, and "
        "there are no pins for complements: leave the cause `encoder_loss` off."
    )
    return _page(board, said, table_of(board, signals_of_axes(spec.axes)), drive(spec))


def _page(board: Description, shown: str, signals: str, drives: str) -> str:
    """Return the page of a board: its picture, the table of its signals, and the text on its drive."""
    notes = "\n".join(f"- {note}" for note in (f"At power-up {board.power_up}.", *board.notes))
    sources = "\n".join(f"- {source}" for source in board.sources)
    return f"""\
# Wiring of `{board.name}`: {board.title}

Generated from the description of the board. **It was not tried on real hardware**: before anything is connected, hold
it against the board's own papers, and follow the checklist of the page *Connect a motor safely*.

{shown}

All levels are LVCMOS of 3.3 V. "Pull" is the resistor inside the part, tens of kΩ, which comes with the configuration.

{signals}
## The drive

{drives}
## Before anything is connected

{notes}
{RECEIVERS}
## The serial line

{serial(board)}
## Where the pins are from

{sources}
"""


def table(board: Description, stage: str) -> str:
    """Return the table of every signal of a board with a drive stage."""
    return table_of(board, signals_of(stage))


def table_of(board: Description, signals: Iterable[Signal]) -> str:
    """Return the table of some signals of a board."""
    lines = [
        "| signal | direction | where | FPGA pin | pull | outside | what it is | at rest |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for signal in signals:
        pin = board.pins[signal.name]
        cells = (f"`{signal.name}`", _direction(signal), pin.at, pin.site, PULLS[pin.pull], signal.outside)
        lines.append(f"| {' | '.join((*cells, signal.what, signal.rest))} |")
    return "\n".join(lines) + "\n"


def _direction(signal: Signal) -> str:
    return "out" if signal.out else "in"


def serial(board: Description) -> str:
    """Return which serial port of a PC is the board's line."""
    port = board.serial
    if port.ports == 1:
        which = "the only port of its USB bridge"
    else:
        which = (
            f"port {port.port} of the {port.ports} of its USB bridge, counted from 0; the other one loads bitstreams"
        )
    timer = (
        "The bridge keeps bytes for up to 16 ms: set its latency timer to 1 ms."
        if port.latency
        else "The bridge only behaves like one of FTDI; whether it has their latency timer is not known."
    )
    return f"It is {which}: `/dev/serial/by-id/{port.by_id}`, with the USB ids {port.vendor}:{port.product}. {timer}\n"
