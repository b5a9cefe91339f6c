"""Speed against accuracy: the best points, the comparison with the reference, and the command."""

import json
from types import SimpleNamespace

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.studies import trade_runs
from hardwall.sim.studies.shortcuts import REFERENCE, Shortcut, shortcuts
from hardwall.sim.studies.trade import HIT, MAP, Point, Trade, best
from hardwall.sim.studies.trade_runs import AROUND, GRID, METHODS, study
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.grid import grid_of
from hardwall.sim.walls.zwidth import Map
from stimuli.command_line import call

EDGE = 22e3


class Invented:
    """Runs of a world with one rule: walls are stable up to 22 kN/m, with some shortcuts up to another stiffness."""

    def stable(self, stiffness, damping, changes, backend):
        times = 1.5 if "solver.step_s" in changes else 1.1 if backend == "float" else 1.0
        times *= 0.0 if "transmission" in changes and damping > 30 else 1.0
        return stiffness <= times * EDGE

    def maps(self, backend, cases):
        return [self._map(case, backend) for case in cases]

    def _map(self, case, backend):
        grid = grid_of(case.scene)
        step, points = grid.stiffness_step_n_per_m, []
        for damping in grid.dampings:
            stable = [row for row in range(1, grid.rows + 1) if self.stable(row * step, damping, case.changes, backend)]
            row = max(stable, default=0)
            points.append(BoundaryPoint(damping, row * step, None if row == grid.rows else (row + 1) * step))
        return Map(case, points, len(points) * grid.rows, [None] * len(points))

    def verdicts(self, jobs):
        return [
            {"verdict": "stable" if self.stable(*job["wall"], job["changes"], job["backend"]) else "unstable"}
            for job in jobs
        ]

    def medians(self, contestants, rounds):
        if rounds == 1:
            return {name: give() for name, give in contestants.items()}
        return {name: 0.1 if "solver" in name[0] else 0.2 for name in contestants}


@pytest.fixture
def hardware(monkeypatch):
    """Hits of any backend take 5 s and have the same words."""
    monkeypatch.setattr(
        trade_runs.hit, "run", lambda scene, backend, until_sure: SimpleNamespace(seconds=5.0, force_sha256="same")
    )


@pytest.fixture
def found(hardware):
    trade = study(Case.of("drive-2011"), Invented())
    return trade, {point.shortcut.label: point for point in trade.points}


def test_a_shortcut_is_held_against_the_reference(found):
    trade, points = found
    assert trade.walls == dict.fromkeys(METHODS, 5 * len(AROUND))
    reference = points[REFERENCE.label]
    assert (reference.differ, reference.errors) == (dict.fromkeys(METHODS, 0.0), {name: [0.0] * 5 for name in METHODS})
    assert reference.hit_s == pytest.approx(0.2)
    assert reference.map_s == pytest.approx(0.2 * reference.hits)
    stepped = points["steps of 100 µs"]
    assert stepped.errors == {name: [pytest.approx(0.5)] * 5 for name in METHODS}
    # With 33 kN/m as the limit, the last three of 16, 19, 21, 24, 26 and 32 kN/m become stable.
    assert stepped.differ == dict.fromkeys(METHODS, 0.5)
    assert stepped.hit_s == pytest.approx(0.1)
    assert points["float"].errors["adjusted"] == [pytest.approx(2 / 22)] * 5


def test_a_region_that_ends_is_wrong_by_all_of_k(found):
    assert found[1]["no cable"].errors["adjusted"] == [0.0, 0.0, 1.0, 1.0, 1.0]
    assert found[1]["no cable"].of_stiffness("adjusted") == {"median": 1.0, "largest": 1.0}


def test_steps_of_k_are_of_maps_alone(found):
    coarse, reference = found[1]["K by 5 kN/m"], found[1][REFERENCE.label]
    assert coarse.errors["adjusted"] == [pytest.approx(2 / 22)] * 5
    assert coarse.differ == reference.differ
    assert coarse.hit_s == reference.hit_s
    assert coarse.hits < reference.hits / 2


def test_the_hardware_has_the_verdicts_of_its_model(found):
    trade, points = found
    for label, model in (("rtl", REFERENCE.label), ("rtl, clock of 3 MHz", "clock of 3 MHz")):
        assert points[label].hit_s == 5.0
        assert (points[label].hits, points[label].errors) == (points[model].hits, points[model].errors)
    assert trade.words_checked == 2 * 2 * 2


def test_other_force_words_are_a_failure(monkeypatch):
    monkeypatch.setattr(
        trade_runs.hit, "run", lambda scene, backend, until_sure: SimpleNamespace(seconds=5.0, force_sha256=backend)
    )
    with pytest.raises(RuntimeError, match=r"^the RTL and the model differ in their force words: rtl, "):
        study(Case.of("drive-2011"), Invented())


def test_where_nothing_is_stable_there_is_nothing_to_compare(hardware, monkeypatch):
    monkeypatch.setattr(Invented, "stable", lambda *_: False)
    with pytest.raises(RuntimeError, match=r"^drive-2011: with adjusted no wall of the map is stable"):
        study(Case.of("drive-2011"), Invented())


def point(label, seconds, error, axis="parts", coarser=1):
    return Point(Shortcut(axis, label, {}, coarser=coarser), seconds, 1, seconds, {"fdm": error}, {"fdm": [0.0, error]})


