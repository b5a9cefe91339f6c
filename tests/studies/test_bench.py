"""The benchmark: it runs on any scene, its cocotb loop gives the model's words, and its report is as promised."""

import re

import pytest

from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import read
from hardwall.sim.studies import bench, waiting_time
from hardwall.sim.studies.waiting_time import SCENE, Command
from stimuli.lengths import LONG
from stimuli.scenes import NARROW
from support.reports import check

HIT = ("hit", SCENE, "--set", "protocol.start_m=-1e-5", *waiting_time.SHORTER, "--json")
COMMANDS = {"fixed (samples/s)": Command(HIT, 1, speed=True), "a hit, nothing compiled (s)": Command(HIT, 1, cold=True)}
if not LONG:
    del COMMANDS["fixed (samples/s)"]  # `test_waiting_time` has one of these

PARTS = (
    "none", "coulomb friction", "bristles, Dahl's model", "bristles, LuGre's model", "amplifier delay",
    "encoder phase error", "converter", "amplifier lag", "amplifier lag, motor, cable, friction",
)[slice(None) if LONG else slice(1, 2)]  # fmt: skip
"""What is timed of a device: each has its own loop to compile. The short form has the part whose loop others need."""


def measured_uncompiled(*given):
    """Measure commands that do not compile, for that would take longer than all else."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_DISABLE_JIT", "1")
        return waiting_time.measure(*given)


def own_scene() -> str:
    """Return the text of `seed-2011` with the axis of `NARROW`."""
    text = read("seed-2011")
    for key, value in NARROW.items():
        text, number = re.subn(rf"(?m)^{key.partition('.')[2]} = [\d._]+", f"{key.partition('.')[2]} = {value}", text)
        assert number == 1
    return text


@pytest.mark.rtl
def test_the_benchmark_runs_on_a_scene_of_ones_own(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "ROUNDS", 1)
    monkeypatch.setattr(bench, "COCOTB_SAMPLES", 40)
    monkeypatch.setattr(bench, "SECONDS_OF_SCENE", {"float": 0.1, "fixed": 0.1, "rtl": 0.02})
    (tmp_path / "mine.toml").write_text(own_scene())
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
    assert len(said) == 1 + 4 + len(PARTS) + sum(each.rounds + (not each.cold) for each in COMMANDS.values())
    # What is left there by a process that is killed is removed by the next.
    assert {folder.parent for folder in folders} == {build_dir() / "cocotb"}
