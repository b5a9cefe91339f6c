"""The end of a command: what is printed, saved and drawn, whichever of these fails."""

import json
import math
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from hardwall.cli import terminal
from hardwall.cli.report import ReportOptions, _do_all, _write
from hardwall.model.runtime.build_folder import build_dir
from hardwall.model.runtime.result import Values
from hardwall.model.runtime.stages import logger
from hardwall.sim.jobs.store import Store
from hardwall.sim.rtl.waveform import vcd_to_fst
from stimuli import results
from support.command_line import call
from support.processes import HARDWALL, ended, started, wait_until

DRAWING = """
import sys, time
from pathlib import Path
from hardwall.cli.app import main
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

    monkeypatch.setattr("hardwall.cli.hit.vcd_to_fst", full)
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


def test_names_of_files_stay_on_a_line_and_folders_are_made(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hardwall.sim.walls.hit.run", lambda *_: results.hit())
    files = "new/a\nb.npz", "other/folder/x\ny.svg"
    code, _, err = call(monkeypatch, capsys, "hit", "--json", "--trace", files[0], "--plot", files[1])
    assert (code, err) == (0, "trace: new/a\\nb.npz\npicture: other/folder/x\\ny.svg\n")
    assert all(Path(file).exists() for file in files)


def test_what_a_run_says_of_a_name_stays_on_a_line(monkeypatch, capsys):
    monkeypatch.setattr(logger, "handlers", [])
    terminal.hear_stages()
    logger.info("compiling a\nb ...")
    monkeypatch.setattr(terminal, "SILENCE_S", 0.0)
    with terminal.progress("a\nb.csv", 2) as advance:
        advance(1)
    assert capsys.readouterr().err == "compiling a\\nb ...\na\\nb.csv: 50%\n"


@pytest.mark.parametrize(
    ("begun", "patience_s", "drawn"), [(False, 0.0, False), (True, 0.0, True), (True, 60.0, False)]
)
def test_what_is_refused_soon_is_one_line_without_a_bar(monkeypatch, capsys, begun, patience_s, drawn):
    monkeypatch.setattr(terminal, "log", Console(stderr=True, force_terminal=True))
    monkeypatch.setattr(terminal, "PATIENCE_S", patience_s)
    with suppress(ValueError), terminal.progress("a.csv", 2) as advance:
        if begun:
            advance(1)
        raise ValueError
    assert bool(capsys.readouterr().err) == drawn


def test_a_folder_that_went_meanwhile_is_an_error_in_a_line(tmp_path):
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "x.csv"
    with pytest.raises(OSError, match=r"/file/x\.csv: cannot be written \(File exists\)$"):
        _write("velocities", path, Path.touch)


def test_the_folder_that_a_link_leads_to_is_made(tmp_path):
    link = tmp_path / "link.csv"
    link.symlink_to("new/folder/target.csv")
    _write("velocities", link, Path.touch)
    assert (tmp_path / "new/folder/target.csv").exists()


def test_a_waveform_goes_where_a_link_leads(tmp_path):
    vcd, link = tmp_path / "x.vcd", tmp_path / "link.fst"
    vcd.write_text("$timescale 1ns $end\n$var wire 1 ! a $end\n$enddefinitions $end\n#0\n1!\n#1\n0!\n")
    link.symlink_to("target.fst")
    assert vcd_to_fst(vcd, link) == 2
    assert link.is_symlink()
    assert (tmp_path / "target.fst").stat().st_size


def test_a_waveform_that_cannot_be_written_is_an_error_that_names_it_once(tmp_path):
    fst = tmp_path / "absent" / "x.fst"
    with pytest.raises(OSError, match=r"/absent/x\.fst: cannot be written \(it cannot be created\)$") as failure:
        vcd_to_fst(tmp_path / "x.vcd", fst)
    assert str(failure.value).count(str(tmp_path)) == 1


def test_a_number_that_json_lacks_is_an_error_in_a_line(capsys):
    for number in (math.nan, math.inf):
        with pytest.raises(RuntimeError, match=r"^the result cannot be printed as JSON: Out of range float values"):
            ReportOptions(command="hit", as_json=True).finish(Values({"rms_mm": number}))
    assert capsys.readouterr().out == ""


def test_a_refused_call_does_not_load_what_draws(tmp_path):
    command = [HARDWALL, "hit", "--plot", "x.png", "--set", "handle.mass_kg=-1"]
    environ = os.environ | {"MPLCONFIGDIR": "/dev/null/none"}
    done = subprocess.run(command, cwd=tmp_path, env=environ, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)


def test_settings_of_the_user_s_windows_and_folders_are_not_in_the_way_of_a_picture(tmp_path):
    (tmp_path / "matplotlibrc").write_text("backend: none\nno.key: 1\nlines.linewidth: thick\n")
    program = "from hardwall.cli.report import _pictures; print(_pictures('.style').mpl.get_backend())"
    environ = os.environ | {"MPLBACKEND": "none", "MPLCONFIGDIR": "/dev/null/none"}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=tmp_path, env=environ, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "agg\n", "")


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


def test_no_test_reads_a_user_s_results_or_writes_among_them():
    assert not Store("verdicts").path.is_relative_to(build_dir())
