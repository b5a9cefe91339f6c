"""The quick ones of the netlists beside their RTL, and the means: `make gate` simulates every netlist."""

import ctypes
import re
from dataclasses import replace

import pytest

from hardwall.sim.boards.parts import PARTS
from hardwall.sim.rtl import netlist, shared_library
from hardwall.sim.rtl.families import FAMILIES
from hardwall.sim.rtl.netlist import GATES, Netlist, mapped
from signoff import gate
from signoff.gates import run
from signoff.gates.run import Case, Outcome, compared
from signoff.gates.tops import SMALL, TOPS
from signoff.kept import Findings
from stimuli.lengths import LONG, long_form

ECP5 = FAMILIES["ecp5"]
CELLS, AXIS, SMALLEST = (Case(ECP5, top) for top in (TOPS[0], TOPS[1], SMALL))
FIRST = """\
#include "Vgates__ALL.cpp"
extern "C" uint32_t found(uint32_t a, uint32_t b) {
    VerilatedContext context;
    Vgates top{&context};
    top.a = a;
    top.b = b;
    top.write = 1;
    top.eval();
    top.clk = 1;
    top.eval();
    return top.found;
}
"""
"""What the netlist of `SMALL` finds of inputs that it has before anything is evaluated."""


def netlist_of(case: Case) -> Netlist:
    return mapped(case.top.component(), case.family)


@long_form
def test_products_and_memories_are_those_of_their_cells():
    """The models of cells that are ours have the product and the memory of plain Verilog."""
    outcome = compared(CELLS, netlist_of(CELLS), 2_000)
    assert (outcome.cells["dsp"], outcome.cells["bram"]) == (4, 20)
    assert outcome.ok, outcome.explanation


@long_form
def test_the_netlist_of_an_axis_is_equal_to_it():
    """The short form has an equal netlist of a few registers alone, beside a wrong one."""
    made = netlist_of(AXIS)
    outcome = compared(AXIS, made, 2_000)
    assert outcome.cells["dsp"] == 2
    assert outcome.clocks >= 2_000 * made.component.spec.clocks_per_sample
    assert outcome.different == 0, outcome.explanation
    # So few samples need not have one with a velocity beyond its range, nor a count at its end or a homing.
    assert set(outcome.still) <= {"saturated", "wrapped", "referenced"}


def inverted(found: re.Match) -> str:
    return f".INIT(16'h{0xFFFF ^ int(found[1], 16):04x})"


def test_a_wrong_table_of_a_cell_is_found():
    right = netlist_of(SMALLEST)
    wrong = replace(right, gates=re.sub(r"\.INIT\(16'h(\w+)\)", inverted, right.gates, count=1))
    assert wrong.gates != right.gates
    assert compared(SMALLEST, right, 1_000).ok
    outcome = compared(SMALLEST, wrong, 1_000)
    assert outcome.different > 0
    assert not outcome.ok
    (line, *values) = outcome.explanation.splitlines()
    assert line == f"ECP5 small: differs at {outcome.different} clocks, first at clock {outcome.first}"
    assert values


@long_form
def test_registers_without_a_value_at_power_up_are_found():
    right = netlist_of(CELLS)
    blank = replace(right, models=right.models.replace("initial Q = srval;", ""))
    assert blank.models != right.models
    outcome = compared(CELLS, blank, 1_000)
    # Nothing is reset for a while, and the first clock edge finds what power-up left.
    assert outcome.different > 0
    assert outcome.first == 0


@pytest.mark.parametrize("family", FAMILIES if LONG else [ECP5.name.lower()])
def test_the_first_evaluation_leaves_the_inputs_as_they_are(family):
    """In the gate there is none that has inputs; on a virtual board the first one has the reset."""
    made = netlist_of(Case(FAMILIES[family], SMALL))
    files = {"gates.v": f"{made.gates}\n{made.models}", "first.cpp": FIRST}
    options = ("--top-module", GATES, *netlist.OPTIONS)
    recipe = shared_library.Recipe(files, "first.cpp", "Vgates", options, shared_library.FAST_TO_BUILD)
    library = ctypes.CDLL(str(shared_library.build(recipe)))
    assert library.found(0x3_5A5A, 0x0_FF00) == 0x3_5A5A ^ 0x0_FF00


def test_netlists_are_mapped_as_the_parts_are():
    assert {family.synth for family in FAMILIES.values()} >= {part.synth for part in PARTS.values()}
    assert FAMILIES["ice40"].count(["SB_LUT4", "SB_DFFESR", "SB_DFF", "SB_MAC16"]) == {
        "lut4": 1, "dsp": 1, "bram": 0, "ff": 2
    }  # fmt: skip


OUTCOME = Outcome.equal(SMALLEST, dict.fromkeys(gate.CELLS, 5), 10, 20)


@pytest.mark.parametrize(
    ("outcome", "said"),
    [
        (OUTCOME, "gate: 1 netlists, 1 equal"),
        (replace(OUTCOME, clocks=9), "gate: 1 netlists, 0 equal"),
        (replace(OUTCOME, different=1, unlike={"a": (1, 2)}), "gate: 1 netlists, 0 equal"),
        (replace(OUTCOME, still=("a",)), "gate: 1 netlists, 0 equal"),
    ],
    ids=["equal", "too short", "different", "still"],
)
def test_the_command_ends_in_a_line_for_a_script(outcome, said, monkeypatch, capsys):
    monkeypatch.setattr(gate, "CASES", [SMALLEST])
    monkeypatch.setattr(run, "mapped", lambda component, family: None)
    monkeypatch.setattr(run, "compared", lambda case, netlist, samples: outcome)
    monkeypatch.setattr(gate, "findings_of", lambda task: Findings())
    code = gate.main("ECP5")
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == said
    assert f"{outcome.line}\n" == err
    assert code == int(not outcome.ok)
    assert ("RTL 1, netlist 2" in out) == bool(outcome.unlike)


def test_no_netlist_is_no_success(monkeypatch, capsys):
    assert gate.main("no such family") == 1
    assert capsys.readouterr().out.splitlines()[-1] == "gate: 0 netlists, 0 equal"


def test_what_was_equal_is_kept_until_something_changes_that_it_came_from(monkeypatch, tmp_path):
    findings, asked = Findings(tmp_path / "gate"), []

    def compare(case, netlist, samples):
        asked.append(samples)
        return replace(OUTCOME, different=int(samples == 11))

    monkeypatch.setattr(run, "mapped", lambda component, family: None)
    monkeypatch.setattr(run, "compared", compare)
    first, again = (run.run([SMALLEST], 10, lambda _: None, findings) for _ in range(2))
    assert first == again == [OUTCOME]
    assert asked == [10]
    # What differs is compared again.
    assert [run.run([SMALLEST], 11, lambda _: None, findings)[0].ok for _ in range(2)] == [False] * 2
    assert asked == [10, 11, 11]
    digests = {run.origin_digest(case, 10) for case in (CELLS, SMALLEST, Case(FAMILIES["ice40"], SMALL))}
    assert len(digests) == 3
