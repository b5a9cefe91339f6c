"""The rooms of the project, and who imports whom, as the sources say it."""

import ast
from collections.abc import Iterator
from pathlib import Path

from .sheet import BLUE, GREEN, GREY, LINE, ORANGE, PURPLE, SMALL, SOFT, YELLOW, Box, Line, Place, Sheet, bold, small

ROOT = Path(__file__).absolute().parents[2]
SAID = {
    "cli": ("the command line",),
    "sim": ("devices, the closed loop,", "scenes, studies"),
    "host": ("what runs on a PC", "beside a board"),
    "hdl": ("what is synthesised,", "in Amaranth"),
    "model": ("the bit-accurate twin", "of every block"),
}
"""The rooms, and what is in each."""
TONES = {"cli": YELLOW, "sim": GREEN, "host": PURPLE, "hdl": ORANGE, "model": BLUE}


def _imports(path: Path) -> Iterator[tuple[str, ...]]:
    """Yield the parts of the name of every module that a source imports, those of this project from its root on."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            folder = ("hardwall", *path.relative_to(ROOT).parts[:-1])
            package = folder[: len(folder) + 1 - node.level] if node.level else ()
            yield *package, *(node.module or "").split(".")


def importers() -> dict[tuple[str, str], frozenset[str]]:
    """Return, for every room that imports another, the folders whose sources do so."""
    found: dict[tuple[str, str], set[str]] = {}
    for room in SAID:
        for path in (ROOT / room).rglob("*.py"):
            for first, *rest in _imports(path):
                if first == "hardwall" and rest and rest[0] in SAID and rest[0] != room:
                    found.setdefault((room, rest[0]), set()).add(path.parent.relative_to(ROOT).as_posix())
    return {pair: frozenset(folders) for pair, folders in found.items()}


def tested() -> set[str]:
    """Return the rooms of which the tests import something."""
    every = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")]
    return {room for room in SAID if any(f"from hardwall.{room}." in text for text in every)}


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(456)
    frame = sheet.box(Box(14, 14, 578, 394), tone=GREY, dashed=True)
    sizes = {"cli": (212, 30, 170, 66), "sim": (32, 150, 206, 92), "host": (372, 150, 178, 92)}
    sizes |= {"hdl": (32, 300, 206, 92), "model": (342, 300, 208, 92)}
    rooms = {room: Box(*size) for room, size in sizes.items()}
    for room, at in rooms.items():
        sheet.box(at, bold(f"{room}/"), *map(small, SAID[room]), tone=TONES[room])
    ways = _ways(rooms)
    found = importers()
    if set(found) != set(ways):
        raise ValueError(f"the arrows must be those of the imports, {sorted(found)}, not {sorted(ways)}")
    for pair, (at, *way) in ways.items():
        (folder, *more) = sorted(found[pair])
        alone = not more and folder != pair[0]
        sheet.wire(*way, ink=LINE, dashed=alone)
        if alone:
            sheet.text(at, small(f"only {folder}/"))
    tests = sheet.box(Box(618, 176, 68, 70), bold("tests/"))
    if tested() != set(SAID):
        raise ValueError("the tests must import every room")
    sheet.wire(tests.west, (frame.right, tests.y))
    sheet.text((350, 434), Line("an arrow points to what is imported", SMALL, SOFT))
    return sheet.svg()


def _ways(rooms: dict[str, Box]) -> dict[tuple[str, str], tuple[Place, ...]]:
    """Return, for each room and what it imports, the place of a word beside the arrow, and the arrow's places."""
    cli, sim, host, hdl, model = (rooms[room] for room in ("cli", "sim", "host", "hdl", "model"))
    aside, between, low, side = (0.0, 0.0), (sim.right + model.left) / 2, sim.y + 20, 574
    return {
        ("cli", "sim"): (aside, (cli.left + 40, cli.bottom), (cli.left + 40, 122), (sim.x, 122), sim.north),
        ("cli", "host"): (aside, (cli.right - 40, cli.bottom), (cli.right - 40, 122), (host.x, 122), host.north),
        ("cli", "model"): (aside, cli.east, (side, cli.y), (side, model.y), model.east),
        ("sim", "host"): ((305, sim.y - 30), (sim.right, sim.y - 16), (host.left, sim.y - 16)),
        ("sim", "model"): (
            aside,
            (sim.right, low),
            (between, low),
            (between, model.y - 18),
            (model.left, model.y - 18),
        ),
        ("sim", "hdl"): ((sim.x + 56, 271), sim.south, hdl.north),
        ("hdl", "model"): (aside, (hdl.right, model.y + 18), (model.left, model.y + 18)),
        ("host", "model"): (aside, host.south, (host.x, model.top)),
    }
