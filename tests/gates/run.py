"""Netlists simulated beside their RTL: what came of each."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hardwall.model.build_folder import build_dir
from hardwall.sim.jobs.scratch import scratch
from hardwall.sim.rtl import cocotb_runner, netlist
from hardwall.sim.rtl.families import Family
from hardwall.sim.rtl.netlist import Netlist, mapped
from hardwall.testing import SEED

from .pair import Pair
from .tops import Top

OPTIONS = (
    *netlist.OPTIONS,
    # What no initial value and no reset has set is random, and so is what Yosys leaves open.
    *("--x-initial", "unique", "--x-assign", "unique"),
)
PLUSARGS = ("+verilator+rand+reset+2", f"+verilator+seed+{SEED}")


@dataclass(frozen=True)
class Case:
    """A top to be mapped to a family."""

    family: Family
    top: Top

    @property
    def name(self) -> str:
        return f"{self.family.name} {self.top.name}"


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes:
        case: the case.
        netlist: what Yosys made of it.
        samples: the samples that were asked for.
        clocks: the clock edges at which all outputs were compared.
        different: how many of them found an output different.
        first: the number of the first of these, from power-up.
        unlike: the outputs that differed then, each as the RTL and the netlist had it.
        still: the outputs that never changed though they should have.
    """

    case: Case
    netlist: Netlist
    samples: int
    clocks: int
    different: int
    first: int
    unlike: dict[str, tuple[int, int]]
    still: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether all outputs were equal at every clock, and all that can change did."""
        return self.clocks >= self.samples and not self.different and not self.still

    @property
    def line(self) -> str:
        """One line for the progress."""
        return f"{self.case.name}: {'equal' if self.ok else 'not equal'} in {self.clocks} clocks"

    @property
    def explanation(self) -> str:
        """What is wrong with a case that is not as it should be; nothing of one that is."""
        said = ""
        if self.different:
            values = "".join(f"  {name}: RTL {rtl}, netlist {gates}\n" for name, (rtl, gates) in self.unlike.items())
            said = f"{self.case.name}: differs at {self.different} clocks, first at clock {self.first}\n{values}"
        if self.still:
            said += f"{self.case.name}: these outputs never changed, so they show nothing: {', '.join(self.still)}\n"
        return said


def compared(case: Case, made: Netlist, samples: int) -> Outcome:
    """Return what comes of a netlist beside its RTL, from power-up on; the simulator's log is in the build folder.

    Raises:
        RuntimeError: if the simulation cannot be built, or fails.
    """
    folder = build_dir() / "gate"
    with scratch(folder) as own:
        report = own / "report"
        given = {"top": case.top.name, "samples": samples, "report": str(report)}
        job = cocotb_runner.Job(
            module="side_by_side",
            folder=Path(__file__).parent,
            environ={"HARDWALL_PARAMETERS": json.dumps(given)},
            seed=SEED,
            log=folder / f"{case.name.replace(' ', '-')}.log",
            more=made.verilog,
            options=OPTIONS,
            plusargs=PLUSARGS,
        )
        cocotb_runner.simulate(Pair(made.component), "pair", job)
        found = json.loads(report.read_text(encoding="ascii"))
    unlike = {name: (value, found["gates"][name]) for name, value in found["rtl"].items()}
    return Outcome(
        case,
        made,
        samples,
        found["clocks"],
        found["different"],
        found["first"],
        {name: both for name, both in unlike.items() if both[0] != both[1]},
        tuple(name for name in found["still"] if name not in case.top.still),
    )


def run(cases: Sequence[Case], samples: int, done: Callable[[Outcome], None]) -> list[Outcome]:
    """Return the outcomes in the order of the cases; `done` is called with each as it comes.

    Raises:
        SynthesisError: if Yosys is missing or fails.
        RuntimeError: if a simulation cannot be built, or fails.
    """
    outcomes = []
    for case in cases:
        outcomes.append(compared(case, mapped(case.top.component(), case.family), samples))
        done(outcomes[-1])
    return outcomes
