"""The grids of maps: large enough for a region to end on, with a controller made for them."""

import pytest

from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.walls.grid import grid_of, wider_grid
from stimuli.scenes import COUPLING


def test_a_study_s_grid_is_three_times_as_large_on_a_controller_made_for_it():
    scene = load("seed-2011")
    wider = load("seed-2011", wider_grid(scene, 4.0))
    before, after = grid_of(scene), grid_of(wider)
    assert after.damping_from_n_s_per_m == before.damping_from_n_s_per_m
    assert (after.stiffness_to_n_per_m, after.damping_to_n_s_per_m) == (300e3, 900.0)
    assert (after.stiffness_step_n_per_m, after.damping_step_n_s_per_m) == (4e3, 24.0)
    assert (wider.controller.stiffness_max_n_per_m, wider.controller.damping_max_n_s_per_m) == (300e3, 900.0)


def test_a_controller_that_is_made_for_more_stays_as_it_is():
    scene = load("seed-2011", {"controller.stiffness_max_n_per_m": 1e6})
    assert wider_grid(scene, 1.0)["controller.stiffness_max_n_per_m"] == 1e6


def test_the_words_of_a_coupling_stay_as_they_are():
    scene = load("seed-2011", COUPLING)
    wider = load("seed-2011", COUPLING | wider_grid(scene, 4.0))
    assert grid_of(wider).stiffness_to_n_per_m == 300e3
    assert wider.spec == scene.spec


def test_a_scene_without_steps_has_no_study():
    with pytest.raises(ValueError, match="mhz: zwidth is missing"):
        wider_grid(load("mhz"), 1.0)


def test_a_grid_is_limited_where_a_map_is_made_and_one_hit_does_not_ask():
    lower = load("seed-2011", {"controller.stiffness_max_n_per_m": 50e3})
    assert lower.spec.stiffness_max_n_per_m == 50e3
    refusal = r"^seed-2011: zwidth\.stiffness_to_n_per_m must be at most controller\.stiffness_max_n_per_m, 50000,"
    with pytest.raises(SceneError, match=refusal):
        grid_of(lower)
    assert grid_of(load("seed-2011", wider_grid(lower, 4.0))).stiffness_to_n_per_m == 300e3
