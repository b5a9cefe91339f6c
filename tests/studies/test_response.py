"""The response to a sine: its edges against its counts, and gains against what is known of filters and quantisers."""

import cmath
import json
import math

import pytest
import scipy

from hardwall.sim.estimates.motions import Sine
from hardwall.sim.scene.case import Case
from hardwall.sim.studies import response
from hardwall.sim.walls.methods import Curve
from stimuli.lengths import some_of
from support.command_line import call
from support.reports import check

SCENE = "seed-2011"
SAMPLE_HZ = 10_000
PLAIN = Curve("fdm", "fdm", "u")


def quotient(
    counts: float, hz: float, phase: float, place: float, backend="fixed", estimator="fdm", **changes
) -> complex:
    scene = Case.of(SCENE, {"controller.estimator": estimator} | changes).scene
    count_m = scene.encoder.count_m
    motion = Sine(place * count_m, counts * count_m, hz, phase / (math.tau * hz))
    found, flags = response.response(scene, backend, motion)
    assert not flags
    return found


def test_a_sine_within_a_count_shows_nothing():
    assert quotient(0.49, 20.0, 0.0, 0.5) == 0


@pytest.mark.parametrize("backend", ["fixed", "float"])
@pytest.mark.parametrize("hz", [20.0, 70.0, 333.0])
def test_a_finite_difference_has_the_response_of_one(backend, hz):
    """(1 - exp(-j w T)) / (j w T), but for the quantisation: 4 / pi of half a count at most, as of any square wave."""
    step = 1j * math.tau * hz / SAMPLE_HZ
    exact = (1 - cmath.exp(-step)) / step
    for amplitude in (50.0, 1000.0):
        found = quotient(amplitude, hz, 1.0, 0.3, backend)
        assert abs(found - exact) <= 2 / math.pi / amplitude


def test_a_few_counts_have_the_gain_of_a_quantiser():
    """A sine that is rounded to counts: 4 / (pi A) times the sum of sqrt(1 - ((2 i - 1) / (2 A))^2), for 2 i - 1 < 2 A.

    Source: Gelb, Vander Velde 1968, of the quantiser with uniform steps. A sample is late by a sample at most.
    """
    hz = 10.0
    late = math.tau * hz / SAMPLE_HZ
    for amplitude in (0.75, 1.2, 2.0, 3.7, 10.0):
        steps = range(1, math.floor(amplitude + 0.5) + 1)
        rounded = 4 / (math.pi * amplitude) * sum(math.sqrt(1 - ((i - 0.5) / amplitude) ** 2) for i in steps)
        # A place of half a count makes the floor a rounding.
        found = quotient(amplitude, hz, 0.7, 0.5)
        assert abs(found) == pytest.approx(rounded, abs=rounded * late)
        assert cmath.phase(found) == pytest.approx(0, abs=late)


def test_a_butterworth_has_the_response_of_scipy_s():
    hz, changes = 150.0, {"controller.gains.butterworth": {"cutoff_hz": 1000.0}}
    _, (filtered,) = scipy.signal.freqz(*scipy.signal.butter(2, 1000.0, fs=SAMPLE_HZ), worN=[hz], fs=SAMPLE_HZ)
    step = 1j * math.tau * hz / SAMPLE_HZ
    exact = filtered * (1 - cmath.exp(-step)) / step
    found = quotient(1000.0, hz, 0.2, 0.1, estimator="butterworth", **changes)
    # Its coefficients have 12 bits.
    assert abs(found - exact) <= 2 / math.pi / 1000 + 2**-10


def test_edges_reach_an_estimator_by_stamps():
    found = quotient(50.0, 20.0, 1.0, 0.3, estimator="edge-kalman")
    assert abs(found - 1) < 0.03


