"""The means of `make coverage`: points are read, merged over sizes of a block, and held against goals and reasons."""

import re
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from hardwall.hdl.axis import axis
from signoff import cover
from signoff.covering import origin
from signoff.covering.blocks import BLOCKS, TESTS, Block
from signoff.covering.points import Point, merged
from signoff.covering.report import REASONS, Coverage, grouped
from signoff.covering.sources import code_of, sources_of
from signoff.kept import Findings
from signoff.reasons import Reason, reasons_for

VERILOG = """module part;
  always @* begin
    if (\\$start ) begin end
    if (\\$7 ) begin
      sum = 4'h3;
    end
  end
endmodule
"""
POINTS = [
    ("v_line/top.part", 5, "block"),
    ("v_branch/top.part", 4, "if"),
    ("v_branch/top.part", 4, "else"),
    ("v_branch/top.part", 3, "if"),
    ("v_branch/top", 4, "if"),
    ("v_toggle/top.part", 1, "sum[1]:0->1"),
    ("v_toggle/top.part", 1, "sum[0]:0->1"),
    ("v_toggle/top.part", 1, "__0247[0]:0->1"),
]
OF_THE_BENCH = {
    TESTS / f"{name}.py"
    for name in (
        "test_typing",
        "axis/test_board_stages",
        "axis/test_axis_bursts",
        "axes/test_supervised_faults",
        "testing/test_campaign",
        "link/test_mbpoll",
        "link/test_axi_link",
        "link/test_axi_link_in_c",
        "estimators/test_edge_kalman_map",
    )
}
"""Tests that simulate hardware of their own, need a program that may be absent, see a block in a board alone, or with
another block that has a test; or inject faults by hand into what a block's own test covers."""
REACHED = Point("toggle", "part.sum[0]:0->1")
MISSED = Point("toggle", "part.sum[1]:0->1")


def simulation(folder: Path, name: str, verilog: str, *counts: int) -> Path:
    """Write what a simulation leaves, with the counts of `POINTS`."""
    (folder / f"{name}.v").write_text(verilog, encoding="ascii")
    lines = ["# SystemC::Coverage-3"]
    for (page, line, what), count in zip(POINTS, counts, strict=True):
        fields = {"f": folder / f"{name}.v", "l": line, "page": page, "o": what}
        lines.append("C '" + "".join(f"\1{key}\2{value}" for key, value in fields.items()) + f"' {count}")
    file = folder / f"{name}.dat"
    file.write_text("\n".join(lines), encoding="ascii")
    return file


def test_points_of_two_sizes_are_one_where_the_text_differs_in_numbers(tmp_path):
    files = [
        simulation(tmp_path, "small", VERILOG, 1, 1, 0, 0, 0, 0, 1, 0),
        simulation(tmp_path, "large", VERILOG.replace("$7", "$11").replace("4'h3", "9'h1fe"), 1, 0, 2, 0, 0, 0, 1, 0),
    ]
    counts = {point.title: count for point, count in merged(files, ("part",)).items()}
    assert counts == {
        "line part block: sum = 0;": 2,
        r"branch part if: if (\$0 ) begin": 1,
        r"branch part else: if (\$0 ) begin": 2,
        "toggle part.sum[1]:0->1": 0,
        "toggle part.sum[0]:0->1": 2,
    }


def test_a_branch_of_another_text_is_another_branch(tmp_path):
    files = [
        simulation(tmp_path, "one", VERILOG, 1, 1, 0, 0, 0, 0, 1, 0),
        simulation(tmp_path, "other", VERILOG.replace("sum =", "sum <="), 1, 0, 2, 0, 0, 0, 1, 0),
    ]
    assert sorted(count for point, count in merged(files, ("part",)).items() if point.kind == "branch") == [0, 0, 1, 2]


def test_a_file_without_the_module_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"has no point of other$"):
        merged([simulation(tmp_path, "one", VERILOG, *[1] * len(POINTS))], ("other",))


def test_a_point_that_is_missed_needs_a_reason():
    counts = merged([], ()) | {REACHED: 1, MISSED: 0}
    without = Coverage.of("part", counts, [])
    assert not without.ok
    assert without.row == ["part", "100.00", "100.00", "50.00", "0", "1", "FAILED"]
    assert without.explanation == "part: missed: toggle part.sum[1]:0->1\n"
    explained = Coverage.of("part", counts, [Reason("part", "toggle part.sum[1]*", "It is constant.")])
    assert explained.ok
    assert explained.row == ["part", "100.00", "100.00", "50.00", "1", "0", "covered"]


def test_a_reason_for_what_is_reached_is_a_failure():
    counts = merged([], ()) | {REACHED: 1}
    stale = Coverage.of("part", counts, [Reason("part", "toggle part.sum[0]*", "It is constant.")])
    assert not stale.ok
    assert stale.explanation == "part: reached, so that its reason must go: toggle part.sum[0]*\n"


