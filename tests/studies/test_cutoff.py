"""The best cutoff: the search on known areas, and the table and picture of measured areas."""

import json
import math

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load, names, read
from hardwall.sim.studies import cutoff
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.zwidth import Map
from stimuli import results
from stimuli.maps import Known
from support.command_line import call


def map_of(case: Case, area: float, leaves: bool = False) -> Map:
    """Return a map that has the given area."""
    first = BoundaryPoint(0.0, area, None if leaves else 2 * area)
    return Map(case, [first, BoundaryPoint(1.0, area, 1.0), BoundaryPoint(1.0, 0.0, 1.0)], 1, [None] * 3)


def cutoff_of(case: Case) -> float | None:
    gains = case.changes.get("controller.gains.butterworth")
    return gains and gains["cutoff_hz"]


class Areas(Known):
    """Maps whose areas are a function of the cutoff; None stands for no filter."""

    def __init__(self, area):
        self.area, self.calls = area, []

    def __call__(self, title: str, cases: list[Case]) -> list[Map]:
        self.calls.append([cutoff_of(case) for case in cases])
        return [map_of(case, self.area(cutoff_of(case))) for case in cases]


def staircase(cutoff_hz: float | None) -> float:
    """Return the height of a hill around 1200 Hz, in steps of a 50th of its height."""
    return 50 * math.exp(-(math.log(cutoff_hz / 1200) ** 2)) // 1 if cutoff_hz else 7.0


def test_the_top_of_a_staircase_is_found_between_the_sweep_s_cutoffs():
    known = Areas(staircase)
    (optimum,) = cutoff.study([Case.of("seed-2011")], known).optima
    sweep, *search = known.calls
    assert set(cutoff.PAPERS_HZ) < set(sweep)
    assert (min(sweep[:-1]), max(sweep[:-1]), sweep[-1]) == (30.0, 4000.0, None)
    assert [len(each) for each in search] == [1] * len(search)
    assert 2 < len(search) <= cutoff.EVALUATIONS
    assert optimum.best.area == 49 > max(staircase(each) for each in sweep[:-1])
    # 1000 and 1400 Hz are on the same step, and the lower one is taken.
    assert staircase(1000) == staircase(1400) == max(staircase(each) for each in sweep[:-1])
    assert all(700 < each < 1400 for (each,) in search)
    assert list(optimum.maps) == sorted({*sweep[:-1], *(each for (each,) in search)})
    assert (optimum.at_end, optimum.unfiltered.area) == (False, 7.0)


@pytest.mark.parametrize("top_hz", [1200.0, 433.0, 77.0])
def test_the_search_closes_in_on_the_top(top_hz):
    known = Areas(lambda cutoff_hz: 1e4 - 1e4 * math.log((cutoff_hz or 1.0) / top_hz) ** 2)
    (optimum,) = cutoff.study([Case.of("seed-2011")], known).optima
    assert optimum.best_hz == pytest.approx(top_hz, rel=cutoff.TOLERANCE)


def test_an_area_that_still_rises_where_the_rate_ends_is_said_to():
    (optimum,) = cutoff.study([Case.of("desktop-arm")], Areas(lambda cutoff_hz: cutoff_hz or 1e4)).optima
    assert (optimum.best_hz, optimum.at_end) == (400.0, True)
    assert optimum.report()["best_is_at_the_end"] is True


def test_nothing_stable_is_not_searched():
    known = Areas(lambda _: 0.0)
    (optimum,) = cutoff.study([Case.of("maglev")], known).optima
    assert (len(known.calls), optimum.best.area) == (1, 0.0)


def test_every_scene_is_swept_at_once_and_has_its_own():
    known = Areas(staircase)
    optima = cutoff.study([Case.of(name, {"handle.mass_kg": 0.5}) for name in cutoff.SCENES], known).optima
    assert [(each.scene.name, each.scene.handle.mass_kg) for each in optima] == [(name, 0.5) for name in cutoff.SCENES]
    assert len(known.calls[0]) == sum(len(each.maps) + 1 for each in optima) - len(known.calls[1:])


