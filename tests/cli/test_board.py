"""The command `board`: what it prints, and bad input in one line before any work."""

import json
import re

import pytest

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.rtl.loader import LOADER
from support.command_line import call
from support.reports import check_text
from support.tools import stand_in


@pytest.fixture
def calls(tmp_path, monkeypatch):
    """Set up stand-ins for the tools, and be in an empty folder; return the file that lists the calls."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    return stand_in(tmp_path, monkeypatch)


def test_a_scene_becomes_a_bitstream_in_one_command(calls, monkeypatch, capsys):
    code, out, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "-o", "out")
    assert code == 0, err
    assert re.search(r"^identity +[0-9a-f]{16}", out, re.MULTILINE)
    assert err.splitlines()[-1] == "bitstream: out/ulx3s-25f.bit, 50.00 MHz for a clock of 50 MHz"
    code, out, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "mhz", "-o", "out", "--json")
    assert code == 0, err
    check_text("board", out)
    assert LOADER not in calls.read_text()


def test_several_axes_have_the_rates_of_the_scene(calls, monkeypatch, capsys):
    code, out, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "mhz", "--axes", "8", "-o", "out", "--json")
    assert code == 0, err
    check_text("board", out)
    assert (json.loads(out)["axes"], json.loads(out)["stage"]) == (8, "pdm")
    code, out, err = call(monkeypatch, capsys, "synth", "mhz", "--axes", "3", "--seeds", "1", "--json")
    assert code == 0, err
    check_text("synth", out)
    assert (json.loads(out)["axes"], json.loads(out)["scene"]) == (3, "mhz")


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (("synth", "mhz", "--axes", "9"), "--axes must be at most 8 on ulx3s-25f, not 9"),
        (("synth", "mhz", "--axes", "0"), "--axes must be a whole number of 1 to 32, not '0'"),
        (("board", "icebreaker", "--axes", "2", "-o", "out"),
         "--axes must be absent on icebreaker (its pins are those of a single axis), not 2"),
        (("synth", "--device", "gw1nr-9", "--axes", "2"),
         "--axes must be absent on tangnano9k (its pins are those of a single axis), not 2"),
        (("verilog", "--board", "icebreaker", "--axes", "1", "-o", "out"),
         "--axes must be absent on icebreaker (its pins are those of a single axis), not 1"),
        (("verilog", "--board", "ulx3s-25f", "--axes", "9", "-o", "out"),
         "--axes must be at most 8 on ulx3s-25f, not 9"),
        (("verilog", "mhz", "--axes", "33", "-o", "out"), "--axes must be a whole number of 1 to 32, not '33'"),
        (("synth", "mhz", "--axes", "2", "--estimator", "kalman"),
         "the scene's estimator must be one of fdm, levant, window, not 'kalman'"),
        (("synth", "mhz", "--axes", "2", "--set", "drive={stage='pdm', newtons_per_volt=2.0, full_scale_v=24.0}"),
         "--axes must be absent for a scene with [drive], not 2: the pipeline of several axes has no drive stages"),
        (("verilog", "mhz", "--axes", "2", "--estimator", "kalman", "--set", "virtual_mass.most_kg=0.05", "-o", "out"),
         "--axes must be absent for a scene with [virtual_mass], not 2: "
         "the pipeline of several axes has no acceleration"),
        (("synth", "mhz", "--axes", "2", "--set", "coupling={stiffness_n_per_m=1e4, sample_hz=1000}"),
         "--axes must be absent for a scene with [coupling], not 2: "
         "the pipeline of several axes has no moving surfaces"),
        (("verilog", "mhz", "--axes", "2", "--set", "passivity.damping_n_s_per_m=5", "-o", "out"),
         "--axes must be absent for a scene with [passivity], not 2: "
         "the pipeline of several axes has no passivity controller"),
    ],
)  # fmt: skip
def test_axes_that_cannot_be_are_one_line(calls, monkeypatch, capsys, command, message):
    code, out, err = call(monkeypatch, capsys, *command)
    assert (code, out, err) == (2, "", f"hardwall: error: {message}\n")
    assert not calls.exists()


def test_without_a_scene_the_board_runs_its_own(calls, monkeypatch, capsys):
    changed = ("--set", "controller.sample_hz=250000", "--set", "controller.actuation_hz=250000")
    code, out, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "-o", "out", "--json", *changed)
    assert code == 0, err
    report = json.loads(out)
    assert (report["scene"], report["clock_mhz"]) == ("mhz", 50.0)


def test_a_clock_that_is_missed_is_one_line_and_no_folder(calls, monkeypatch, capsys, tmp_path):
    code, out, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "-o", "out", "--seeds", "2")
    assert (code, out) == (1, "")
    assert err.splitlines()[-1].startswith(
        "hardwall: error: ulx3s-25f misses the clock of 50 MHz: the highest of 2 seeds is 20.00 MHz ("
    )
    assert list((tmp_path / "here").iterdir()) == []


def test_the_board_is_loaded_at_the_end_and_without_one_the_files_stay(calls, monkeypatch, capsys, tmp_path):
    code, _, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "-o", "out", "--program", "sram")
    assert code == 0, err
    bitstream = tmp_path / "here/out/ulx3s-25f.bit"
    last = calls.read_text().splitlines()[-1]
    assert re.fullmatch(rf"{LOADER} --board ulx3s --write-sram /\S+/{bitstream.name}", last)
    (calls.parent / "bin" / LOADER).write_text("#!/bin/sh\necho 'unable to open ftdi device: -3'\nexit 1\n")
    code, out, err = call(monkeypatch, capsys, "board", "ulx3s-25f", "-o", "out", "--program", "flash")
    assert code == 1
    assert "identity" in out
    last = err.splitlines()[-1]
    assert last.startswith("hardwall: error: loading ulx3s-25f failed: unable to open ftdi device: -3; see ")
    assert bitstream.exists()


NEAR = "nearest 45750000, 46500000, 47250000, 48000000, not 50000000"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nix", "-o", "out"], f"board must be one of {', '.join(BOARDS)}, not 'nix'"),
        (["ulx3s", "-o", "out"], f"board must be one of {', '.join(BOARDS)}, not 'ulx3s'"),
        (["icebreaker", "nix", "-o", "out"], "scene must be one of "),
        (
            ["icebreaker", "mhz", "-o", "out"],
            f"the scene's clock_hz must be one that the board makes exactly of its 12000000 Hz, {NEAR}",
        ),
        (["icebreaker"], "Missing option '-o'"),
        (["icebreaker", "-o", ""], "-o must be a folder, not ''"),
        (["icebreaker", "-o", "."], "-o must be another folder than the current one and those above it, not '.'"),
        (["icebreaker", "-o", ".."], "-o must be another folder than the current one and those above it, not '..'"),
        (
            ["icebreaker", "-o", "mine"],
            "-o must be a folder that is new, empty, or as this command wrote it, and 'mine' has 'notes.txt'",
        ),
        (["icebreaker", "-o", "mine/notes.txt"], "-o must be a folder that is new, empty, or as this command wrote it"),
        (["icebreaker", "-o", "mine/notes.txt/x"], "-o 'mine/notes.txt/x' cannot be written: Not a directory"),
        (["icebreaker", "-o", "out", "--program", "sram"], "--program must be one of flash for icebreaker, not 'sram'"),
        (["icebreaker", "-o", "out", "--program", "nix"], "--program must be one of sram, flash, not 'nix'"),
        (["icebreaker", "-o", "out", "--seeds", "0"], "--seeds must be a whole number of 1 to 99, not '0'"),
    ],
)
def test_bad_input_is_one_line_before_any_work(calls, monkeypatch, capsys, tmp_path, words, message):
    mine = tmp_path / "here/mine"
    mine.mkdir()
    (mine / "notes.txt").write_text("mine")
    code, out, err = call(monkeypatch, capsys, "board", *words)
    assert (code, out) == (2, "")
    (line,) = err.splitlines()
    assert line.startswith(f"hardwall: error: {message}")
    assert not calls.exists(), "no tool was called"
    assert [path.name for path in (tmp_path / "here").rglob("*")] == ["mine", "notes.txt"]
