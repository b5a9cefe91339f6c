"""What a wall renders: the jobs of a study, what is said of their results, and the command as it is called."""

import json
import math
from dataclasses import replace

import pytest

from hardwall.cli import rendered as command
from hardwall.sim.estimates import hardness, impedance
from hardwall.sim.scene.case import Case
from hardwall.sim.studies import rendered
from hardwall.sim.studies.rendered import Moving
from hardwall.sim.studies.rendered_setting import slow_hz
from hardwall.sim.walls import theory
from hardwall.sim.walls.methods import methods
from stimuli import results
from support.command_line import call

MOVING = Moving([5, 50, 600], 1e-4, [0.05, 0.2], 2e-3)
FEW = [
    "--rates",
    "1e3,1e4",
    "--frequencies",
    "20,600",
    "--speeds",
    "50",
    "--amplitude",
    "0.4",
    "--starts",
    "2",
    "--workers",
    "1",
]


def study_of(run, **changes) -> rendered.Rendered:
    curves = [methods()[name] for name in ("adjusted", "fdm-100")]
    case = Case.of("seed-2011", changes)
    return rendered.study(case, curves, [1_000, 1_000_000], MOVING, "fixed", 3, run)


def test_every_estimator_is_moved_at_every_rate_and_the_fastest_first():
    asked = []

    def run(title, function, jobs):
        asked.append((function, jobs))
        return [{"number": number} for number in range(len(jobs))]

    found = study_of(run, **{"wall.stiffness_n_per_m": 7e3})
    (waves_by, waves), (contacts_by, contacts) = asked
    assert (waves_by, contacts_by) == (impedance.measure, hardness.measure)
    rates = [Case("", job["scene"], job["text"], job["changes"]).scene.controller.sample_hz for job in waves]
    assert rates == sorted(rates, reverse=True)
    assert set(rates) == {1_000, 10_000, 1_000_000}
    assert {(job["backend"], job["starts"]) for job in (*waves, *contacts)} == {("fixed", 3)}
    assert {job["amplitude_m"] for job in waves} == {1e-4}
    assert {job["window_s"] for job in contacts} == {2e-3}
    names = [(each.curve.label, each.name) for each in found.settings]
    assert names == [
        (label, rate)
        for label in ("Levant u, adjusted gains", "FDM + 100 Hz")
        for rate in ("own rates", "1 kHz", "1 MHz")
    ]
    for each in found.settings:
        # 600 Hz is more than half of the force's rate of the scene, and of 1 kHz.
        assert list(each.waves) == ([5, 50, 600] if each.name == "1 MHz" else [5, 50])
        assert list(each.contacts) == [0.05, 0.2]
        for frequency_hz, result in each.waves.items():
            job = waves[result["number"]]
            assert job["frequency_hz"] == frequency_hz
            assert Case("", job["scene"], job["text"], job["changes"]).scene == each.scene
        spring = waves[each.spring["number"]]
        assert spring["frequency_hz"] == 5
        undamped = Case("", spring["scene"], spring["text"], spring["changes"]).scene
        assert undamped == each.scene.hitting(7e3, 0.0)
    assert found.scene.wall.stiffness_n_per_m == 7e3


def test_the_frequency_of_a_hand_is_the_nearest_of_those_that_there_are():
    assert slow_hz([1, 5, 10, 20]) == 10
    assert slow_hz([4, 30]) == 4
    assert slow_hz([3, 30]) == 30
    assert slow_hz([600]) == 600


def test_a_wave_is_rendered_up_to_the_first_frequency_that_is_not():
    setting = results.rendered_setting("adjusted", 10_000, MOVING, starts=2)

    def with_dampings(*pairs):
        waves = {
            frequency: setting.waves[frequency] | {"damping_n_s_per_m": list(pair)}
            for frequency, pair in zip(MOVING.frequencies_hz, pairs, strict=True)
        }
        return replace(setting, waves=waves).damping_to_hz

    assert with_dampings((18.1, 21.9), (20.0, 21.9), (18.1, 19.0)) == 600
    assert with_dampings((18.1, 21.9), (20.0, 22.1), (20.0, 20.0)) == 5
    assert with_dampings((17.9, 20.0), (20.0, 20.0), (20.0, 20.0)) is None
    assert setting.stiffness_to_hz is None


