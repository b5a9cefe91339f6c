"""The program computes what was recorded, and both the digests and their comparison detect a change.

`HARDWALL_DIGESTS=all` (in `make soak`) checks every case; by default only the quick ones are checked. See `digests`.
"""

import os
import re
from pathlib import Path

import pytest

from support import digest_driver, digests, netlists

CASES = {case.name: case for case in digests.cases()}
EVERY = os.environ.get("HARDWALL_DIGESTS") == "all"
RECORDED = digest_driver.load()
EXACT = RECORDED["machine"] == digest_driver.machine()
INNER = """
module inner(input [3:0] a, input [3:0] b, output [3:0] y);
  assign y = a - b;
endmodule
"""
TOP = """
module top(input clk, input [3:0] p, input [3:0] q, input [1:0] place, output reg [3:0] sum, output reg [3:0] kept);
  wire [3:0] less;
  reg [3:0] looked;
  initial sum = 4'd3;
  inner part(.a(p), .b(q), .y(less));
  always @* begin
    case (place)
      2'd0: looked = 4'd9;
      2'd1: looked = 4'd4;
      2'd2: looked = 4'd13;
      default: looked = 4'd7;
    endcase
  end
  always @(posedge clk) sum <= less + 4'd5;
  always @(posedge clk) kept <= looked;
endmodule
"""
VERILOG = INNER + TOP


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if EVERY or case.short])
def test_it_computes_what_was_recorded(name):
    recorded = {entry: value for entry, value in RECORDED["entries"].items() if digest_driver.belongs(entry, name)}
    assert recorded, f"nothing was recorded: make digests ONLY={name}"
    found, exact = CASES[name].run(), EXACT and not CASES[name].fitted
    lines = []
    for entry, value in recorded.items():
        lines += (
            digest_driver.differences(value, found[entry], exact, entry) if entry in found else [f"{entry}: is gone"]
        )
    assert not lines, "\n".join(["what is computed changed; if it should: make digests", *lines])


def test_every_entry_is_of_one_case():
    owners = {entry: [name for name in CASES if digest_driver.belongs(entry, name)] for entry in RECORDED["entries"]}
    assert {entry: names for entry, names in owners.items() if len(names) != 1} == {}
    assert list(RECORDED["entries"]) == sorted(RECORDED["entries"])


def test_every_case_was_recorded():
    """Long cases run in `make soak` alone; that one is absent is said at once."""
    recorded = {name for name in CASES for entry in RECORDED["entries"] if digest_driver.belongs(entry, name)}
    assert sorted(set(CASES) - recorded) == [], "make digests ONLY=NAME records one"


def test_what_is_quick_has_every_kind():
    quick = {case.name for case in CASES.values() if case.short}
    # A drop takes as long as all hits together, and the netlist of a board twice as long as that of its axis.
    assert {name.split("/")[0] for name in quick} | {"drop", "board"} == {name.split("/")[0] for name in CASES}
    scenes = {name.split("/")[1] for name in quick if name.startswith("hit/")}
    assert scenes >= set(digests.SCENES)
    for estimator in digests.HIT:
        assert {f"hit/seed-2011/{estimator}:{output}/fixed" for output in digests.OUTPUTS[estimator]} <= quick


@pytest.mark.parametrize(
    ("recorded", "found", "lines"),
    [
        ({"a": 1, "b": [2, 3]}, {"a": 1, "b": [2, 3], "c": 4}, []),
        ({"a": 1, "b": [2, 3]}, {"b": [2, 4]}, [".a: is gone", ".b[1]: was 3, is 4"]),
        ({"a": [1, 2]}, {"a": [1]}, [".a: was [1, 2], is [1]"]),
        ({"a": True}, {"a": 1}, [".a: was True, is 1"]),
        ({"a": None}, {"a": 0.0}, [".a: was None, is 0.0"]),
        ({"a": float("nan")}, {"a": float("nan")}, []),
        ("0f3a", "0f3b", [": was '0f3a', is '0f3b'"]),
    ],
)
@pytest.mark.parametrize("exact", [True, False])
def test_a_difference_is_named(recorded, found, lines, exact):
    assert digest_driver.differences(recorded, found, exact) == lines


def test_floats_are_equal_here_and_near_elsewhere():
    def same(*values, exact):
        return not digest_driver.differences(*values, exact)

    near, far = 1.0 + 1e-9, 1.0 + 1e-5
    assert same(1.0, 1.0, exact=True)
    assert not same(1.0, near, exact=True)
    assert same(1.0, near, exact=False)
    assert not same(1.0, far, exact=False)
    assert not same("float64 0f", "float64 0e", exact=True)
    assert same("float64 0f", "float64 0e", exact=False)
    assert not same("float64 0f", None, exact=False)


def circuit(folder: Path, verilog: str) -> str:
    (folder / "top.v").write_text(verilog)
    return netlists.digest(folder / "top.v", "top")


@pytest.mark.parametrize(
    ("pattern", "put"),
    [
        (r"\bless\b", "difference"),
        (r"\binner\b", "outer"),
        (r"\bpart\b", "another"),
        (r"(?s)(  always @\*.*?endcase\n  end\n)(.*)(?=endmodule)", r"\2\1"),
        (r"(  always .* sum .*\n)(  always .* kept .*\n)", r"\2\1"),
        (r"(?s)(module inner.*?endmodule)(.*)", r"\2\n\1"),
        (r"(?s)\(input clk, (.*)\);\n  wire", r"(\1, input clk);\n  wire"),
    ],
    ids=["wire", "module", "instance", "blocks", "statements", "modules", "ports' order"],
)
def test_names_and_order_within_a_circuit_are_not_seen(tmp_path, pattern, put):
    changed = re.sub(pattern, put, VERILOG)
    assert changed != VERILOG
    assert circuit(tmp_path, changed) == circuit(tmp_path, VERILOG)


@pytest.mark.parametrize(
    ("pattern", "put"),
    [
        (r"4'd5", "4'd6"),
        (r"4'd13", "4'd12"),
        (r"initial sum = 4'd3", "initial sum = 4'd2"),
        (r"a - b", "b - a"),
        (r"a - b", "a + b"),
        (r"\.a\(p\), \.b\(q\)", ".a(q), .b(p)"),
        (r"\bplace\b", "where"),
        (r"input \[1:0\] place", "input [2:0] place"),
        (r"output reg \[3:0\] kept", "inout reg [3:0] kept"),
        (r"posedge clk\) kept", "negedge clk) kept"),
    ],
    ids=["constant", "table", "initial value", "operands", "operator", "wiring", "port", "width", "direction", "edge"],
)
def test_a_changed_circuit_is_seen(tmp_path, pattern, put):
    changed = re.sub(pattern, put, VERILOG)
    assert changed != VERILOG
    assert circuit(tmp_path, changed) != circuit(tmp_path, VERILOG)
