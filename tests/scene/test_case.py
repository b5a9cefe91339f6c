"""What studies of maps share: grids with room, and cases that cannot be."""

import pytest

from hardwall.sim.scene.load import load, read
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.walls.case import Case, accepted, grid_of, room


def test_a_study_s_grid_is_three_times_as_large_on_a_controller_made_for_it():
    scene = load("seed-2011")
    wider = load("seed-2011", room(scene, 4.0))
    before, after = grid_of(scene), grid_of(wider)
    assert after.damping_from_n_s_per_m == before.damping_from_n_s_per_m
    assert (after.stiffness_to_n_per_m, after.damping_to_n_s_per_m) == (300e3, 900.0)
    assert (after.stiffness_step_n_per_m, after.damping_step_n_s_per_m) == (4e3, 24.0)
    assert (wider.controller.stiffness_max_n_per_m, wider.controller.damping_max_n_s_per_m) == (300e3, 900.0)


def test_a_controller_that_is_made_for_more_stays_as_it_is():
    scene = load("seed-2011", {"controller.stiffness_max_n_per_m": 1e6})
    assert room(scene, 1.0)["controller.stiffness_max_n_per_m"] == 1e6


def test_a_scene_without_steps_has_no_study():
    with pytest.raises(ValueError, match="mhz: zwidth is missing"):
        room(load("mhz"), 1.0)


def test_cases_that_cannot_be_are_left_out_unless_none_can():
    text = read("seed-2011")
    good, bad = (Case("", "seed-2011", text, {"handle.mass_kg": mass}) for mass in (1.0, -1.0))
    assert accepted({1: bad, 2: good, 3: bad}) == {2: good}
    assert accepted({}) == {}
    with pytest.raises(SceneError, match=r"handle\.mass_kg must be more than 0"):
        accepted({1: bad})
