"""What goes to which pin of a board, from the board's description."""

from hardwall.sim.boards.description import BOARDS, Description, Pin
from hardwall.sim.boards.signals import USUAL, Signal, signals_of

from .sheet import BLUE, GREY, ORANGE, PURPLE, RED, YELLOW, Box, Sheet, Tone, bold, code, small

GROUPS: dict[str, tuple[Tone, dict[str, str]]] = {
    "encoder, receivers of 3.3 V": (
        BLUE,
        {
            "encoder_a": "channel A",
            "encoder_a_n": "complement of A, optional",
            "encoder_b": "channel B",
            "encoder_b_n": "complement of B, optional",
            "encoder_z": "index Z",
        },
    ),
    "loops, closed to 3.3 V": (
        RED,
        {
            "drive_enable": "enable relay",
            "external_fault": "fault contact of amplifier",
            "emergency_stop": "emergency stop",
        },
    ),
    f"amplifier, stage {USUAL}": (
        ORANGE,
        {
            "drive_pdm": "pulses: size of the force",
            "drive_sign": "sign of the force",
            "alive": "charge pump of its enable",
        },
    ),
    "USB bridge, to a PC": (PURPLE, {"uart_rx": "serial line, host to board", "uart_tx": "serial line, board to host"}),
    "reset": (GREY, {"rst": "high resets the board"}),
}
"""What is connected, in groups: the colours, and every signal with what its wire is."""
ON_BOARD = {"clk"}
"""Signals that nobody has to connect."""
LOOPS = "loops, closed to 3.3 V"
ROW, HEAD, GAP, TOP = 25, 27, 10, 62
BOARD, OUTSIDE = Box(16, 14, 318, 0), Box(428, 0, 256, 0)


def draw(name: str) -> str:
    """Return the diagram of a board's variant."""
    board, signals = BOARDS[name], {signal.name: signal for signal in signals_of(USUAL)}
    if {each for _, wires in GROUPS.values() for each in wires} != set(signals) - ON_BOARD:
        raise ValueError(f"the wires must be those of the signals, {', '.join(signals)}")
    heights = [HEAD + ROW * len(wires) + 6 for _, wires in GROUPS.values()]
    bottom = TOP + sum(heights) + GAP * (len(heights) - 1)
    sheet = Sheet(bottom + 56)
    _board(sheet, board, bottom)
    top = float(TOP)
    for (title, (tone, wires)), high in zip(GROUPS.items(), heights, strict=True):
        sheet.box(Box(OUTSIDE.left, top, OUTSIDE.wide, high), tone=tone)
        sheet.text((OUTSIDE.left + 12, top + HEAD / 2 + 2), bold(title, 14), align="left")
        for place, (signal, said) in enumerate(wires.items()):
            y = top + HEAD + ROW * (place + 0.5)
            _pin(sheet, y, board.pins[signal], signal)
            sheet.text((OUTSIDE.left + 12, y), said, align="left")
            _wire(sheet, y, signals[signal], title == LOOPS)
        top += high + GAP
    outside = {signal.outside for signal in signals.values() if signal.outside}
    sheet.dot((BOARD.left + 18, bottom + 36), 4.5)
    sheet.text((BOARD.left + 28, bottom + 36), small(f"a resistor outside: {', '.join(sorted(outside))}"), align="left")
    sheet.text((OUTSIDE.right, bottom + 36), small("no pin takes 5 V"), align="right")
    return sheet.svg()


def _board(sheet: Sheet, board: Description, bottom: float) -> None:
    """Draw the board with its name and the heads of its columns."""
    sheet.box(Box(BOARD.left, BOARD.top, BOARD.wide, bottom + 6 - BOARD.top), tone=YELLOW)
    sheet.text((BOARD.left + 14, 34), bold(board.title.partition(",")[0]), align="left")
    for x, head in zip(_columns(), ("", "FPGA pin", "signal"), strict=True):
        sheet.text((x, 56), small(head), align="left")


def _columns() -> tuple[float, float, float]:
    """Return the left sides of place, FPGA pin and signal."""
    return BOARD.left + 14, BOARD.left + 128, BOARD.left + 194


def _pin(sheet: Sheet, y: float, pin: Pin, signal: str) -> None:
    """Write where a pin can be reached, its name of the FPGA's, and its signal."""
    place, site, name = _columns()
    sheet.text((place, y), bold(pin.at.partition(",")[0], 14), align="left")
    sheet.text((site, y), code(pin.site), align="left")
    sheet.text((name, y), code(signal), align="left")


def _wire(sheet: Sheet, y: float, signal: Signal, loop: bool) -> None:
    """Draw a wire in its direction, with a closed switch in a loop, and a dot for a resistor outside."""
    ends = (BOARD.right, y), (OUTSIDE.left, y)
    sheet.wire(*(ends if signal.out else ends[::-1]))
    if signal.outside:
        sheet.dot((BOARD.right + 22, y), 4.5)
    if loop:
        middle = (BOARD.right + OUTSIDE.left) / 2 + 12
        for x in (middle - 13, middle + 13):
            sheet.dot((x, y), 3.5, "#ffffff")
        sheet.wire((middle, y), (middle, y - 8), heads="-")
        sheet.wire((middle - 6, y - 8), (middle + 6, y - 8), heads="-")
