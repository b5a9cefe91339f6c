"""Mutants that no test can kill: those that are proven equal to the component, from power-up on and for any inputs.

There are two ways, and either is enough:

- **One step.** Registers become outputs with their next values, and inputs with their present ones. If no inputs tell
  the component from its mutant, both go from equal states to equal states with equal outputs, and they have the same
  values at power-up. A register that differs after the step is given any value in either; if the outputs are equal all
  the same, nothing depends on it. What both have alike is merged first, so that a multiplier that
  is in both need not be understood.
- **Induction.** Outputs are compared from power-up on, and after some clocks in which they were equal: so states that
  do not last are not searched. If that is not enough, registers are compared too, without those bits that the search
  from power-up finds to differ.

The search from power-up may instead find inputs at which an output differs: then a test could kill the mutant.
"""

import copy
import json
import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

from hardwall.model.build_folder import build_dir
from hardwall.sim.jobs import children
from hardwall.sim.jobs.scratch import scratch
from hardwall.sim.rtl import synthesis

from .netlist import BLOCK, SELECTOR, SELECTOR_BITS, Netlist, run_yosys

EQUIVALENT = "equivalent"
CPU_S = 15
"""The processor's time for a question; one that takes longer is not answered."""
ROUNDS, STEPS, STEPS_OF_REGISTERS = 8, 20, 8
"""The most searches of registers that differ, and the most clocks of the induction, on outputs and on registers."""
FLAT = f"read_verilog mutated.v; hierarchy -top {BLOCK}; proc; flatten; memory; memory_map; dffunmap; opt_clean"
SOLVE = "sat -prove trigger 0"
PROVEN, DIFFERS = "SUCCESS", "base case: FAIL"
_VALUE = re.compile(r"^ *(\d*) *\\(?:gold|gate)_(\S+) .* ([01]+)$", re.MULTILINE)

Bit = tuple[str, int]
"""A bit of a register: the name of its cell, and its place in it."""


def registers(module: dict) -> set[Bit]:
    """Return all bits of the registers of a module.

    Raises:
        ValueError: if a register is of a kind that this does not know.
    """
    found = set()
    for name, cell in module["cells"].items():
        if "ff" in cell["type"] or "latch" in cell["type"]:
            if cell["type"] != "$dff":
                raise ValueError(f"a register must be a $dff, not {cell['type']}")
            found |= {(name, place) for place in range(len(cell["connections"]["Q"]))}
    return found


def cut(module: dict, kept: set[Bit]) -> dict[str, list[Bit]]:
    """Put ports of the module in the place of some bits of its registers, and any value in the place of the others.

    Returns:
        The bits of each port of next values.
    """
    ports: dict[str, list[Bit]] = {}
    for number, name in enumerate(sorted({name for name, _ in registers(module)})):
        pins = module["cells"].pop(name)["connections"]
        mine, rest = [], []
        for place in range(len(pins["Q"])):
            (mine if (name, place) in kept else rest).append(place)
        if mine:
            ports[f"D_{number}"] = [(name, place) for place in mine]
            for port, direction in (("D", "output"), ("Q", "input")):
                module["ports"][f"{port}_{number}"] = {"direction": direction, "bits": [pins[port][n] for n in mine]}
        if rest:
            # The solver takes a cell that it does not know for one with any outputs.
            free = {"Q": [pins["Q"][n] for n in rest]}
            module["cells"][name] = {"type": "free", "port_directions": {"Q": "output"}, "connections": free}
    return ports


def watch(module: dict, kept: set[Bit]) -> dict[str, list[Bit]]:
    """Add outputs with some bits of the registers to a module; return the bits of each of them."""
    ports: dict[str, list[Bit]] = {}
    for number, name in enumerate(sorted({name for name, _ in kept})):
        taken = module["cells"][name]["connections"]["Q"]
        ports[f"Q_{number}"] = [(name, place) for place in range(len(taken)) if (name, place) in kept]
        bits = [taken[place] for _, place in ports[f"Q_{number}"]]
        module["ports"][f"Q_{number}"] = {"direction": "output", "bits": bits}
    return ports


