"""Maps of stable walls: early ends, any pool, interrupts, what is printed and what is refused."""

import csv
import json
import os
import re
import signal
from dataclasses import replace

import pytest
from distributed import LocalCluster

from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.jobs import cluster
from hardwall.sim.jobs.job_pool import Threads
from hardwall.sim.jobs.store import Store
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import read
from hardwall.sim.walls import mapping, methods, zwidth
from hardwall.sim.walls.boundary import BoundaryPoint
from stimuli import results
from stimuli.lengths import LONG, long_form
from support.command_line import call
from support.processes import HARDWALL, ended_by, session, started, stored, wait_until

SMALL = {
    "zwidth.stiffness_step_n_per_m": 4e3,
    "zwidth.damping_from_n_s_per_m": 10.0,
    "zwidth.damping_to_n_s_per_m": 20.0,
    "zwidth.damping_step_n_s_per_m": 10.0,
    "protocol.settle_s": 2.0,
    "protocol.measure_s": 0.5,
}


def options(changes: dict) -> list[str]:
    return [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]


SET = options(SMALL)
METHODS = [methods.methods()[name] for name in ("fdm-100", "adjusted")]
CASES = [Case(each.label, "seed-2011", read("seed-2011"), SMALL | each.changes) for each in METHODS]


STARTS = 4


def mapped(cases: list[Case], starts: int = STARTS) -> list[zwidth.Map]:
    """Return the maps of cases by one thread."""
    with Threads(1) as pool:
        return mapping.run(cases, "fixed", Store("zwidth"), pool, starts=starts)


