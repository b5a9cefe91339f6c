"""The section of a hand: published hands by name, what they do to a handle, and what is refused."""

import numpy as np
import pytest
from scipy.linalg import expm

from hardwall.sim.scene.build import device_of
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.hand_section import HANDS, OF_A_HAND
from hardwall.sim.scene.load import load
from hardwall.sim.world.linear import State
from stimuli.device_motion import moved
from stimuli.scenes import HAND

FREE = {"handle.coulomb_n": None}
NEEDED = f"a hand has {', '.join(OF_A_HAND)}"


@pytest.mark.parametrize("name", HANDS)
def test_a_published_hand_is_the_hand_of_its_figures(name):
    figures = {f"hand.{key}": HANDS[name][key] for key in OF_A_HAND} | {"hand.rest_m": 1e-3}
    by_name = device_of(load("seed-2011", {"hand.model": name, "hand.rest_m": 1e-3}))
    assert by_name == device_of(load("seed-2011", figures))
    assert by_name.hand is not None
    assert HANDS[name].keys() == {*OF_A_HAND, "grip", "source", "seen"}


@pytest.mark.parametrize("name", HANDS)
def test_a_published_hand_moves_the_handle_as_the_linear_system_does(name):
    """Under a steady push, against the exponential of the system's matrix, which is made here from the scene's keys."""
    push_n, seconds, rest_m = 1.5, 0.03, 2e-3
    scene = load("seed-2011", FREE | {"hand.model": name, "hand.rest_m": rest_m})
    mass, damper, spring = (HANDS[name][key] for key in OF_A_HAND)
    mass += scene.handle.mass_kg
    damper += scene.handle.viscous_n_s_per_m
    matrix = np.array([[0, 1, 0], [-spring / mass, -damper / mass, (push_n + spring * rest_m) / mass], [0, 0, 0]])
    position, velocity, _ = expm(seconds * matrix) @ [0.01, -0.2, 1.0]
    end = moved(device_of(scene), State(0.01, -0.2, (0.0, 0.0, 0.0), 0), push_n, seconds)
    assert (end.position_m, end.velocity_m_per_s) == pytest.approx((position, velocity), rel=1e-11)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hand.model": "nobody-1900"}, f"hand.model must be one of {', '.join(HANDS)}, not 'nobody-1900'"),
        (
            {"hand.model": "hogan-1989", "hand.mass_kg": 0.0},
            "hand.mass_kg must be absent, because hand.model is hogan-1989, which has its own",
        ),
        ({"hand.rest_m": 1e-3}, f"hand.mass_kg is missing: {NEEDED}, or is a published one by hand.model, one of"),
        (HAND | {"hand.damping_n_s_per_m": None}, f"hand.damping_n_s_per_m is missing: {NEEDED}, or is"),
    ],
)
def test_what_is_no_hand_is_refused(changes, message):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", changes)
    assert str(refusal.value).startswith(f"seed-2011: {message}")