def test_the_best_are_those_that_none_beats_in_both():
    points = [point("a", 3, 0.0), point("b", 2, 0.1), point("c", 2.5, 0.1), point("d", 1, 0.5), point("e", 2, 0.2)]
    found = best(points, lambda each: each.hit_s, lambda each: each.differ["fdm"])
    assert [each.shortcut.label for each in found] == ["d", "b", "a"]


def test_what_is_within_the_scatter_is_no_error():
    scatter = [point("heavier", 4, 0.05, "scatter"), point("lighter", 4, 0.12, "scatter")]
    points = [point("reference", 3, 0.0, "reference"), *scatter, point("b", 2, 0.1), point("d", 1, 0.5)]
    trade = Trade(load("drive-2011"), points, {"fdm": 9}, 0)
    for question in (HIT, MAP):
        assert trade.scatter(question, "fdm") == 0.12
        assert [each.shortcut.label for each in trade.best(question, "fdm")] == ["d", "b"]
    marks = [row["best_for_hits"] for row in trade.report()["settings"]]
    assert marks == [[], [], [], ["fdm"], ["fdm"]]


def test_every_shortcut_is_a_scene_of_its_own():
    def changed(shortcut):
        return load("drive-2011", GRID | shortcut.changes)

    scene = load("drive-2011", GRID)
    every = shortcuts(scene, lambda _: True)
    assert len({each.label for each in every}) == len(every) == 25
    scenes = {each.label: changed(each) for each in every}
    rigid = scenes["rigid handle only"]
    assert rigid.handle.mass_kg == pytest.approx(0.35)
    assert (rigid.transmission, rigid.motor, rigid.output) == (None, None, None)
    assert rigid.amplifier.bandwidth_hz is None
    assert rigid.amplifier.delay_s == 1e-3
    both = scenes["rigid handle only + steps of 100 µs"]
    assert both == rigid.model_copy(update={"solver": both.solver})
    assert scenes["samples at 2 kHz"].controller.actuation_hz == 1000
    fast = load("drive-2011", {"controller.actuation_hz": 10_000, "amplifier.delay_s": 0.0})
    slower = [each.changes for each in shortcuts(fast, lambda _: True) if each.axis == "rate"]
    assert {"controller.sample_hz": 5000, "controller.actuation_hz": 5000} in slower


def test_a_scene_that_lacks_a_part_has_no_shortcut_without_it(hardware):
    labels = [each.shortcut.label for each in study(Case.of("seed-2011"), Invented()).points]
    assert [label for label in labels if "no " in label or "rigid" in label] == []
    assert "steps of 10 µs" in labels
    assert "samples at 5 kHz + steps of 100 µs" in labels


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: zwidth.stiffness_step_n_per_m is missing"),
        (["--set", "solver.step_s=1e-5"], "--set 'solver.step_s' is what this command sets itself: it is one of the"),
        (["--set", "controller.output=u1"], "--set 'controller.output' is what this command sets itself: it takes two"),
        (["--plot", "trade.gif"], "--plot must end in .pdf or .png or .svg"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "trade", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


SMALL = {
    "zwidth.stiffness_step_n_per_m": 4e3,
    "zwidth.damping_to_n_s_per_m": 10.0,
    "protocol.settle_s": 2.0,
    "protocol.measure_s": 0.2,
}


def test_the_command_prints_and_draws_real_hits(monkeypatch, capsys, tmp_path):
    """The command runs with one estimator and few shortcuts, then again from the stored results."""
    few = (REFERENCE.label, "steps of 100 µs", "K by 2", "scatter")
    every = shortcuts(load("seed-2011", GRID | SMALL), lambda _: True)
    kept = [each for each in every if each.label.startswith(few) and "+" not in each.label]
    monkeypatch.setattr(trade_runs, "shortcuts", lambda scene, accepted: kept)
    monkeypatch.setattr(trade_runs, "METHODS", ("fdm-500",))
    picture = tmp_path / "trade.svg"
    set_ = [word for key, value in SMALL.items() for word in ("--set", f"{key}={value}")]
    order = ["trade", "seed-2011", *set_, "--workers", 1]
    code, out, err = call(monkeypatch, capsys, *order, "--json", "--plot", picture)
    assert code == 0, err
    report = json.loads(out)
    assert [row["label"] for row in report["settings"]] == [each.label for each in kept]
    assert report["settings"][0]["stiffness_error"] == {"fdm-500": {"median": 0.0, "largest": 0.0}}
    assert all(row["hit_s"] > 0 and row["map_hits"] > 0 for row in report["settings"])
    assert any(row["best_for_maps"] for row in report["settings"])
    wanted = {
        "hit": ("steps of 100 µs", "time of a hit (ms)", "verdicts that differ (%)", "FDM + 500 Hz"),
        "map": ("steps of 100 µs", "in one process (s)", "largest error of K (%)", "FDM + 500 Hz"),
    }
    for name, labels in wanted.items():
        text = (tmp_path / f"trade-{name}.svg").read_text()
        assert [label for label in labels if label not in text] == []
    monkeypatch.setattr("hardwall.sim.walls.zwidth.verdict", None)
    code, out, _ = call(monkeypatch, capsys, *order, "--resume")
    assert code == 0
    assert "steps of 100 µs" in out
