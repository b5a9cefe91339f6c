"""A component as Verilog before synthesis, and as the netlist that Yosys maps it to."""

import hashlib
import json
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

from amaranth.lib import wiring

from hardwall.hdl.export import to_verilog
from hardwall.model.build_folder import build_dir
from hardwall.sim.jobs.whole_folder import whole_folder
from hardwall.sim.rtl import tools
from hardwall.sim.rtl.flow import YOSYS

from .families import Family

RTL, GATES = "rtl", "gates"
"""The names of the two modules."""


@dataclass(frozen=True)
class Netlist:
    """A component before and after synthesis.

    Attributes:
        component: the component.
        rtl: Verilog of the module `RTL`, which Yosys reads.
        gates: Verilog of the module `GATES`, instances of a family's cells.
        models: Verilog of these cells.
        cells: units of every resource that it uses.
    """

    component: wiring.Component
    rtl: str = field(repr=False)
    gates: str = field(repr=False)
    models: str = field(repr=False)
    cells: dict[str, int]

    @property
    def verilog(self) -> str:
        """Both modules, and the models of the cells."""
        return "\n".join([self.rtl, self.gates, self.models])


def mapped(component: wiring.Component, family: Family) -> Netlist:
    """Return a component mapped to a family; Yosys is run first if that has not been done.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    rtl = to_verilog(component, RTL)
    script = (
        f"read_verilog rtl.v; {family.synth} -top {RTL} -json netlist.json; "
        f"delete t:$scopeinfo; rename {RTL} {GATES}; write_verilog -noattr gates.v"
    )
    content = "\0".join([rtl, script, version(YOSYS)])
    folder = build_dir() / "gate" / f"{family.name}-{hashlib.sha256(content.encode()).hexdigest()[:16]}"

    def map_into(work: Path) -> None:
        (work / "rtl.v").write_text(rtl, encoding="utf-8")
        command = (YOSYS, "-p", script)
        tools.run(work, work / "yosys.log", command, f"synthesis for {family.name}")

    folder = whole_folder(folder, map_into)
    module = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))["modules"][RTL]
    counted = family.count([cell["type"] for cell in module["cells"].values()])
    gates = (folder / "gates.v").read_text(encoding="utf-8")
    return Netlist(component, rtl, gates, family.models, counted)
