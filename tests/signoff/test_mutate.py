"""The mutants of a small component, and the means: `make mutate` draws mutants of every block."""

import subprocess
from dataclasses import replace
from pathlib import Path

import cocotb
import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out
from cocotb.triggers import RisingEdge

from hardwall.sim.rtl.tools import SynthesisError
from hardwall.testing import SEED, Bench
from signoff import mutate
from signoff.covering.blocks import BLOCKS, TESTS, Block
from signoff.covering.sizes import Size, sizes_of
from signoff.kept import Findings
from signoff.mutation import by_state, equivalent, run, solver
from signoff.mutation.equivalent import EQUIVALENT, known_of
from signoff.mutation.netlist import BLOCK, Mutant, Netlist, mutated
from signoff.mutation.outcomes import REASONS, Fate, Result
from signoff.mutation.run import fates_of, modules_of
from signoff.reasons import Reason, reasons_for
from stimuli.lengths import LONG, some_of

CLOCKS = 3
"""From a start to its answer."""
MANY = 20
HERE = Path(__file__)


class Answer(wiring.Component):
    """Answers a start; of the time that is left, no test looks at more than the answer."""

    start: In(1)
    done: Out(1)
    half: Out(1)

    def elaborate(self, platform):
        m = Module()
        left = Signal(2)
        with m.If(self.start):
            m.d.sync += left.eq(CLOCKS)
        with m.Elif(left != 0):
            m.d.sync += left.eq(left - 1)
        m.d.comb += [self.done.eq(left == 1), self.half.eq(left == 2)]
        return m