def test_bits_that_miss_the_same_are_listed_together():
    points = [Point("toggle", f"part.{bit}") for bit in ("a[3]:0->1", "a[1]:0->1", "a[3]:1->0", "b:0->1")]
    line = Point("line", "part block: sum[3] = 0;", ("x", 3))
    expected = ["toggle part.a[1 3]:0->1", "toggle part.a[3]:1->0", "toggle part.b:0->1", f"line {line.name}"]
    assert grouped([*points, line]) == expected


def test_every_block_has_its_test_and_every_reason_its_block():
    tests = {file for file in TESTS.rglob("test_*.py") if re.search(r"^    simulate\(__file__", file.read_text(), re.M)}
    assert {block.test for block in BLOCKS} == tests - OF_THE_BENCH
    hdl = Path(axis.__file__).parents[1]
    assert [block.name for block in BLOCKS if not (hdl / f"{block.name}.py").exists()] == []
    written = sum(len(reasons_for(block.name, REASONS)) for block in BLOCKS)
    text = REASONS.read_text(encoding="utf-8")
    assert written == text.count("[[reason]]")


def test_no_block_is_tested_with_the_simulation():
    """So what is found of the hardware outlives a change of the simulation: tests with both have files of their own."""
    sources = {block.name: set(sources_of(block.test)) for block in BLOCKS}
    assert {name: every for name, every in sources.items() if any(path.parts[0] == "sim" for path in every)} == {}


def test_what_is_covered_is_kept_and_failed_tests_are_run_again(monkeypatch, tmp_path):
    whole, short = ({REACHED: 2, MISSED: count} for count in (1, 0))
    asked, given = [], [[short, None], [None], [whole, None], [short, short]]

    def counted(block, folder):
        asked.append(folder.name)
        yield from (counts and Counter(counts) for counts in given.pop(0))

    monkeypatch.setattr(cover, "_counted", counted)
    block, findings = Block("link/part"), Findings(tmp_path / "coverage")
    # A whole campaign that fails, after a short one that falls short, leaves nothing.
    assert [cover.measure(block, "a", findings) for _ in range(2)] == [None] * 2
    # A short one that is enough is all.
    first, again = cover.measure(block, "a", findings), cover.measure(block, "a", findings)
    assert first == again
    assert (first.points, first.missed) == ({"toggle": 2}, [])
    assert asked == ["link-part"] * 3
    other = [cover.measure(block, "b", findings) for _ in range(2)]
    assert other[0] == other[1]
    assert other[0].missed == [MISSED]
    assert len(asked) == 4


@pytest.mark.parametrize(("failing", "yielded"), [((), 2), ((20,), 1), ((50,), 2), ((20, 50), 1)])
def test_campaigns_are_short_and_then_whole(failing, yielded, monkeypatch, tmp_path):
    asked = []

    def run(command, env, **_):
        samples = int(env["HARDWALL_SAMPLES"])
        asked.append((samples, env["HARDWALL_EVERY_SIZE"]))
        return subprocess.CompletedProcess(command, int(samples in failing), "", "")

    monkeypatch.setattr(cover, "SHORT", 20)
    monkeypatch.setattr(cover, "SAMPLES", 50)
    monkeypatch.setattr(cover.subprocess, "run", run)
    monkeypatch.setattr(cover, "merged", lambda files, modules: Counter({REACHED: 1}))
    came = list(cover._counted(Block("part"), tmp_path))
    assert asked == [(20, "1"), (50, "1")]
    assert len(came) == yielded
    assert [counts is None for counts in came] == [False] * (yielded - 1) + [50 in failing]


def test_the_digest_of_a_block_is_of_its_verilog_and_its_tests(monkeypatch):
    block = Block("arithmetic/sqrt")
    digest = cover.origin_digest(block)
    assert digest == cover.origin_digest(block) != cover.origin_digest(Block("arithmetic/sqrt", ("component.part",)))
    monkeypatch.setattr(origin, "to_verilog", lambda component, name: "module block; endmodule")
    assert digest != cover.origin_digest(block)


def test_what_says_nothing_to_the_interpreter_is_no_part_of_the_origin():
    code = b"class A:\n    b = 1\n    def c(self):\n        return 'd'\n"
    told = b'"""All."""\n\nclass A:\n    """An A."""\n    b = (\n        1)  # One.\n    def c(self): return "d"\n'
    assert code_of(told) == code_of(code)
    assert code_of(code.replace(b"'d'", b"'e'")) != code_of(code)
    assert code_of(b'def a():\n    """Nothing."""\n') == code_of(b"def a():\n    pass\n")
