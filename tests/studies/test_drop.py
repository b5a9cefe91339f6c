"""The drop at the end of a region: measurements on walls with known answers, real hits, and the printed tables."""

import json
import math

import numpy as np
import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load, read
from hardwall.sim.studies import drop
from hardwall.sim.studies.drop_result import Drop, Law
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.chatter import Chatter
from hardwall.sim.walls.mapping import Effort
from hardwall.sim.walls.methods import methods
from hardwall.sim.walls.zwidth import Map
from stimuli import results
from stimuli.scenes import ODD
from support.command_line import call

NOTHING = Effort("fixed", 0, 0.0)


def strike(scene: str, text: str, changes: dict, damping: float, start: int, backend: str) -> dict:
    """Return a hit by a rule: three of four hits rest up to B = 1000 times the friction, and all up to half of that B.

    No hit rests under 10 N s/m. All hits are stable up to a B that grows with K.
    """
    friction = changes.get("handle.coulomb_n", 0.1)
    rests = 10 < damping < (1000 if start % 4 else 500) * friction
    stable = damping < changes["wall.stiffness_n_per_m"] / 100
    return {"rests": rests, "stable": stable, "rms_m": 0.0 if rests else 1e-5}


def verdict(changes: dict, wall: tuple[float, float], **_) -> dict:
    """Return a verdict that is stable up to 40 kN/m and up to B = 100 N s/m, for Kalman up to 200."""
    stiffness, damping = wall
    stable = stiffness <= 40e3 and damping <= (200 if changes["controller.estimator"] == "kalman" else 100)
    return results.verdict(stable)


def at_rest(scene, backend: str) -> Chatter:
    """Return the chatter: Levant's u swings by 2 mm/s, and all other estimates stand still."""
    swing = np.full(8, 2e-3 if (scene.controller.estimator, scene.estimator_output) == ("levant", "u") else 0.0)
    return Chatter(-swing / 2, swing / 2)


def test_the_chatter_shakes_the_handle_where_the_force_sees_both_sides_of_it():
    text, adjusted = read("seed-2011"), methods()["adjusted"].changes
    wall = adjusted | {"wall.stiffness_n_per_m": 5e3}
    hidden, seen = (drop.strike("seed-2011", text, wall | rates, 60.0, 0, "fixed") for rates in ({}, ODD))
    assert hidden["rests"]
    assert hidden["stable"]
    assert not seen["rests"]
    assert seen["rms_m"] > 1e-6
    assert drop.strike("seed-2011", text, wall | ODD, 5.0, 0, "fixed")["rests"]
    # A handle that is shaken by less than the threshold is stable but not at rest.
    proposed = methods()["proposed"].changes | {"wall.stiffness_n_per_m": 30e3}
    shaken = drop.strike("seed-2011", text, proposed, 90.0, 0, "fixed")
    assert (shaken["rests"], shaken["stable"]) == (False, True)
    # A handle that friction keeps from ever moving has not come to rest in the wall.
    held = wall | {"handle.coulomb_n": 1.0}
    assert not drop.strike("seed-2011", text, held, 10.0, 0, "fixed")["rests"]