def test_the_damping_that_flips_is_where_the_line_through_two_dampings_is_zero():
    setting = results.rendered_setting("adjusted", 1_000, MOVING, starts=3)
    at_rest = setting.spring | {"damping_n_s_per_m": [-7.0, -6.0, -5.0]}
    moved = setting.waves | {5: setting.waves[5] | {"damping_n_s_per_m": [7.0, 9.0, 15.0]}}
    made = replace(setting, spring=at_rest, waves=moved)
    # From -7, -6 and -5 at B = 0 to 7, 9 and 15 at 20: it is 0 at 10, 8 and 5.
    assert made.lost_n_s_per_m == (6, 5, 7)
    assert made.flips_at_n_s_per_m == pytest.approx((8, 5, 10))
    less = setting.waves | {5: setting.waves[5] | {"damping_n_s_per_m": [7.0, 9.0, -5.5]}}
    assert replace(made, waves=less).flips_at_n_s_per_m is None
    assert replace(made, spring=None).flips_at_n_s_per_m is None
    undamped = replace(made, case=made.case.changed({"wall.damping_n_s_per_m": 0.0}))
    assert undamped.flips_at_n_s_per_m is None


def test_theory_stands_beside_linear_estimators_alone_and_the_exact_velocity_beside_all():
    report = results.rendered_walls().report()
    for row in report["rows"]:
        for wave in row["impedance"]:
            assert (wave["theory"]["stiffness_n_per_m"] is None) == (row["estimator"] == "levant")
            assert wave["exact_velocity"]["damping_n_s_per_m"] is not None
    setting = results.rendered_setting("fdm-100", 10_000, MOVING)
    whole = theory.impedance_n_per_m(setting.scene, 50)
    assert setting.expected(50, exact=False) == {
        "stiffness_n_per_m": whole.real,
        "damping_n_s_per_m": pytest.approx(whole.imag / math.tau / 50),
    }


def test_tables_have_a_line_a_setting_and_bands_where_starts_differ():
    found = results.rendered_walls()
    summary, stiffness, damping, hard, first = found.tables()
    assert {len(table.rows) for table in found.tables()} == {6}
    assert [row[:2] for row in summary.rows[:2]] == [
        ["Levant u, adjusted gains", "own"], ["Levant u, adjusted gains", "1"]
    ]  # fmt: skip
    assert list(damping.columns) == ["B_r of 20 N s/m", "kHz", "1 Hz", "50 Hz", "600 Hz"]
    assert list(hard.columns) == ["rate-hardness of 20 kN/m", "kHz", "50 mm/s", "200 mm/s"]
    # A spread of 15 to 15.3 of 20 is less than a fiftieth, and that of K is too.
    assert hard.rows[0][2:] == ["15.2", "15.2"]
    assert stiffness.rows[1][2] == "6.73"
    assert stiffness.rows[1][4] == ""
    wide = replace(found, settings=[results.rendered_setting("adjusted", 1_000, found.moving, starts=9)])
    assert wide.tables()[3].rows[0][2] == "15.6 (15 to 16.2)"
    assert first.rows[0][2:] == ["1.01, 1.01", "4.04, 1.01"]
    assert first.rows[-1][2:] == ["", "4.04, 1.01"]
    assert "Levant u, adjusted gains, own rates: force_limited" in found.notes()


def test_parts_behind_the_drive_are_said_to_be_left_out():
    plain = results.rendered_walls()
    assert not any("left out" in note for note in plain.notes())
    driven = replace(plain, scene=Case.of("drive-2011").scene)
    (said,) = [note for note in driven.notes() if "left out" in note]
    assert said.endswith("behind it: the lag of the amplifier, the motor, the cable")
    pulsed = Case.of("seed-2011", {"output": {"full_scale_n": 50.0, "pwm_carrier_hz": 20_000, "pwm_steps": 300}})
    (said,) = [note for note in replace(plain, scene=pulsed.scene).notes() if "left out" in note]
    assert said.endswith("behind it: the pulses of the output about their mean")


