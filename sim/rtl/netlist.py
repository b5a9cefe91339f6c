"""A component as Verilog before synthesis, and as the netlist that Yosys maps it to, with the models of its cells."""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path

from amaranth.lib import wiring

from ...hdl.export import to_verilog
from ...model.runtime.build_folder import build_dir
from ...model.runtime.stages import stage
from ..jobs.whole_folder import whole_folder
from . import tools
from .families import Family
from .flow import YOSYS

RTL, GATES = "rtl", "gates"
"""The names of the two modules."""
OPTIONS = (
    # The files of cells that a family needs are named; they include no others.
    "-DNO_INCLUDES",
    # iCE40's models give values to inputs that are left open. For Verilator, a cell's input and the net at it are one
    # variable. It gives the values to that net at the first evaluation, up to the pins of the top. Open inputs are 0
    # here.
    "-DNO_ICE40_DEFAULT_ASSIGNMENTS",
    # Yosys leaves out pins that a mode has no use for. Its models name no generate blocks, few have a time scale, and
    # they have delays and parameters that mean nothing here. A name may have lost bits that nothing needs.
    *(f"-Wno-{name}" for name in ("PINMISSING", "GENUNNAMED", "TIMESCALEMOD", "SPECIFYIGN", "UNUSEDPARAM", "UNDRIVEN")),
    # Parameters of a bit have a whole number as their default there, and bits of one vector may follow from each
    # other.
    *("-Wno-WIDTHTRUNC", "-Wno-UNOPTFLAT"),
    # A large memory of theirs loses all that it has in a loop where its power goes off.
    "-Wno-BLKSEQ",
)
"""Options with which Verilator takes a netlist and the models of its cells."""


@dataclass(frozen=True)
class Netlist:
    """A component before and after synthesis.

    Attributes:
        component: the component.
        rtl: Verilog of the module `RTL`, which Yosys reads.
        gates: Verilog of the module that was asked for, instances of a family's cells.
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


def mapped(component: wiring.Component, family: Family, name: str = GATES) -> Netlist:
    """Return a component mapped to a family, as a module of a name; Yosys is run first if that has not been done.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    made_by, rtl = tools.versions([YOSYS]), to_verilog(component, RTL)
    script = (
        f"read_verilog rtl.v; {family.synth} -top {RTL} -json netlist.json; "
        f"delete t:$scopeinfo; rename {RTL} {name}; write_verilog -noattr gates.v"
    )
    content = "\0".join([rtl, script, *made_by])
    folder = build_dir() / "gate" / f"{family.name}-{hashlib.sha256(content.encode()).hexdigest()[:16]}"

    def map_into(work: Path) -> None:
        (work / "rtl.v").write_text(rtl, encoding="utf-8")
        with stage(f"mapping the hardware to {family.name} with Yosys, once"):
            tools.run(work, work / "yosys.log", (YOSYS, "-p", script), f"synthesis for {family.name}")

    folder = whole_folder(folder, map_into)
    module = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))["modules"][RTL]
    counted = family.count([cell["type"] for cell in module["cells"].values()])
    gates = (folder / "gates.v").read_text(encoding="utf-8")
    return Netlist(component, rtl, gates, family.models, counted)
