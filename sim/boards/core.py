"""The core of a board for FuseSoC (CAPI2): the Verilog of an axis, the top and the pins of the board, and its flow."""

import json

from ...model.runtime.extras import version_of_project
from .description import Description
from .top import MODULE

CORE = "hardwall.core"
FLOWS = {".lpf": ("trellis", "LPF"), ".pcf": ("icestorm", "PCF"), ".cst": ("apicula", "CST")}
"""The flow of FuseSoC, and its name for a file of pins, by the end of the file's name."""
NO_VERSION = "0"
"""The version that FuseSoC gives to a core without one; this project has none where its folder was copied."""


def core(board: Description, clock_hz: int) -> str:
    """Return the description of `board.v`, `top.v` and the file of pins, which lie beside it; it is YAML.

    Args:
        board: the board.
        clock_hz: the clock of the axis, which placement aims at.
    """
    flow, kind = FLOWS[board.part.suffixes.pins]
    lines = [
        "CAPI=2:",
        f"# Generated; the clock of the axis is {clock_hz} Hz.",
        f"name: hardwall:haptics:{board.name}:{version_of_project() or NO_VERSION}",
        f'description: "Haptic axes with their supervisor behind a serial line, on {board.title}"',
        "filesets:",
        "  board:",
        "    files:",
        "      - board.v: {file_type: verilogSource}",
        "      - top.v: {file_type: verilogSource}",
        f"      - {board.family}{board.part.suffixes.pins}: {{file_type: {kind}}}",
        "targets:",
        "  default:",
        "    filesets: [board]",
        f"    toplevel: {MODULE}",
        f"    flow: {flow}",
        f"    flow_options: {json.dumps(_options(board, clock_hz))}",
    ]
    return "\n".join(lines) + "\n"


def _options(board: Description, clock_hz: int) -> dict[str, object]:
    """Return what a flow is told: the part, the clock, and the options of the synthesis."""
    part, aim = board.part, ["--freq", f"{clock_hz / 1e6:g}"]
    # That flow knows the boards itself.
    named: dict[str, object] = {"board": board.family} if part.suffixes.pins == ".cst" else {}
    own = aim if named else [*part.nextpnr[1:], *aim]
    return {**named, "yosys_synth_options": part.synth.split()[1:], "nextpnr_options": own}
