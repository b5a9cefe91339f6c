"""A picture of a board's headers, with the signals at their pins, as SVG."""

from html import escape

from .description import Description
from .signals import USUAL, Signal, signals_of

WIDE, HIGH, GAP, HEAD = 34, 160, 10, 24
"""A position's width and height, the gap between rows, and the height of a line of text; px."""
LEAST_WIDE = 620
"""The width of the legend, px."""
COLOURS = {"in": "#cfe3f7", "out": "#fbd9b5", "GND": "#d0d0d0", "3V3": "#f3c4c4", "": "#ffffff"}
"""The fill of a position by what it is: driven from outside, driven by the FPGA, supply, or not used."""
LEGEND = {"in": "input of the FPGA", "out": "output of the FPGA", "3V3": "3.3 V", "GND": "ground", "": "not used"}


def picture(board: Description, stage: str = USUAL) -> str:
    """Return the SVG of all headers of a board with a drive stage, side by side."""
    drawn, left, low = [], GAP, 0
    for header in board.headers:
        top = GAP + HEAD
        drawn.append(_text(left, top - GAP, header.title, 14, "bold"))
        for row in header.rows:
            for place, name in enumerate(row):
                at = f"{header.name} {name}"
                signal = next((each for each in signals_of(stage) if board.pins[each.name].at == at), None)
                site = board.pins[signal.name].site if signal else ""
                drawn.append(_position(name, signal, site, left + WIDE * place, top))
            top += HIGH + GAP
        left, low = left + WIDE * max(map(len, header.rows)) + 2 * GAP, max(low, top)
    drawn += _legend(low)
    size = f"{max(left, LEAST_WIDE)} {low + HEAD}"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" font-family="sans-serif">'
    return "\n".join([head, '<rect width="100%" height="100%" fill="#ffffff"/>', *drawn, "</svg>"]) + "\n"


def _position(name: str, signal: Signal | None, site: str, left: int, top: int) -> str:
    """Return the SVG of a position: its name above, and below it, upright, the signal and the FPGA's pin."""
    kind = name if signal is None else "out" if signal.out else "in"
    box = (
        f'<rect x="{left}" y="{top}" width="{WIDE}" height="{HIGH}" fill="{COLOURS.get(kind, COLOURS[""])}" '
        'stroke="#505050"/>'
    )
    label = _text(left + WIDE // 2, top + 17, name, 12, "bold", "middle")
    if signal is None:
        return box + label
    text = f"{signal.name} ({site})"
    across, low = left + WIDE // 2 + 5, top + HIGH - 8
    return box + label + f'<g transform="rotate(-90 {across} {low})">{_text(across, low, text, 13)}</g>'


def _legend(top: int) -> list[str]:
    drawn, left = [], GAP
    for kind, meaning in LEGEND.items():
        drawn.append(f'<rect x="{left}" y="{top}" width="14" height="14" fill="{COLOURS[kind]}" stroke="#505050"/>')
        drawn.append(_text(left + 20, top + 12, meaning, 12))
        left += 40 + 7 * len(meaning)
    return drawn


def _text(left: int, base: int, text: str, size: int, weight: str = "normal", anchor: str = "start") -> str:
    return (
        f'<text x="{left}" y="{base}" font-size="{size}" font-weight="{weight}" text-anchor="{anchor}">'
        f"{escape(text)}</text>"
    )
