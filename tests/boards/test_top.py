"""The Verilog around the board: no lint; and in simulation the clock that was asked for, and outputs after its lock.

The vendors' cells are models that make the frequency which their parameters give; see `stimuli/clock_cells.py`.
"""

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.axis.board import Board
from hardwall.hdl.export import to_verilog
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.spec import AxisSpec
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.boards.pll import ClockError
from hardwall.sim.boards.signals import OF_STAGE, signals_of, signals_of_axes
from hardwall.sim.boards.top import pads_of, top_of_axes, top_verilog
from hardwall.sim.rtl.verilator import LINT_OPTIONS, environment
from stimuli.clock_cells import MODELS
from stimuli.lengths import LONG
from stimuli.specs import SPECS
from stimuli.stages import STAGES

CLOCKS = [
    ("ulx3s-25f", 50_000_000),
    ("ulx3s-25f", 12_000_000),
    ("ulx3s-85f", 25_000_000),
    ("icebreaker", 24_000_000),
    ("icebreaker", 12_000_000),
    ("tangnano9k", 27_000_000),
    ("tangnano9k", 24_000_000),
]
"""Boards and clocks, with a PLL and without."""
OPEN = ("drive_enable", "external_fault", "emergency_stop")
BODY = re.compile(r"(module (?!made_clock)\w+ (?:#\((?:.|\n)*?\) )?\([^;]*?\);)(?:.|\n)*?endmodule")
"""A module of a cell; its first group is all but what is inside."""
BENCH = """
`timescale 1ps/1ps
module bench;
    reg pin = 0, rst = 0;
    wire drive_pdm, drive_sign, alive, uart_tx;
    integer rising = 0;
    realtime first, last;

    always #({half_ps}) pin = ~pin;
    // The pull-downs outside.
    pulldown (drive_pdm);
    pulldown (drive_sign);
    pulldown (alive);

    top dut (
        .clk(pin), .rst(rst), .encoder_a(1'b1), .encoder_a_n(1'b1), .encoder_b(1'b1), .encoder_b_n(1'b1),
        .encoder_z(1'b0), .drive_enable(1'b1), .external_fault(1'b1), .emergency_stop(1'b1), .uart_rx(1'b1),
        .drive_pdm(drive_pdm), .drive_sign(drive_sign), .alive(alive), .uart_tx(uart_tx)
    );

    always @(posedge dut.board.clk) if (dut.locked) begin
        rising = rising + 1;
        if (rising == 1) first = $realtime;
        last = $realtime;
        if (rising == 401) $display("periods_ps %0d", $rtoi(last - first + 0.5));
    end

    always @(dut.driven) $display("driven %b locked %b reset %b", dut.driven, dut.locked, dut.board.rst);

    initial begin
        #1 $display("start driven %b pdm %b alive %b reset %b", dut.driven, drive_pdm, alive, dut.board.rst);
        #60000000 $display("later driven %b pdm %b alive %b", dut.driven, drive_pdm, alive);
        rst = 1;
        #5000000 $display("reset driven %b", dut.driven);
        rst = 0;
        #20000000 $display("again driven %b", dut.driven);
        force dut.locked = 0;
        #1 $display("unlocked driven %b pdm %b reset %b", dut.driven, drive_pdm, dut.board.rst);
        $finish;
    end
endmodule
"""


