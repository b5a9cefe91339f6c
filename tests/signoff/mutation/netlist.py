"""One netlist of a component with many mutants in it, chosen by the value of its input `mutant`; 0 chooses none.

Yosys lists small changes of the netlist before any optimisation: a bit of a cell's port is inverted, constant, or
inverted where another bit of that port is low or high. Three kinds are left out:

- **Outputs of registers.** A change of a register's input is the same a clock later, and leaves its initial value.
- **Clocks**, of registers and of modules inside. A mutant has the clock that its tests give it.
- **First contents of memories.** They are constants of the netlist, and no input can choose them.
"""

import random
import re
from dataclasses import dataclass, field
from pathlib import Path

from amaranth.lib import wiring

from hardwall.hdl.export import to_verilog
from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.jobs.scratch import scratch
from hardwall.sim.rtl import tools
from hardwall.sim.rtl.flow import YOSYS

BLOCK, SELECTOR = "block", "mutant"
"""The names of the module and of the input that chooses."""
SELECTOR_BITS = 16
SPARE = 3
"""How many times as many changes are listed as are taken, since some are left out."""
_OPTION, _PLACE = re.compile(r"-(\w+) (\S+)"), re.compile(r"-src rtl\.v:(\d+)\.\d+-(\d+)\.")
_REGISTER = re.compile(r"^ *(\S+) <= (\\\$\d+) ;$", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """A small change of a netlist.

    Attributes:
        number: the value that chooses it.
        change: what it changes, for people and for the list of reasons.
    """

    number: int
    change: str


@dataclass(frozen=True)
class Netlist:
    """A component with its mutants.

    Attributes:
        component: the component without them.
        verilog: Verilog of the module `BLOCK` and of those inside it.
        modules: the modules that were changed.
        mutants: the mutants.
    """

    component: wiring.Component
    verilog: str = field(repr=False)
    modules: tuple[str, ...]
    mutants: list[Mutant]


def _taken(line: str) -> bool:
    """Return whether a listed change is none of those left out."""
    options = dict(_OPTION.findall(line))
    return options["port"] not in ("CLK", "clk") and not (
        options["cell"].startswith("$procdff") and options["port"] == "Q"
    )


def _described(line: str, source: list[str]) -> str:
    """Return what a change is: its kind, the cell and its bit, and the Verilog of the cell."""
    options = dict(_OPTION.findall(line))
    mode = options["mode"] + (f" by {options['ctrlbit']}" if "ctrlbit" in options else "")
    cell = re.sub(r"\$.*", "", options["cell"].removeprefix("$"))
    of_wire = f" of {options['wire']}[{options['wirebit']}]" if "wire" in options else ""
    places = _PLACE.findall(line)
    first, last = map(int, places[-1]) if places else (1, 0)
    text = " ".join(each.strip() for each in source[first - 1 : min(last, first + 1)])
    said = f"{options['module']}: {mode}: {cell}.{options['port']}[{options['portbit']}]{of_wire}: {text}"
    # The next value of a register has no name of its own. Every module numbers its signals anew.
    begin = max((n for n, each in enumerate(source[:first]) if each.startswith("module ")), default=0)
    for register, following in _REGISTER.findall("\n".join(source[begin:]).partition("\nendmodule")[0]):
        said = re.sub(rf"{re.escape(following)}(?!\d) ?", f"next({register})", said)
    return said


def mutated(component: wiring.Component, modules: tuple[str, ...], count: int, seed: int) -> Netlist:
    """Return a component with mutants, evenly drawn; fewer than asked for if it has no more.

    Args:
        component: the component.
        modules: the modules to be changed, with `BLOCK` for the component itself.
        count: how many mutants.
        seed: draws them.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    rtl = to_verilog(component, BLOCK)
    with scratch(build_dir() / "mutate") as work:
        (work / "rtl.v").write_text(rtl, encoding="utf-8")
        chosen = " ".join([modules[0], *(f"{module} %u" for module in modules[1:]), "t:$meminit* %d"])
        listing = f"mutate -list {SPARE * count} -seed {seed} -o listed {chosen}"
        run_yosys(work, f"read_verilog rtl.v; hierarchy -top {BLOCK}; proc; opt_clean; {listing}; write_rtlil plain.il")
        lines = (work / "listed").read_text(encoding="utf-8").splitlines()
        fit = [line for line in lines if _taken(line)]
        drawn = random.Random(seed).sample(fit, min(count, len(fit)))
        commands, mutants = [], []
        for number, line in enumerate(drawn, 1):
            commands.append(line.replace("mutate ", f"mutate -ctrl {SELECTOR} {SELECTOR_BITS} {number} ", 1))
            mutants.append(Mutant(number, _described(line, rtl.splitlines())))
        (work / "changes.ys").write_text("\n".join(commands) + "\n", encoding="utf-8")
        # A choice of which several apply is then the same to the simulator and to the solver.
        run_yosys(work, "read_rtlil plain.il; script changes.ys; pmuxtree; opt_clean; write_verilog -noattr mutated.v")
        return Netlist(component, (work / "mutated.v").read_text(encoding="utf-8"), modules, mutants)


def run_yosys(work: Path, script: str) -> None:
    """Run a script of Yosys in a folder.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    tools.run(work, work / "yosys.log", (YOSYS, "-p", script), "mutation")
