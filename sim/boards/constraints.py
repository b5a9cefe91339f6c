"""Files of pins for the placers, written from a description: .lpf for the ECP5, .pcf for the iCE40, .cst for Gowin."""

from collections.abc import Iterable

from .description import Description, Pin
from .signals import USUAL, Signal, signals_of

DRIVE_MA = 4
"""The strength of outputs that are not a serial line's: enough for a receiver, and slow enough for a wire."""


def constraints(board: Description, stage: str = USUAL) -> str:
    """Return the text of the file of pins of a board with a drive stage."""
    return constraints_of(board, signals_of(stage))


def constraints_of(board: Description, signals: Iterable[Signal]) -> str:
    """Return the text of the file of pins of a board with some signals."""
    write = WRITERS[board.part.suffixes.pins]
    head, line, mark = write["head"], write["line"], write["comment"]
    about = [
        f"{board.title}: the pins of `top`, for {board.part.nextpnr[0].removeprefix('yowasp-')}.",
        "Generated from the description of the board, as WIRING.md is, which says what to connect.",
        *board.sources,
    ]
    lines = [*(f"{mark} {each}" for each in about), "", *head]
    for signal in signals:
        pin = board.pins[signal.name]
        lines += [f"{mark} {signal.name}: {pin.at}", *line(signal, pin)]
    return "\n".join(lines) + "\n"


def _lpf(signal: Signal, pin: Pin) -> list[str]:
    drive = f" DRIVE={DRIVE_MA}" if signal.out else ""
    pull = "" if signal.out else f" PULLMODE={pin.pull.upper()}"
    return [
        f'LOCATE COMP "{signal.name}" SITE "{pin.site}";',
        f'IOBUF PORT "{signal.name}" IO_TYPE=LVCMOS33{pull}{drive};',
    ]


def _pcf(signal: Signal, pin: Pin) -> list[str]:
    pull = "-pullup yes " if pin.pull == "up" else ""
    return [f"set_io {pull}{signal.name} {pin.site}"]


def _cst(signal: Signal, pin: Pin) -> list[str]:
    drive = f" DRIVE={DRIVE_MA}" if signal.out else ""
    pull = "" if signal.out and pin.pull == "none" else f" PULL_MODE={pin.pull.upper()}"
    return [f'IO_LOC "{signal.name}" {pin.site};', f'IO_PORT "{signal.name}" IO_TYPE=LVCMOS33{pull}{drive};']


WRITERS = {
    ".lpf": {"comment": "#", "head": ["BLOCK RESETPATHS;", "BLOCK ASYNCPATHS;"], "line": _lpf},
    ".pcf": {"comment": "#", "head": [], "line": _pcf},
    ".cst": {"comment": "//", "head": [], "line": _cst},
}
"""The writers, by the end of a file's name."""
