"""Verilog of several axes and the tables beside it: they list the same ports, and say what they are of."""

import subprocess
from pathlib import Path

import pytest

from hardwall.hdl.axes.axis import Axes
from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.export import to_verilog, write
from hardwall.hdl.ports import port_table
from hardwall.model import register_texts
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.registers import AxesMap
from hardwall.sim.rtl.verilator import LINT_OPTIONS, environment
from hardwall.sim.scene.load import load
from stimuli.lengths import LONG
from support.tables import rows, verilog_ports

TOPS = {"axes": Axes, "board": AxesBoard}
WRITTEN = ("axes.v", "board.v", "ports.md", "registers.md", "registers.json")


def several(axes: int, estimator: str = "levant") -> AxesSpec:
    return AxesSpec(axes=axes, **load("mhz", {"controller.estimator": estimator}).requirements)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("verilog") / "made"
    assert write(several(3), folder, {}) == tuple(folder / name for name in WRITTEN)
    return folder


SIZES = [(5, "window", "axes"), (1, "fdm", "board"), (1, "fdm", "axes"), (5, "window", "board")]


@pytest.mark.parametrize(("axes", "estimator", "top"), SIZES if LONG else SIZES[:2])
def test_table_and_verilog_have_the_same_ports(axes, estimator, top):
    component = TOPS[top](several(axes, estimator))
    table = rows(port_table(component))
    seen = {row["port"].strip("`"): (row["direction"], int(row["width"])) for row in table}
    assert len(seen) == len(table)
    assert seen == verilog_ports(to_verilog(component, top), top)
    assert all(row["what it is"] for row in table)


def test_rows_of_arrays_say_how_many_words_there_are():
    spec = several(3)
    table = {row["port"].strip("`"): row for row in rows(port_table(Axes(spec)))}
    assert (table["drive"]["format"], table["drive"]["one LSB"]) == (f"3 x {spec.force}", "0.001 N")
    assert int(table["drive"]["width"]) == 3 * spec.force.width
    assert table["record_drive"]["format"] == str(spec.force)
    assert table["record_velocity"]["one LSB"] == table["velocity"]["one LSB"]
    assert table["flags"]["format"] == "3 x bits"
    assert table["encoder_a"]["format"] == "bits"


@pytest.mark.parametrize("top", TOPS)
def test_written_verilog_passes_the_lint_and_says_what_it_is_of(written, top):
    file = written / f"{top}.v"
    command = ["verilator", "--lint-only", *LINT_OPTIONS, "--top-module", top, str(file)]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    text = file.read_text()
    head = text.splitlines()[: text.splitlines().index("")]
    assert all(line.startswith("//") for line in head)
    assert "// axes = 3" in head
    # The Verilog of a board takes seconds, and has been made for the file.
    if LONG or top == "axes":
        assert text.endswith(to_verilog(TOPS[top](several(3)), top))


def test_written_tables_have_the_ports_the_words_and_the_registers(written):
    spec, text = several(3), (written / "ports.md").read_text()
    for top in TOPS.values():
        assert f"\n\n{port_table(top(spec))}" in text
    assert f"\nA sample of every axis in each rota of 50 clocks; its drive changes {spec.latency} clocks after" in text
    for number, word in enumerate(spec.design.words):
        assert f"\n| {number} | `{word.name}` | {word.format} | {word.reset} | {word.doc} |\n" in text
    registers = AxesMap(spec)
    assert (written / "registers.md").read_text() == register_texts.markdown(registers)
    assert (written / "registers.json").read_text() == register_texts.as_json(registers)
