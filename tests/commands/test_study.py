"""The end of a command: what is printed, saved and drawn, whichever of these fails."""

import json
import signal
import sys

import numpy as np
import pytest

from hardwall.sim.commands.study import _do_all
from stimuli import results
from stimuli.command_line import call
from stimuli.processes import ended, started, wait_until

DRAWING = """
import sys, time
from pathlib import Path
from hardwall.sim.commands.app import main
from hardwall.sim.pictures import style
def save_all(*_):
    Path("drawing").touch()
    time.sleep(600)
style.save_all = save_all
sys.argv = ["hardwall", "hit", "--json", "--plot", "hit.png", "--trace", "hit.npz"]
main()
"""


def test_a_picture_that_fails_loses_neither_the_report_nor_the_trace(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError("hit.png: cannot be written (No space left on device)")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hardwall.sim.pictures.style.save_all", full)
    code, out, err = call(monkeypatch, capsys, "hit", "--json", "--plot", "hit.png", "--trace", "hit.npz")
    assert code == 1
    assert err.endswith("\nhardwall: error: hit.png: cannot be written (No space left on device)\n")
    with np.load("hit.npz") as trace:
        assert json.loads(str(trace["report"])) == json.loads(out)


def test_a_waveform_that_fails_does_not_lose_the_report(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError("hit.fst: cannot be written")

    monkeypatch.setattr("hardwall.sim.commands.hit.vcd_to_fst", full)
    monkeypatch.setattr("hardwall.sim.walls.hit.run", lambda *_: results.hit())
    code, out, err = call(monkeypatch, capsys, "hit", "--backend", "rtl", "--json", "--trace", tmp_path / "hit.fst")
    assert (code, err) == (1, "hardwall: error: hit.fst: cannot be written\n")
    assert json.loads(out)["rms_mm"] == 0


def test_an_interrupt_while_drawing_loses_neither_the_report_nor_the_trace(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with started(sys.executable, "-c", DRAWING) as process:
        wait_until((tmp_path / "drawing").exists)
        process.send_signal(signal.SIGINT)
        code, out, err = ended(process)
    # Before, a slow machine says what it compiles.
    assert (code, err.splitlines()[-2:]) == (130, ["trace: hit.npz", "hardwall: error: interrupted"])
    assert json.loads(out)["backend"] == "fixed"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["drawing", "hit.npz"]


def test_several_failures_are_one_error():
    done = []

    def fails(error):
        raise error

    steps = [
        lambda: fails(OSError("a.csv: cannot be written (x)")),
        lambda: done.append(1),
        lambda: fails(RuntimeError("")),
        lambda: fails(RuntimeError("stdout: y")),
        lambda: done.append(2),
    ]
    with pytest.raises(RuntimeError, match=r"^a\.csv: cannot be written \(x\); stdout: y$"):
        _do_all(steps)
    assert done == [1, 2]
    # A fault of the program is not hidden behind what may happen.
    with pytest.raises(TypeError, match=r"^a fault$"):
        _do_all([*steps, lambda: fails(TypeError("a fault"))])
    _do_all([])
