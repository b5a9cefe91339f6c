"""The bound on the acceleration from a hit: its report, its gains, its picture, and refused input."""

import json
import math

import pytest

from hardwall.sim.studies.lipschitz import least_alpha_m_per_s2
from support.command_line import call, said


def test_report_and_picture(monkeypatch, capsys, tmp_path):
    picture = tmp_path / "fit.svg"
    code, out, _ = call(monkeypatch, capsys, "lipschitz", "--json", "--plot", picture)
    assert code == 0
    report = json.loads(out)
    bound = report["c_m_per_s2"]
    assert 0 < bound < report["true_peak_m_per_s2"]
    assert len(report["amplitudes_mm"]) == 7
    assert len(report["frequencies_hz"]) == report["sines"] == 7
    assert report["proposed_lambda_sqrt_m_per_s"] == math.sqrt(bound)
    assert report["proposed_alpha_m_per_s2"] == 1.1 * bound
    text = picture.read_text()
    wanted = (
        "position (mm)",
        "velocity (mm/s)",
        "acceleration (m/s²)",
        "time after the contact (ms)",
        "recorded counts",
    )
    assert [label for label in wanted if label not in text] == []


def test_a_longer_record_gives_a_smaller_bound(monkeypatch, capsys):
    """The same seven sines must cover a longer motion: this is the finding that the module states."""
    bounds = []
    for before, after in ((0.05, 0.2), (0.1, 0.4), (0.3, 0.7)):
        _, out, _ = call(monkeypatch, capsys, "lipschitz", "--json", "--before", before, "--after", after)
        bounds.append(json.loads(out)["c_m_per_s2"])
    assert bounds[0] > 1.5 * bounds[1] > 2 * bounds[2]


def test_a_record_beyond_the_run_is_remarked_on(monkeypatch, capsys):
    remarks = []
    for options in ((), ("--before", 0.3, "--after", 5.4), ("--before", 0.6), ("--before", 1e6, "--after", 1e6)):
        code, _, err = call(monkeypatch, capsys, "lipschitz", *options)
        assert code == 0
        remarks.append([line for line in err.splitlines() if line.startswith("--")])
    before = "--before {}: the run has 0.5494 s before the contact, and all of it is taken"
    after = "--after 1e+06: the run has 5.4506 s after the contact, and all of it is taken"
    assert remarks == [[], [], [before.format("0.6")], [before.format("1e+06"), after]]


def test_the_least_alpha_satisfies_the_condition_just():
    """In the paper, lambda 500 mm^(1/2)/s with C = 12 m/s^2 needs an alpha of 17.7 m/s^2 or more."""
    square = 250.0
    alpha = least_alpha_m_per_s2(math.sqrt(square), 12.0)
    assert alpha == pytest.approx(17.7, abs=0.05)
    assert square == pytest.approx(4 * 12.0 * (alpha + 12.0) / (alpha - 12.0))
    assert least_alpha_m_per_s2(math.sqrt(48.0), 12.0) is None


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--sines", "0"], 2, "--sines"),
        (["--after", "0"], 2, "--after"),
        (["--before", "0", "--after", "0.005"], 1, "the record is too short: values must be at least 28 for 7 sines"),
        (["--set", "protocol.push_n=0.05"], 1, "the handle did not reach the wall, or not within 0.1 s"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(monkeypatch, capsys, arguments, code, message):
    done, out, err = call(monkeypatch, capsys, "lipschitz", *arguments)
    assert (done, out) == (code, "")
    (line,) = said(err)
    assert message in line