class Around(wiring.Component):
    """Has an `Answer` inside, and shows the half of it with the whole alone, when there is none."""

    start: In(1)
    done: Out(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.answer = answer = Answer()
        m.d.comb += [answer.start.eq(self.start), self.done.eq(answer.done | answer.done & answer.half)]
        return m


class Stored(wiring.Component):
    """Reads a word of a memory, which is shown from power-up on, but not after a clock without a read."""

    address: In(2)
    read: In(1)
    word: Out(2)

    def elaborate(self, platform):
        m = Module()
        m.submodules.memory = memory = Memory(shape=2, depth=4, init=[1, 2, 3, 0])
        port, quiet = memory.read_port(), Signal(reset_less=True)
        m.d.sync += quiet.eq(~self.read)
        m.d.comb += [port.addr.eq(self.address), port.en.eq(self.read), self.word.eq(port.data & ~quiet.replicate(2))]
        return m


@cocotb.test()
async def answers(dut):
    bench = Bench(dut, Answer())
    await bench.reset()
    begun = bench.clock_number()
    bench.drive(start=1)
    await RisingEdge(dut.clk)
    bench.drive(start=0)
    # Nothing ends this but the answer.
    await RisingEdge(dut.done)
    assert bench.clock_number() - begun == CLOCKS


def test_mutants_are_killed_even_if_they_hang_or_proven_equivalent_or_left():
    many, tried = (MANY, 4) if LONG else (14, 2)
    fates = fates_of(Size(HERE, Answer, {}), (BLOCK,), many)
    by_hanging = [fate for fate in fates if fate.killed_by and "CancelledError" in fate.killed_by]
    at_once = [fate for fate in fates if fate.killed_by and "AssertionError" in fate.killed_by]
    left = [fate for fate in fates if fate.left]
    assert [fate.mutant for fate in by_hanging if "done" in fate.mutant]
    assert at_once
    assert [fate.mutant for fate in left if "half" in fate.mutant]
    assert all(fate.known.startswith("differs after ") for fate in left)
    assert [fate for fate in fates if fate.equivalent]
    # What a test kills is not proven equivalent either.
    killed = [number for number, fate in enumerate(fates, 1) if fate.killed_by]
    known = known_of(mutated(Answer(), (BLOCK,), many, SEED), killed[:tried])
    assert all(said.startswith("differs after ") for said in known.values())


def test_a_module_may_give_anything_where_the_module_around_it_takes_nothing():
    netlist = mutated(Around(), (f"{BLOCK}.answer",), MANY, SEED)
    taken, untaken = (
        next(mutant.number for mutant in netlist.mutants if "const0" in mutant.change and name in mutant.change)
        for name in ("done", "half")
    )
    known = known_of(netlist, [taken, untaken])
    assert known[taken].startswith("differs after ")
    assert known[untaken] == EQUIVALENT


def test_a_register_without_a_first_value_powers_up_alike_in_both():
    """What it holds without a read is never shown; what it reads is shown a clock later."""
    netlist = mutated(Stored(), (BLOCK,), MANY, SEED)
    held, read = ([mutant.number for mutant in netlist.mutants if f"procmux.{port}[" in mutant.change] for port in "AB")
    known = known_of(netlist, held[:1] + read[:1])
    assert list(known.values()) == [EQUIVALENT, "differs after 1 clocks"]


SUM = """
module block(input clk, input start, input [1:0] word, input [15:0] mutant, output reg [1:0] total);
  reg fsm_state = 0, running = 0;
  reg [1:0] held = 0;
  reg [5:0] left = 0;
  initial total = 0;
  always @(posedge clk)
    if (!fsm_state) begin
      if (mutant == 1) held <= ~held;
      if (start) begin
        fsm_state <= 1;
        running <= 1;
        held <= word;
        if (running ? mutant == 4 : mutant != 2) total <= 0;
      end
    end else begin
      left <= left + 1;
      if (mutant == 3) held <= ~held;
      if (&left) begin
        total <= total + held * held;
        fsm_state <= 0;
      end
    end
endmodule
"""
"""Adds squares of words, each long after its start. What holds the word matters in that time; the first clear never."""


@pytest.mark.parametrize(("number", "equal"), some_of([(1, True), (2, True), (3, False), (4, False)], 1, 2))
def test_what_differs_where_no_state_reads_it_is_equivalent(number, equal):
    known = known_of(Netlist(Answer(), SUM, (BLOCK,), [Mutant(number, "planted")]), [number])
    assert (known[number] == EQUIVALENT) == equal


TURNS = """
module block(input clk, input start, input [15:0] word, input [15:0] mutant, output reg [15:0] shown);
  parameter READ = 5, SKIPS = 0;
  reg [2:0] fsm_state = 0;
  reg [15:0] held = 0;
  initial shown = 0;
  always @(posedge clk) begin
    held <= (fsm_state == 1 ? word : held) ^ mutant[0];
    if (fsm_state == READ) shown <= held * held;
    fsm_state <= fsm_state ? fsm_state + (SKIPS & fsm_state == 3 & start ? 2 : 1) : start;
  end
endmodule
"""
"""Shows the square of a word some clocks after its start. The mutant inverts a bit of what holds it at every clock: it
differs if that is read an odd number of clocks after it is written, or perhaps one less, or before it is written."""


@pytest.mark.parametrize(
    ("read", "skips", "equal"),
    some_of([(3, 0, True), (7, 0, True), (7, 1, False), (2, 0, False), (6, 0, False), (1, 0, False)], 1, 2, 5),
)
def test_what_is_inverted_where_no_state_reads_it_is_equal_by_states(read, skips, equal, tmp_path):
    verilog = TURNS.replace("READ = 5, SKIPS = 0", f"READ = {read}, SKIPS = {skips}")
    (tmp_path / "mutated.v").write_text(verilog, encoding="utf-8")
    flat = equivalent._flat(tmp_path, f"hierarchy -top {BLOCK}; proc")
    assert by_state.equal_by_state(tmp_path, flat, 1) == equal


LEVEL = """
module block(input clk, input go, input [15:0] mutant, output at);
  reg [7:0] level = 2;
  reg [5:0] clocks = 0;
  always @(posedge clk) begin
    if (go) level <= level == 8 ? 2 : level + 3;
    if (!(&clocks)) clocks <= clocks + 1;
  end
  assign at = mutant == 1 ? level == 131 : mutant == 2 ? level == 8 & &clocks : 0;
endmodule
"""
"""Goes through three levels, and may rest at any. From 11 it would come to 131, behind the end of the induction."""


@pytest.mark.parametrize(("number", "known"), [(1, EQUIVALENT), (2, "undecided")])
def test_what_differs_in_no_state_that_is_reached_is_equivalent(number, known):
    """A difference behind more clocks than the induction has is none that is proven absent."""
    assert known_of(Netlist(Answer(), LEVEL, (BLOCK,), [Mutant(number, "planted")]), [number]) == {number: known}


KEPT = """
module block(input clk, input [1:0] at, input [1:0] word, input [15:0] mutant, output shown);
  reg [1:0] kept [3:0];
  reg [1:0] taken = 0;
  always @(posedge clk) begin
    kept[at] <= word ^ mutant[1:0];
    taken <= kept[at] & {mutant[2], 1'b1};
  end
  assign shown = |taken;
endmodule
"""
"""Keeps words of two bits and shows the lower one; it has mutants that keep others, and one that shows both."""


@pytest.mark.parametrize(("number", "equal"), [(2, True), (1, False), (4, False)])
def test_a_bit_of_a_memory_that_nothing_reads_may_be_any(number, equal):
    verilog = KEPT if number == 4 else KEPT.replace("mutant[2]", "1'b0")
    known = known_of(Netlist(Answer(), verilog, (BLOCK,), [Mutant(number, "planted")]), [number])
    assert (known[number] == EQUIVALENT) == equal


def test_tests_that_fail_without_a_mutant_say_nothing(monkeypatch):
    """A first campaign may be too short for the tests themselves; the whole one may not."""
    asked, whole = [], "too few samples"

    def answered(size, netlist, numbers, samples=None):
        asked.append(samples)
        return {0: whole if samples is None else "too few samples", **dict.fromkeys(numbers, "a test")}

    monkeypatch.setattr(run, "killed", answered)
    monkeypatch.setattr(run, "known_of", lambda netlist, numbers: dict.fromkeys(numbers, "undecided"))
    with pytest.raises(RuntimeError, match=r"^the tests of test_mutate\.py fail without a mutant: too few samples$"):
        fates_of(Size(HERE, Answer, {}), (BLOCK,), 4)
    whole = None
    assert [fate.killed_by for fate in fates_of(Size(HERE, Answer, {}), (BLOCK,), 4)] == ["a test"] * 4
    assert asked == [run.SAMPLES, None] * 2


def test_what_came_of_a_block_is_kept_until_something_changes_that_it_came_from(monkeypatch, tmp_path):
    sizes, asked = [Size(HERE, Answer, {})], []
    came = [replace(fate, mutant=f": {fate.mutant}") for fate in (LEFT, EQUAL)]
    block, findings = Block("part", tested_with="arithmetic/sqrt"), Findings(tmp_path / "mutate")

    def fates(size, modules, count, before):
        asked.append((count, *before))
        return came[:count]

    monkeypatch.setattr(run, "sizes_of", lambda test: sizes)
    monkeypatch.setattr(run, "fates_of", fates)
    results = [run.run([block], count, True, lambda result: None, findings)[0] for count in (2, 2, 1, 2, 2)]
    assert [result.fates for result in results] == [came, came, came[:1], came, came]
    assert asked == [(2,), (1,), (2,)]
    sizes[0] = Size(HERE, Around, {})
    run.run([block], 2, True, lambda result: None, findings)
    monkeypatch.setattr(Block, "test", HERE)
    run.run([block], 2, True, lambda result: None, findings)
    assert asked[3:] == [(2,), (2,)]
    # With other proofs, what had survived is asked about again.
    monkeypatch.setattr(run, "PROVING", run.PROVING[:1])
    monkeypatch.setattr(run, "_digest", lambda block, sizes, count: kept["part"]["digest"])
    kept = findings.every()
    run.run([block], 2, True, lambda result: None, findings)
    assert asked[5:] == [(2, *came)]


def test_only_what_has_survived_is_asked_about_again(monkeypatch):
    size, asked = Size(HERE, Answer, {}), []

    def known_of(netlist, numbers):
        asked.append(numbers)
        return dict.fromkeys(numbers, "undecided")

    monkeypatch.setattr(run, "known_of", known_of)
    monkeypatch.setattr(run, "killed", lambda *given: pytest.fail("it was tested again"))
    before = [Fate("a", "a test"), Fate("b", None, EQUIVALENT), Fate("c", "a test"), Fate("d", None, "undecided")]
    fates = fates_of(size, (BLOCK,), 4, before)
    assert [fate.killed_by for fate in fates] == ["a test", None] * 2
    assert [fate.known for fate in fates] == ["", "undecided"] * 2
    assert asked == [[2, 4]]


def test_the_seed_draws_the_mutants_and_the_selector_counts_them():
    first, again, other = (mutated(Answer(), (BLOCK,), 8, seed) for seed in (1, 1, 2))
    assert first.mutants == again.mutants != other.mutants
    assert [mutant.number for mutant in first.mutants] == [*range(1, 9)]
    assert len({mutant.change for mutant in first.mutants}) == 8


def test_the_sizes_of_a_block_are_those_that_its_tests_simulate():
    sizes = sizes_of(TESTS / "arithmetic/test_sqrt.py")
    assert [size.parameters for size in sizes] == [{"width": width} for width in some_of([1, 2, 3, 16, 35], 4)]
    assert sizes[-1].name == "width 35"
    assert sizes[-1].component().width == 35


def test_a_block_is_mutated_in_its_own_modules():
    modules = {block.name: modules_of(block) for block in BLOCKS}
    assert modules["axis/wall"] == (f"{BLOCK}.law",)
    assert modules["link/uart"] == (f"{BLOCK}.receiver", f"{BLOCK}.transmitter")


@pytest.mark.parametrize(("printed", "code"), [("wasm trap: call stack exhausted", 1), ("", -9)])
def test_a_question_that_is_too_large_for_the_solver_has_no_answer(printed, code, monkeypatch, tmp_path):
    done = subprocess.CompletedProcess([], code, stdout=printed)
    monkeypatch.setattr(solver, "_run", lambda *given: done)
    assert solver.answer(tmp_path, {}, [], "miter", "-prove trigger 0") == ""


def test_a_question_that_is_wrong_ends_the_run(monkeypatch, tmp_path):
    done = subprocess.CompletedProcess([], 1, stdout="read\nERROR: No such command: sut\n")
    monkeypatch.setattr(solver, "_run", lambda *given: done)
    with pytest.raises(SynthesisError, match=r"^Yosys cannot compare a mutant: No such command: sut$"):
        solver.answer(tmp_path, {}, [], "miter", "-prove trigger 0")


KILLED = [Fate(f"killed {number}", "a test") for number in range(19)]
EQUAL = Fate("equal", None, EQUIVALENT)
LEFT = Fate("a mutant", None, "differs after 3 clocks")
REASON = Reason("part", "a mut*", "Nothing reads it.")


@pytest.mark.parametrize(
    ("result", "ok", "said"),
    [
        (Result("part", [*KILLED, EQUAL], []), True, ""),
        (Result("part", [*KILLED, LEFT], []), False, "part: left, differs after 3 clocks: a mutant\n"),
        (Result("part", [*KILLED, EQUAL, LEFT], [REASON]), True, ""),
        (Result("part", [*KILLED, LEFT, LEFT], [REASON]), False, ""),
        (Result("part", KILLED, [REASON]), False, "part: killed or not drawn, so that its reason must go: a mut*\n"),
        (Result("part", KILLED, [REASON], ours=False), True, ""),
        (Result("part", [], []), False, ""),
    ],
    ids=["killed", "left", "with a reason", "too many left", "stale", "of others", "none"],
)
def test_nineteen_of_twenty_must_be_killed_and_what_is_left_needs_a_reason(result, ok, said):
    assert (result.ok, result.explanation) == (ok, said)


def test_every_reason_is_of_a_block():
    written = sum(len(reasons_for(block.name, REASONS)) for block in BLOCKS)
    assert written == REASONS.read_text(encoding="utf-8").count("[[reason]]")


@pytest.mark.parametrize(
    ("fates", "last"),
    [
        ([*KILLED, EQUAL], "mutate: 20 mutants, 19 killed, 1 equivalent, 0 left"),
        ([*KILLED, LEFT], "mutate: 20 mutants, 19 killed, 0 equivalent, 1 left"),
        ([], "mutate: 0 mutants, 0 killed, 0 equivalent, 0 left"),
    ],
    ids=["good", "left", "none"],
)
def test_the_command_ends_in_a_line_for_a_script(fates, last, monkeypatch, capsys):
    given = []

    def came(blocks, *_):
        given.extend(block.name for block in blocks)
        return [Result("axis/wall", fates, [])]

    monkeypatch.setattr(mutate, "run", came)
    code = mutate.main("axis/wal")
    assert given == ["axis/wall"]
    assert capsys.readouterr().out.splitlines()[-1] == last
    assert code == int(EQUAL not in fates)
