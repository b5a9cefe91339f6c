"""Files and changes of scenes that are refused: in a line, and at once."""

import math
import os
import re

import pytest

from hardwall.model.encoder.quadrature_speed import max_edge_rate
from hardwall.sim.scene import checks
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import BYTES_MAX, load, parse, read
from hardwall.sim.scene.schema import Scene
from hardwall.sim.scene.sentences import sections_of
from stimuli.scenes import OF_ONE_AXIS

SEED = read("seed-2011")
SEVEN_KHZ = {"controller.clock_hz": 14_000_000, "controller.sample_hz": 7000, "controller.actuation_hz": 7000}
MASS = {"controller.estimator": "kalman", "virtual_mass.most_kg": 0.2}
CABLE = {"transmission.stiffness_n_per_m": 2e5, "transmission.motor_mass_kg": 0.05}
PULSES = {"output.dac_bits": None, "output.pwm_carrier_hz": 60_000, "output.pwm_steps": 200}


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("handle.coulmb_n", "handle.coulmb_n is not a key of a scene; did you mean coulomb_n?"),
        ("handel.coulomb_n", "handel is not a key of a scene; did you mean handle?"),
        ("name", "name is not a key of a scene; its section has handle, "),
        ("handle.mass_kg.x", "handle.mass_kg.x is not a key of a scene: handle.mass_kg is no section"),
        ("handle.", "handle. is not a key of a scene; its section has mass_kg"),
        (".", " is not a key of a scene; its section has handle"),
    ],
)
@pytest.mark.parametrize("value", [None, 1.0])
def test_a_key_that_is_none_is_refused_whatever_its_value(key, value, said):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", {key: value})
    assert str(refusal.value).startswith(f"seed-2011: {said}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name = 'mine'\n" + SEED, "name is not a key of a scene: the name of the file is the scene's name"),
        (SEED.replace("mass_kg = 0.35", f"mass_kg = {'9' * 5000}"), "must be a readable TOML file: Exceeds the limit"),
        (SEED.replace("mass_kg = 0.35", f"mass_kg = {'9' * 4000}"), "handle.mass_kg must be a number of 1e-06 to 1000"),
        (SEED.replace("1.0 ", "[" * 5000 + "1" + "]" * 5000), "must be a readable TOML file: it is nested too deeply"),
        ("handle = 3", "handle must be a section, not 3"),
        ("handle = [[1]]", "handle must be a section, not [[1]]"),
        (
            SEED.replace("travel_m = 0.15", "travel_m = 'a\\nb'"),
            "controller.travel_m must be a number of 1e-12 to 1000",
        ),
    ],
)
def test_text_that_is_no_scene_is_refused_in_a_short_line(text, said):
    with pytest.raises(SceneError) as refusal:
        parse("seed-2011", text)
    assert str(refusal.value).startswith(f"seed-2011: {said}")
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 300


def test_a_scene_may_begin_with_a_byte_order_mark(tmp_path):
    """As editors on Windows write it."""
    for encoding in ("utf-8", "utf-8-sig"):
        (tmp_path / f"{encoding}.toml").write_text(SEED, encoding=encoding)
    one, other = (load(str(tmp_path / f"{encoding}.toml")) for encoding in ("utf-8", "utf-8-sig"))
    assert one.spec == other.spec


