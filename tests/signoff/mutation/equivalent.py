"""Mutants that no test can kill: those that are proven equal to the component, from power-up on and for any inputs.

The component and its mutant are put side by side, with the same inputs. They have most bits of their registers in
common: that the mutant's next value of such a bit is the component's is proven with the outputs. The other bits, those
that a search has found to differ, are of each alone. What both have alike is merged, so that a multiplier that is in
both need not be understood. A memory that is written is outside of both: what goes there is proven, and what comes from
there is the same for both. A register without a first value powers up with any, but with the same in both. There are
five ways, and any is enough:

- **One step**, in which common bits have any value, and the others have any value in either.
- **One step by states**, in which what differs may do so in some states alone: see `by_state.py`.
- **Induction** from power-up on, and after some clocks in which all was equal: so states that do not last are not
  searched.
- **Induction with an invariant** that ABC looks for, so that what holds in all states that are reached is enough.
- **Induction of the outputs**, with no bit in common, for more clocks.

Where one module was changed, it is compared alone, without what is inside it: what it gives to the modules inside is an
output, and what it gets from them an input. So the question does not grow with what is around and inside. A mutant that
is equal so is equal in the component, too. Where that module is the component, all of it is compared, too. Otherwise
the module around it is, but for the two inductions that go clock by clock: so it may give anything where nobody takes
it.

The search from power-up may instead find inputs at which an output differs: then a test could kill the mutant, unless
what is around or inside never gives such inputs.
"""

import copy
import json
import re
from collections.abc import Collection
from pathlib import Path

from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.jobs.scratch import scratch

from .by_state import equal_by_state
from .cutting import Bit, cut, joined, part_from_memories, registers, start_alike
from .netlist import BLOCK, Netlist, run_yosys
from .solver import answer, copies, never

EQUIVALENT = "equivalent"
ROUNDS, STEPS, STEPS_IN_COMMON = 8, 20, 16
"""The most searches of bits that differ, and the most clocks of the induction, with no bit and with some in common."""
FLAT = (
    "flatten; memory_collect; memory_map -rom-only; dffunmap; setundef -zero; opt_expr -fine; opt_clean; splitcells;"
    " opt_clean"
)
"""Registers and memories in the simplest form, without the bits that nothing reads.

What has no value is 0, which the simulation takes it for, too.
"""
BETWEEN = "___"
"""What joins the names of a module inside and of its port."""
PROVEN, DIFFERS = "SUCCESS", "base case: FAIL"
_VALUE = re.compile(r"^ *(\d*) *\\(?:gold|gate)_(\S+) .* ([01]+)$", re.MULTILINE)


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
            flat = _flat(work, commands)
            known |= {number: _known(work, flat, number) for number in numbers if known.get(number) != EQUIVALENT}
        left = [number for number in numbers if known[number] != EQUIVALENT]
        if left and (around := _around(netlist)):
            flat = _flat(work, around)
            known |= dict.fromkeys([number for number in left if _equal_around(work, flat, number)], EQUIVALENT)
    return known


def _around(netlist: Netlist) -> str:
    """Return the commands that make `BLOCK` of the module around the one that was changed; an empty text for none."""
    outer = netlist.modules[0].rpartition(".")[0]
    return f"hierarchy -top {outer}; proc; rename {outer} {BLOCK}" if outer and len(netlist.modules) == 1 else ""


def _flat(work: Path, commands: str) -> dict:
    """Return what is compared, as Yosys writes it, without its memories."""
    run_yosys(work, f"read_verilog mutated.v; {commands}; {FLAT}; write_json flat.json")
    flat = json.loads((work / "flat.json").read_text(encoding="utf-8"))
    part_from_memories(flat["modules"][BLOCK])
    return flat


def _equal_around(work: Path, flat: dict, number: int) -> bool:
    kept = _unequal_in_a_step(work, flat, number)
    return kept is None or equal_by_state(work, flat, number) or _equal_where_reached(work, flat, number, kept)


def _known(work: Path, flat: dict, number: int) -> str:
    kept = _unequal_in_a_step(work, flat, number)
    if kept is None or equal_by_state(work, flat, number):
        return EQUIVALENT
    answer = ""
    # What differs from some state may be the same from all states that the block comes to.
    for common in (registers(flat["modules"][BLOCK]), kept):
        answer, alike = _induced(work, flat, number, common)
        if any(said in answer for said in (PROVEN, DIFFERS)):
            break
    else:
        if _equal_where_reached(work, flat, number, alike):
            return EQUIVALENT
        answer = _asked(work, copy.deepcopy(flat), number, f"-tempinduct -maxsteps {STEPS}")
    if DIFFERS in answer:
        steps = re.findall(r"\[base case (\d+)\] Solving", answer)
        return f"differs after {int(steps[-1]) - 1} clocks"
    return EQUIVALENT if PROVEN in answer else "undecided"


def _induced(work: Path, flat: dict, number: int, kept: set[Bit]) -> tuple[str, set[Bit]]:
    """Return the answer of the induction with some bits in common, and these without those that it finds to differ."""
    answer = ""
    for _ in range(ROUNDS):
        design = copy.deepcopy(flat)
        ports = cut(design["modules"][BLOCK], kept, free=False)
        answer = _asked(work, design, number, f"-tempinduct -maxsteps {STEPS_IN_COMMON} -show-outputs")
        unlike = _unlike(answer, ports) if DIFFERS in answer else set()
        if not unlike:
            return answer, kept
        kept = kept - unlike
    return "", kept


def _equal_where_reached(work: Path, flat: dict, number: int, kept: set[Bit]) -> bool:
    """Return whether a mutant with some bits in common is proven equal in all states that are reached."""
    design = copy.deepcopy(flat)
    cut(design["modules"][BLOCK], kept, free=False)
    return never(work, design, *_side_by_side(work, design, number, joint=True))


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
    made, top = _side_by_side(work, design, number, joint)
    return answer(work, design, made, top, f"-prove trigger 0 {how}")


def _side_by_side(work: Path, design: dict, number: int, joint: bool) -> tuple[list[str], str]:
    """Return the commands that put a design and its mutant side by side, and the module that is made."""
    if joint:
        start_alike(design["modules"][BLOCK])
    (work / "joined.v").write_text(joined(design["modules"][BLOCK]), encoding="utf-8")
    made = [*copies(number), "miter -equiv -flatten -make_outputs gold gate miter"]
    return ([*made, "read_verilog joined.v"], "machine") if joint else (made, "miter")
