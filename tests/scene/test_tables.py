"""The tables `[[axis]]` of a scene: what each axis has of its own, and what is refused in a line."""

import pytest

from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load, parse, read
from hardwall.sim.scene.schema import Scene
from hardwall.sim.scene.several import AxesScene
from hardwall.sim.scene.tables import load_any, parse_axes

EIGHT = read("eight-axes")
MHZ = read("mhz")


def with_axes(*tables: str) -> str:
    """Return the text of mhz with tables of axes behind it."""
    return MHZ + "".join(f"\n[[axis]]\n{table}" for table in tables)


def test_an_axis_has_what_its_table_says_and_what_is_said_of_all():
    scene = load_any("eight-axes")
    assert isinstance(scene, AxesScene)
    axes = {each.axis: each for each in scene.axes}
    assert [each.number for each in scene.axes] == list(range(8))
    assert axes["grip"].handle.mass_kg == 0.05
    assert axes["grip"].wall.forbid_pull
    assert axes["forearm"].handle.mass_kg == 0.35
    assert axes["wrist-bend"].handle.coulomb_n == 0.1
    assert axes["wrist-bend"].wall.stiffness_n_per_m == 10e3
    assert axes["hand"].estimator_output == "u1"
    assert {each.name for each in scene.axes} == {scene.name} == {"eight-axes"}
    assert {each.samples for each in scene.axes} == {scene.samples}


def test_a_scene_without_tables_is_as_before():
    scene = load_any("mhz", {"handle.mass_kg": 0.5})
    assert type(scene) is Scene
    assert scene == load("mhz", {"handle.mass_kg": 0.5})


def test_a_change_is_of_every_axis_or_of_the_one_that_it_names():
    changes = {"wall.damping_n_s_per_m": 33.0, "axis.grip.wall.stiffness_n_per_m": 3e3, "axis.grip.hand.mass_kg": 0.1}
    changes |= {"axis.grip.hand.damping_n_s_per_m": 1.0, "axis.grip.hand.stiffness_n_per_m": 10.0}
    scene = load_any("eight-axes", changes)
    assert {each.wall.damping_n_s_per_m for each in scene.axes} == {33.0}
    assert [each.wall.stiffness_n_per_m for each in scene.axes if each.axis == "grip"] == [3e3]
    assert [each.axis for each in scene.axes if each.wall.stiffness_n_per_m == 3e3] == ["grip"]
    assert [each.axis for each in scene.axes if each.hand] == ["grip"]
    both = {"axis.grip.wall.damping_n_s_per_m": 7.0, "wall.damping_n_s_per_m": 33.0}
    assert [each.wall.damping_n_s_per_m for each in load_any("eight-axes", both).axes] == [33.0] * 7 + [7.0]
    assert load_any("eight-axes", {"axis.grip.wall.forbid_pull": None}).axes[-1].wall.forbid_pull is False