@pytest.fixture(scope="module")
def map_of_one_thread(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hardwall.sim.jobs.store.build_dir", lambda: tmp_path_factory.mktemp("one"))
        return mapped(CASES)


def test_a_worker_with_other_sources_is_refused():
    with pytest.raises(RuntimeError, match=r"has other sources of hardwall, or other versions of its tools$"):
        mapping.verdict("seed-2011", read("seed-2011"), "0", {}, (1e3, 10.0), None, "fixed")


def test_two_workers_and_two_threads_give_the_map_of_one(map_of_one_thread):
    options = {"threads_per_worker": 1, "dashboard_address": ":0"}
    with LocalCluster(n_workers=2, **options) as local, cluster.connected(local.scheduler_address) as pool:
        assert mapping.run(CASES, "fixed", Store("zwidth"), pool, starts=STARTS) == map_of_one_thread
    with Threads(2) as pool:
        assert mapping.run(CASES, "fixed", Store("zwidth"), pool, starts=STARTS) == map_of_one_thread


def test_a_map_goes_on_from_what_is_known(map_of_one_thread, monkeypatch):
    """A map that is ended after five hits and resumed hits none of the five again, and is the same."""
    real, hits = mapping.verdict, []

    def counted(**job):
        if len(hits) == 5:
            raise KeyboardInterrupt
        hits.append(job)
        return real(**job)

    monkeypatch.setattr(mapping, "verdict", counted)
    with pytest.raises(KeyboardInterrupt):
        mapped(CASES)
    before = list(hits)
    monkeypatch.setattr(mapping, "verdict", lambda **job: hits.append(job) or real(**job))
    assert mapped(CASES) == map_of_one_thread
    assert len(hits) == sum(each.hits for each in map_of_one_thread)
    assert all(job not in before for job in hits[5:])


@long_form
@pytest.mark.rtl
def test_the_rtl_gives_the_map_of_fixed(monkeypatch, capsys):
    smaller = {"zwidth.stiffness_to_n_per_m": 20e3, "zwidth.damping_to_n_s_per_m": 10.0}
    few = [*options(SMALL | smaller | {"controller.clock_hz": 6_000_000}), "--estimators", "adjusted"]
    few += ["--workers", 1, "--json", "--starts", 2]
    fixed, rtl = (
        json.loads(call(monkeypatch, capsys, "zwidth", *few, "--backend", each)[1])["maps"] for each in ("fixed", "rtl")
    )
    assert all(each[0].pop("seconds") > 0 for each in (fixed, rtl))
    assert fixed == rtl
    assert fixed[0]["hits"] > 2


def test_more_starts_hit_again_only_what_they_have_not(map_of_one_thread, monkeypatch):
    mapped(CASES, 2)
    real, hits = mapping.verdict, []
    monkeypatch.setattr(mapping, "verdict", lambda **job: hits.append(job) or real(**job))
    assert mapped(CASES) == map_of_one_thread
    assert 0 < len(hits) < sum(each.hits for each in map_of_one_thread)


def test_a_map_counts_the_verdicts_of_its_walls(map_of_one_thread):
    """At 90 N s/m and more, Levant's chatter shakes soft walls but not stiff walls."""
    changes = {**METHODS[1].changes, "zwidth.stiffness_step_n_per_m": 4e3}
    changes |= {"zwidth.damping_from_n_s_per_m": 90.0, "zwidth.damping_to_n_s_per_m": 120.0}
    changes |= {"zwidth.damping_step_n_s_per_m": 30.0}
    (found,) = mapped([replace(CASES[1], changes=changes)], 8)
    report = found.report()
    assert sum(sum(wall[2:]) for wall in report["p_stable"]) == report["hits"] == found.hits
    assert [wall[:2] for wall in report["p_stable"]] == sorted(wall[:2] for wall in report["p_stable"])
    assert any(wall[2] and wall[3] for wall in report["p_stable"]), "a wall on which the starts do not agree"
    for damping, stiffness, low, high in report["boundary"]:
        assert damping in (90.0, 120.0)
        assert low <= stiffness <= high
    low, high = report["area_low_n2_s_per_m2"], report["area_high_n2_s_per_m2"]
    assert low < report["area_n2_s_per_m2"] < high
    left, right = (point.held * point.stable_n_per_m for point in found.boundary)
    assert all(0 < point.held <= 1 for point in found.boundary)
    assert report["area_held_n2_s_per_m2"] == found.area_held == pytest.approx(30 * (left + right) / 2)
    assert replace(found, boundary=[replace(point, held=None) for point in found.boundary]).area_held is None


def test_areas_are_compared_start_for_start(map_of_one_thread):
    filtered, adjusted = map_of_one_thread
    assert filtered.times(filtered) == (1.0, 1.0)
    low, high = adjusted.times(filtered)
    assert low <= adjusted.area / filtered.area <= high
    assert adjusted.times(replace(filtered, drawn=0 * filtered.drawn)) is None


def test_every_hit_can_be_had_as_a_line_and_made_again(monkeypatch, capsys, tmp_path):
    file = tmp_path / "hits.csv"
    options = [*SET, "--estimators", "adjusted", "--workers", 1, "--starts", STARTS]
    code, out, _ = call(monkeypatch, capsys, "zwidth", *options, "--json", "--csv", file)
    assert code == 0
    (report,) = json.loads(out)["maps"]
    lines = list(csv.DictReader(file.open()))
    assert len(lines) == report["hits"]
    for line in lines[:: len(lines) // 3]:
        wall = "--stiffness", line["stiffness_n_per_m"], "--damping", line["damping_n_s_per_m"]
        start = [f"--set=protocol.{key}={line[key]}" for key in ("start_counts", "start_periods")]
        hit = json.loads(call(monkeypatch, capsys, "hit", *SET, *wall, *start, "--json")[1])
        assert (hit["verdict"], hit["stable"]) == (line["verdict"], line["verdict"] == "stable")


def test_walls_out_of_place_are_left_out_of_the_area_in_place():
    boundary = [BoundaryPoint(10.0 * n, 20e3, 21e3) for n in range(5)]
    found = zwidth.Map(CASES[0], boundary, 5, [True, True, False, True, True])
    assert found.area == 40 * 20e3
    # Two of the four trapezoids lose half of their area.
    assert found.area_in_place == 30 * 20e3


def test_a_map_knows_which_of_its_walls_are_in_place(map_of_one_thread):
    filtered = map_of_one_thread[0]
    assert filtered.in_place == [point.stable_n_per_m > 0 for point in filtered.boundary]
    assert filtered.area_in_place == filtered.area > 0
    large = {"controller.gains.levant": {"lambda_sqrt_m_per_s": 100.0, "alpha_m_per_s2": 560.0}}
    (chatters,) = mapped([replace(CASES[1], changes=CASES[1].changes | large)])
    assert chatters.area > chatters.area_in_place == 0


def test_report_and_picture(monkeypatch, capsys, tmp_path, map_of_one_thread):
    picture = tmp_path / "map.svg"
    names = ["--estimators", "fdm-100,adjusted", "--workers", 1, "--starts", STARTS]
    code, out, _ = call(monkeypatch, capsys, "zwidth", *SET, *names, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    expected = [each.report() for each in map_of_one_thread]
    assert all(each.pop("seconds") > 0 for each in expected + report["maps"])
    assert report["maps"] == expected
    assert report["hits"] == sum(each["hits"] for each in report["maps"])
    text = picture.read_text()
    wanted = (
        "damping B of the wall (N s/m)",
        "stiffness K up to which half are stable (kN/m)",
        "band: 95 of 100 draws of the 4 starts of every wall",
        "FDM + 100 Hz",
        "linear loop",
        "passive walls",
    )
    assert [label for label in wanted if label not in text] == []
    code, out, _ = call(monkeypatch, capsys, "zwidth", *SET, *names, "--resume")
    assert code == 0
    assert "Levant u, adjusted gains" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: zwidth is missing: a map needs its steps"),
        (
            ["desktop-arm"],
            "butterworth.cutoff_hz must be 4.52346e-12 to 400 at these rates, not 500.0 (FDM + 500 Hz)",
        ),
        (["--starts", "0"], "--starts must be a whole number of 1 to 10000, not '0'"),
        (["--csv", "hits.txt"], "--csv must end in .csv, not 'hits.txt'"),
        (["--set", "protocol.verdict=fair"], "protocol.verdict must be one of detrended, literal, not 'fair'"),
        (["--set", "protocol.start_counts=1.1"], "protocol.start_counts must be a number of 0 to 1, not 1.1"),
        (["--set", "protocol.threshold_mm=1e300"], "protocol.threshold_mm must be a number of 1e-09 to 1000, not"),
        (["--workers", "2", "--scheduler", ""], "--scheduler must be an address such as tcp:"),
        (["--estimators", "nobody"], "--estimators: estimator must be one of fdm, "),
        (
            ["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"],
            "--scheduler tcp://127.0.0.1:1 has workers",
        ),
        (["--set", "zwidth.stiffness_step_n_per_m=0"], "zwidth.stiffness_step_n_per_m must be a number of 1e-06"),
        (
            ["--set", "zwidth.stiffness_to_n_per_m=1e6"],
            "zwidth.stiffness_to_n_per_m must be at most controller.",
        ),
        (
            ["--set", "zwidth.damping_to_n_s_per_m=1.0"],
            "zwidth.damping_to_n_s_per_m must be at least zwidth.",
        ),
        (["--set", "zwidth.damping_step_n_s_per_m=1e-9"], "zwidth.damping_step_n_s_per_m must be at least 0.0294"),
        (["--set", "zwidth.stiffness_step_n_per_m=1e-3"], "zwidth.stiffness_step_n_per_m must be at least 10, 10000"),
        (
            ["--set", "controller.estimator=fdm"],
            "--set 'controller.estimator' must be absent (this command sets it): see",
        ),
        (
            ["--set", "wall.damping_n_s_per_m=1.0"],
            "--set 'wall.damping_n_s_per_m' must be absent (this command sets it)",
        ),
        (["--plot", "map.gif"], "--plot must end in .pdf or .png or .svg"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "zwidth", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_a_scene_of_a_file_need_not_be_there_any_more(tmp_path, map_of_one_thread):
    file = tmp_path / "mine.toml"
    file.write_text(read("seed-2011"))
    cases = [replace(case, source=str(file), text=read(str(file))) for case in CASES]
    file.unlink()
    maps = mapped(cases)
    assert [each.boundary for each in maps] == [each.boundary for each in map_of_one_thread]


INTERRUPTS = [("SIGINT", 1), ("SIGTERM", 2), *([("SIGINT", 2), ("SIGTERM", 1)] if LONG else ())]
"""Signals and numbers of workers: each of both, and every pair of them by `make soak`."""


@pytest.mark.parametrize(("number", "workers"), INTERRUPTS)
def test_an_interrupted_map_says_how_to_go_on(tmp_path, number, workers):
    (tmp_path / "numba").symlink_to(build_dir() / "numba")
    with started(HARDWALL, "zwidth", "--workers", workers, "--json", HARDWALL_BUILD=str(tmp_path)) as process:
        wait_until(lambda: len(stored(tmp_path)) > 1)
        # An interrupt of the terminal goes to all processes of its group.
        os.killpg(process.pid, signal.Signals[number])
        out, before, remark = ended_by(number, process)
        wait_until(lambda: session(process) == [])
    assert (out, "Traceback" in before) == ("", False)
    assert re.fullmatch(r"; (1 new result is|\d+ new results are) kept, and --resume goes on from there", remark)


def test_the_columns_of_the_table_that_need_it_are_explained():
    result = results.maps()
    headings = list(result.tables()[0].columns)
    said = [note.partition(":")[0] for note in result.notes()]
    columns = ["area", "of starts", "held", "in place", "to B", "islands", "undecided"]
    assert said[: len(columns)] == columns
    assert all(any(heading.startswith(word) for heading in headings) for word in columns)


def test_a_scene_without_a_grid_is_refused_before_there_is_a_pool():
    mapper = mapping.Mapper("fixed", 1, Store("zwidth"), pytest.fail, pytest.fail)
    with pytest.raises(SceneError, match=r"^mhz: zwidth is missing"):
        mapper("maps", [Case.of("mhz")])
    assert mapper.effort()[:2] == ("fixed", 0)
