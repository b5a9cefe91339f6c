"""The benchmark: it runs on any scene, its cocotb loop gives the model's words, and its report is as promised."""

import shutil

import pytest

from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import FOLDER
from hardwall.sim.studies import bench, waiting_time
from hardwall.sim.studies.waiting_time import SCENE, Command
from stimuli.lengths import LONG
from support.reports import check

HIT = ("hit", SCENE, "--set", "protocol.start_m=-1e-5", *waiting_time.SHORTER, "--json")
COMMANDS = {"fixed (samples/s)": Command(HIT, 1, speed=True), "a hit, nothing compiled (s)": Command(HIT, 1, cold=True)}

PARTS = (
    "none", "coulomb friction", "bristles, Dahl's model", "bristles, LuGre's model", "amplifier delay",
    "encoder phase error", "converter", "amplifier lag", "amplifier lag, motor, cable, friction",
)[: None if LONG else 1]  # fmt: skip
"""What is timed of a device: each has its own loop to compile, so the short form has none of the parts."""


def measured_uncompiled(*given):
    """Measure commands that do not compile, for that would take longer than all else."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_DISABLE_JIT", "1")
        return waiting_time.measure(*given)


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
    monkeypatch.setattr(waiting_time, "COMMANDS", COMMANDS)
    monkeypatch.setattr(bench, "measure", measured_uncompiled)
    every = bench._parts
    monkeypatch.setattr(bench, "_parts", lambda sample_s: {part: every(sample_s)[part] for part in PARTS})
    report = bench.study(case, said.append).report()
    assert set(report["samples_per_s"]) == {"float", "fixed", "rtl", "cocotb"}
    assert tuple(report["ns_per_sample_of_parts"]) == PARTS
    assert all(value > 0 for value in report["samples_per_s"].values())
    assert report["rtl_over_cocotb"] == report["samples_per_s"]["rtl"] / report["samples_per_s"]["cocotb"]
    check("bench", report)
    assert set(report["clocks_of_estimators"]) == set(ESTIMATORS)
    assert [wait["name"] for wait in report["from_the_prompt"]] == list(COMMANDS)
    assert len(said) == 1 + 4 + len(PARTS) + 3
    # What is left there by a process that is killed is removed by the next.
    assert {folder.parent for folder in folders} == {build_dir() / "cocotb"}