def known_of(netlist: Netlist, numbers: Iterable[int]) -> dict[int, str]:
    """Return what is known of some mutants: `equivalent`, `differs after N clocks`, or `undecided`.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    with scratch(build_dir() / "mutate") as work:
        (work / "mutated.v").write_text(netlist.verilog, encoding="utf-8")
        run_yosys(work, f"{FLAT}; write_json flat.json")
        flat = json.loads((work / "flat.json").read_text(encoding="utf-8"))
        return {number: _known(work, flat, number) for number in numbers}


def _known(work: Path, flat: dict, number: int) -> str:
    kept = _unequal_in_a_step(work, flat, number)
    if kept is None:
        return EQUIVALENT
    answer = ""
    for _ in range(ROUNDS):
        watched = copy.deepcopy(flat)
        ports = watch(watched["modules"][BLOCK], kept)
        answer = _asked(
            work, watched, number, f"{SOLVE} -tempinduct -maxsteps {STEPS_OF_REGISTERS} -show-outputs miter"
        )
        unlike = _unlike(answer, ports) if DIFFERS in answer else set()
        if not unlike:
            break
        kept -= unlike
    if not any(said in answer for said in (PROVEN, DIFFERS)):
        answer = _asked(work, flat, number, f"{SOLVE} -tempinduct -maxsteps {STEPS} miter")
    if DIFFERS in answer:
        steps = re.findall(r"\[base case (\d+)\] Solving", answer)
        return f"differs after {int(steps[-1]) - 1} clocks"
    return EQUIVALENT if PROVEN in answer else "undecided"


def _unequal_in_a_step(work: Path, flat: dict, number: int) -> set[Bit] | None:
    """Return None if a mutant is equal in a step, and otherwise the bits that did not differ in the first search."""
    kept = registers(flat["modules"][BLOCK])
    first = None
    for _ in range(ROUNDS):
        step = copy.deepcopy(flat)
        ports = cut(step["modules"][BLOCK], kept)
        answer = _asked(work, step, number, f"{SOLVE} -ignore_unknown_cells -show-outputs miter")
        if PROVEN in answer:
            return None
        unlike = _unlike(answer, ports)
        kept = kept - unlike
        first = kept if first is None else first
        if not unlike:
            break
    return first


def _unlike(answer: str, ports: dict[str, list[Bit]]) -> set[Bit]:
    """Return the bits of registers that differ at the last clock of an answer; none if an output of the block does."""
    last = answer.rpartition("Signal Name")[2]
    clocks: dict[int, dict[str, list[str]]] = {}
    for clock, name, bits in _VALUE.findall(last):
        clocks.setdefault(int(clock or 0), {}).setdefault(name, []).append(bits[::-1])
    pairs = clocks[max(clocks)] if clocks else {}
    unlike = {name: both for name, both in pairs.items() if both[0] != both[-1]}
    if not set(unlike) <= set(ports):
        return set()
    return {
        bit
        for name, (one, other) in unlike.items()
        for bit, a, b in zip(ports[name], one, other, strict=True)
        if a != b
    }


def _asked(work: Path, design: dict, number: int, question: str) -> str:
    """Return the solver's answer on a design with its mutant beside it; an empty text if it has none in its time."""
    (work / "design.json").write_text(json.dumps(design), encoding="utf-8")
    (work / "ask.ys").write_text("\n".join(_side_by_side(number)) + f"\n{question}\n", encoding="utf-8")
    tool = shutil.which(synthesis.YOSYS, path=synthesis.TOOLS)
    # This Yosys has no clock to end its solver by.
    limited = ("/bin/sh", "-c", 'ulimit -t "$0" && exec "$@"', str(CPU_S), tool, "-s", "ask.ys")
    done = children.run(limited, cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode > 0:
        why = next(
            (line for line in done.stdout.splitlines() if line.startswith("ERROR: ")), f"exit code {done.returncode}"
        )
        raise synthesis.SynthesisError(f"Yosys cannot compare a mutant: {why.removeprefix('ERROR: ')}")
    return done.stdout if done.returncode == 0 else ""


def _side_by_side(number: int) -> list[str]:
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
    compared = ["miter -equiv -flatten -make_outputs gold gate miter", "hierarchy -top miter"]
    return ["read_json design.json", *fixed, *compared, "opt -full", "opt_merge -share_all", "dffunmap", "opt_clean"]