def test_report_table_and_picture(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("hardwall.sim.studies.drop.strike", strike)
    monkeypatch.setattr("hardwall.sim.studies.drop.at_rest", at_rest)
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", verdict)
    picture = tmp_path / "drop.svg"
    code, out, err = call(monkeypatch, capsys, "drop", "--workers", 1, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    measured = {(each["method"], each["factor"], each["value"]): each["measured_n_s_per_m"] for each in report["laws"]}
    # The search halves the logarithm of the range from 3 to 400 five times.
    step = (400 / 3) ** (1 / 32)
    for friction, value in ((0.03, "x 0.3"), (0.05, "x 0.5"), (0.2, "x 2"), (0.3, "x 3")):
        found = measured["proposed", "Coulomb friction", value]
        assert found / step < 1000 * friction < found * step
    for key, value in measured.items():
        assert key[1] == "Coulomb friction" or value / step < 100 < value * step
    predicted = {(each["method"], each["value"]): each["predicted_n_s_per_m"] for each in report["laws"]}
    assert predicted["proposed", ""] == predicted["adjusted", ""] == pytest.approx(2 * 0.1 / 2e-3)
    assert predicted["proposed", "x 0.3"] == pytest.approx(30)
    assert predicted["kalman", ""] is None
    ends = {(each["method"], each["stiffness_n_per_m"]): each for each in report["ends"]}
    assert len(ends) == 2 * len(drop.STIFFNESSES_N_PER_M)
    for (_, stiffness), each in ends.items():
        tried = drop.ENDS_N_S_PER_M
        assert each["rests_n_s_per_m"] == tried[tried < 100].max()
        assert each["stable_n_s_per_m"] == tried[tried < stiffness / 100].max()
    kalman, adjusted = report["methods"]["kalman"], report["methods"]["adjusted"]
    # In steps of 24 N s/m from 6 on, the last stable B are 198 and 78; the next step has no stable wall. In steps of 4
    # kN/m, the edge is halfway to 44.
    assert adjusted["area_n2_s_per_m2"] == pytest.approx((78 - 6 + 12) * 42e3)
    assert kalman["of_papers_best"] == pytest.approx((198 - 6 + 12) / (78 - 6 + 12))
    assert kalman["before_the_end"] == 1.0
    wanted = {
        "rest": ("damping B of the wall (N s/m)", "shaken, by more than 3 µm"),
        "law": ("predicted: the handle rests up to B (N s/m)", "measured in the loop: B (N s/m)"),
        "ends": ("stiffness K of the wall (kN/m)", "stable up to here"),
        "maps": ("stiffness K (kN/m)", "Kalman ("),
    }
    for name, labels in wanted.items():
        path = tmp_path / f"drop-{name}.svg"
        assert f"picture: {path}" in err.replace("\n", "")
        text = path.read_text()
        assert [label for label in labels if label not in text] == []
    monkeypatch.setattr("hardwall.sim.studies.drop.strike", None)
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", None)
    code, out, _ = call(monkeypatch, capsys, "drop", "--workers", 1, "--resume")
    assert code == 0
    assert "Coulomb friction x 2" in out


@pytest.mark.parametrize(
    ("stiffnesses", "part"),
    [
        ([40, 50, 10, 0], 1.0),
        ([50, 30, 20, 10, 0], 0.4),
        ([50, 30, 20, 10], None),
        ([50, 0], None),
        ([0], None),
    ],
)
def test_k_before_the_end_is_that_of_the_last_wall_but_one(stiffnesses, part):
    case = Case("", "seed-2011", "", {})
    boundary = [BoundaryPoint(10.0 * n, 1e3 * k, None) for n, k in enumerate(stiffnesses)]
    found = Map(case, boundary, 1, [None] * len(boundary))
    assert Drop(load("seed-2011"), {}, [], [], [], {"adjusted": found}, NOTHING).before_the_end("adjusted") == part


def test_agreement_leaves_out_what_has_no_end():
    pairs = ((10.0, 20.0), (10.0, math.inf), (math.inf, 5.0), (10.0, 0.0), (40.0, 20.0))
    laws = [Law("mass", "x 2", "proposed", *pair) for pair in pairs]
    assert Drop(load("seed-2011"), {}, [], [], laws, {}, NOTHING).agreement() == pytest.approx(
        [0.5, 0.875, 1.25, 1.625, 2.0]
    )
    assert Drop(load("seed-2011"), {}, [], [], [], {}, NOTHING).agreement() == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: zwidth is missing: a map needs its steps"),
        (["--set", "handle.coulomb_n="], "seed-2011: handle.coulomb_n must be more than 0: no friction holds"),
        (
            ["--set", "controller.estimator=fdm"],
            "--set 'controller.estimator' must be absent (this command sets it)",
        ),
        (
            ["--set", "wall.damping_n_s_per_m=1.0"],
            "--set 'wall.damping_n_s_per_m' must be absent (this command sets it)",
        ),
        (["--backend", "rtl"], "--backend must be one of float, fixed, not 'rtl'"),
        (["--plot", "drop.gif"], "--plot must end in .pdf or .png or .svg"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "drop", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
