"""Speed against accuracy: the best points, the comparison with the reference, and the command."""

import json
from types import SimpleNamespace

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.studies import shortcuts as settings
from hardwall.sim.studies.shortcuts import GRID, LACKED, METHODS, REFERENCE, Shortcut, shortcuts
from hardwall.sim.studies.trade import Point, Trade, best, study
from hardwall.sim.walls import hit
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.edge_shift import Move
from hardwall.sim.walls.grid import grid_of
from hardwall.sim.walls.zwidth import Map
from support.command_line import call

EDGE = 22e3


class Invented:
    """Runs of a world with one rule: walls are stable up to 22 kN/m, with some shortcuts up to another stiffness."""

    starts = 1

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

    def medians(self, contestants, rounds):
        if rounds == 1:
            return {name: give() for name, give in contestants.items()}
        return {name: 0.1 if "solver" in name[0] else 0.2 for name in contestants}


@pytest.fixture
def hardware(monkeypatch):
    """Hits of any backend take 5 s and have the same words."""
    monkeypatch.setattr(
        hit, "run", lambda scene, backend, until_sure: SimpleNamespace(seconds=5.0, force_sha256="same")
    )


@pytest.fixture
def found(hardware):
    trade = study(Case.of("drive-2011"), Invented())
    return trade, {point.shortcut.label: point for point in trade.points}


def test_a_shortcut_is_held_against_the_reference(found):
    trade, points = found
    assert trade.labels == list(METHODS)
    reference = points[REFERENCE.label]
    assert [(move.area, move.stiffness, move.moved) for move in reference.moves.values()] == [(1.0, 0.0, False)] * 2
    assert reference.hit_s == pytest.approx(0.2)
    assert reference.map_s == pytest.approx(0.2 * reference.hits)
    stepped = points["steps of 100 µs"]
    for move in stepped.moves.values():
        # 33 kN/m for 22, at each of four B.
        assert (move.area, move.stiffness, move.dampings) == (pytest.approx(1.5), pytest.approx(0.5), 4)
        assert move.moved
    assert stepped.moves["adjusted"].distance == pytest.approx(0.5)
    assert stepped.hit_s == pytest.approx(0.1)
    assert points["float"].moves["adjusted"].area == pytest.approx(24 / 22)


def test_a_region_that_ends_moves_by_all_of_k(found):
    move = found[1]["no cable"].moves["adjusted"]
    assert (move.stiffness, move.dampings) == (-1.0, 2)


def test_steps_of_k_are_of_maps_alone(found):
    coarse, reference = found[1]["K in steps of 5 kN/m"], found[1][REFERENCE.label]
    assert coarse.moves["adjusted"].area == pytest.approx(20 / 22)
    assert coarse.hit_s == reference.hit_s
    assert coarse.hits < reference.hits / 2


def test_the_hardware_has_the_verdicts_of_its_model(found):
    trade, points = found
    for label, model in (("rtl", REFERENCE.label), ("rtl, clock of 3 MHz", "clock of 3 MHz")):
        assert points[label].hit_s == 5.0
        assert (points[label].hits, points[label].moves) == (points[model].hits, points[model].moves)
    assert trade.words_checked == 2 * 2 * 2


def test_other_force_words_are_a_failure(monkeypatch):
    monkeypatch.setattr(
        hit, "run", lambda scene, backend, until_sure: SimpleNamespace(seconds=5.0, force_sha256=backend)
    )
    with pytest.raises(RuntimeError, match=r"^the RTL and the model differ in their force words: rtl, "):
        study(Case.of("drive-2011"), Invented())


def test_where_nothing_is_stable_there_is_nothing_to_compare(hardware, monkeypatch):
    monkeypatch.setattr(Invented, "stable", lambda *_: False)
    with pytest.raises(RuntimeError, match=r"^drive-2011: with adjusted no wall of the map is stable"):
        study(Case.of("drive-2011"), Invented())


def point(label, seconds, area, half=0.0, step=0.0):
    move = Move(area, area - half, area + half, step, 0.0, 0)
    return Point(Shortcut("parts", label, {}), seconds, 1, seconds, {"fdm": move})


def test_the_best_are_those_that_none_beats_in_both():
    points = [point("a", 3, 1.0), point("b", 2, 0.9), point("c", 2.5, 1.1), point("d", 1, 0.5), point("e", 2, 1.2)]
    found = best(points, lambda each: each.map_s, lambda each: each.moves["fdm"].distance)
    assert [each.shortcut.label for each in found] == ["d", "b", "a"]


def test_what_the_starts_or_a_step_do_not_tell_is_no_move_and_a_wide_interval_is_not_right():
    points = [point("reference", 3, 1.0), point("b", 2, 1.0, half=0.3), point("c", 1.5, 1.1, step=0.1)]
    points.append(point("d", 1, 0.5))
    rows = Trade(load("drive-2011"), points, 10, 0).report()["settings"]
    assert [row["moves"]["fdm"]["moved"] for row in rows] == [False, False, False, True]
    assert [row["best_for"] for row in rows] == [["fdm"], [], ["fdm"], ["fdm"]]


