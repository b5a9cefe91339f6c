"""Speed and size of a placed and routed design, with the delay that nextpnr does not know.

It times the iCE40's multiplier block as if it had registers. A block used without them is part of a path: from the last
register before it, through it, to the first behind it.
"""

import re

from ..boards.parts import Part


def _delay_ns(report: dict, start: str, end: str) -> float | None:
    """Return the longest delay from one clock to another, as nextpnr names them; None if there is no path."""
    for path in report["critical_paths"]:
        if re.search(start, path["from"]) and re.search(end, path["to"]):
            return sum(step["delay"] for step in path["path"])
    return None


def _signal(step: dict) -> str:
    """Return the signal after which a cell is named."""
    cell = step["cell"].removeprefix("board.").partition("_SB_")[0]
    return re.sub(r"_(SB|TRELLIS|CCU2C|LUT\d|PFUMX|L6MUX21|MULT\w+?|DFF[A-Z]*|ALU|MUX2)(_.*)?$", "", cell)


def timing(part: Part, report: dict) -> tuple[float, str]:
    """Return a report's longest delay between registers, in ns, and the two ends of its path."""
    # The oscillator is a clock, too. A net of the pin `clk` has its name, or the name of an inner port of the same
    # name.
    clock, fmax = next((name, fmax) for name, fmax in report["fmax"].items() if re.search(r"(^|[$.])clk($|\$)", name))
    longest = 1e3 / fmax["achieved"]
    paths = report["critical_paths"]
    path = next(entry["path"] for entry in paths if entry["from"] == entry["to"] == f"posedge {clock}")
    ends = f"{_signal(path[0]['from'])} to {_signal(path[-1]['to'])}"
    if part.multiplier_ns is not None:
        clocked = re.escape(f"posedge {clock}")
        # Blocks without registers have no clock: nextpnr treats them as clocked by a constant.
        into = _delay_ns(report, clocked, r"PACKER_GND_NET")
        out = _delay_ns(report, r"PACKER_GND_NET", clocked)
        if into is not None and out is not None and into + part.multiplier_ns + out > longest:
            longest, ends = into + part.multiplier_ns + out, "through a multiplier"
    return longest, ends


def half_registered(netlist: dict) -> bool:
    """Return whether an iCE40 multiplier has registers on one side only, a case that nextpnr does not time."""
    for cell in netlist.values():
        if cell["type"] == "SB_MAC16":
            bits = {name: int(str(value), 2) for name, value in cell["parameters"].items()}
            before = bits.get("A_REG", 0) and bits.get("B_REG", 0)
            behind = bits.get("TOPOUTPUT_SELECT") == 1 or bits.get("PIPELINE_16x16_MULT_REG2", 0)
            if bool(before) != bool(behind):
                return True
    return False


def size(part: Part, utilization: dict, types: list[str]) -> dict:
    """Return the part of the report on size, from nextpnr's report and the types of the cells before it."""
    return {
        **{name: sum(utilization[kind]["used"] for kind in kinds) for name, kinds in part.counted.items()},
        "ff": sum(kind.startswith(part.flip_flops) for kind in types),
        "available": {name: utilization[kinds[0]]["available"] for name, kinds in part.counted.items()},
        "untimed": [kind for kind in part.untimed if kind in types],
    }
