"""Mutants that are equal to the component because what differs is not read in the states in which it differs.

The component and its mutant begin alike and get the same inputs. Three kinds of facts are found and then proven for a
single step, so that they hold for ever:

- **States that are reached**: words of the registers in `CONTROL`, which are to be alike always.
- **Registers that differ**: in which of these states each of the others may. None does at power-up; a register is given
  every state in which some step makes it differ, until no step makes another.
- **A bit that is inverted**: in which of these states the mutant's is known to be the other one. This is looked for
  where a single bit of a register begins to differ: all its steps are listed, and what comes of them from power-up on
  is taken to hold, until some step leads out of it. So a bit that turns at every clock, and is read an even number of
  clocks after it is written, is equal where it is read.

A product is any number, the same for both where its factors are: that two products are equal, a solver finds slowly.

Before the first state is left for the first time, most registers still have their first values. That is found, too: all
that have one are taken to, but for those that some step changes there.
"""

import copy
import re
from dataclasses import dataclass, field
from pathlib import Path

from .cutting import cut, first_values, registers
from .netlist import BLOCK, SELECTOR
from .solver import answer, copies

CONTROL = ("fsm_state", "running")
"""The registers by which states are told apart. A block with more bits of them than `MOST_BITS` is not tried."""
MOST_BITS = 8
PROVEN = "SUCCESS"
SHOWN = "at", "next", "bad", "new", "off", "before", "unlike"
"""What examples tell, as far as a question has it."""
QUESTIONS, ANSWERS, STATES = 40, 12, 10_000
"""The most questions, the most examples of each, and the most steps from a state to another."""
_REGISTER, _PRODUCT = re.compile(r"[DQ]_(\d+)$"), re.compile(r"(TIMES_\d+)_[ABY]$")
"""The ports of registers and of multipliers."""
_VALUE = re.compile(r"^ *\\(\S+) .* ([01]+)$", re.MULTILINE)

Place = tuple[int, int]
"""A bit of a register: the number of that, and its place in it."""


@dataclass
class Facts:
    """What is taken to hold.

    Attributes:
        bits: the control's bits, each the number of its register and its place in it.
        reached: the states that are reached.
        firsts: the first value of every register that has one.
        untouched: the registers that have it as long as the first state lasts.
        differ: the states in which a register may differ, by its number.
        inverted: the states in which a bit is known to be inverted, by its register and its place in it; none of them
            is that at power-up.
    """

    bits: list[Place]
    reached: set[int] = field(default_factory=set)
    firsts: dict[int, str] = field(default_factory=dict)
    untouched: set[int] = field(default_factory=set)
    differ: dict[int, set[int]] = field(default_factory=dict)
    inverted: dict[Place, set[int]] = field(default_factory=dict)

    @property
    def control(self) -> set[int]:
        return {register for register, _ in self.bits}

    @property
    def first(self) -> int:
        """The state at power-up."""
        return sum((self.firsts[register][::-1][place] == "1") << n for n, (register, place) in enumerate(self.bits))

    def word(self, prefix: str) -> str:
        """Return Verilog of the control's word."""
        return "{" + ", ".join(f"{prefix}{register}[{place}]" for register, place in reversed(self.bits)) + "}"

    def of_mutant(self, register: int | None, value: str, word: str) -> str:
        """Return Verilog of what a register of the component is in the mutant, where it may not differ otherwise."""
        turned = [
            f"({self.among(word, states)} << {place})" for (n, place), states in self.inverted.items() if n == register
        ]
        return " ^ ".join([value, *turned])

    def among(self, word: str, states: set[int]) -> str:
        """Return Verilog that says whether a word of the control is among some states."""
        return "(" + " | ".join([f"({word} == {state})" for state in sorted(states)] or ["1'b0"]) + ")"


def equal_by_state(work: Path, flat: dict, number: int) -> bool:
    """Return whether a mutant is proven equal so; False where it is not, or has no control.

    Args:
        work: a folder for the files.
        flat: the component with its mutants, as Yosys writes it, without memories.
        number: the mutant.
    """
    design = copy.deepcopy(flat)
    module = design["modules"][BLOCK]
    initial, cells = first_values(module), sorted({name for name, _ in registers(module)})
    outputs = {n: module["cells"][name]["connections"]["Q"] for n, name in enumerate(cells)}
    named = [net["bits"] for name, net in module["netnames"].items() if name.rpartition(".")[2] in CONTROL]
    control = {bit for bits in named for bit in bits}
    facts = Facts([(n, k) for n, bits in outputs.items() for k, bit in enumerate(bits) if bit in control])
    facts.firsts = {
        n: "".join(initial[bit] for bit in reversed(bits))
        for n, bits in outputs.items()
        if all(bit in initial for bit in bits)
    }
    if not 0 < len(facts.bits) <= MOST_BITS or not facts.control <= set(facts.firsts):
        return False
    facts.untouched = set(facts.firsts) - facts.control
    cut(module, registers(module), free=False)
    _part_from_products(module)
    steps = _examples(work, design, number, _stepping(module, facts), f"-max {STATES}")
    if not steps or len(steps) >= STATES:
        return False
    new = {facts.first}
    while new:
        facts.reached |= new
        new = {step["next"] for step in steps if step["at"] in facts.reached} - facts.reached
    _take_inverted(work, design, number, facts)
    return _holds(work, design, number, facts)


