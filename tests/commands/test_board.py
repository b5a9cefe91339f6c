"""The command `board`: what it prints, and bad input in one line before any work."""

import json
import re

import pytest

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.rtl.loader import LOADER
from stimuli.command_line import call
from stimuli.reports import check_text
from stimuli.tools import stand_in


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
    assert calls.read_text().splitlines()[-1] == f"{LOADER} --board ulx3s --write-sram {bitstream}"
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
