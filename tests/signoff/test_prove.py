"""The quick ones of the proofs, each with one of its bugs, and the means: `make prove` proves everything with all."""

import inspect
from dataclasses import replace
from itertools import product

import pytest
from amaranth.hdl import Module, Shape
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

import signoff.proofs.run as proving
from hardwall.hdl.axis.output import Output
from signoff import prove
from signoff.kept import Findings
from signoff.proofs import properties
from signoff.proofs.bench import Bench
from signoff.proofs.bugs import Bug
from signoff.proofs.property import Property
from signoff.proofs.run import run
from signoff.proofs.solver import Verdict
from signoff.proofs.widths import Widths, extremes, range_of_product
from stimuli.lengths import LONG

QUICK = [known for known in properties.PROPERTIES if known.quick]
CHOSEN = "sqrt", "output", "supervisor", "drive", "axis"
"""Arithmetic, a stage of the force, a machine of states, pins, and a whole axis: an induction of 2 to 5 clocks."""
FIRST = {known.block.split()[0]: known for known in reversed(QUICK)}
PROVEN = QUICK if LONG else [FIRST[kind] for kind in CHOSEN]
"""The quick ones, of which the short form proves the first of each block that is chosen."""


class Sum(wiring.Component):
    """A sum that fits its register, and a difference that does not."""

    a: In(4)
    b: In(4)
    sum: Out(5)
    difference: Out(4)

    def elaborate(self, platform):
        m = Module()
        m.d.sync += [self.sum.eq(self.a + self.b), self.difference.eq(self.a - self.b)]
        return m


def sums(*wraps: str) -> Property:
    """Return the property that nothing wraps but these, with a bug by which the sum does."""
    larger = Bug(Sum.elaborate, "self.a + self.b", "self.a + self.b + 2")
    name = " ".join(["sum", *wraps])
    return Property("nothing wraps", name, lambda bench: bench.block(Sum(), Widths(wraps)), 2, (larger,), within=4)


def test_every_property_has_a_bug_and_a_name_of_its_own():
    assert [known.name for known in properties.PROPERTIES if not known.bugs] == []
    assert len({known.name for known in properties.PROPERTIES}) == len(properties.PROPERTIES)


@pytest.mark.parametrize("known", PROVEN, ids=[known.name for known in PROVEN])
def test_is_proven_and_a_bug_is_found(known):
    (outcome,) = run([replace(known, bugs=known.bugs[:1])], lambda _: None, Findings())
    assert outcome.verdict.proved, outcome.explanation
    assert [verdict.refuted for verdict in outcome.bugs] == [True]


@pytest.mark.parametrize("known", PROVEN, ids=[known.name for known in PROVEN])
def test_every_bug_changes_the_hardware(known):
    right = known.rtlil()
    assert [bug for bug in known.bugs if known.rtlil(bug) == right] == []


@pytest.mark.parametrize("known", properties.PROPERTIES, ids=[known.name for known in properties.PROPERTIES])
def test_every_bug_has_its_place_in_the_source(known):
    for bug in known.bugs:
        with bug.seeded():
            pass


def test_a_bug_must_be_of_a_part_that_the_source_has_once():
    code = Output.elaborate.__code__
    with pytest.raises(ValueError, match=r"^Output\.elaborate must have 'self\.drive' once, not \d+$"):
        Bug(Output.elaborate, "self.drive", "0").seeded().__enter__()
    with Bug(Output.elaborate, "turn & self.enable", "turn & 1").seeded():
        assert Output.elaborate.__code__ is not code
    assert Output.elaborate.__code__ is code
    assert "turn & self.enable" in inspect.getsource(Output.elaborate)


def test_a_value_that_loses_a_bit_is_found_unless_it_is_meant_to_wrap():
    widths = Widths(("difference",))
    Bench(lambda bench: bench.block(Sum(), widths)).elaborate(None)
    assert widths.places == []
    every = Widths()
    Bench(lambda bench: bench.block(Sum(), every)).elaborate(None)
    assert [name for name, _ in every.places] == ["difference"]


@pytest.mark.parametrize("signs", [(False, False), (False, True), (True, False), (True, True)])
def test_the_range_of_a_product_is_that_of_all_products(signs):
    for widths in product(range(1, 5), repeat=2):
        shapes = [Shape(width, signed) for width, signed in zip(widths, signs, strict=True)]
        (a, b), (c, d) = map(extremes, shapes)
        products = {x * y for x in range(a, b + 1) for y in range(c, d + 1)}
        assert range_of_product(*shapes) == (min(products), max(products))


def test_what_is_proven_is_kept_until_it_changes(monkeypatch, tmp_path):
    findings = Findings(tmp_path / "prove")
    known, asked = sums("difference"), []

    def solve(name, text, depth, bounded):
        asked.append(name)
        return Verdict(not bounded, bounded, 3 if bounded else None, None, (), 1.5)

    monkeypatch.setattr(proving, "solve", solve)
    first, again = (run([known], lambda _: None, findings) for _ in range(2))
    assert first == again
    assert asked == [known.name, f"{known.name}-bug-0"]
    for other in (replace(known, depth=3), replace(known, within=5), sums("sum", "difference")):
        asked.clear()
        assert run([other], lambda _: None, findings)[0].ok
        assert len(asked) == 2
    # What falls short is tried again.
    monkeypatch.setattr(proving, "solve", lambda *given: replace(solve(*given), proved=False))
    asked.clear()
    for _ in range(2):
        assert not run([replace(known, depth=4)], lambda _: None, findings)[0].ok
    assert len(asked) == 4


def test_where_the_source_stands_is_no_part_of_what_is_proven():
    here, there = (f'  attribute \\src "{place}:7"\n  cell $and $1\n' for place in ("a.py", "b/a.py"))
    assert proving._unplaced(here) == proving._unplaced(there) == "  cell $and $1\n"


@pytest.mark.parametrize(
    ("known", "result", "last"),
    [
        (sums("difference"), "proved", "prove: 1 properties, 1 proved"),
        (sums(), "refuted", "prove: 1 properties, 0 proved"),
        (sums("difference", "sum"), "proved, but a bug is not found", "prove: 1 properties, 0 proved"),
    ],
    ids=["proved", "refuted", "missed"],
)
def test_the_command_ends_in_a_line_for_a_script(known, result, last, monkeypatch, capsys):
    monkeypatch.setattr(prove, "PROPERTIES", [known])
    monkeypatch.setattr(prove, "findings_of", lambda task: Findings())
    code = prove.main("")
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == last
    assert f"nothing wraps: {result} (" in err
    assert code == int(result != "proved")
    # A counterexample is told by clock.
    assert ("\nclock " in out) == (result == "refuted")