def _holds(work: Path, design: dict, number: int, facts: Facts) -> bool:
    """Return whether a mutant is proven equal by facts, without those that some step leads out of."""
    module = design["modules"][BLOCK]
    for _ in range(QUESTIONS):
        found = _examples(work, design, number, _pair(module, facts), f"-prove trigger 0 -max {ANSWERS}")
        if not found:
            return found is not None
        for example in found:
            if example["bad"]:
                return False
            for n in range(example["new"].bit_length()):
                if example["new"] >> n & 1:
                    facts.differ.setdefault(n, set()).add(example["next"])
            facts.untouched -= {n for n in facts.untouched if example["off"] >> n & 1}
    return False


def _take_inverted(work: Path, design: dict, number: int, facts: Facts) -> None:
    """Take a bit to be inverted in some states, and to be any in others, if there is such a bit.

    It is the only one that a step from equal registers makes differ. Its steps are all listed, with the others equal.
    """
    module = design["modules"][BLOCK]
    places = [
        (int(found[1]), place)
        for name, port in module["ports"].items()
        if name.startswith("D_") and (found := _REGISTER.match(name)) and int(found[1]) not in facts.control
        for place in range(len(port["bits"]))
    ]
    if not places:
        return
    begun = _examples(work, design, number, _single(module, facts, places), f"-prove trigger 0 -max {ANSWERS}")
    unlike = {place for example in begun or () for k, place in enumerate(places) if example["unlike"] >> k & 1}
    if len(unlike) != 1:
        return
    steps = _examples(work, design, number, _single(module, facts, [*unlike]), f"-prove trigger 0 -max {STATES}")
    if not steps or len(steps) >= STATES:
        return
    come, new = set(), {(facts.first, 0)}
    while new:
        come |= new
        new = {(step["next"], step["unlike"]) for step in steps if (step["at"], step["before"]) in come} - come
    inverted = {state for state, differs in come if differs and (state, 0) not in come}
    ((register, place),) = unlike
    facts.inverted = {(register, place): inverted}
    facts.differ = {register: {state for state, differs in come if differs} - inverted}


def _single(module: dict, facts: Facts, places: list[Place]) -> str:
    """Return Verilog of a machine for steps from registers that are equal, but for a bit if `places` has one alone.

    Its outputs are `unlike`, which of the places differ in the next state. If there is one, it triggers at every step,
    and the others are `at` and `next`, this state and the next one, and `before`, whether the bit differs in this one.
    Otherwise it triggers where one differs.
    """
    alone = places[0] if len(places) == 1 else None
    sides: dict[str, list[str]] = {"gold": [], "gate": []}
    heads, body = ["input inverts", "output trigger", f"output [{len(places) - 1}:0] unlike"], []
    for name, port in module["ports"].items():
        width, register = len(port["bits"]), _REGISTER.match(name)
        if port["direction"] == "output":
            for side, pins in sides.items():
                body.append(f"wire [{width - 1}:0] {side}_{name};")
                pins.append(f".{name}({side}_{name})")
        elif name != SELECTOR:
            heads.append(f"input [{width - 1}:0] {name}")
            turned = f" ^ (inverts << {alone[1]})" if alone and register and int(register[1]) == alone[0] else ""
            body.append(f"wire [{width - 1}:0] gate_{name} = {name}{turned};")
            sides["gold"].append(f".{name}({name})")
            sides["gate"].append(f".{name}(gate_{name})")
    words = {"at": facts.word("Q_"), "next": facts.word("gold_D_"), "before": "inverts"} if alone else {}
    heads += [f"output [{0 if key == 'before' else len(facts.bits) - 1}:0] {key}" for key in words]
    words["unlike"] = "{" + ", ".join(f"gold_D_{n}[{k}] ^ gate_D_{n}[{k}]" for n, k in reversed(places)) + "}"
    lines = [f"module machine({', '.join(heads)});", *body, f"wire [{len(facts.bits) - 1}:0] now = {facts.word('Q_')};"]
    lines += [f"{side} {side}({', '.join(pins)});" for side, pins in sides.items()]
    lines += [f"assign {key} = {value};" for key, value in words.items()]
    lines += [f"assign trigger = {facts.among('now', facts.reached)}{'' if alone else ' & (|unlike)'};", "endmodule"]
    return "\n".join(lines) + "\n"


