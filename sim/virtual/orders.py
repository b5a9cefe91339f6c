"""A person's orders to a running virtual board: hold and push the handle, cut a wire, stop the clock."""

from collections.abc import Callable
from dataclasses import dataclass

from ...model.checks import shown
from ..rtl.board_library import SWITCHES, WIRES, Level
from .serial_port import Line
from .virtual_board import VirtualBoard

PUSH_MAX_N = 1000.0
DROPS_MAX = 1e6
FREE = "free"
"""The word for a hand that lets go."""


class OrderError(ValueError):
    """An invalid order; the one line of the message says what is accepted."""


@dataclass(frozen=True)
class Order:
    """An order.

    Attributes:
        operand: the name of what follows it.
        obey: does it.
        accepted: the words that may follow; empty for a number.
    """

    operand: str
    obey: Callable[[VirtualBoard, Line, str], None]
    accepted: tuple[str, ...] = ()


def _number(text: str, least: float, most: float, unit: str) -> float:
    """Return the number that a text is; raise OrderError if it is not `least` to `most`."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not least <= value <= most:
        raise OrderError(f"must be followed by {least:g} to {most:g} {unit}, not {shown(text)}")
    return value


def _hold(board: VirtualBoard, line: Line, text: str) -> None:
    travel_mm = board.scene.spec.travel_m * 1e3
    board.hand.held_m = None if text == FREE else _number(text, -travel_mm, travel_mm, f"mm, or {FREE}") / 1e3


def _push(board: VirtualBoard, line: Line, text: str) -> None:
    board.hand.push_n = _number(text, -PUSH_MAX_N, PUSH_MAX_N, "N")


def _drop(board: VirtualBoard, line: Line, text: str) -> None:
    line.drops += int(_number(text, 1, DROPS_MAX, "bytes"))


def _motor(board: VirtualBoard, line: Line, text: str) -> None:
    board.reversed = text == "swapped"


def _wire(level: Level) -> Callable[[VirtualBoard, Line, str], None]:
    return lambda board, line, name: board.hardware.wire(name, level)


def _switch(on: bool) -> Callable[[VirtualBoard, Line, str], None]:
    return lambda board, line, name: board.hardware.switch(name, on)


ORDERS = {
    "hold": Order("MM", _hold),
    "push": Order("N", _push),
    "cut": Order("WIRE", _wire("low"), WIRES),
    "high": Order("WIRE", _wire("high"), WIRES),
    "invert": Order("WIRE", _wire("inverted"), WIRES),
    "mend": Order("WIRE", _wire("sound"), WIRES),
    "open": Order("LOOP", _switch(False), SWITCHES),
    "close": Order("LOOP", _switch(True), SWITCHES),
    "drop": Order("BYTES", _drop),
    "motor": Order("HOW", _motor, ("swapped", "right")),
}
"""The orders by name."""


def obey(board: VirtualBoard, line: Line, text: str) -> None:
    """Do what a line of text says.

    Raises:
        OrderError: if it is no order.
    """
    name, *operands = text.split() or [""]
    if name not in ORDERS:
        raise OrderError(f"the order must be one of {', '.join(ORDERS)}, not {shown(name)}")
    order = ORDERS[name]
    if len(operands) != 1:
        raise OrderError(f"the order must be `{name} {order.operand}`, not {shown(text.strip())}")
    if order.accepted and operands[0] not in order.accepted:
        raise OrderError(f"{name} must be followed by one of {', '.join(order.accepted)}, not {shown(operands[0])}")
    try:
        order.obey(board, line, operands[0])
    except OrderError as error:
        raise OrderError(f"{name} {error}") from None