def test_report_tables_and_pictures(monkeypatch, capsys, tmp_path):
    picture = tmp_path / "rendered.svg"
    arguments = ["rendered", "--estimators", "fdm,kalman", *FEW]
    code, out, _ = call(monkeypatch, capsys, *arguments, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    names = [(row["estimator"], row["own_rates"], row["sample_hz"], row["actuation_hz"]) for row in report["rows"]]
    assert names == [
        (name, *rates)
        for name in ("fdm", "kalman")
        for rates in ((True, 10_000, 1_000), (False, 1_000, 1_000), (False, 10_000, 10_000))
    ]
    by_name = {(row["estimator"], row["sample_hz"], row["own_rates"]): row for row in report["rows"]}
    late, slow, fast = (by_name["fdm", rate, own] for rate, own in ((10_000, True), (1_000, False), (10_000, False)))
    # The scene's own force is a millisecond late and held for one; 10 kN/m take 15 N s/m of the damper. Counts may add
    # 1/400 of the stiffness over w, 0.2 N s/m, and a sine that is not its angle another 0.1 to 15.
    for row, taken in ((late, 15), (slow, 5), (fast, 0.5)):
        assert row["spring_takes_n_s_per_m"] == pytest.approx(taken, abs=0.3)
    # The damper's gain is 1, but for twice that of 20 N s/m, and for a cosine that is not 1 by 0.02 at most.
    for row in (slow, fast):
        assert row["negative_below_n_s_per_m"] == pytest.approx(row["spring_takes_n_s_per_m"], rel=0.05)
    assert [len(row["impedance"]) for row in (late, slow, fast)] == [1, 1, 2]
    for name, wanted in (("impedance", "B rendered (N s/m)"), ("contact", "hardness (kN/m)")):
        assert wanted in (tmp_path / f"rendered-{name}.svg").read_text()
    code, out, err = call(monkeypatch, capsys, *arguments)
    assert code == 0
    assert "K_r of 10" in out
    assert "rate-hardness: the force 2 ms after the contact" in " ".join(err.split())


def test_a_scene_that_lacks_parts_and_one_with_all_of_them_are_moved(monkeypatch, capsys):
    for scene in ("maglev", "desktop-arm", "drive-2011"):
        code, out, _ = call(
            monkeypatch, capsys, "rendered", scene, "--estimators", "fdm", "--rates", "1e4", "--frequencies", "20",
            "--starts", 1, "--workers", 1, "--json",
        )  # fmt: skip
        assert code == 0
        assert json.loads(out)["scene"] == scene


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing"], "scene must be one of "),
        (["--estimators", "nobody"], "--estimators: estimator must be one of fdm, "),
        (["--rates", "1e2"], "--rates must be whole numbers of 1000 to 1e+07 Hz, not '1e2'"),
        (["--rates", "3e3"], "seed-2011: controller.sample_hz must divide"),
        (["--frequencies", "0"], "--frequencies must be whole numbers of 1 to 10000 Hz, not '0'"),
        (["--frequencies", "1.5"], "--frequencies must be whole numbers of 1 to 10000 Hz, not '1.5'"),
        (["--frequencies", "1,nan"], "--frequencies must be whole numbers of 1 to 10000 Hz, not 'nan'"),
        (["--frequencies", ""], "--frequencies must be whole numbers of 1 to 10000 Hz, not ''"),
        (["--frequencies", ",".join(map(str, range(1, 102)))], "--frequencies must be at most 100 numbers, not 101"),
        (["--frequencies", "600", "--rates", "1e3"], "the fastest motion is a frequency of 600 Hz, which must be 1 to"),
        (["--speeds", "0"], "--speeds must be numbers of 0.1 to 10000 mm/s, not '0'"),
        (["--speeds", "fast"], "--speeds must be numbers of 0.1 to 10000 mm/s, not 'fast'"),
        (["--speeds", "5000"], "a speed of 5000 mm/s until 2 ms after the contact is a speed of 5 m/s, which must be"),
        (["--amplitude", "nan"], "--amplitude must be 1e-06 to 100 mm, not nan"),
        (["--amplitude", "50"], "an amplitude of 50 mm at 1 Hz is a way of 0.05 m, which must be 1e-06 to 0.0375"),
        (["--amplitude", "1"], "an amplitude of 1 mm at 400 Hz is a speed of 2.51327 m/s, which must be 0 to 2"),
        (["--window", "0"], "--window must be 0.01 to 100 ms, not 0.0"),
        (["--starts", "0"], "--starts must be a whole number of 1 to 10000, not '0'"),
        (
            ["--set", "controller.estimator=fdm"],
            "--set 'controller.estimator' must be absent (this command sets it): see",
        ),
        (["--set", "wall.damping_n_s_per_m=-1"], "seed-2011: wall.damping_n_s_per_m must be"),
        (["--backend", "gpu"], "--backend must be one of float, fixed, rtl, not 'gpu'"),
        (["--plot", "a.gif"], "--plot must end in .pdf or .png or .svg"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line_before_any_work(monkeypatch, capsys, arguments, message):
    for module in (impedance, hardness):
        monkeypatch.setattr(module, "measure", lambda **_: pytest.fail("it measures"))
    code, out, err = call(monkeypatch, capsys, "rendered", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"hardwall: error: {message}")
    assert err.count("\n") == 1


def test_the_defaults_are_those_of_the_study():
    assert command.FREQUENCIES_HZ[0] <= min(rendered.FREQUENCIES_HZ)
    assert max(rendered.FREQUENCIES_HZ) < min(rendered.RATES_HZ) / 2
