"""The files of constraints/, for those who take the Verilog into their own flow: pins, `top`, and a core for FuseSoC.

Each is for the scene that its board runs if none is given; `hardwall verilog` writes the `board.v` that belongs to it.
"""

import json
from importlib.metadata import version

from .constraints import constraints
from .description import BOARDS, Description
from .top import MODULE, top_verilog

CORE = "hardwall.core"
FLOWS = {".lpf": ("trellis", "LPF"), ".pcf": ("icestorm", "PCF"), ".cst": ("apicula", "CST")}
"""The flow of FuseSoC, and its name for a file of pins, by the end of the file's name."""


def files(clocks_hz: dict[str, int]) -> dict[str, str]:
    """Return the text of every file by its name.

    Args:
        clocks_hz: the clock of the scene that a board runs, by the board's name.
    """
    texts = {CORE: core(clocks_hz)}
    for board in BOARDS.values():
        texts[_pins(board)] = constraints(board)
        texts[f"{board.family}.v"] = top_verilog(board, clocks_hz[board.name])
    return texts


def core(clocks_hz: dict[str, int]) -> str:
    """Return the description of the files for FuseSoC (CAPI2), which is YAML."""
    lines = [
        "CAPI=2:",
        "# Generated from the descriptions of the boards. Write board.v beside it first: hardwall verilog SCENE -o .",
        f"name: hardwall:haptics:board:{version('hardwall')}",
        'description: "One haptic axis with its supervisor behind a serial line, and the pins and clocks of boards"',
        "filesets:",
        "  board:",
        "    files: [board.v]",
        "    file_type: verilogSource",
    ]
    for board in {board.family: board for board in BOARDS.values()}.values():
        kind = FLOWS[board.part.suffixes.pins][1]
        lines += [
            f"  {board.family}:",
            "    files:",
            f"      - {board.family}.v: {{file_type: verilogSource}}",
            f"      - {_pins(board)}: {{file_type: {kind}}}",
        ]
    lines += ["targets:", "  default:", "    filesets: [board]", "    toplevel: board"]
    for board in BOARDS.values():
        lines += [
            f"  {board.name}:",
            f'    description: "{board.title}"',
            f"    filesets: [board, {board.family}]",
            f"    toplevel: {MODULE}",
            f"    flow: {FLOWS[board.part.suffixes.pins][0]}",
            f"    flow_options: {json.dumps(_options(board, clocks_hz[board.name]))}",
        ]
    return "\n".join(lines) + "\n"


def _pins(board: Description) -> str:
    return board.family + board.part.suffixes.pins


def _options(board: Description, clock_hz: int) -> dict[str, object]:
    """Return what a flow is told: the part, the clock, and the options of the synthesis."""
    part, aim = board.part, ["--freq", f"{clock_hz / 1e6:g}"]
    # That flow knows the boards itself.
    named: dict[str, object] = {"board": board.family} if part.suffixes.pins == ".cst" else {}
    own = aim if named else [*part.nextpnr[1:], *aim]
    return {**named, "yosys_synth_options": part.synth.split()[1:], "nextpnr_options": own}
