"""Netlists simulated beside their RTL: what came of each; what was equal is kept."""

import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hardwall.hdl.export import to_verilog
from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.jobs.scratch import scratch
from hardwall.sim.rtl import cocotb_build, cocotb_runner, netlist, tools
from hardwall.sim.rtl.families import Family
from hardwall.sim.rtl.flow import YOSYS
from hardwall.sim.rtl.netlist import RTL, Netlist, mapped
from hardwall.testing import SEED
from signoff.covering.sources import code_of_all, means
from signoff.kept import Findings, digest_of

from .pair import Pair
from .tops import Top

OPTIONS = (
    *netlist.OPTIONS,
    # What no initial value and no reset has set is random, and so is what Yosys leaves open.
    *("--x-initial", "unique", "--x-assign", "unique"),
)
IN_SIMULATOR = Path(__file__).with_name("side_by_side.py")
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
        cells: the units of every resource in the netlist.
        samples: the samples that were asked for.
        clocks: the clock edges at which all outputs were compared.
        different: how many of them found an output different.
        first: the number of the first of these, from power-up.
        unlike: the outputs that differed then, each as the RTL and the netlist had it.
        still: the outputs that never changed though they should have.
    """

    case: Case
    cells: dict[str, int]
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
    def figures(self) -> dict[str, Any]:
        """What is kept of a case whose netlist is equal, of what JSON has."""
        return {name: getattr(self, name) for name in ("cells", "samples", "clocks")}

    @classmethod
    def equal(cls, case: Case, cells: dict[str, int], samples: int, clocks: int) -> "Outcome":
        """Return the outcome of a case whose netlist was found equal."""
        return cls(case, cells, samples, clocks, 0, 0, {}, ())

    @property
    def line(self) -> str:
        """One line for the progress."""
        return f"{self.case.name}: {'different' if self.different else 'equal'} in {self.clocks} clocks"

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
            module=IN_SIMULATOR.stem,
            folder=IN_SIMULATOR.parent,
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
        made.cells,
        samples,
        found["clocks"],
        found["different"],
        found["first"],
        {name: both for name, both in unlike.items() if both[0] != both[1]},
        tuple(name for name in found["still"] if name not in case.top.still),
    )


def origin_digest(case: Case, samples: int) -> str:
    """Return a digest of all that an outcome comes from: the RTL, the mapping, the cells' models and the stimuli."""
    component, family = case.top.component(), case.family
    verilog = to_verilog(component, RTL), to_verilog(Pair(component), "pair")
    mapping = family.synth, family.models, tools.versions([YOSYS])
    compared_by = means(__file__, netlist.__file__, cocotb_build.__file__, cocotb_runner.__file__)
    return digest_of(case.top.still, verilog, mapping, code_of_all(IN_SIMULATOR), compared_by, samples, SEED)


def run(cases: Sequence[Case], samples: int, done: Callable[[Outcome], None], findings: Findings) -> list[Outcome]:
    """Return the outcomes in the order of the cases; `done` is called with each as it comes.

    What was found equal before is not simulated again.

    Raises:
        SynthesisError: if Yosys is missing or fails.
        RuntimeError: if a simulation cannot be built, or fails.
    """
    # The hardware is made by this thread alone.
    digests = [origin_digest(case, samples) for case in cases]

    def outcome(case: Case, digest: str) -> Outcome:
        if kept := findings.of(case.name, digest):
            return Outcome.equal(case, **kept)
        came = compared(case, mapped(case.top.component(), case.family), samples)
        if came.ok:
            findings.keep(case.name, digest, came.figures)
        return came

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(outcome, case, digest) for case, digest in zip(cases, digests, strict=True)]
        for future in as_completed(futures):
            done(future.result())
    return [future.result() for future in futures]
