"""Whole commands from the prompt: timed in turns, compared as ratios, and refused where there is no hardwall."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from hardwall.sim.scene.load import read
from hardwall.sim.studies import waiting_time
from hardwall.sim.studies.waiting_time import SCENE, Command, Wait
from stimuli.lengths import LONG
from support.command_line import call

AT_THE_WALL = ("--set", "protocol.start_m=-1e-5")
HIT = ("hit", SCENE, *AT_THE_WALL, *waiting_time.SHORTER, "--json")
ROUNDS = 2 if LONG else 1


def test_two_versions_are_timed_in_turns(monkeypatch, capsys):
    """The other is one that is installed. Neither compiles, which would take longer than all else."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    monkeypatch.setattr(waiting_time, "COMMANDS", {"fixed (samples/s)": Command(HIT, ROUNDS, speed=True)})
    other = waiting_time.program_of(Path(sys.executable).parents[1])
    said: list[str] = []
    (wait,) = waiting_time.measure(read("seed-2011"), other, said.append)
    assert said == [f"round {number} of {ROUNDS}: fixed (samples/s)" for number in range(ROUNDS + 1)]
    assert len(wait.here) == len(wait.other) == ROUNDS
    assert waiting_time.table([wait]).rows[0][0] == "fixed (samples/s)"


def test_ratios_say_how_many_times_as_fast_this_one_is():
    speed, seconds = Wait("fixed (samples/s)", [4.0, 6.0, 9.0], [2.0] * 3), Wait("a hit (s)", [1.0, 2.0], [4.0, 4.0])
    assert (speed.ratios, seconds.ratios) == ([2.0, 3.0, 4.5], [2.0, 4.0])
    assert speed.report()["times_as_fast"] == 3.0
    assert waiting_time.table([speed, seconds]).rows == [
        ["fixed (samples/s)", "6", "2", "3.00 (2.00 to 4.50)"],
        ["a hit (s)", "1.5", "4", "3.00 (2.00 to 4.00)"],
    ]
    assert waiting_time.table([Wait("a hit (s)", [1.0], [])]).rows == [["a hit (s)", "1"]]


def test_a_command_that_fails_is_named(monkeypatch):
    monkeypatch.setattr(waiting_time, "COMMANDS", {"a hit (s)": Command(("hit", "nowhere"), 1, cold=True)})
    with pytest.raises(RuntimeError, match=r"^hit nowhere by \S+ failed: hardwall: error: .*nowhere"):
        waiting_time.measure(read("seed-2011"), None, lambda text: None)


def test_a_command_that_an_older_version_refuses_has_no_ratio(tmp_path, monkeypatch):
    """It is run here to the end, and tried there once."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    other, calls = tmp_path / "hardwall", tmp_path / "calls"
    other.write_text(f"#!/bin/sh\necho called >> {calls}\nexit 2\n")
    other.chmod(0o755)
    command = Command(HIT, 1, speed=True, cold=not LONG, lately=True)
    monkeypatch.setattr(waiting_time, "COMMANDS", {"fixed (samples/s)": command})
    (wait,) = waiting_time.measure(read("seed-2011"), other, lambda text: None)
    assert (len(wait.here), wait.other, calls.read_text()) == (1, [], "called\n")
    compared = Wait("a hit (s)", [2.0], [4.0])
    assert waiting_time.table([wait, compared]).rows[0] == ["fixed (samples/s)", f"{wait.here[0]:.4g}", "", ""]
    monkeypatch.setattr(waiting_time, "COMMANDS", {"fixed (samples/s)": replace(command, lately=False)})
    with pytest.raises(RuntimeError, match="failed: exit code 2"):
        waiting_time.measure(read("seed-2011"), other, lambda text: None)


def test_what_has_no_hardwall_is_refused(tmp_path, monkeypatch, capsys):
    code, out, err = call(monkeypatch, capsys, "bench", "--against", str(tmp_path))
    assert (code, out) == (2, "")
    assert err == (
        "hardwall: error: --against must be a checkout in which make tools has run, or an environment with hardwall, "
        f"not {tmp_path}\n"
    )
    code, out, err = call(monkeypatch, capsys, "bench", "--against", "a" * 300)
    assert (code, out) == (2, "")
    assert err.startswith("hardwall: error: --against must be a checkout in which make tools has run, ")
