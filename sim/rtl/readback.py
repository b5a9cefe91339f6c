"""The readback of a bitstream, compared with the placed and routed design of nextpnr.

Of an iCE40 every bit of every tile is compared. The unpackers of the others write a configuration in other words than
nextpnr does: a default may be written or left out. Of these it is the part, the contents of every logic cell that has a
function, by its place, and the switches of the wires; and of an ECP5 all memories.
"""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from ..boards.description import Description
from .tools import SynthesisError

Facts = dict[str, str]
"""The compared facts, by name or place."""
CONSTANT = {"0" * 16, "1" * 16}
"""Contents of a logic cell without a function: a cell that is not used has one of these."""
UNTOLD_ECP5 = re.compile(
    r"\w+_SLICE|\w+_PIO|\w*(BOUNCE|JMUIA\d+|JPADDI|JREFCLK\d_\d|(BNK_|G_J|SYNC)ECLK\d|CLKINTFB|DDRDEL)"
)
"""Sources of wires of an ECP5 that are not compared. They have no bits: they are connected unless another wire is.
Exceptions are outputs of logic cells, some of whose bits their mode sets too, and edge clocks, which are not used."""
UNTOLD_GOWIN = re.compile(r"XD\d|GT00")
"""Wires of a Gowin that cannot be told: from a logic cell to its flip-flop there is no switch, and where clocks are
tapped, four spines have the same bits."""
ROWS, COLUMNS = 29, 47
"""The places of the Gowin, a GW1N-9C."""
TOWARDS = {"N": (1, 0), "E": (0, -1), "S": (-1, 0), "W": (0, 1)}
"""Rows and columns from a place on a wire that leads there back to where it begins."""
TURNED = {"N": "S", "E": "W", "S": "N", "W": "E"}
WIRE = "wire "
"""How the name of a wire of a Gowin begins. The unpacker has a source for every wire, also where none was routed."""


def check(board: Description, routed: Path, unpacked: Path, bitstream: Path) -> int:
    """Compare the placed and routed design with the bitstream's content; return the number of equal facts.

    Args:
        board: the board.
        routed: what nextpnr wrote.
        unpacked: what the unpacker wrote.
        bitstream: the bitstream.

    Raises:
        SynthesisError: if the bitstream is for another part, or has something else.
    """
    part = board.part
    placed, read = READERS[part.suffixes.routed](routed), READERS[part.suffixes.unpacked](unpacked)
    device = DEVICES.get(part.suffixes.bitstream, lambda _: read[".device"])(bitstream)
    if device != part.code:
        raise SynthesisError(f"the bitstream of {board.name} is for the part {device}, not {part.code}")
    names = placed.keys() | {name for name in read if not name.startswith(WIRE)}
    wrong = sorted(name for name in names if placed.get(name) != read.get(name))
    if wrong or len(placed) < 2:
        raise SynthesisError(
            f"the bitstream of {board.name} is not what was placed: {len(wrong)} of {len(placed)} differ "
            f"({', '.join(wrong[:3])})"
        )
    return len(placed)


