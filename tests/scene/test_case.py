"""A scene as a value: made once, hit many times, and left out where it is impossible."""

import pytest

from hardwall.sim.scene import case as cases
from hardwall.sim.scene.case import Case, accepted
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load, read


def test_cases_that_cannot_be_are_left_out_unless_none_can():
    text = read("seed-2011")
    good, bad = (Case("", "seed-2011", text, {"handle.mass_kg": mass}) for mass in (1.0, -1.0))
    assert accepted({1: bad, 2: good, 3: bad}) == {2: good}
    assert accepted({}) == {}
    with pytest.raises(SceneError, match=r"handle\.mass_kg must be a number of 1e-06 to 1000, not"):
        accepted({1: bad})


def test_a_scene_is_made_once_a_process_however_many_are_asked_for_it(monkeypatch):
    made, parse = [], cases.parse
    monkeypatch.setattr(cases, "parse", lambda *recipe: made.append(recipe) or parse(*recipe))
    changes = {"handle.mass_kg": 0.123}
    case = Case.of("seed-2011", changes, "a label")
    again = Case("another", case.source, case.text, dict(changes))
    assert again.scene is case.scene
    scene = case.hitting(5e3, 20.0)
    assert len(made) == 1
    assert scene == load("seed-2011", changes | {"wall.stiffness_n_per_m": 5e3, "wall.damping_n_s_per_m": 20.0})
    assert scene.words == load("seed-2011", changes | dict(zip(WALL, (5e3, 20.0), strict=True))).words
    assert scene.spec is case.scene.spec


WALL = "wall.stiffness_n_per_m", "wall.damping_n_s_per_m"


def test_what_a_hit_leaves_is_the_scene_s():
    case = Case.of("seed-2011", {WALL[0]: 7e3, WALL[1]: 3.0})
    assert case.hitting() == case.scene
    start = {"protocol.start_counts": 0.25, "protocol.start_periods": 0.75}
    assert case.hitting(start=(0.25, 0.75)) == load("seed-2011", {WALL[0]: 7e3, WALL[1]: 3.0, **start})


@pytest.mark.parametrize(
    ("hit", "message"),
    [
        (
            (-1.0, 2.0),
            "seed-2011: wall.stiffness_n_per_m must be 0, or 1.95313 (half of its word's LSB) to 200000 (what the "
            "controller is for), not -1.0",
        ),
        (
            (1e9, 2.0),
            "seed-2011: wall.stiffness_n_per_m must be 0, or 1.95313 (half of its word's LSB) to 200000 (what the "
            "controller is for), not 1000000000.0",
        ),
        (
            (1e3, 1e9),
            "seed-2011: wall.damping_n_s_per_m must be 0, or 0.003125 (half of its word's LSB) to 400 (what the "
            "controller is for), not 1000000000.0",
        ),
    ],
)
def test_a_hit_that_cannot_be_is_refused(hit, message):
    with pytest.raises(SceneError) as refusal:
        Case.of("seed-2011").hitting(*hit)
    assert str(refusal.value) == message


def test_changes_go_in_their_order_and_defaults_give_way():
    case = Case.of("seed-2011", {"handle.mass_kg": 0.5})
    assert case.with_defaults({"handle.mass_kg": 9.0, "handle.coulomb_n": 0.2}).changes == {
        "handle.mass_kg": 0.5,
        "handle.coulomb_n": 0.2,
    }
    gains = "controller.gains.levant"
    both = case.changed({gains: {"lambda_sqrt_m_per_s": 10.0, "alpha_m_per_s2": 20.0}}, "both")
    assert both.changed({f"{gains}.alpha_m_per_s2": 30.0}).scene.controller.gains.levant.alpha_m_per_s2 == 30.0
    with pytest.raises(SceneError, match=r"handle\.mass_kg must be a number of 1e-06 to 1000, not -1\.0 \(both\)$"):
        _ = both.changed({"handle.mass_kg": -1.0}).scene
