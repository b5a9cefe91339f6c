"""Where a force law sits between estimator and output stage, and when what comes to it."""

import ast
from pathlib import Path

from hardwall.model.axis import wall

from .sheet import BLUE, GREEN, GREY, LINE, ORANGE, PURPLE, Box, Place, Sheet, bold, code, small

EXAMPLE = Path(__file__).absolute().parents[1] / "examples" / "layered"
WORDS = "wall_stiffness", "wall_damping", "core_stiffness", "core_depth"
"""Some of the law's words at run time."""
LEFT, UNIT, CLOCKS = 92, 66, 9


def latency() -> int:
    """Return the latency of the law of the example, as its source says it.

    Raises:
        ValueError: if the source has none, or lacks one of the words.
    """
    (source,) = (EXAMPLE / "model").rglob("layered.py")
    text = source.read_text(encoding="utf-8")
    if any(word not in text for word in WORDS):
        raise ValueError(f"{source.name} must have the words {', '.join(WORDS)}")
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "LATENCY":
            return eval(compile(ast.Expression(node.value), source.name, "eval"), {"wall": wall})
    raise ValueError(f"{source.name} must have a LATENCY")


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(582)
    law = _path(sheet)
    _around(sheet, law)
    _waves(sheet, 330)
    return sheet.svg()


def _path(sheet: Sheet) -> Box:
    """Draw the blocks from the decoder to the output stage; return where the law is."""
    top, high = 108, 76
    decoder = sheet.box(Box(46, top, 74, high), "decoder", tone=GREY)
    estimator = sheet.box(Box(166, top, 84, high), "estimator", tone=BLUE)
    law = sheet.box(Box(326, top, 92, high), bold("FORCE"), bold("LAW"), tone=ORANGE, lw=2.8)
    passivity = sheet.box(Box(466, top, 86, high), "mass,", "passivity", small("optional"), tone=PURPLE, dashed=True)
    output = sheet.box(Box(574, top, 68, high), "output", "stage", tone=GREEN)
    sheet.chain(decoder, estimator, law, passivity, output)
    sheet.wire((10, decoder.y), decoder.west)
    sheet.text((24, decoder.y - 14), small("A, B"))
    sheet.wire(output.east, (692, output.y))
    sheet.text((668, output.y - 14), small("drive"))
    _names(sheet, (143, decoder.y), "seen")
    _names(sheet, (284, decoder.y), "strobe", "velocity")
    _names(sheet, (442, decoder.y), "valid", "force")
    under = top + high + 30
    sheet.wire((decoder.x, decoder.bottom), (decoder.x, under), (law.left + 24, under), (law.left + 24, law.bottom))
    sheet.text(((decoder.x + law.left) / 2, under - 13), code("count", 13))
    return law


def _names(sheet: Sheet, at: Place, above: str, below: str = "") -> None:
    """Write the names of what a wire carries above and below it."""
    sheet.text((at[0], at[1] - 14), code(above, 12.5))
    if below:
        sheet.text((at[0], at[1] + 14), code(below, 12.5))


def _around(sheet: Sheet, law: Box) -> None:
    """Draw the strobe of the sample, the words of the law, and its twin."""
    divider = sheet.box(Box(146, 20, 124, 42), "sample divider", tone=GREY)
    sheet.wire((208, divider.bottom), (208, law.top))
    sheet.text((199, 86), code("strobe", 13), align="right")
    sheet.wire(divider.east, (law.left + 24, divider.y), (law.left + 24, law.top))
    sheet.text((law.left + 15, 86), code("lead", 13), align="right")
    sheet.wire((432, divider.y), (law.right - 24, divider.y), (law.right - 24, law.top))
    said = (f"{', '.join(WORDS[:2])},", f"{', '.join(WORDS[2:])}, ...")
    sheet.text((440, divider.y), *(code(line, 13) for line in said), align="left")
    sheet.wire((law.right - 24, law.bottom), (law.right - 24, 236), (440, 236), heads="-", dashed=True)
    sheet.box(Box(440, 218, 94, 36), "hardware", tone=ORANGE)
    sheet.text((556, 236), bold("=="))
    sheet.box(Box(578, 218, 94, 36), "model", tone=ORANGE)


def _at(clock: float) -> float:
    return LEFT + UNIT * clock


def _waves(sheet: Sheet, top: float) -> None:
    """Draw when the law is given a sample, and when its force is there."""
    strobe = wall.LEAD + 1
    valid = strobe + latency()
    sheet.grid(map(_at, range(CLOCKS + 1)), top - 6, top + 196)
    for clock in range(CLOCKS):
        sheet.text((_at(clock + 0.5), top - 16), small(f"{clock}"))
    sheet.text((18, top - 16), small("clock"), align="left")
    for name, clock, row in (("lead", 0, 0), ("strobe", strobe, 1), ("valid", valid, 2)):
        _pulse(sheet, name, clock, top + 14 + 50 * row)
    sheet.text((_at(1) + 8, top + 20), small("count of k"), align="left")
    sheet.text((_at(strobe + 1) + 8, top + 70), small("velocity of k"), align="left")
    low, high = top + 40, top + 14
    dashed = (_at(strobe), low), (_at(strobe), high), (_at(strobe + 1), high), (_at(strobe + 1), low)
    sheet.wire(*dashed, ink=ORANGE.edge, dashed=True, heads="-")
    sheet.text((_at(strobe + 1) + 8, top + 20), small("the next sample may begin here", ORANGE.edge), align="left")
    _force(sheet, valid, top + 164)
    here = top + 218
    sheet.span(_at(0), _at(strobe), here, code(f"lead: {wall.LEAD} clocks or more", 13), above=False)
    sheet.span(_at(strobe), _at(valid), here, code(f"latency: {latency()} clocks", 13), above=False)


def _pulse(sheet: Sheet, name: str, clock: int, top: float) -> None:
    """Draw a signal that is high for a clock."""
    low = top + 26
    sheet.text((18, top + 15), code(name), align="left")
    path = (_at(0) - 8, low), (_at(clock), low), (_at(clock), top), (_at(clock + 1), top), (_at(clock + 1), low)
    sheet.wire(*path, (_at(CLOCKS), low), ink=LINE, heads="-")


def _force(sheet: Sheet, clock: int, top: float) -> None:
    """Draw the force, which changes at a clock."""
    low, slope, edge = top + 26, 6, _at(clock)
    sheet.text((18, top + 13), code("force"), align="left")
    for one, other in ((top, low), (low, top)):
        sheet.wire((_at(0) - 8, one), (edge - slope, one), (edge + slope, other), (_at(CLOCKS), other), heads="-")
    sheet.text((_at(clock / 2), top + 13), small("of k - 1"))
    sheet.text((_at((clock + CLOCKS) / 2), top + 13), small("of k"))