def test_an_interval_without_an_end_has_none_in_the_report():
    endless = Point(REFERENCE, 1, 1, 1, {"fdm": Move(1.0, 0.0, float("inf"), 0.1, 0.0, 0)})
    assert endless.report()["moves"]["fdm"]["area_ratio_high"] is None
    assert not endless.moves["fdm"].moved


def test_what_is_clipped_new_or_refused_is_said():
    new = Point(REFERENCE, 1, 1, 1, {"fdm": Move(1.3, 1.2, 1.4, 0.1, float("inf"), 2, clipped=True)})
    trade = Trade(load("drive-2011"), [new], 10, 0, {"with a hand": "it has one"})
    assert trade.tables()[0].rows[0][-2:] == ["* 1.30+ (1.20 to 1.40)!", "new at 2"]
    assert new.report()["moves"]["fdm"]["farthest_stiffness_change"] is None
    notes = " ".join(trade.notes())
    assert "not tried: with a hand, for it has one" in notes
    assert "+: a region goes on" in notes


def test_what_a_scene_refuses_is_kept_with_its_reason(found):
    reason = found[0].refused["with friction that bends"]
    assert reason.startswith("presliding")
    assert found[0].report()["refused"]["with friction that bends"] == reason


def test_a_map_of_one_damping_is_refused_before_a_hit(hardware):
    one = Case.of("drive-2011", {"zwidth.damping_to_n_s_per_m": 10.0})
    with pytest.raises(SceneError, match=r"^drive-2011: zwidth.damping_to_n_s_per_m must leave two values of B"):
        study(one, None)


def test_every_shortcut_is_a_scene_of_its_own():
    def changed(shortcut):
        return load("drive-2011", GRID | shortcut.changes)

    scene = load("drive-2011", GRID)
    every = shortcuts(scene, lambda _: True)
    assert len({each.label for each in every}) == len(every) == 34
    scenes = {each.label: changed(each) for each in every if each.label != "with friction that bends"}
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
    # It has dry friction, so no second one is tried; no amplifier, so one is; and no motor to put a resistor across.
    lacked = [label for label in labels if label.startswith("with ")]
    others = "with dry friction of 0.1 N", "with a resistor and 20 mF across the motor"
    assert lacked == [label for label in LACKED if label not in others]
    assert "steps of 10 µs" in labels
    assert "samples at 5 kHz + steps of 100 µs" in labels


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: zwidth.stiffness_step_n_per_m is missing"),
        (
            ["--set", "solver.step_s=1e-5"],
            "--set 'solver.step_s' must be absent (this command sets it): it is one of the",
        ),
        (
            ["--set", "controller.output=u1"],
            "--set 'controller.output' must be absent (this command sets it): it takes two",
        ),
        (["--starts", "4"], "--starts must be 5 or more, because fewer cannot tell a move from chance, not 4"),
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
    "zwidth.damping_to_n_s_per_m": 30.0,
    "protocol.settle_s": 2.0,
    "protocol.measure_s": 0.2,
}


def test_the_command_prints_and_draws_real_hits(monkeypatch, capsys, tmp_path):
    """The command runs with one estimator and few shortcuts, then again from the stored results."""
    few = (REFERENCE.label, "steps of 100 µs", "K in steps of 2", "scatter")
    every = shortcuts(load("seed-2011", GRID | SMALL), lambda _: True)
    kept = [each for each in every if each.label.startswith(few) and "+" not in each.label]
    monkeypatch.setattr(settings, "shortcuts", lambda scene, accepted: kept)
    monkeypatch.setattr(settings, "METHODS", ("fdm-500",))
    picture = tmp_path / "trade.svg"
    set_ = [word for key, value in SMALL.items() for word in ("--set", f"{key}={value}")]
    order = ["trade", "seed-2011", *set_, "--workers", 1, "--starts", 5]
    code, out, err = call(monkeypatch, capsys, *order, "--json", "--plot", picture)
    assert code == 0, err
    report = json.loads(out)
    assert [row["label"] for row in report["settings"]] == [each.label for each in kept]
    assert report["starts"] == 5
    assert report["settings"][0]["moves"]["fdm-500"]["area_ratio"] == 1.0
    assert all(row["hit_s"] > 0 and row["map_hits"] > 0 for row in report["settings"])
    assert any(row["best_for"] for row in report["settings"])
    text = picture.read_text()
    wanted = "area of the stable walls (1: the area with all parts)", "FDM + 500 Hz"
    assert [label for label in wanted if label not in text] == []
    # Only what moves an edge is drawn.
    assert any(each.label in text for each in kept[1:])
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", None)
    code, out, _ = call(monkeypatch, capsys, *order, "--resume")
    assert code == 0
    assert "steps of 100 µs" in out
