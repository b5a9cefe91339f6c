"""Speed and size of a placed and routed design, with the delay that nextpnr does not know.

It times the iCE40's multiplier block as if it had registers on both sides. A block without them, or with one behind it
alone, is part of a path: from the last register before it, through it, to the first behind it. A path that begins in
the block's own register has 0.1 ns for its output, where Project IceStorm has 2.1 ns: it is that much too short.
"""

import re

from ..boards.parts import Part
from .tools import SynthesisError

SETUP_NS = 1.3
"""At most the setup of a flip-flop of the iCE40 behind its look-up table: nextpnr has 1.234 ns."""


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


def timing(part: Part, report: dict, netlist: dict[str, dict]) -> tuple[float, str]:
    """Return a report's longest delay between registers, in ns, and the two ends of its path.

    Args:
        part: the part.
        report: nextpnr's report; of a part with a `multiplier_ns`, with its detailed timings.
        netlist: the cells that were placed, by name.

    Raises:
        SynthesisError: if the report does not time what goes into a multiplier.
    """
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
        through = [part.multiplier_ns + way for way in _ways_ns(report, netlist)]
        through += [] if into is None or out is None else [into + part.multiplier_ns + out]
        if max(through, default=0.0) > longest:
            longest, ends = max(through), "through a multiplier"
    return longest, ends


def _ways_ns(report: dict, netlist: dict[str, dict]) -> list[float]:
    """Return for every multiplier with a register behind it the delays before and behind it, added.

    What is not in that register goes to registers at once, see `untimed`. What is, is taken for as late as that.

    Raises:
        SynthesisError: if the report does not time what goes into such a multiplier.
    """
    blocks = {f"{name}_DSP": _registers(cell) for name, cell in netlist.items() if cell["type"] == "SB_MAC16"}
    behind = [name for name, halves in blocks.items() if any(halves)]
    into, out = dict.fromkeys(behind, 0.0), dict.fromkeys(behind, 0.0)
    for net in report.get("detailed_net_timings", ()):
        for end in net["endpoints"]:
            if end["cell"] in into and re.match(r"[AB]_", end["port"]):
                into[end["cell"]] = max(into[end["cell"]], *end["delay"])
            if net["driver"] in out:
                out[net["driver"]] = max(out[net["driver"]], *end["delay"])
    if missing := [name for name in behind if not (into[name] and (out[name] or all(blocks[name])))]:
        raise SynthesisError(f"nextpnr gives no delay into or out of the multiplier {missing[0]}")
    return [into[name] + out[name] + SETUP_NS for name in behind]


def _registers(multiplier: dict) -> tuple[bool, bool]:
    """Return whether the lower and the upper half of the output of a multiplier are registers."""
    chosen = (int(str(multiplier["parameters"].get(f"{half}OUTPUT_SELECT", 0)), 2) for half in ("BOT", "TOP"))
    lower, upper = (each == 1 for each in chosen)
    return lower, upper


def untimed(netlist: dict[str, dict]) -> bool:
    """Return whether an iCE40 multiplier is used in a way whose delay is not known.

    Known are multipliers without registers, and those with registers behind them alone: what is not in the block's own
    register must then go to others at once.
    """
    inside = ("A_REG", "B_REG", "C_REG", "D_REG", *(f"PIPELINE_16x16_MULT_REG{number}" for number in (1, 2)))
    inside += ("TOP_8x8_MULT_REG", "BOT_8x8_MULT_REG")
    takers: dict[int, list[tuple[str, str]]] = {}
    for cell in netlist.values():
        for port, bits in cell["connections"].items():
            for bit in bits:
                takers.setdefault(bit, []).append((cell["type"], port))
    for cell in netlist.values():
        if cell["type"] != "SB_MAC16":
            continue
        if any(int(str(cell["parameters"].get(name, 0)), 2) for name in inside):
            return True
        halves = _registers(cell)
        if any(halves) and not all(halves):
            output = cell["connections"]["O"]
            loose = output[16:] if halves[0] else output[:16]
            others = [taker for bit in loose for taker in takers.get(bit, []) if taker != ("SB_MAC16", "O")]
            if not all(re.match("SB_DFF(?!N)", kind) and port == "D" for kind, port in others):
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