def test_a_key_may_be_in_every_table_and_not_at_the_top():
    text = MHZ.replace("[wall]\nstiffness_n_per_m = 10e3", "[wall]\nforbid_pull = true")
    walls = [f"name = '{name}'\nwall.stiffness_n_per_m = {k}" for name, k in (("a", 1e3), ("b", 2e3))]
    scene = parse_axes("mine.toml", text + "".join(f"\n[[axis]]\n{wall}" for wall in walls))
    assert [each.wall.stiffness_n_per_m for each in scene.axes] == [1e3, 2e3]
    with pytest.raises(SceneError, match=r"^mine\.toml: axis b: wall\.stiffness_n_per_m is missing$"):
        parse_axes("mine.toml", text + f"\n[[axis]]\n{walls[0]}\n[[axis]]\nname = 'b'")


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        (
            ["name = 'a'\nwall.stifness_n_per_m = 1.0"],
            "axis a: wall.stifness_n_per_m is not a key of a scene; did you me",
        ),
        (["name = 'a'\nmass_kg = 1.0"], "axis a: mass_kg is not a key of a scene"),
        (
            ["name = 'a'", "name = 'b'\nhandle.mass_kg = 0.0"],
            "axis b: handle.mass_kg must be a number of 1e-06 to 1000",
        ),
        (["name = 'a'", "name = 'b'\nhandle = 3"], "axis b: handle must be a section, not 3"),
        (
            ["name = 'a'\ncontroller.sample_hz = 1000"],
            "axis a: controller.sample_hz is shared by all axes, and stands in the sections at the top alone",
        ),
        (["name = 'a'\nencoder.count_m = 1e-6"], "axis a: encoder.count_m is shared by all axes"),
        (["name = 'a'\nprotocol.settle_s = 1.0"], "axis a: protocol.settle_s is shared by all axes"),
        (
            ["name = 'a'\nzwidth.damping_step_n_s_per_m = 1.0"],
            "axis a: zwidth must be absent: no map is made of several axes",
        ),
        (
            ["name = 'a'\ndrive.stage = 'pdm'"],
            "axis a: drive must be absent: the pipeline of several axes has no drive",
        ),
        (["name = 'a'\nwall.stiffness_n_per_m = 1e9"], "axis a: wall.stiffness_n_per_m must be 0, or 1.95313"),
        (
            ["name = 'a'", "name = 'b'\nprotocol.start_m = -1.0"],
            "axis b: protocol.start_m must be less than 0 and at le",
        ),
        (["name = 'a'", "name = 'b'\ncontroller.output = 'u7'"], "axis b: controller.output must be one of u, u1"),
        (
            ["name = 'a'", "name = 'b'\ncontroller.gains.levant = {lambda_sqrt_m_per_s = 1e3, alpha_m_per_s2 = 50.0}"],
            "axis b: controller.gains.levant.lambda_sqrt_m_per_s must be 1.95313 to 124.998",
        ),
        (
            ["name = 'a'", "name = 'b'\ncontroller.gains.levant = {lambda_sqrt_m_per_s = 1e-9, alpha_m_per_s2 = 50.0}"],
            "axis b: controller.gains.levant.lambda_sqrt_m_per_s must be 1.95313 to 124.998",
        ),
        (
            ["name = 'a'", "name = 'b'\ncontroller.gains.levant.alpha_m_per_s2 = -1.0"],
            "axis b: controller.gains.levant.al",
        ),
        (["wall.stiffness_n_per_m = 1.0"], "name of axis number 1 must be 1 to 40 letters, digits, - and _, not None"),
        (["name = 'a'", "name = 'a.b'"], "name of axis number 2 must be 1 to 40 letters, digits, - and _, not 'a.b'"),
        (["name = 'a'", "name = 'a'"], "name of axis number 2 must be another than those before, not 'a'"),
        ([f"name = 'a{number}'" for number in range(33)], "axis must be 1 to 32 tables, not 33"),
    ],
)
def test_what_is_wrong_with_an_axis_is_said_in_a_line_that_names_it(tables, said):
    with pytest.raises(SceneError) as refusal:
        parse_axes("mine.toml", with_axes(*tables))
    assert str(refusal.value).startswith(f"mine.toml: {said}")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (EIGHT.replace("mass_kg = 0.35", "mass_kg = 0.0"), "handle.mass_kg must be a number of 1e-06 to 1000, not 0.0"),
        (EIGHT.replace("[handle]", "[handel]"), "handel is not a key of a scene; did you mean handle?"),
        (
            EIGHT.replace("6_000_000\nact", "12_000_000\nact"),
            "controller.sample_hz must leave 14 clocks for 8 axes in tu",
        ),
        (EIGHT.replace("clock_hz = 96_000_000\n", ""), "controller.clock_hz is missing"),
        ("axis = 3\n" + MHZ, "axis must be tables, each under [[axis]], not 3"),
        ("axis = []\n" + MHZ, "axis must be 1 to 32 tables, not 0"),
        ("axis = [3]\n" + MHZ, "axis must be tables, each under [[axis]], not [3]"),
        ("number = 3\n" + EIGHT, "number is not a key of a scene"),
        (
            EIGHT.replace("[protocol]", "[zwidth]\n[protocol]"),
            "zwidth must be absent beside [[axis]]: no map is made of",
        ),
    ],
)
def test_what_is_wrong_with_all_axes_names_none(text, said):
    with pytest.raises(SceneError) as refusal:
        parse_axes("mine.toml", text)
    assert str(refusal.value).startswith(f"mine.toml: {said}")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        (
            "axis.gripp.wall.damping_n_s_per_m",
            1.0,
            "'axis.gripp.wall.damping_n_s_per_m' names no axis of this scene: its axes",
        ),
        ("axis", 1.0, "'axis' names no axis of this scene: its axes are base, shoulder"),
        ("axis.grip", 1.0, "'axis.grip' must be followed by a key of a scene"),
        ("axis.grip.wall.damping", 1.0, "axis grip: wall.damping is not a key of a scene; its section has stiff"),
        ("axis.grip.controller.clock_hz", 1, "axis grip: controller.clock_hz is shared by all axes"),
        ("controller.estimator", "kalman", "controller.estimator must be one of fdm, levant, window, not 'kalman'"),
        (
            "drive.stage",
            "pdm",
            "drive must be absent beside [[axis]]: the pipeline of several axes has no drive stages",
        ),
    ],
)
def test_changes_that_are_of_no_axis_are_refused(key, value, said):
    with pytest.raises(SceneError) as refusal:
        load_any("eight-axes", {key: value})
    assert str(refusal.value).startswith(f"eight-axes: {said}")


def test_who_takes_one_axis_refuses_several():
    for refused in (lambda: load("eight-axes"), lambda: parse("mine.toml", with_axes("name = 'a'"))):
        with pytest.raises(SceneError, match=r"^\S+: has several axes, \[\[axis\]\], which `hardwall hit` takes; "):
            refused()
