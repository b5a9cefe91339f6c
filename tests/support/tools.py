"""Stand-ins for the tools from Yosys to the loader: speed and size follow from the seed, so every number is known."""

import sys
from pathlib import Path

from hardwall.sim.boards.parts import PARTS
from hardwall.sim.rtl import flow, tools
from hardwall.sim.rtl.loader import LOADER

TOOL = """#!{python}
import json, pathlib, sys
seed = int(sys.argv[sys.argv.index("--seed") + 1]) if "--seed" in sys.argv else 0
with open({calls!r}, "a") as calls:
    print(seed, file=calls)
cells = {{17: "5950", 19: "5017"}}.get(seed, "1")
print("Info: as if\\nInfo: \\t  ICESTORM_LC:  " + cells + "/ 5280   9%")
said = "find legal placement for all cells" if seed == 19 else "place cell 'x', no BELs remaining"
print("ERROR: " * (seed in (13, 17, 19)) + "Unable to " + said + ".")
if seed in (13, 17, 19):
    sys.exit(1)
if not seed:
    cells = ["TRELLIS_FF"] * 3 + ["LUT4"] * 4 + ["SB_DFFESR"] * 5 + ["SB_DFF"] + ["DFFRE"] * 2 + ["MULT9X9"]
    netlist = {{str(k): {{"type": kind, "parameters": {{}}, "connections": {{}}}} for k, kind in enumerate(cells)}}
    pathlib.Path("top.json").write_text(json.dumps({{"modules": {{"top": {{"cells": netlist}}}}}}))
else:
    step = lambda cell, delay: {{"delay": delay, "from": {{"cell": cell}}, "to": {{"cell": cell}}}}
    path = lambda start, end, delay: {{
        "from": start, "to": end,
        "path": [step("board.axis.from_SB_DFF_Q_1", 0.0), step("board.axis.to_TRELLIS_FF_Q_DI", delay)]
    }}
    clock, none = "posedge clk$net", "posedge $PACKER_GND_NET_$glb_clk"
    kinds = ["TRELLIS_COMB", "MULT18X18D", "DP16KD", "ICESTORM_LC", "ICESTORM_DSP", "ICESTORM_RAM"]
    kinds += ["LUT4", "ALU", "MULT18X18", "MULT9X9", "MULT36X36", "BSRAM"]
    for option in ("--textcfg", "--asc", "--write"):
        if option in sys.argv:
            pathlib.Path(sys.argv[sys.argv.index(option) + 1]).write_text({routed!r})
    pathlib.Path("report.json").write_text(json.dumps({{
        "fmax": {{
            "oscillator": {{"achieved": 1.0, "constraint": 1.0}},
            "clk$net": {{"achieved": 10.0 * seed, "constraint": 1.0}}
        }},
        "utilization": {{kind: {{"used": k, "available": 100 + k}} for k, kind in enumerate(kinds)}},
        "critical_paths": [path(clock, clock, 100.0 / seed), path(clock, none, 5.0), path(none, clock, 6.0)],
    }}))
"""

# What each packer and unpacker writes, and each loader says.
PACKER = """#!{python}
import pathlib, sys
with open({calls!r}, "a") as calls:
    print(pathlib.Path(sys.argv[0]).name, *sys.argv[1:], file=calls)
said = pathlib.Path({calls!r}).with_name("says")
if said.exists():
    print(said.read_text())
    sys.exit(1)
name = pathlib.Path(sys.argv[0]).name
if name != {loader!r}:
    *_, source, target = [each for each in sys.argv[1:] if not each.startswith("-") and each != "GW1N-9C"]
    text = pathlib.Path(source).read_text()
    damage = pathlib.Path({calls!r}).with_name("damage")
    if damage.exists() and "unpack" in name:
        text = text.replace(*damage.read_text().split("|"))
    pathlib.Path(target).write_text(text)
"""
ROUTED = """.device LFE5U-25F

.tile R2C3:PLC2
word: SLICEA.K0.INIT 0000000011111111
word: SLICEA.K1.INIT 1111111111111111
arc: E1_H02E0101 F0
arc: F0 F0_SLICE

.bram_init 1
000 111
"""
"""What nextpnr's stand-in writes, and the packers' pass on."""


def stand_in(folder: Path, monkeypatch) -> Path:
    """Set up stand-ins for all tools and an empty build folder; return the file that lists their calls.

    Of a call of nextpnr it has the seed, of one of Yosys 0, of the others all words. A file `says` beside it is what
    the others say before they fail, and one `damage`, as `OLD|NEW`, what is changed when a bitstream is read back.
    """
    calls, programs = folder / "calls", folder / "bin"
    programs.mkdir()
    made = {flow.YOSYS: TOOL, LOADER: PACKER}
    for part in PARTS.values():
        made |= {part.nextpnr[0]: TOOL, part.pack[0]: PACKER, part.unpack[0]: PACKER}
    for name, text in made.items():
        said = {"python": sys.executable, "calls": str(calls), "loader": LOADER, "routed": ROUTED}
        (programs / name).write_text(text.format(**said))
        (programs / name).chmod(0o755)
    monkeypatch.setattr(tools, "TOOLS", programs)
    monkeypatch.setattr(tools, "version", lambda tool: "1.0")
    # The stand-ins do not read it.
    monkeypatch.setattr(flow, "to_verilog", lambda component, name: f"{name} {component.signature}")
    monkeypatch.setenv("HARDWALL_BUILD", str(folder / "build"))
    return calls