def test_a_file_that_is_no_regular_one_or_too_large_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "large.toml").write_text("#" * (BYTES_MAX + 1))
    for name, said in (("pipe", "not a regular file"), ("folder", "not a regular file"), ("large", "more than 1 MB")):
        with pytest.raises(
            SceneError, match=rf"^scene must be a readable \.toml file, not '{name}\.toml': it .*{said}$"
        ):
            load(f"{name}.toml")
    with pytest.raises(SceneError, match=f"^scene must be one of .* not '{'x' * 50}"):
        load("x" * 5000)
    with pytest.raises(SceneError, match=r"x\.\.\.: File name too long$"):
        load("x" * 5000 + ".toml")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"zwidth.damping_from_n_s_per_m": 1e6},
            "zwidth.damping_to_n_s_per_m must be at least zwidth.damping_from_n_s_per_m, 1e+06, not 300.0",
        ),
        (
            {"encoder.phase_error_counts": 0.7},
            "encoder.phase_error_counts and duty_error_counts must move each edge by less than 0.5 counts, not 0.7",
        ),
        (
            {"controller.slew_limit_n_per_s": 1e-9},
            "controller.slew_limit_n_per_s must be 0.5 (half of its word's LSB) to",
        ),
        (
            MASS | {"virtual_mass.in_wall_kg": 0.3},
            "virtual_mass.in_wall_kg must be 0, or 5e-06 (half of its word's",
        ),
        (MASS | {"virtual_mass.in_free_space_kg": -0.3}, "virtual_mass.in_free_space_kg must be 0, or 5e-06 (half of"),
        (
            MASS | {"virtual_mass.in_wall_kg": -1e-9},
            "virtual_mass.in_wall_kg must be 0, or 5e-06 (half of its word",
        ),
        (
            MASS | {"virtual_mass.most_kg": 0.35},
            "virtual_mass.most_kg must be less than handle.mass_kg, 0.35, not 0.35",
        ),
        (
            MASS | {"controller.estimator": "levant"},
            "virtual_mass.most_kg needs an estimator with an acceleration (kal",
        ),
        (MASS | CABLE, "virtual_mass.most_kg must be less than transmission.motor_mass_kg, 0.05, not 0.2"),
        ({"virtual_mass.in_wall_kg": 0.1}, "virtual_mass.most_kg is missing"),
        ({"passivity.damping_n_s_per_m": 1e7}, "passivity.damping_n_s_per_m must be 0, or 0.003125 (half of its"),
        ({"wall.stiffness_n_per_m": 1.0}, "wall.stiffness_n_per_m must be 0, or 1.95313 (half of its word's LSB) to"),
        ({"wall.stiffness_n_per_m": 10**400}, "wall.stiffness_n_per_m must be 0, or 1.95313 (half of its word's LSB)"),
        (
            {"protocol.settle_s": 100.0, "amplifier.delay_s": 101.0},
            "amplifier.delay_s must be at most protocol.settle_s, 100, not 101.0",
        ),
        (
            {"protocol.settle_s": 1e4, "amplifier.delay_s": 1e3},
            "amplifier.delay_s must be at most 100, 1000000 samples, not 1000.0",
        ),
        ({"controller.output": ""}, "controller.output must be one of u, u1, not ''"),
    ],
)
def test_keys_that_contradict_each_other_are_both_named(changes, said):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", changes)
    assert str(refusal.value).startswith(f"seed-2011: {said}")


def test_a_whole_number_may_be_written_as_a_float():
    clocks = {"controller.clock_hz": 24e6, "encoder.seed": 3.0, "output.dac_bits": 1.2e1, "output.full_scale_n": 40.0}
    scene = load("seed-2011", clocks)
    assert scene.controller.clock_hz == 24_000_000
    assert type(scene.controller.clock_hz) is int
    assert (scene.encoder.seed, scene.output.dac_bits) == (3, 12)
    for value, said in ((1.5, "1.5"), (math.inf, "inf"), (True, "True"), ("24e6", "'24e6'"), (2e9, "2000000000")):
        with pytest.raises(SceneError) as refusal:
            load("seed-2011", {"controller.clock_hz": value})
        accepted = "controller.clock_hz must be a whole number of 1 to 1e+09"
        assert str(refusal.value) == f"seed-2011: {accepted}, not {said}"


def test_a_run_is_too_long_only_by_what_its_scene_says(monkeypatch):
    """An axis may be so fast that the 20 s of a scene that says nothing are more samples than can be asked for."""
    monkeypatch.setattr(checks, "SAMPLES_MAX", 60_000)
    assert load("seed-2011").most_samples == 200_000
    with pytest.raises(
        SceneError, match=r"^seed-2011: protocol.longest_s must be at most 6, 60000 samples, not 20\.0$"
    ):
        load("seed-2011", {"protocol.longest_s": 20.0})