def _blocks(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield the heading of every block of a text, a line that begins with `.`, and the lines below but empty ones."""
    heading, lines = "", []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("."):
            yield heading, lines
            heading, lines = line, []
        elif line:
            lines.append(line)
    yield heading, lines


def _asc(path: Path) -> Facts:
    """Return the bits of every tile and memory of an iCE40, but for memories that are all zero."""
    facts = {}
    for heading, lines in _blocks(path):
        kind, _, rest = heading.partition(" ")
        if kind == ".device":
            facts[kind] = rest
        elif kind not in ("", ".comment", ".sym") and not (kind == ".ram_data" and set("".join(lines)) <= {"0"}):
            facts[heading] = "\n".join(lines)
    return facts


def _config(path: Path) -> Facts:
    """Return the contents of every logic cell and memory of an ECP5, and the source of every wire that is switched."""
    facts = {}
    for heading, lines in _blocks(path):
        kind, _, rest = heading.partition(" ")
        if kind == ".device":
            facts[kind] = rest
        elif kind == ".bram_init":
            facts[heading] = "\n".join(lines)
        elif kind == ".tile":
            said = "\n".join(lines)
            for name, bits in re.findall(r"^word: (\w+\.K\d\.INIT) (\d+)$", said, re.MULTILINE):
                if bits not in CONSTANT:
                    facts[f"{rest} {name}"] = bits
            for wire, source in re.findall(r"^arc: (\S+) (\S+)$", said, re.MULTILINE):
                if not UNTOLD_ECP5.fullmatch(source):
                    facts[f"{rest} {wire}"] = source
    return facts


def _routed_json(path: Path) -> Facts:
    """Return the contents of every logic cell of a Gowin, and the source of every wire, as nextpnr wrote them."""
    facts = {}
    (module,) = json.loads(path.read_text(encoding="utf-8"))["modules"].values()
    for cell in module["cells"].values():
        if kind := re.fullmatch(r"LUT([1-4])", cell["type"]):
            across, down, place = re.fullmatch(r"X(\d+)Y(\d+)/LUT(\d)", cell["attributes"]["NEXTPNR_BEL"]).groups()
            # One with fewer inputs repeats its contents.
            bits = cell["parameters"]["INIT"][-(1 << int(kind[1])) :]
            bits *= 16 // len(bits)
            if bits not in CONSTANT:
                facts[f"R{int(down) + 1}C{int(across) + 1}_LUT4_{place}"] = bits
    for net in module["netnames"].values():
        routing = net["attributes"].get("ROUTING", "")
        for across, down, wire, source in re.findall(r"X(\d+)Y(\d+)/([^/;]+)/([^/;]+);", routing):
            if not UNTOLD_GOWIN.fullmatch(wire):
                place = int(down) + 1, int(across) + 1
                facts[WIRE + wire_of(*place, wire)] = wire_of(*place, source)
    return facts


def wire_of(row: int, column: int, wire: str) -> str:
    """Return the unpacker's name of a Gowin wire at a place; a wire that leads there is named after its beginning.

    Args:
        row, column: the place, from 1 on.
        wire: its name there, for instance W272: to the west, of two places, the seventh, and the place is its end.
    """
    between = re.fullmatch(r"([NESW])([128]\d)(\d)", wire)
    if not between:
        return wire if wire in ("VCC", "VSS") else f"R{row}C{column}_{wire}"
    direction, number, places = between.groups()
    rows, columns = TOWARDS[direction]
    # A wire that leads out of the part comes back in the other direction.
    row, turned = _folded(row + rows * int(places), ROWS)
    column, turned_too = _folded(column + columns * int(places), COLUMNS)
    return f"R{row}C{column}_{TURNED[direction] if turned or turned_too else direction}{number}"


def _folded(at: int, most: int) -> tuple[int, bool]:
    """Return a row or column within the part, and whether it had to be brought there."""
    return (1 - at, True) if at < 1 else (2 * most + 1 - at, True) if at > most else (at, False)


def _unpacked_verilog(path: Path) -> Facts:
    """Return the contents of every logic cell of a Gowin, and the source of every wire, as the unpacker wrote them."""
    text = path.read_text(encoding="utf-8")
    found = re.findall(r"^defparam (\w+)\.INIT = 16'h(\w+);", text, re.MULTILINE)
    contents = {name: f"{int(bits, 16):016b}" for name, bits in found if "_LUT4_" in name}
    facts = {name: bits for name, bits in contents.items() if bits not in CONSTANT}
    # A name that another one stands for is a macro.
    wires = re.findall(r"^assign `?(\w+) = `?(\w+);", text, re.MULTILINE)
    return facts | {WIRE + wire: source for wire, source in wires}


def _idcode(path: Path) -> str:
    """Return the part's code in a bitstream of Gowin: of the command 06, in its head."""
    for line in path.read_text(encoding="ascii").splitlines():
        if len(line) == 64 and int(line[:8], 2) == 6:
            return f"{int(line[32:], 2):08x}"
    return "none"


READERS: dict[str, Callable[[Path], Facts]] = {
    ".asc": _asc,
    ".config": _config,
    ".json": _routed_json,
    ".v": _unpacked_verilog,
}
"""The readers of files by the ends of their names."""
DEVICES: dict[str, Callable[[Path], str]] = {".fs": _idcode}
"""The readers of a part's code from a bitstream, where what is unpacked does not have it."""
