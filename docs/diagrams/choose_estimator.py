"""Which estimator to choose: questions, and where each answer leads."""

from hardwall.model.estimators.registry import ESTIMATORS

from .sheet import BLUE, GREEN, GREY, Box, Place, Sheet, bold, small

QUESTIONS = {
    "axes": (Box(20, 20, 272, 46), "several axes in one pipeline?", ""),
    "stamps": (Box(20, 98, 272, 46), "can the clock stamp edges?", ""),
    "bursts": (Box(20, 176, 272, 46), "edges in bursts?", ""),
    "cells": (Box(20, 258, 272, 54), "logic cells left?", "edges are stamped"),
    "counts": (Box(372, 258, 308, 54), "logic cells left?", "from counts alone"),
}
LEAVES = {
    "axes": (Box(430, 14, 250, 58), "levant", "output u1", ""),
    "mt": (Box(20, 378, 100, 78), "mt", "few cells", ""),
    "edges": (Box(140, 378, 200, 78), "edge-kalman", "learns how well edges", "are in their places"),
    "fewest": (Box(372, 378, 110, 78), "window", "fewest cells", ""),
    "counts": (Box(502, 378, 178, 78), "levant-adaptive", "finds the bound", "of the motion by itself"),
}
"""Where the questions and the estimators are, and their words."""
BUS = 332
"""Where what leads to the counts alone comes down."""


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(478)
    for at, question, note in QUESTIONS.values():
        sheet.box(at, question, *((small(note),) if note else ()), tone=GREY)
    for at, name, *notes in LEAVES.values():
        if name not in ESTIMATORS:
            raise ValueError(f"a leaf must be one of {', '.join(ESTIMATORS)}, not {name!r}")
        sheet.box(at, bold(name), *(small(note) for note in notes if note), tone=GREEN)
    _upper(sheet)
    _left(sheet)
    _right(sheet)
    return sheet.svg()


def _answer(sheet: Sheet, said: str, at: Place, *way: Place, align: str = "left") -> None:
    """Draw an arrow, and beside it the answer that takes it."""
    sheet.wire(*way)
    sheet.text(at, small(said, BLUE.edge), align=align)


def _upper(sheet: Sheet) -> None:
    """Draw the answers to the questions that come first."""
    axes, stamps, bursts, cells, counts = (
        QUESTIONS[name][0] for name in ("axes", "stamps", "bursts", "cells", "counts")
    )
    _answer(sheet, "yes", (axes.right + 8, axes.y - 11), axes.east, LEAVES["axes"][0].west)
    for said, above, below in (("no", axes, stamps), ("yes", stamps, bursts), ("no", bursts, cells)):
        _answer(sheet, said, (above.x + 8, above.bottom + 14), above.south, below.north)
    _answer(sheet, "fewer", (cells.right + 8, cells.y + 13), cells.east, counts.west)
    for said, box in (("no", stamps), ("yes", bursts)):
        sheet.wire(box.east, (BUS, box.y), (BUS, cells.y), heads="-")
        sheet.text((box.right + 8, box.y - 11), small(said, BLUE.edge), align="left")
    sheet.dot((BUS, cells.y), 3.5)
    sheet.dot((BUS, bursts.y), 3.5)


def _left(sheet: Sheet) -> None:
    """Draw the answers where edges are stamped."""
    cells = QUESTIONS["cells"][0]
    _down(sheet, "for mt only", 70, cells, LEAVES["mt"][0])
    _down(sheet, "for edge-kalman", 190, cells, LEAVES["edges"][0])


def _right(sheet: Sheet) -> None:
    """Draw the answers where there are only counts."""
    counts = QUESTIONS["counts"][0]
    _down(sheet, "fewer", 400, counts, LEAVES["fewest"][0])
    _down(sheet, "for levant-adaptive", 530, counts, LEAVES["counts"][0])


def _down(sheet: Sheet, said: str, x: float, above: Box, below: Box) -> None:
    """Draw an arrow straight down, with its answer on the right."""
    _answer(sheet, said, (x + 7, above.bottom + 24), (x, above.bottom), (x, below.top))