@pytest.mark.parametrize(
    ("scene", "changes", "key"),
    [
        ("desktop-arm", {}, "wall.damping_n_s_per_m"),
        ("mhz", {"controller.stiffness_max_n_per_m": 123456.7}, "wall.stiffness_n_per_m"),
    ],
)
def test_the_bounds_that_a_refused_wall_is_told_are_accepted(scene, changes, key):
    with pytest.raises(SceneError) as refusal:
        load(scene, changes | {key: 1e-12})
    least, most = re.search(r" must be 0, or (\S+) \(.*\) to (\S+) \(", str(refusal.value)).groups()
    for bound in (0.0, float(least), float(most)):
        load(scene, changes | {key: bound})


@pytest.mark.parametrize(
    ("key", "value", "changes"),
    [
        ("controller.speed_max_m_per_s", 2.0, {"encoder.duty_error_counts": 0.11, "encoder.phase_error_counts": 0.4}),
        ("controller.speed_max_m_per_s", 9.0, {"encoder.phase_error_counts": 0.1234567}),
        (
            "encoder.edge_error_counts",
            0.2,
            {"encoder.phase_error_counts": 0.1234567, "controller.speed_max_m_per_s": 0.2},
        ),
        ("solver.step_s", 1e-4, {"transmission.stiffness_n_per_m": 3.3e8}),
        ("encoder.glitches_hz", 1e8, {"encoder.glitch_s": 1e-7, **SEVEN_KHZ}),
        ("output.full_scale_n", 1e5, {"motor.voltage_limit_v": 23.7, **PULSES}),
    ],
)
def test_the_bound_that_a_refused_number_is_told_is_accepted(key, value, changes):
    scene = "drive-2011" if key.startswith(("solver.", "output.")) else "seed-2011"
    with pytest.raises(SceneError) as refusal:
        load(scene, changes | {key: value})
    bound = re.search(rf"{key} must be at most ([^ ,]+)", str(refusal.value)).group(1)
    load(scene, changes | {key: float(bound)})


def test_a_wall_of_very_many_digits_is_refused_in_a_short_line():
    with pytest.raises(SceneError, match=r", not 10{56}\.\.\.$"):
        load("seed-2011", {"wall.stiffness_n_per_m": 10**400})


@pytest.mark.parametrize("value", ["stiff", True, [1.0]])
def test_a_wall_that_is_no_number_is_told_the_range_of_its_key(value):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", {"wall.stiffness_n_per_m": value})
    assert str(refusal.value) == f"seed-2011: wall.stiffness_n_per_m must be a number of 0 to 1e+10, not {value!r}"


def test_every_number_has_a_range():
    def ends(schema: dict) -> list[dict]:
        inner = schema.get("anyOf", []) + ([schema["items"]] if "items" in schema else [])
        return [schema, *(each for part in inner for each in ends(part))]

    sections, found = list(sections_of(Scene).values()), 0
    while sections:
        section = sections.pop()
        sections += sections_of(section).values()
        for key, schema in section.model_json_schema()["properties"].items():
            for part in ends(schema):
                if part.get("type") in ("number", "integer"):
                    assert {"minimum", "maximum"} <= part.keys(), f"{section.__name__}.{key}"
                    found += 1
    assert found > 60


@pytest.mark.parametrize("name", OF_ONE_AXIS)
@pytest.mark.parametrize("errors", [0.0, 0.3])
def test_without_a_glitch_filter_given_it_is_the_longest_that_leaves_twice_the_speed(name, errors):
    scene = load(name, {"controller.glitch_clocks": None, "encoder.phase_error_counts": errors})
    glitch, rate = scene.glitch_clocks, scene.spec.edges_per_clock_max
    assert scene.words["encoder_glitch_clocks"] == glitch > 0
    assert max_edge_rate(1.0, glitch, errors) >= 2 * rate
    assert glitch == 15 or max_edge_rate(1.0, glitch + 1, errors) < 2 * rate
    assert scene.spec.glitch_clocks_at_reset == glitch
    assert load(name).glitch_clocks == 2
    # Until the first parameters are committed, the hardware has its reset words.
    assert load(name).spec.design.encode()["encoder_glitch_clocks"] == 2
