"""Mutants that no test can kill: those that are proven equal to the component, from power-up on and for any inputs.

There are two ways, and either is enough:

- **One step.** Every register becomes an output with its next value and an input with its present one, and what is left
  has no state. If no inputs tell the component from its mutant, both go from equal states to equal states with equal
  outputs, and they have the same values at power-up. What both have alike is merged first, so that a multiplier that is
  in both need not be understood.
- **Induction.** Only the outputs are compared, from power-up on and after some clocks in which they were equal: so a
  register may differ where nothing reads it, and states that do not last are not searched.

The search of the induction may instead find inputs at which an output differs: then a test could kill the mutant.
"""

import copy
import json
import re
from collections.abc import Sequence
from pathlib import Path

from hardwall.model.build_folder import build_dir
from hardwall.sim.jobs.scratch import scratch

from .netlist import BLOCK, SELECTOR, SELECTOR_BITS, Netlist, run_yosys

TIMEOUT_S, STEPS = 20, 20
"""The seconds of the solver for one question, and the most clocks of the induction."""
FLAT = f"read_verilog mutated.v; hierarchy -top {BLOCK}; proc; flatten; memory; memory_map; dffunmap; opt_clean"
SOLVE = f"sat -timeout {TIMEOUT_S} -prove trigger 0 -set-def-inputs"
WAYS = {"step": f"{SOLVE} miter", "flat": f"{SOLVE} -tempinduct -maxsteps {STEPS} miter"}
"""The questions, by the name of the design that each is asked of."""


def cut(module: dict) -> None:
    """Put ports of the module in the place of each of its registers.

    Raises:
        ValueError: if a register is of a kind that this does not know.
    """
    for number, (name, cell) in enumerate(list(module["cells"].items())):
        if "ff" in cell["type"] or "latch" in cell["type"]:
            if cell["type"] != "$dff":
                raise ValueError(f"a register must be a $dff, not {cell['type']}")
            for direction, port in (("output", "D"), ("input", "Q")):
                module["ports"][f"{port}_{number}"] = {"direction": direction, "bits": cell["connections"][port]}
            del module["cells"][name]


def proven(netlist: Netlist, numbers: Sequence[int]) -> dict[int, str]:
    """Return what is known of some mutants: `equivalent`, `differs after N clocks`, or `undecided`.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    if not numbers:
        return {}
    with scratch(build_dir() / "mutate") as work:
        (work / "mutated.v").write_text(netlist.verilog, encoding="utf-8")
        run_yosys(work, f"{FLAT}; write_json flat.json")
        flat = json.loads((work / "flat.json").read_text(encoding="utf-8"))
        step = copy.deepcopy(flat)
        cut(step["modules"][BLOCK])
        (work / "step.json").write_text(json.dumps(step), encoding="utf-8")
        script = []
        for design, question in WAYS.items():
            script += ["design -reset", f"read_json {design}.json", f"design -save {design}"]
            for number in numbers:
                script += [*_side_by_side(design, number), f"tee -q -o {design}-{number} {question}"]
        (work / "compare.ys").write_text("\n".join(script) + "\n", encoding="utf-8")
        run_yosys(work, "script compare.ys")
        return {number: _known(work, number) for number in numbers}


def _side_by_side(design: str, number: int) -> list[str]:
    """Return the commands that compare the outputs of a mutant with the component's, in a module `miter`."""
    fixed = [
        line
        for name, value in (("gold", 0), ("gate", number))
        for line in (
            f"copy {BLOCK} {name}",
            f"delete -input {name}/{SELECTOR}",
            f"cd {name}",
            f"connect -set {SELECTOR} {SELECTOR_BITS}'d{value}",
            "cd ..",
        )
    ]
    merged = ["miter -equiv -flatten gold gate miter", "hierarchy -top miter", "opt -full", "opt_merge -share_all"]
    return [f"design -load {design}", *fixed, *merged, "opt_clean"]


def _known(work: Path, number: int) -> str:
    """Return what the answers say of a mutant."""
    answers = [(work / f"{design}-{number}").read_text(encoding="utf-8") for design in WAYS]
    if any("SUCCESS" in answer for answer in answers):
        return "equivalent"
    if "base case: FAIL" in answers[1]:
        steps = re.findall(r"\[base case (\d+)\] Solving", answers[1])
        return f"differs after {int(steps[-1]) - 1} clocks"
    return "undecided"
