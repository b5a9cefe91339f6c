"""What a packer wrote, read back and held against what nextpnr has placed and routed.

Of an iCE40 every bit of every tile is compared. The unpackers of the others write a configuration in other words than
nextpnr does, for a default may be said or left out: of these the part and the contents of every logic cell that has a
function, by its place, and of an ECP5 all memories.
"""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from ..boards.description import Description
from .tools import SynthesisError

Facts = dict[str, str]
"""What is compared, by name or place."""
CONSTANT = {"0" * 16, "1" * 16}
"""Contents of a logic cell without a function: a cell that is not used has one of these."""


def check(board: Description, routed: Path, unpacked: Path, bitstream: Path) -> int:
    """Compare what was placed and routed with what a bitstream has; return the number of facts that are the same.

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
    wrong = sorted(name for name in placed.keys() | read.keys() if placed.get(name) != read.get(name))
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
    """Return the contents of every logic cell and memory of an ECP5."""
    facts = {}
    for heading, lines in _blocks(path):
        kind, _, rest = heading.partition(" ")
        if kind == ".device":
            facts[kind] = rest
        elif kind == ".bram_init":
            facts[heading] = "\n".join(lines)
        elif kind == ".tile":
            for name, bits in re.findall(r"^word: (\w+\.K\d\.INIT) (\d+)$", "\n".join(lines), re.MULTILINE):
                if bits not in CONSTANT:
                    facts[f"{rest} {name}"] = bits
    return facts


def _routed_json(path: Path) -> Facts:
    """Return the contents of every logic cell of a Gowin, from what nextpnr wrote."""
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
    return facts


def _unpacked_verilog(path: Path) -> Facts:
    """Return the contents of every logic cell of a Gowin, from what the unpacker wrote."""
    found = re.findall(r"^defparam (\w+)\.INIT = 16'h(\w+);", path.read_text(encoding="utf-8"), re.MULTILINE)
    facts = {name: f"{int(bits, 16):016b}" for name, bits in found if "_LUT4_" in name}
    return {name: bits for name, bits in facts.items() if bits not in CONSTANT}


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
