"""The gain from the sample rate: the cases, the ratios of their maps, the linear limits, and the command."""

import json

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.studies import rates
from hardwall.sim.walls import methods, theory
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.zwidth import Map
from stimuli.maps import Known
from stimuli.scenes import TWO_SECONDS
from support.command_line import call

CURVES = [methods.Curve("kalman", "kalman", "u"), methods.Curve("fdm", "fdm", "u")]
FEW = {
    "zwidth.damping_from_n_s_per_m": 30.0, "zwidth.damping_to_n_s_per_m": 30.0,
    "zwidth.damping_step_n_s_per_m": 10.0, "zwidth.stiffness_step_n_per_m": 25e3,
} | TWO_SECONDS  # fmt: skip


class OneWall(Known):
    """Maps of one wall, whose stiffnesses are given in turn; the cases are kept."""

    def __init__(self, stiffness):
        self.seen, self._values = [], iter(stiffness)

    def __call__(self, title, cases):
        self.seen.extend(cases)
        return [Map(case, [BoundaryPoint(10.0, k := next(self._values), k + 1)], 1, [True]) for case in cases]


def test_each_method_is_mapped_at_the_scene_s_rates_and_at_each():
    maps = OneWall([20e3, 100e3, 296e3, 300e3, 0.0, 50e3, 60e3, 40e3])
    case = Case.of("drive-2011", {"handle.coulomb_n": 0.2})
    kalman, fdm = rates.study(case, CURVES, [1_000, 10_000, 1_000_000], maps).gains
    seen = maps.seen
    controllers = [case.scene.controller for case in seen]
    assert [(c.estimator, c.sample_hz, c.actuation_hz) for c in controllers[:4]] == [
        ("kalman", 10_000, 1_000), ("kalman", 1_000, 1_000), ("kalman", 10_000, 10_000), ("kalman", 10**6, 10**6),
    ]  # fmt: skip
    assert {case.scene.handle.coulomb_n for case in seen} == {0.2}
    assert [case.scene.amplifier.delay_s for case in seen[:2]] == [1e-3, 0.0]
    assert (kalman.ratio, kalman.ends_at_hz) == (15.0, 10_000)
    assert (fdm.ratio, fdm.ends_at_hz) == (None, 10_000)
    assert json.loads(json.dumps(fdm.report()))["largest_stiffness_n_per_m"] == [50e3, 60e3, 40e3]


def test_each_part_lowers_the_linear_limit_and_without_any_it_grows_with_the_rate():
    limits = rates.linear_limits(Case.of("drive-2011"), [1_000, 100_000])
    whole, no_cable, no_lag, rigid = limits.values()
    for each in (no_cable, no_lag):
        assert whole[1] < each[1] < rigid[1]
    assert rigid[1] > 50 * rigid[0]
    assert whole[1] < 4 * whole[0]
    scene = load("seed-2011", rates.FINE | rates.SHORT | rates.at_rate(1_000) | {"controller.estimator": "fdm"})
    largest = max(theory.linear_limit_n_per_m(theory.Loop(scene), b) for b in range(10, 151, 20))
    assert rigid[0] == pytest.approx(largest, rel=1e-6), "the masses of handle and motor are those of the rigid device"


def test_a_map_that_k_leaves_has_no_ratio_and_no_end():
    within, clipped = BoundaryPoint(10.0, 50e3, 60e3), BoundaryPoint(10.0, 500e3, None)
    for own, last in ((clipped, within), (within, clipped)):
        maps = [Map(None, [each], 1, [True]) for each in (own, within, last)]
        gain = rates.Gain("fdm", [1_000, 10_000], maps[0], maps[1:])
        assert gain.ratio is None
        assert gain.report()["clipped"] == [False, last is clipped]
        assert (gain.ends_at_hz is None) == (last is clipped)


def test_without_a_cable_mass_and_friction_of_the_motor_are_the_handle_s():
    own = {"handle.mass_kg": 0.3, "handle.viscous_n_s_per_m": 0.25}
    side = {"transmission.motor_mass_kg": 0.125, "transmission.motor_viscous_n_s_per_m": 0.5}
    scene = load("drive-2011", own | side)
    moved = {"handle.mass_kg": 0.425, "handle.viscous_n_s_per_m": 0.75}
    assert rates.taken_out(scene, rates.CABLE) == rates.CABLE | moved
    assert rates.taken_out(scene, rates.LAG) == rates.LAG
    assert rates.taken_out(load("seed-2011"), rates.CABLE) == rates.CABLE


def test_report_and_picture(monkeypatch, capsys, tmp_path):
    picture = tmp_path / "rates.svg"
    words = [word for key, value in FEW.items() for word in ("--set", f"{key}={value}")]
    words += ["--estimators", "fdm", "--rates", "1e3,1e4", "--starts", 1, "--workers", 1]
    code, out, _ = call(monkeypatch, capsys, "rates", *words, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    assert report["methods"][0]["rates_hz"] == [1_000, 10_000]
    largest = report["methods"][0]["largest_stiffness_n_per_m"]
    assert 0 < largest[0] < largest[1] <= 500e3
    assert "largest stable stiffness K of the map (kN/m)" in picture.read_text()
    code, out, _ = call(monkeypatch, capsys, "rates", *words, "--resume")
    assert (code, "linear: rigid" in out) == (0, True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--rates", "0"], "--rates must be whole numbers of"),
        (["--rates", "3e3"], "controller.sample_hz must divide clock_hz 50000000, not 3000"),
        (
            ["--set", "controller.sample_hz=1000"],
            "--set 'controller.sample_hz' must be absent (this command sets it): see --rates",
        ),
        (["--estimators", "nobody"], "--estimators: estimator must be one of fdm, "),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "rates", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
