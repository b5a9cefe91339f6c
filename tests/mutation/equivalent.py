"""Mutants that no test can kill: those that are proven equal to the component, from power-up on and for any inputs.

The component and its mutant are put side by side, with the same inputs. They have most bits of their registers in
common: that the mutant's next value of such a bit is the component's is proven with the outputs. The other bits, those
that a search has found to differ, are of each alone. What both have alike is merged, so that a multiplier that is in
both need not be understood. A memory that is written is outside of both: what goes there is proven, and what comes from
there is the same for both. A register without a first value powers up with any, but with the same in both: the mutant is
asked what the component would do from there. There are three ways, and any is enough:

- **One step**, in which common bits have any value, and the others have any value in either.
- **Induction** from power-up on, and after some clocks in which all was equal: so states that do not last are not
  searched.
- **Induction of the outputs**, with no bit in common, for more clocks.

Where one module was changed, it is compared alone, without what is inside it: what it gives to the modules inside is an
output, and what it gets from them an input. So the question does not grow with what is around and inside. A mutant that
is equal so is equal in the component, too. Where that module is the component, all of it is compared, too.

The search from power-up may instead find inputs at which an output differs: then a test could kill the mutant, unless
what is around or inside never gives such inputs.
"""

import copy
import json
import re
import shutil
import subprocess
from collections.abc import Collection
from itertools import count
from pathlib import Path

from hardwall.model.build_folder import build_dir
from hardwall.sim.jobs import children
from hardwall.sim.jobs.scratch import scratch
from hardwall.sim.rtl import tools
from hardwall.sim.rtl.flow import YOSYS

from .netlist import BLOCK, SELECTOR, SELECTOR_BITS, Netlist, run_yosys

EQUIVALENT = "equivalent"
CPU_S = 15
"""The processor's time for a question; one that takes longer is not answered."""
ROUNDS, STEPS, STEPS_IN_COMMON = 8, 20, 16
"""The most searches of bits that differ, and the most clocks of the induction, with no bit and with some in common."""
FLAT = "flatten; memory_collect; memory_map -rom-only; dffunmap; setundef -zero; opt_clean"
"""Registers and memories in the simplest form. What has no value is 0, which the simulation takes it for, too."""
START, FIRST = "START", "FIRST"
"""The ports of the first values of registers that have none of their own, and of the clock at which these hold."""
TO_MEMORY = ("RD_ADDR", "RD_EN", "WR_ADDR", "WR_DATA", "WR_EN")
BETWEEN = "___"
"""What joins the names of a module inside and of its port."""
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


def cut(module: dict, kept: set[Bit], free: bool) -> dict[str, list[Bit]]:
    """Put ports of the module in the place of some bits of its registers; return the bits of each port of next values.

    The other bits stay registers, or if `free` is true, have any value at any time.
    """
    ports: dict[str, list[Bit]] = {}
    for number, name in enumerate(sorted({name for name, _ in registers(module)})):
        cell = module["cells"].pop(name)
        pins = cell["connections"]
        mine, rest = [], []
        for place in range(len(pins["Q"])):
            (mine if (name, place) in kept else rest).append(place)
        if mine:
            ports[f"D_{number}"] = [(name, place) for place in mine]
            for port, direction in (("D", "output"), ("Q", "input")):
                module["ports"][f"{port}_{number}"] = {"direction": direction, "bits": [pins[port][n] for n in mine]}
        if rest and free:
            # The solver takes a cell that it does not know for one with any outputs.
            pins = {"Q": [pins["Q"][n] for n in rest]}
            module["cells"][name] = {"type": "free", "port_directions": {"Q": "output"}, "connections": pins}
        elif rest:
            connections = {port: [bits[n] for n in rest] if port in "DQ" else bits for port, bits in pins.items()}
            parameters = {**cell["parameters"], "WIDTH": f"{len(rest):032b}"}
            module["cells"][name] = {**cell, "connections": connections, "parameters": parameters}
    return ports


def part_from_memories(module: dict) -> None:
    """Put ports of the module in the place of its memories: their contents are equal while equal writes go there."""
    memories = [name for name, cell in module["cells"].items() if cell["type"] == "$mem_v2"]
    for number, name in enumerate(memories):
        pins = module["cells"].pop(name)["connections"]
        for port in (*TO_MEMORY, "RD_DATA"):
            direction = "output" if port in TO_MEMORY else "input"
            module["ports"][f"M_{number}_{port}"] = {"direction": direction, "bits": pins[port]}


