"""The monitors' words after reset against the scenes: what a scene does at its hit is no runaway."""

import pytest

from hardwall.model.axis import monitors
from hardwall.sim.scene import load
from stimuli.scenes import OF_ONE_AXIS


@pytest.mark.parametrize("name", OF_ONE_AXIS)
def test_no_hit_of_a_scene_is_a_runaway(name):
    scene = load.load(name)
    axis, protocol = scene.spec, scene.protocol
    # What the push has given the handle on its way, and gives it on, the drive at its limit takes: friction helps.
    way_m = protocol.push_n * abs(protocol.start_m) / (axis.force_max_n - protocol.push_n)
    words = monitors.Design(axis, axis.design.estimator).words
    runaway = next(word for word in words if word.name == "supervisor_runaway")
    assert way_m < runaway.to_si(runaway.reset)
