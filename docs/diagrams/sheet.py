"""How every diagram looks: its size, colours and letters, and the few shapes that all of them are made of.

A sheet is measured in pixels, from its left upper corner, y downwards. It is `WIDE` pixels wide, as a page shows it, so
that a size of letters is what a reader sees. Its ground is white, with round corners: it reads in a dark theme, too.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple
from xml.etree import ElementTree

import schemdraw
from schemdraw.elements import Element
from schemdraw.segments import Segment, SegmentCircle, SegmentPath, SegmentText

schemdraw.use("svg")
# Letters stay letters, and their place does not depend on how a program reads `dominant-baseline`.
schemdraw.svgconfig.text = "text"
schemdraw.svgconfig.useBatik = True

WIDE = 700
TEXT, SMALL, LARGE = 15, 13, 17
LEADING = 1.28
"""The distance of two lines of text, by the size of the letters."""
ROUND = 8
INK, SOFT, LINE = "#1b1f24", "#565d66", "#4a525c"
FONTS = {"sans": {}, "bold": {"font-weight": "bold"}, "mono": {"font-family": "monospace"}}
"""The attributes of letters by the name of a font."""
Place = tuple[float, float]


class Tone(NamedTuple):
    """The colours of a box, and of what belongs to it."""

    fill: str
    edge: str


PLAIN, GREY = Tone("#ffffff", "#6b7480"), Tone("#eef0f3", "#6b7480")
BLUE, GREEN = Tone("#dcebfa", "#0b5394"), Tone("#d8f0e2", "#1a7446")
ORANGE, RED = Tone("#fde7d2", "#b0500a"), Tone("#fadcdb", "#b3261e")
PURPLE, YELLOW = Tone("#e9e2f6", "#6a3fa0"), Tone("#fdf3c6", "#8a6d00")


class Line(NamedTuple):
    """A line of text."""

    text: str
    size: float = TEXT
    ink: str = INK
    font: str = "sans"


def bold(text: str, size: float = TEXT, ink: str = INK) -> Line:
    """Return a line in heavy letters."""
    return Line(text, size, ink, "bold")


def small(text: str, ink: str = SOFT) -> Line:
    """Return a line in small letters."""
    return Line(text, SMALL, ink)


def code(text: str, size: float = 14, ink: str = INK) -> Line:
    """Return a line as it stands in the code."""
    return Line(text, size, ink, "mono")


class Box(NamedTuple):
    """Where a box is."""

    left: float
    top: float
    wide: float
    high: float

    @property
    def right(self) -> float:
        return self.left + self.wide

    @property
    def bottom(self) -> float:
        return self.top + self.high

    @property
    def x(self) -> float:
        """The middle, across."""
        return self.left + self.wide / 2

    @property
    def y(self) -> float:
        """The middle, downwards."""
        return self.top + self.high / 2

    @property
    def north(self) -> Place:
        return self.x, self.top

    @property
    def south(self) -> Place:
        return self.x, self.bottom

    @property
    def west(self) -> Place:
        return self.left, self.y

    @property
    def east(self) -> Place:
        return self.right, self.y


class _Shape(Element):
    """A part of a sheet: schemdraw's y goes up, and its unit is a pixel here."""

    _element_defaults = {"theta": 0}  # noqa: RUF012  (schemdraw's own way)

    def __init__(self, segment: Segment | SegmentCircle | SegmentPath | SegmentText):
        super().__init__()
        self.segments.append(segment)