@pytest.mark.parametrize(
    ("areas", "low", "high"),
    [
        # The limits are a tenth of the way, in the logarithm, to half of the best area.
        ({100.0: 50, 200.0: 100, 400.0: 50}, 200 / 2**0.1, 200 * 2**0.1),
        ({100.0: 96, 200.0: 100, 400.0: 0}, 100.0, 200 * 2**0.05),
        ({100.0: 97, 150.0: 20, 200.0: 97, 300.0: 100, 400.0: 99}, 200 * 0.75 ** (2 / 77), 400.0),
    ],
)
def test_as_good_is_what_is_within_a_twentieth(areas, low, high):
    maps = {cutoff_hz: map_of(Case("", "seed-2011", "", {}), area) for cutoff_hz, area in areas.items()}
    optimum = cutoff.Optimum(load("seed-2011"), maps, maps[200.0])
    assert optimum.level_hz == pytest.approx((low, high), rel=1e-12)


def verdict(changes: dict, wall: tuple[float, float], **_) -> dict:
    """Return a verdict that is stable up to a stiffness, which rises with the cutoff to 450 Hz and falls above."""
    stiffness, _ = wall
    gains = changes.get("controller.gains.butterworth", {"cutoff_hz": 4e3})
    stable = stiffness < 100 * min(gains["cutoff_hz"], 900 - gains["cutoff_hz"])
    return results.verdict(stable)


def test_report_table_and_picture(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", verdict)
    picture = tmp_path / "cutoff.svg"
    few = "--set", "zwidth.damping_step_n_s_per_m=111.0"
    code, out, _ = call(monkeypatch, capsys, "cutoff", "seed-2011", *few, "--workers", 1, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    (device,) = report["devices"]
    areas = {each["cutoff_hz"]: each["area_n2_s_per_m2"] for each in device["maps"]}
    assert device["best_cutoff_hz"] in areas
    # The area is all of B, 6 to 894 N s/m, times a K halfway between steps of 2 kN/m, at most 45; 400 Hz has 39.
    assert device["best_area_n2_s_per_m2"] == max(areas.values())
    assert max(areas.values()) in [888 * stiffness for stiffness in (41e3, 43e3, 45e3)]
    assert (device["best_leaves_the_map"], device["unfiltered"]["area_n2_s_per_m2"]) == (True, 0)
    hits = sum(each["hits"] for each in device["maps"]) + device["unfiltered"]["hits"]
    assert (report["backend"], report["hits"]) == ("fixed", hits)
    text = picture.read_text()
    wanted = (
        "cutoff of the second-order",
        "area (kN/m N s/m)",
        "seed-2011: 0.35 kg, 0.1 N dry friction",
        "no filter: 0",
    )
    assert [label for label in wanted if label not in text] == []
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", None)
    code, out, _ = call(monkeypatch, capsys, "cutoff", "seed-2011", *few, "--workers", 1, "--resume")
    assert code == 0
    assert f"{max(areas.values()) / 1e3:.0f}+" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: zwidth is missing: a map needs its steps"),
        (["nothing"], f"scene must be one of {', '.join(names())}, or a .toml file, not 'nothing'"),
        (
            ["--set", "controller.estimator=fdm"],
            "--set 'controller.estimator' must be absent (this command sets it)",
        ),
        (
            ["--set", "wall.damping_n_s_per_m=1.0"],
            "--set 'wall.damping_n_s_per_m' must be absent (this command sets it)",
        ),
        (["--set", "handle.mass_kg=0"], "seed-2011: handle.mass_kg must be a number of 1e-06 to 1000, not 0"),
        (["--backend", "rtl"], "--backend must be one of float, fixed, not 'rtl'"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], "give it or --workers, not both"),
        (["--plot", "area.gif"], "--plot must end in .pdf or .png or .svg"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "cutoff", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_two_files_of_one_name_are_two_devices(tmp_path):
    """Their maps are told apart by their cases, not by their names."""
    paths = [tmp_path / folder / "device.toml" for folder in "ab"]
    for path, mass in zip(paths, ("0.35", "0.7"), strict=True):
        path.parent.mkdir()
        path.write_text(read("seed-2011").replace("mass_kg = 0.35", f"mass_kg = {mass}"))

    class OfMass(Known):
        def __call__(self, title: str, cases: list[Case]) -> list[Map]:
            return [map_of(case, 100 * case.scene.handle.mass_kg) for case in cases]

    optima = cutoff.study([Case.of(str(path)) for path in paths], OfMass()).optima
    assert [round(optimum.best.area) for optimum in optima] == [35, 70]
    assert [round(optimum.unfiltered.area) for optimum in optima] == [35, 70]