def first_values(module: dict) -> dict[int, str]:
    """Return the value at power-up, 0 or 1, of every bit that has one."""
    initial = {}
    for net in module["netnames"].values():
        bits = zip(net["bits"], reversed(net["attributes"].get("init", "")), strict=False)
        initial |= {bit: value for bit, value in bits if value in "01"}
    return initial


def start_alike(module: dict) -> None:
    """Give every register without a first value that of a port, which is the same for the two that are compared.

    The solver would choose one for each of the two, and find that they differ from power-up on.
    """
    initial = first_values(module)
    numbers = count(1 + max(bit for net in module["netnames"].values() for bit in net["bits"] if isinstance(bit, int)))
    first, start = next(numbers), []
    for name, cell in [(name, cell) for name, cell in module["cells"].items() if cell["type"] == "$dff"]:
        pins = cell["connections"]
        seen = [bit for bit in pins["Q"] if bit not in initial]
        if seen:
            held, given = ([next(numbers) for _ in seen] for _ in range(2))
            renamed = dict(zip(seen, held, strict=True))
            pins["Q"] = [renamed.get(bit, bit) for bit in pins["Q"]]
            module["cells"][f"{START}_{name}"] = {
                "type": "$mux",
                "parameters": {"WIDTH": f"{len(seen):032b}"},
                "port_directions": {"A": "input", "B": "input", "S": "input", "Y": "output"},
                "connections": {"A": held, "B": given, "S": [first], "Y": seen},
            }
            start += given
    if start:
        module["ports"][START] = {"direction": "input", "bits": start}
        module["ports"][FIRST] = {"direction": "input", "bits": [first]}


def joined(module: dict) -> str:
    """Return Verilog of `machine`: the two side by side, with one register for both in the place of their ports."""
    initial = first_values(module)
    heads, inside, pins = ["output trigger"], [], ["trigger"]
    for name, port in module["ports"].items():
        width, number = f"[{len(port['bits']) - 1}:0]", name.removeprefix("Q_")
        if port["direction"] == "output":
            heads += [f"output {width} {side}_{name}" for side in ("gold", "gate")]
            pins += [f"{side}_{name}" for side in ("gold", "gate")]
        elif name.startswith("Q_"):
            bits = "".join(initial.get(bit, "x") for bit in reversed(port["bits"]))
            inside.append(f"reg {width} in_{name} = {len(bits)}'b{bits};")
            inside.append(f"always @(posedge of_both) in_{name} <= gold_D_{number};")
            pins.append(f"in_{name}")
        elif name == FIRST:
            inside.append(f"reg in_{name} = 1'b1;")
            inside.append(f"always @(posedge of_both) in_{name} <= 1'b0;")
            pins.append(f"in_{name}")
        elif name != SELECTOR:
            heads.append(f"input {width} in_{name}")
            pins.append(f"in_{name}")
    connected = ", ".join(f".{name}({name})" for name in pins)
    lines = ["module machine(input of_both, " + ", ".join(heads) + ");", *inside, f"miter miter({connected});"]
    return "\n".join([*lines, "endmodule"]) + "\n"


def _compared(netlist: Netlist) -> list[str]:
    """Return the commands that make `BLOCK` of what is compared, which is tried in this order."""
    whole = f"hierarchy -top {BLOCK}; proc"
    if len(netlist.modules) > 1:
        return [whole]
    (top,) = netlist.modules
    alone = f"hierarchy -top {top}; proc; expose -evert -sep {BETWEEN} {top}/t:{top}.*; hierarchy -top {top}"
    if top != BLOCK:
        return [f"{alone}; rename {top} {BLOCK}"]
    return [alone, whole] if f"module \\{top}." in netlist.verilog else [whole]


