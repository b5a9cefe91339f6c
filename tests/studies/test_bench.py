"""The benchmark: it runs on any scene, its cocotb loop gives the model's words, and its report is as promised."""

import shutil
import sys
from pathlib import Path

import pytest

from hardwall.model.build_folder import build_dir
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import FOLDER, read
from hardwall.sim.studies import bench, waits
from hardwall.sim.studies.waits import SCENE, Command, Wait
from stimuli.command_line import call
from stimuli.reports import check

HIT = ("hit", SCENE, *waits.SHORT, "--json")
COMMANDS = {"fixed (samples/s)": Command(HIT, 1, speed=True), "a hit, nothing compiled (s)": Command(HIT, 1, cold=True)}


@pytest.mark.rtl
def test_the_benchmark_runs_on_a_scene_of_ones_own(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "ROUNDS", 1)
    monkeypatch.setattr(bench, "COCOTB_SAMPLES", 40)
    monkeypatch.setattr(bench, "SECONDS_OF_SCENE", {"float": 0.1, "fixed": 0.1, "rtl": 0.02})
    shutil.copy(FOLDER / "seed-2011.toml", tmp_path / "mine.toml")
    monkeypatch.chdir(tmp_path)
    case, said, folders, simulated = Case.of("mine.toml"), [], [], bench.simulate_axis
    (tmp_path / "mine.toml").unlink()  # it was read once
    monkeypatch.setattr(bench, "simulate_axis", lambda spec, job: (folders.append(job.folder), simulated(spec, job)))
    monkeypatch.setattr(waits, "COMMANDS", COMMANDS)
    report = bench.study(case, said.append).report()
    assert set(report["samples_per_s"]) == {"float", "fixed", "rtl", "cocotb"}
    assert set(report["ns_per_sample_of_parts"]) == {
        "none", "coulomb friction", "amplifier delay", "encoder phase error", "converter", "amplifier lag",
        "amplifier lag, motor, cable, friction",
    }  # fmt: skip
    assert all(value > 0 for value in report["samples_per_s"].values())
    assert report["rtl_over_cocotb"] == report["samples_per_s"]["rtl"] / report["samples_per_s"]["cocotb"]
    check("bench", report)
    assert set(report["clocks_of_estimators"]) == set(ESTIMATORS)
    assert [wait["name"] for wait in report["from_the_prompt"]] == list(COMMANDS)
    assert len(said) == 1 + 4 + 7 + 3
    # What is left there by a process that is killed is removed by the next.
    assert {folder.parent for folder in folders} == {build_dir() / "cocotb"}


def test_two_versions_are_timed_in_turns(monkeypatch, capsys):
    """Both are this one: what is measured is the same command, through another Python's name."""
    monkeypatch.setattr(waits, "COMMANDS", {"fixed (samples/s)": Command(HIT, 2, speed=True)})
    other = Path(sys.executable).parent / "." / Path(sys.executable).name
    said: list[str] = []
    (wait,) = waits.measure(read("seed-2011"), other, said.append)
    assert said == [f"round {number} of 2: fixed (samples/s)" for number in (0, 1, 2)]
    assert len(wait.here) == len(wait.other) == 2
    assert waits.table([wait]).rows[0][0] == "fixed (samples/s)"


def test_ratios_say_how_many_times_as_fast_this_one_is():
    speed, seconds = Wait("fixed (samples/s)", [4.0, 6.0, 9.0], [2.0] * 3), Wait("a hit (s)", [1.0, 2.0], [4.0, 4.0])
    assert (speed.ratios, seconds.ratios) == ([2.0, 3.0, 4.5], [2.0, 4.0])
    assert speed.report()["times_as_fast"] == 3.0
    assert waits.table([speed, seconds]).rows == [
        ["fixed (samples/s)", "6", "2", "3.00 (2.00 to 4.50)"],
        ["a hit (s)", "1.5", "4", "3.00 (2.00 to 4.00)"],
    ]
    assert waits.table([Wait("a hit (s)", [1.0], [])]).rows == [["a hit (s)", "1"]]


def test_a_command_that_fails_is_named(monkeypatch):
    monkeypatch.setattr(waits, "COMMANDS", {"a hit (s)": Command(("hit", "nowhere"), 1, cold=True)})
    with pytest.raises(RuntimeError, match=r"^hit nowhere by \S+ failed: hardwall: error: .*nowhere"):
        waits.measure(read("seed-2011"), None, lambda text: None)


def test_what_has_no_hardwall_is_refused(tmp_path, monkeypatch, capsys):
    code, out, err = call(monkeypatch, capsys, "bench", "--against", str(tmp_path))
    assert (code, out) == (2, "")
    assert err == (
        "hardwall: error: --against must be a checkout in which make tools has run, or an environment with hardwall, "
        f"not {tmp_path}\n"
    )
