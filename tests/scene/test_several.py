"""A scene of several axes: the hardware that they share, and the words of each."""

import pytest

from hardwall.model.axes.axis import AxesSpec
from hardwall.sim.scene.load import load
from hardwall.sim.scene.schema import Scene
from hardwall.sim.scene.several import ABSENT, GAIN_WORDS, SHARED
from hardwall.sim.scene.tables import load_any


def test_all_axes_are_one_piece_of_hardware():
    scene = load_any("eight-axes")
    assert isinstance(scene.spec, AxesSpec)
    assert scene.spec.axes == 8
    assert all(each.spec is scene.spec for each in scene.axes[1:])
    assert scene.axes[0].spec == scene.spec


def test_an_axis_samples_in_its_turn_once_all_words_are_written():
    scene = load_any("eight-axes", {"controller.actuation_hz": 1_500_000})
    spec, first = scene.spec, scene.axes[0].timing
    clocks = spec.clocks_per_sample
    assert first.strobe % (spec.samples_per_actuation * clocks) == 0
    assert first.strobe >= clocks + spec.axes * len(spec.design.words) + 2
    assert [each.timing for each in scene.axes] == [first._replace(strobe=first.strobe + i) for i in range(8)]
    assert first[0] == clocks
    assert first[2] == spec.latency


@pytest.mark.parametrize("estimator", ["levant", "fdm", "window"])
def test_the_words_of_an_axis_are_those_of_a_scene_with_its_keys(estimator):
    """Formats follow from what is shared, so the words are the same unless gains are an axis's own."""
    changes = {"controller.estimator": estimator, "controller.output": None}
    changes |= {"controller.sample_hz": 2_000_000, "controller.actuation_hz": 1_000_000}
    scene = load_any("eight-axes", changes)
    for each in scene.axes[:7]:
        keys = {"handle": each.handle, "wall": each.wall, "protocol": each.protocol}
        sections = {name: section.model_dump(exclude_none=True) for name, section in keys.items()}
        own = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
        assert each.words == load("mhz", changes | own | {"controller.clock_hz": 96_000_000}).words


@pytest.mark.parametrize(
    ("estimator", "gains"),
    [("levant", {"lambda_sqrt_m_per_s": 20.0, "alpha_m_per_s2": 80.0}), ("window", {"window_s": 1e-4})],
)
def test_an_axis_has_gains_of_its_own_in_the_words_of_all(estimator, gains):
    own = {f"axis.grip.controller.gains.{estimator}.{key}": value for key, value in gains.items()}
    changes = {"controller.estimator": estimator, "controller.output": None}
    scene = load_any("eight-axes", changes | own)
    words = {word.name: word for word in scene.spec.design.words}
    base, grip = scene.axes[0], scene.axes[-1]
    for name, field in GAIN_WORDS.items():
        if field in gains:
            assert words[name].to_si(grip.words[name]) == pytest.approx(gains[field], rel=1e-3)
            assert grip.words[name] != base.words[name] == words[name].reset
    assert grip.parameters.keys() - base.parameters.keys() == {n for n, field in GAIN_WORDS.items() if field in gains}


def test_what_is_shared_are_keys_of_a_scene():
    for section, key in SHARED:
        assert key in Scene.model_fields[section].annotation.model_fields
    assert ABSENT.keys() <= Scene.model_fields.keys()
