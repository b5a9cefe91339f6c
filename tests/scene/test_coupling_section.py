"""The section `coupling`: what it makes of the axis and the tool, and a line for what does not fit."""

import pytest

from hardwall.sim.scene.build import sweep_of, tool_of, world_of
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.scene.tables import load_any
from hardwall.sim.studies import bench, drop, rates, rendered
from hardwall.sim.walls.grid import grid_of
from stimuli.scenes import COUPLING


def test_without_the_section_the_axis_has_no_moving_surface():
    scene = load("seed-2011")
    assert not scene.spec.coupling
    assert not {"wall_velocity", "wall_two_sided"} & scene.words.keys()
    assert scene.felt_n_per_m == scene.wall.stiffness_n_per_m


def test_the_axis_holds_the_handle_to_the_tool_and_the_tool_has_the_wall():
    scene = load("seed-2011", COUPLING | {"wall.stiffness_n_per_m": 60e3, "wall.forbid_pull": True})
    words = scene.words
    si = {word.name: word.to_si(words[word.name]) for word in scene.spec.design.words}
    assert si["wall_stiffness"] == pytest.approx(20e3, rel=1e-3)
    assert si["wall_damping"] == pytest.approx(10.0, rel=1e-3)
    held = {"wall_position": 0, "wall_velocity": 0, "wall_two_sided": 1, "wall_forbid_pull": 0, "wall_left": 0}
    assert words.items() >= held.items()
    tool = tool_of(scene, "fixed")
    assert (tool.period, tool.latency, tool.period_s, tool.ahead_s) == (10, 1, 1e-3, 0.0)
    assert (tool.wall_stiffness_n_per_m, tool.wall_damping_n_s_per_m, tool.forbid_pull) == (60e3, 20.0, True)
    assert tool.velocity_m_per_s == scene.spec.design.estimator.velocity.lsb * 1e-6 * 10e3
    assert (tool.stiffness_n_per_m, tool.damping_n_s_per_m) == (si["wall_stiffness"], si["wall_damping"])
    exact = tool_of(scene, "float")
    assert exact.velocity_m_per_s == pytest.approx(0.01)
    assert (exact.stiffness_n_per_m, exact.damping_n_s_per_m) == (20e3, 10.0)
    assert si["wall_stiffness"] != 20e3
    assert tool_of(load("seed-2011", COUPLING | {"coupling.delay_s": 1e-3}), "fixed").latency == 10
    assert scene.felt_n_per_m == pytest.approx(15e3)
    assert sweep_of(scene, world_of(scene), None) is None


def test_a_wall_of_a_tool_may_be_stiffer_than_any_word():
    stiff = {"wall.stiffness_n_per_m": 1e9, "wall.damping_n_s_per_m": 1e5, "zwidth.stiffness_to_n_per_m": 1e9}
    scene = load("seed-2011", COUPLING | stiff | {"zwidth.stiffness_step_n_per_m": 1e6})
    assert grid_of(scene).rows == 1000


OVERLAPPING = {"controller.sample_hz": 1_000_000, "controller.actuation_hz": 1_000_000, "amplifier": None}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"coupling.sample_hz": None}, "coupling.sample_hz is missing"),
        ({"coupling.stiffness_n_per_m": None}, "coupling.stiffness_n_per_m is missing"),
        ({"coupling.stiffness_n_per_m": 0.0}, "coupling.stiffness_n_per_m must be a number of 1e-06 to "),
        ({"coupling.stiffness_n_per_m": 300e3}, "coupling.stiffness_n_per_m must be 1.95313 .* to 200000 "),
        ({"coupling.stiffness_n_per_m": 1e-5}, "coupling.stiffness_n_per_m must be 1.95313 "),
        ({"coupling.damping_n_s_per_m": 500.0}, "coupling.damping_n_s_per_m must be 0, or .* to 400 "),
        ({"coupling.mass_kg": -1.0}, "coupling.mass_kg must be a number of 0 to 1000, not -1.0"),
        ({"coupling.sample_hz": 3000}, "coupling.sample_hz must be controller.sample_hz 10000 divided by a whole num"),
        ({"coupling.sample_hz": 20_000}, "coupling.sample_hz must be controller.sample_hz 10000 divided by a whole"),
        ({"coupling.delay_s": 1.1e-3}, "coupling.delay_s must be at most 0.001, one of the host's periods, not 0.0011"),
        ({"coupling.delay_s": 1.5e-4}, "coupling.delay_s must be a whole number of samples of 0.0001 s, not 0.00015"),
        ({"coupling.ahead_s": 0.0101}, "coupling.ahead_s must be at most 0.01, 10 of the host's periods, not 0.0101"),
        (OVERLAPPING, "controller.sample_hz must be at most 800000 beside a coupling, whose surface moves between a "),
        ({"coupling.tool": 1}, "coupling.tool is not a key of a scene; its section has stiffness_n_per_m"),
    ],
)
def test_what_does_not_fit_is_said_in_a_line(changes, told):
    with pytest.raises(SceneError, match=f"^seed-2011: {told}"):
        load("seed-2011", COUPLING | changes)


@pytest.mark.parametrize(
    ("study", "arguments"), [(bench.study, 1), (drop.study, 3), (rates.study, 3), (rendered.study, 6)]
)
def test_studies_of_what_the_axis_renders_refuse_a_coupling(study, arguments):
    with pytest.raises(SceneError, match=r"^seed-2011: coupling must be absent: "):
        study(Case.of("seed-2011", COUPLING), *[None] * arguments)


def test_several_axes_have_none():
    with pytest.raises(SceneError, match=r"^eight-axes: .*coupling"):
        load_any("eight-axes", COUPLING)