def _part_from_products(module: dict) -> None:
    """Put ports of the module in the place of its multipliers: outputs for factors, and an input for the product."""
    products = [name for name, cell in module["cells"].items() if cell["type"] == "$mul"]
    for number, name in enumerate(products):
        pins = module["cells"].pop(name)["connections"]
        for pin in "ABY":
            direction = "input" if pin == "Y" else "output"
            module["ports"][f"TIMES_{number}_{pin}"] = {"direction": direction, "bits": pins[pin]}


def _stepping(module: dict, facts: Facts) -> str:
    """Return Verilog of a machine whose outputs are any state of the control and the next one."""
    ports, pins = [], []
    for name, port in module["ports"].items():
        if name != SELECTOR:
            ports.append(f"{port['direction']} [{len(port['bits']) - 1}:0] {name}")
            pins.append(f".{name}({name})")
    width = len(facts.bits) - 1
    return (
        f"module machine({', '.join(ports)}, output [{width}:0] at, output [{width}:0] next);\n"
        f"gold gold({', '.join(pins)});\n"
        f"assign at = {facts.word('Q_')};\nassign next = {facts.word('D_')};\nendmodule\n"
    )


def _pair(module: dict, facts: Facts) -> str:
    """Return Verilog of a machine that triggers where a step from what is taken to hold leads out of it.

    Its outputs are `next`, the next state; `bad`, whether an output or the control differs; `new`, with a bit for every
    register that differs in the next state and was not known to; and `off`, with one for every register that loses its
    first value in the first state.
    """
    sides: dict[str, list[str]] = {"gold": [], "gate": []}
    heads, body, held = [], [], [facts.among("now", facts.reached)]
    bad, new, off = ["1'b0"], {}, {}
    for name, port in module["ports"].items():
        width, register = len(port["bits"]), _REGISTER.match(name)
        n = int(register[1]) if register else None
        first = f"{width}'b{facts.firsts[n]}" if n in facts.untouched else None
        if port["direction"] == "output":
            for side, pins in sides.items():
                body.append(f"wire [{width - 1}:0] {side}_{name};")
                pins.append(f".{name}({side}_{name})")
            unlike = f"(({facts.of_mutant(n, f'gold_{name}', 'next')}) != gate_{name})"
            if n is not None and n not in facts.control:
                new[n] = f"{unlike} & ~{facts.among('next', facts.differ.get(n, set()))}"
            elif not _PRODUCT.match(name):
                bad.append(unlike)
            if first:
                off[n] = f"(next == {facts.first}) & (gold_{name} != {first})"
        elif name != SELECTOR:
            heads += [f"input [{width - 1}:0] {side}{name}" for side in ("", "other_")]
            given = facts.of_mutant(n, name, "now")
            body.append(f"wire [{width - 1}:0] gate_{name} = {_apart(name, n, facts)} ? other_{name} : {given};")
            sides["gold"].append(f".{name}({name})")
            sides["gate"].append(f".{name}(gate_{name})")
            if first:
                held.append(f"((now != {facts.first}) | ({name} == {first}))")
    every = range(max(new, default=0), -1, -1)
    words = {"next": facts.word("gold_D_"), "bad": " | ".join(bad)}
    words |= {
        key: "{" + ", ".join(each.get(n, "1'b0") for n in every) + "}" for key, each in (("new", new), ("off", off))
    }
    widths = {"next": len(facts.bits), "bad": 1, "new": len(every), "off": len(every)}
    heads += ["output trigger", *(f"output [{widths[key] - 1}:0] {key}" for key in words)]
    lines = [f"module machine({', '.join(heads)});", *body, f"wire [{len(facts.bits) - 1}:0] now = {facts.word('Q_')};"]
    lines += [f"{side} {side}({', '.join(pins)});" for side, pins in sides.items()]
    lines += [f"assign {key} = {value};" for key, value in words.items()]
    lines += [f"assign trigger = {' & '.join(held)} & (bad | (|new) | (|off));", "endmodule"]
    return "\n".join(lines) + "\n"


def _apart(name: str, register: int | None, facts: Facts) -> str:
    """Return Verilog that says when an input may have a value for the mutant that it has not for the component."""
    if product := _PRODUCT.match(name):
        factors = (f"{product[1]}_{pin}" for pin in "AB")
        return "(" + " | ".join(f"(gold_{factor} != gate_{factor})" for factor in factors) + ")"
    return facts.among("now", facts.differ.get(register, set()))


def _examples(work: Path, design: dict, number: int, machine: str, how: str) -> list[dict[str, int]] | None:
    """Return what the machine's outputs are in the solver's examples; None if it has no answer in its time."""
    (work / "machine.v").write_text(machine, encoding="utf-8")
    shown = " ".join(f"-show {name}" for name in SHOWN if f" {name} =" in machine)
    said = answer(work, design, [*copies(number), "read_verilog machine.v"], "machine", f"{how} {shown}")
    tables = said.split("Signal Name")[1:]
    if not tables and PROVEN not in said:
        return None
    return [{name: int(bits, 2) for name, bits in _VALUE.findall(table)} for table in tables]