@cache
def board_verilog(clock_hz: int, stage: str = "pdm") -> str:
    """Return the Verilog of a small axis with a drive stage."""
    rates = {"clock_hz": clock_hz, "sample_hz": clock_hz // 50, "actuation_hz": clock_hz // 50}
    given = {key: value for key, value in SPECS["mhz"].items() if key != "gains"}
    return to_verilog(Board(AxisSpec(**given | rates, estimator="fdm", stage=STAGES[stage][1])), "board")


def verilog(name: str, clock_hz: int, stage: str = "pdm") -> str:
    """Return the Verilog of a small axis with a drive stage on a board."""
    return top_verilog(BOARDS[name], clock_hz, stage) + board_verilog(clock_hz, stage)


STAGED = [
    *((*each, "pdm") for each in dict(CLOCKS).items()),
    ("ulx3s-25f", 50_000_000, "pwm"),
    ("ulx3s-25f", 50_000_000, "dac"),
]


@pytest.mark.parametrize(("name", "clock_hz", "stage"), STAGED if LONG else STAGED[2::2])
def test_no_warning_of_verilator(name, clock_hz, stage, tmp_path):
    lint(verilog(name, clock_hz, stage), tmp_path)


def test_no_warning_of_verilator_with_several_axes(tmp_path):
    given = {key: value for key, value in SPECS["mhz"].items() if key != "gains"}
    board = AxesBoard(AxesSpec(**given, axes=3, estimator="fdm"))
    lint(top_of_axes(BOARDS["ulx3s-25f"], given["clock_hz"], 3) + to_verilog(board, "board"), tmp_path)


def lint(text: str, tmp_path: Path) -> None:
    """Assert that Verilator finds nothing in the Verilog of a board."""
    (tmp_path / "top.v").write_text(text)
    (tmp_path / "cells.v").write_text(BODY.sub(r"\1 endmodule", MODELS.replace("`OSCILLATOR_MHZ", "1")))
    # Of the cells only the ports are read; and outputs of a PLL that nothing needs are left open.
    waived = '`verilator_config\nlint_off -file "*/cells.v"\nlint_off -rule PINCONNECTEMPTY\n'
    (tmp_path / "cells.vlt").write_text(waived)
    options = ["--lint-only", "--timing", *LINT_OPTIONS, str(tmp_path / "cells.vlt"), "--top-module", "top"]
    done = subprocess.run(
        ["verilator", *options, str(tmp_path / "cells.v"), str(tmp_path / "top.v")],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    assert done.returncode == 0


@pytest.mark.skipif(not shutil.which("iverilog"), reason="iverilog is not installed")
@pytest.mark.parametrize(("name", "clock_hz"), CLOCKS)
def test_the_clock_is_the_one_asked_for_and_outputs_wait_for_its_lock(name, clock_hz, tmp_path):
    board = BOARDS[name]
    half_ps = 1e12 / board.oscillator_hz / 2
    (tmp_path / "cells.v").write_text(MODELS.replace("`OSCILLATOR_MHZ", f"{board.oscillator_hz / 1e6}"))
    (tmp_path / "top.v").write_text("`timescale 1ps/1ps\n" + verilog(name, clock_hz))
    (tmp_path / "bench.v").write_text(BENCH.format(half_ps=half_ps))
    subprocess.run(
        ["iverilog", "-g2012", "-s", "bench", "-o", "bench", "cells.v", "top.v", "bench.v"], cwd=tmp_path, check=True
    )
    done = subprocess.run(["vvp", "-n", "bench"], cwd=tmp_path, capture_output=True, text=True, check=True)
    said = done.stdout.splitlines()
    # The simulator rounds every half of the 400 periods to a picosecond.
    (periods,) = [int(line.split()[1]) for line in said if line.startswith("periods_ps")]
    assert abs(periods - 400e12 / clock_hz) <= 400
    assert f"start driven 0 pdm 0 alive 0 reset {int(clock_hz != board.oscillator_hz)}" in said
    assert "later driven 1 pdm 0 alive 0" in said
    assert "reset driven 0" in said
    assert "again driven 1" in said
    assert said[-1] == "unlocked driven 0 pdm 0 reset 1"
    driven = [line for line in said if line.startswith("driven 1")]
    assert driven == ["driven 1 locked 1 reset 0"] * 2


def test_the_pads_and_the_ports_of_several_axes_are_in_the_order_of_their_numbers():
    text = top_of_axes(BOARDS["ulx3s-25f"], 50_000_000, 3)
    pads = [signal.name for signal in signals_of_axes(3) if signal.out and signal.name != "uart_tx"]
    assert sorted(re.findall(r"assign (\w+) = driven \?", text)) == sorted(pads)
    assert ".encoder_z({encoder_z_2, encoder_z_1, encoder_z_0})," in text
    for pin, wire in (("drive_pdm", "pdm"), ("drive_sign", "sign"), ("alive", "pump")):
        assert f".{pin}({{{wire}_2, {wire}_1, {wire}_0}})," in text
        assert f"assign {pin}_1 = driven ? {wire}_1 : 1'bz;" in text


@pytest.mark.parametrize("stage", OF_STAGE)
def test_the_pads_are_those_of_the_drive(stage):
    pads = pads_of(stage)
    assert set(pads) == {signal.name for signal in signals_of(stage) if signal.out} - {"uart_tx"}
    text = top_verilog(BOARDS["icebreaker"], 24_000_000, stage)
    assert re.findall(r"assign (\w+) = driven \?", text) == list(pads)


def test_a_clock_that_cannot_be_made_has_no_text():
    with pytest.raises(ClockError, match=r"^clock_hz must be one that the board makes exactly of its 27000000 Hz"):
        top_verilog(BOARDS["tangnano9k"], 50_000_000)