class Sheet:
    """A diagram under way.

    Args:
        high: its height, px.
    """

    def __init__(self, high: float):
        self._high = high
        self._drawing = schemdraw.Drawing(show=False, inches_per_unit=1 / 72, margin=0)

    def box(self, at: Box, *lines: Line | str, tone: Tone = PLAIN, dashed: bool = False, lw: float = 1.6) -> Box:
        """Draw a box with lines of text in its middle; return where it is."""
        r = min(ROUND, at.high / 2, at.wide / 2)
        left, top, right, bottom = at.left, -at.top, at.right, -at.bottom
        path: list = ["M", (left + r, top), "L", (right - r, top), "Q", (right, top), (right, top - r)]
        path += ["L", (right, bottom + r), "Q", (right, bottom), (right - r, bottom)]
        path += ["L", (left + r, bottom), "Q", (left, bottom), (left, bottom + r)]
        path += ["L", (left, top - r), "Q", (left, top), (left + r, top), "Z"]
        style = {"color": tone.edge, "fill": tone.fill, "lw": lw, "ls": "--" if dashed else "-"}
        self._add(SegmentPath(path, zorder=1, **style))
        self.text((at.x, at.y), *lines)
        return at

    def text(self, at: Place, *lines: Line | str, align: str = "center") -> None:
        """Write lines below each other, with their middle at a place."""
        every = [Line(line) if isinstance(line, str) else line for line in lines]
        x, y = at[0], at[1] - sum(line.size * LEADING for line in every) / 2
        for line in every:
            y += line.size * LEADING / 2
            segment = SegmentText(
                (x, -y), line.text, (align, "center"), fontsize=line.size, font=line.font, color=line.ink, zorder=4
            )
            self._add(segment)
            y += line.size * LEADING / 2

    def wire(self, *places: Place, ink: str = LINE, lw: float = 1.8, dashed: bool = False, heads: str = "->") -> None:
        """Draw a line through places, with an arrow at its end unless `heads` says otherwise."""
        style = {"color": ink, "lw": lw, "ls": "--" if dashed else "-", "joinstyle": "round"}
        arrow = heads if set(heads) & set("<>") else None
        path = [(x, -y) for x, y in places]
        self._add(Segment(path, arrow=arrow, arrowwidth=9, arrowlength=11, zorder=2, **style))

    def dot(self, at: Place, radius: float, fill: str = INK) -> None:
        """Draw a dot, on top of a wire."""
        self._add(SegmentCircle((at[0], -at[1]), radius, color=INK, fill=fill, lw=1.4, zorder=3))

    def grid(self, places: Iterable[float], top: float, bottom: float) -> None:
        """Draw pale lines downwards, behind all else."""
        for x in places:
            self._add(Segment([(x, -top), (x, -bottom)], color="#dfe3e8", lw=1, zorder=0))

    def chain(self, *boxes: Box) -> None:
        """Draw an arrow from every box to the next one on its right."""
        for before, behind in pairwise(boxes):
            self.wire(before.east, behind.west)

    def span(
        self, left: float, right: float, y: float, *lines: Line | str, ink: str = LINE, above: bool = True
    ) -> None:
        """Draw a measure from one place across to another, with its text above or below."""
        for x in (left, right):
            self.wire((x, y - 5), (x, y + 5), ink=ink, lw=1.4, heads="-")
        self.wire((left, y), (right, y), ink=ink, lw=1.4, heads="<->" if right - left > 26 else "-")
        every = [Line(line, SMALL) if isinstance(line, str) else line for line in lines]
        off = 7 + sum(line.size * LEADING for line in every) / 2
        self.text(((left + right) / 2, y - off if above else y + off), *every)

    def _add(self, segment: Segment | SegmentCircle | SegmentPath | SegmentText) -> None:
        self._drawing.add(_Shape(segment).at((0, 0)).hold())

    def svg(self) -> str:
        """Return the diagram as SVG, the same bytes every time."""
        drawn = ElementTree.fromstring(self._drawing.get_imagedata("svg"))
        size = {"width": f"{WIDE}", "height": _short(self._high), "viewBox": f"0 0 {WIDE} {_short(self._high)}"}
        root = ElementTree.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", **size, "font-family": "sans-serif"})
        ground = {"width": f"{WIDE}", "height": _short(self._high), "rx": "12", "fill": "#ffffff"}
        ElementTree.SubElement(root, "rect", ground)
        root.extend(_tidied(each) for each in drawn)
        ElementTree.indent(root)
        return ElementTree.tostring(root, encoding="unicode") + "\n"


def _short(number: float) -> str:
    """Return a number to a tenth of a pixel."""
    return f"{round(number, 1) + 0.0:.1f}".removesuffix(".0")


def _tidied(drawn: ElementTree.Element) -> ElementTree.Element:
    """Return an element of schemdraw's without its namespace, with short numbers and a text in one piece."""
    kept = ElementTree.Element(drawn.tag.rpartition("}")[2])
    if kept.tag == "text":
        kept.text = "".join(drawn.itertext())
        size = float(drawn.get("font-size", TEXT))
        places = {"x": _short(float(drawn.get("x", 0))), "y": _short(float(drawn.get("y", 0)) + size)}
        kept.attrib |= places | {name: drawn.get(name, "") for name in ("fill", "font-size", "text-anchor")}
        kept.attrib |= FONTS[drawn.get("font-family", "sans")]
        return kept
    for name, value in drawn.attrib.items():
        if name == "style":
            # Of a line without dashes schemdraw says so in a way that SVG does not know.
            kept.set(name, value.replace("stroke-dasharray:-;", "").rstrip(";"))
        else:
            kept.set(name, re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda found: _short(float(found[0])), value))
    return kept


def row(left: float, right: float, count: int, gap: float) -> Sequence[tuple[float, float]]:
    """Return the left sides and the widths of boxes that fill a row."""
    wide = (right - left - gap * (count - 1)) / count
    return [(left + k * (wide + gap), wide) for k in range(count)]
