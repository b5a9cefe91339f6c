"""The files that an estimator of one's own has, and the lines that make it known."""

import ast
from pathlib import Path

from .sheet import BLUE, GREEN, LARGE, ORANGE, PURPLE, YELLOW, Box, Sheet, bold, code, small

EXAMPLE = Path(__file__).absolute().parents[1] / "examples" / "two_step"
NAME = EXAMPLE.name
SAID = NAME.replace("_", "-")
"""The example's name as a module, and on the command line."""


def defined(path: str, *names: str) -> str:
    """Return names of what a file of the example defines, in one line.

    Raises:
        ValueError: if it does not define one of them.
    """
    nodes = ast.parse((EXAMPLE / path).read_text(encoding="utf-8")).body
    known = {node.name for node in nodes if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    if set(names) - known:
        raise ValueError(f"{path} must define {', '.join(sorted(set(names) - known))}")
    return ", ".join(names)


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(520)
    path = f"model/estimators/{NAME}.py"
    names = defined(path, "Gains", "Design"), defined(path, "step", "float_step")
    model = sheet.box(Box(16, 18, 268, 96), code(path, 13), *map(code, names), tone=BLUE)
    path = f"hdl/estimators/{NAME}.py"
    block = sheet.box(Box(416, 18, 268, 96), code(path, 13), code(defined(path, "Estimator")), tone=ORANGE)
    sheet.wire(model.east, block.west)
    sheet.text((350, model.y - 25), small("formats, words,"), small("latency"))
    proof = ("RTL == model", "model == third opinion")
    test = sheet.box(Box(204, 158, 292, 88), code(f"tests/estimators/test_{NAME}.py", 13), *proof, tone=GREEN)
    sheet.wire((172, model.bottom), (172, test.y), test.west)
    sheet.wire((528, block.bottom), (528, test.y), test.east)
    registries = _registries(sheet)
    for x, top, registry in zip((90, 610), (model.bottom, block.bottom), registries, strict=True):
        sheet.wire((x, top), (x, registry.top))
    _uses(sheet, *registries)
    return sheet.svg()


def _registries(sheet: Sheet) -> tuple[Box, Box]:
    """Draw the two registries with the line of each."""
    boxes = []
    for room, name, left, tone in (("model", "Design", 16, BLUE), ("hdl", "Estimator", 416, ORANGE)):
        lines = code(f"{room}/estimators/registry.py", 13), code(f'"{SAID}":', 13), code(f"{NAME}.{name}", 13)
        boxes.append(sheet.box(Box(left, 290, 268, 84), *lines, tone=tone))
    first, second = boxes
    sheet.text((350, first.y), bold("=", LARGE), small("same names,"), small("same order"))
    return first, second


def _uses(sheet: Sheet, *registries: Box) -> None:
    """Draw what an estimator in both registries is then part of."""
    first, second = registries
    line = first.bottom + 24
    uses = Box(first.left, 428, first.wide, 74)
    gates = Box(second.left, 428, second.wide, 74)
    sheet.box(uses, "scenes, commands, Verilog", code(f"--estimator {SAID}"), tone=PURPLE)
    sheet.box(gates, "tests of every", "registered estimator", tone=YELLOW)
    for registry, box in ((first, uses), (second, gates)):
        sheet.wire(registry.south, box.north)
        sheet.dot((registry.x, line), 3.5)
    sheet.wire((first.x, line), (second.x, line), heads="-")
