"""The theory of a virtual mass: its period against the motion itself, its range against what is known."""

import math

import numpy as np
import pytest

from hardwall.sim.scene.load import load
from hardwall.sim.studies.rates import at_rate
from hardwall.sim.walls import theory
from hardwall.sim.walls.mass_theory import is_stable, period, stable_shares
from stimuli.lengths import some_of

DELAYS = [0.0, 0.4e-3, 1e-3, 2.3e-3]
WALL = 12e3, 31.0


def scene_of(delay_s: float, **changes):
    return load("seed-2011", {"amplifier.delay_s": delay_s} | changes)


def moved(scene, position: float, velocity: float, force: float, seconds: float) -> tuple[float, float]:
    """Return position and velocity after a time under a constant force, in closed form."""
    mass, viscous = scene.handle.mass_kg, scene.handle.viscous_n_s_per_m
    left, most = math.exp(-viscous / mass * seconds), force / viscous
    return position + most * seconds + (velocity - most) * mass / viscous * (1 - left), most + (velocity - most) * left


@pytest.mark.parametrize("share", [-0.4, 0.0, 0.3])
@pytest.mark.parametrize("delay_s", some_of(DELAYS, 2))
def test_a_period_is_the_motion_under_the_forces_that_act(delay_s, share):
    """A motion by its events: samples, and forces that come late; no state of theirs is shared."""
    scene = scene_of(delay_s)
    mass_kg, period_s = share * scene.handle.mass_kg, 1 / scene.controller.actuation_hz
    change, late = period(scene, *WALL, mass_kg), theory.delay_s(scene) / period_s
    position, velocity, force = 1e-3, -0.02, 0.0
    coming: list[tuple[float, float]] = []
    state = np.array([position, velocity, *[0.0] * (len(change) - 2)])
    for sample in range(40):
        viscous_n = scene.handle.viscous_n_s_per_m * velocity
        acceleration = (force - viscous_n) / scene.handle.mass_kg
        command = -(WALL[0] * position + WALL[1] * velocity + mass_kg * acceleration)
        coming.append((sample + late, command))
        now = float(sample)
        for when, sent in [event for event in coming if event[0] < sample + 1]:
            position, velocity = moved(scene, position, velocity, force, (when - now) * period_s)
            now, force = when, sent
        coming = [event for event in coming if event[0] >= sample + 1]
        position, velocity = moved(scene, position, velocity, force, (sample + 1 - now) * period_s)
        state = change @ state
        np.testing.assert_allclose(state[:2], [position, velocity], rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("delay_s", DELAYS)
def test_without_a_wall_every_mass_below_the_handles_is_stable(delay_s):
    scene = scene_of(delay_s)
    assert stable_shares(scene, 0.0, 0.0) == pytest.approx((-0.995, 0.995))
    for share in (-1.01, 1.01):
        assert not is_stable(scene, 0.0, 0.0, share * scene.handle.mass_kg)


def test_without_a_mass_it_is_the_linear_loop_of_a_fast_difference():
    """The boundary of `theory.Loop`, whose velocity is a difference of samples that are much faster than the force."""
    scene = load("seed-2011", {"controller.estimator": "fdm", "controller.sample_hz": 100_000})
    for damping in (10.0, 40.0, 90.0):
        limit = theory.linear_limit_n_per_m(theory.Loop(scene), damping)
        assert is_stable(scene, 0.97 * limit, damping, 0.0)
        assert not is_stable(scene, 1.03 * limit, damping, 0.0)


def test_a_faster_loop_allows_a_lighter_handle():
    own, fast = (stable_shares(load("seed-2011", changes), 40e3, 60.0) for changes in ({}, at_rate(100_000)))
    assert own is not None
    assert own[0] > 0
    assert fast == pytest.approx((-0.99, 0.995), abs=0.006)


def test_a_wall_that_no_mass_makes_stable_has_no_range():
    assert stable_shares(scene_of(1e-3), 190e3, 390.0) is None