def test_a_filter_is_the_same_at_all_amplitudes_and_levant_is_not():
    every = response.cases(Case.of(SCENE), [PLAIN, Curve("levant u1", "levant", "u1")])
    rows = [response.respond(**job) for job in response.jobs(every, [200.0], [20.0, 200.0], 3, "fixed")]
    assert [row["estimator"] for row in rows] == ["fdm", "fdm", "levant", "levant"]
    few, many, near, far = (row["gain"] for row in rows)
    assert few == pytest.approx(many, abs=0.05)
    # Beyond its alpha, 50 m/s^2, the estimate is a triangle that the velocity has left behind.
    assert near > 0.9
    assert far < 0.3
    assert all(row["gain_from"] <= row["gain_to"] and row["flags"] == [] for row in rows)


IMPLICIT = {"controller.jerk_max_m_per_s3": 1e5}


@pytest.mark.parametrize("backend", some_of(["fixed", "float"], 0))
def test_an_implicit_levant_is_weak_at_a_few_counts_right_at_twenty_and_late_beyond_its_bound(backend):
    case = Case.of(SCENE, IMPLICIT)
    every = response.cases(case, [Curve("order 2", "levant-2-implicit", "z1")])
    few, some, many = (
        response.respond(**job) for job in response.jobs(every, [150.0], [2.0, 20.0, 500.0], 10, backend)
    )
    assert few["gain"] < 0.85
    assert abs(few["lead_deg"]) < 10
    assert some["gain"] == pytest.approx(1, abs=0.06)
    assert many["lead_deg"] < -90


def test_the_errors_of_the_encoder_are_the_scene_s():
    """Channel B off by 0.4 counts: every second edge is late, which an estimate of a slow sine of few counts shows."""
    perfect, off = (quotient(3.0, 20.0, 1.0, 0.3, **{"encoder.phase_error_counts": each}) for each in (0.0, 0.4))
    assert abs(perfect - off) > 0.01


def test_a_flag_that_was_raised_is_said():
    row = {"label": "fdm", "frequency_hz": 70.0, "amplitude_counts": 2.0, "gain": 1.0, "lead_deg": None}
    result = response.Responses([row | {"flags": ["velocity_saturated"]}], SCENE)
    assert result.notes() == ["*: a flag was raised: velocity_saturated"]
    assert result.tables()[0].rows == [["fdm", "2", "1.000*", "-"]]


def test_report_table_and_picture(monkeypatch, capsys, tmp_path):
    picture = tmp_path / "response.png"
    words = ["response", "--estimators", "fdm,levant:u1", "--frequencies", "200,70", "--amplitudes", "20,0.5"]
    words += ["--starts", 2, "--workers", 1]
    code, out, _ = call(monkeypatch, capsys, *words, "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    check("response", report)
    assert [(row["estimator"], row["amplitude_counts"], row["frequency_hz"]) for row in report["rows"]] == [
        (name, counts, hz) for name in ("fdm", "levant") for counts in (0.5, 20.0) for hz in (70.0, 200.0)
    ]
    assert picture.stat().st_size > 0
    code, out, _ = call(monkeypatch, capsys, *words)
    assert code == 0
    assert "gain" in out
    assert "levant u1" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--frequencies", "2600"], "--frequencies must be at most a quarter of the sample rate, 2500 Hz, not 2600"),
        (["--frequencies", "0.01"], "--frequencies must be at least 0.08 Hz at this rate, not 0.01"),
        (["--frequencies", "x"], "--frequencies must be numbers of 0.001 to 1e+07 Hz, not 'x'"),
        (["--amplitudes", "0.4"], "--amplitudes must be numbers of 0.5 to 100000 counts, not '0.4'"),
        (["--amplitudes", "1e4"], "--amplitudes must be at most 1591 counts at 200 Hz"),
        (["--estimators", "best"], "--estimators: estimator must be one of "),
        (["--set", "controller.output=u1"], "--set 'controller.output' must be absent (this command sets it)"),
        (["eight-axes"], "eight-axes: has several axes"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "response", *arguments)
    assert (code, out) == (2, "")
    assert message in err