def known_of(netlist: Netlist, numbers: Collection[int]) -> dict[int, str]:
    """Return what is known of some mutants: `equivalent`, `differs after N clocks`, or `undecided`.

    Raises:
        SynthesisError: if Yosys is missing or fails.
    """
    known: dict[int, str] = {}
    with scratch(build_dir() / "mutate") as work:
        (work / "mutated.v").write_text(netlist.verilog, encoding="utf-8")
        for commands in _compared(netlist):
            run_yosys(work, f"read_verilog mutated.v; {commands}; {FLAT}; write_json flat.json")
            flat = json.loads((work / "flat.json").read_text(encoding="utf-8"))
            part_from_memories(flat["modules"][BLOCK])
            known |= {number: _known(work, flat, number) for number in numbers if known.get(number) != EQUIVALENT}
    return known


def _known(work: Path, flat: dict, number: int) -> str:
    kept = _unequal_in_a_step(work, flat, number)
    if kept is None:
        return EQUIVALENT
    answer = ""
    # What differs from some state may be the same from all states that the block comes to.
    for common in (registers(flat["modules"][BLOCK]), kept):
        answer = _induced(work, flat, number, common)
        if any(said in answer for said in (PROVEN, DIFFERS)):
            break
    else:
        answer = _asked(work, copy.deepcopy(flat), number, f"-tempinduct -maxsteps {STEPS}")
    if DIFFERS in answer:
        steps = re.findall(r"\[base case (\d+)\] Solving", answer)
        return f"differs after {int(steps[-1]) - 1} clocks"
    return EQUIVALENT if PROVEN in answer else "undecided"


def _induced(work: Path, flat: dict, number: int, kept: set[Bit]) -> str:
    """Return the answer of the induction with some bits in common, without those that it finds to differ."""
    answer = ""
    for _ in range(ROUNDS):
        design = copy.deepcopy(flat)
        ports = cut(design["modules"][BLOCK], kept, free=False)
        answer = _asked(work, design, number, f"-tempinduct -maxsteps {STEPS_IN_COMMON} -show-outputs")
        unlike = _unlike(answer, ports) if DIFFERS in answer else set()
        if not unlike:
            return answer
        kept = kept - unlike
    return ""


def _unequal_in_a_step(work: Path, flat: dict, number: int) -> set[Bit] | None:
    """Return None if a mutant is equal in a step, and otherwise the bits that did not differ in the first search."""
    kept = registers(flat["modules"][BLOCK])
    first = None
    for _ in range(ROUNDS):
        step = copy.deepcopy(flat)
        ports = cut(step["modules"][BLOCK], kept, free=True)
        answer = _asked(work, step, number, "-ignore_unknown_cells -show-outputs", joint=False)
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


def _asked(work: Path, design: dict, number: int, how: str, joint: bool = True) -> str:
    """Return the solver's answer on a design with its mutant beside it; an empty text if it has none in its time.

    Args:
        work: a folder for the files.
        design: the component with its mutants, as Yosys writes it, with ports in the place of registers in common.
        number: the mutant.
        how: options of the solver.
        joint: whether these ports are joined by registers; otherwise they have any value.
    """
    if joint:
        start_alike(design["modules"][BLOCK])
    (work / "design.json").write_text(json.dumps(design), encoding="utf-8")
    (work / "joined.v").write_text(joined(design["modules"][BLOCK]), encoding="utf-8")
    top = "machine" if joint else "miter"
    whole = ["read_verilog joined.v"] if joint else []
    # Registers stay as they are: what is made of those with a constant bit loses their values at power-up.
    whole += [f"hierarchy -top {top}", "proc", "flatten", *("opt_expr -full", "opt_merge -share_all", "opt_clean") * 3]
    script = [*_side_by_side(number), *whole, f"sat -prove trigger 0 {how} {top}"]
    (work / "ask.ys").write_text("\n".join(script) + "\n", encoding="utf-8")
    tool = shutil.which(YOSYS, path=tools.TOOLS)
    # This Yosys has no clock to end its solver by.
    limited = ("/bin/sh", "-c", 'ulimit -t "$0" && exec "$@"', str(CPU_S), tool, "-s", "ask.ys")
    done = children.run(limited, cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode > 0:
        why = next(
            (line for line in done.stdout.splitlines() if line.startswith("ERROR: ")), f"exit code {done.returncode}"
        )
        raise tools.SynthesisError(f"Yosys cannot compare a mutant: {why.removeprefix('ERROR: ')}")
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
    return ["read_json design.json", *fixed, "miter -equiv -flatten -make_outputs gold gate miter"]
