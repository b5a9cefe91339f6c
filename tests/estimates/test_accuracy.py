"""Accuracy of estimators: the founding paper's figures, every backend, and refused input."""

import math

import numpy as np
import pytest

from hardwall.sim.estimates import figures, signals
from hardwall.sim.estimates.accuracy import (
    COARSEN,
    PHASE,
    axis_spec,
    exact_velocity,
    judged,
    measure,
    measure_recording,
    outputs,
)
from hardwall.sim.estimates.replay import replay
from hardwall.sim.recordings.load import load
from stimuli.lengths import LONG, some_of
from stimuli.outputs import EVERY_OUTPUT

RECORDINGS = ("davinci_L2_02.csv", "davinci_L2_22.csv", "davinci_R5_42.csv")
PUBLISHED = {"fdm": 4.13, "butterworth, 0.1 fs": 0.621, "levant u, proposed gains": 0.626}
"""Figure 2 at 10 kHz, RMS mm/s: where the filtered difference and Levant's differentiator cross."""


@pytest.mark.parametrize("backend", some_of(["float", "fixed"], 1))
@pytest.mark.parametrize("label", PUBLISHED)
def test_the_papers_second_figure_at_its_crossing(label, backend):
    curve = next(curve for curve in figures.curves(2) if curve.label == label)
    row = measure(**curve.job("paper", 10_000, backend=backend))
    assert row["rms_mm_s"] == pytest.approx(PUBLISHED[label], rel=0.01)
    assert row["flags"] == []


def test_the_papers_second_figure_rises_and_falls_as_published():
    """Levant's error falls steeply until it meets the filter's, then hardly rises; the plain difference only rises."""
    rms = {
        (name, rate): measure(name, "u", "paper", rate)["rms_mm_s"]
        for name in ("fdm", "levant")
        for rate in (2_000, 5_000, 10_000, 20_000)
    }
    falls = [rms["levant", slow] / rms["levant", fast] for slow, fast in ((2_000, 5_000), (5_000, 10_000))]
    rise = rms["levant", 20_000] / rms["levant", 10_000]
    assert rise > 1
    assert min(falls) > rise
    assert rms["fdm", 2_000] < rms["fdm", 5_000] < rms["fdm", 10_000] < rms["fdm", 20_000]


# Its levels change at times that a rounding moves, so two runs differ: only many runs, as in its own test, show the
# cost of words.
REPEATABLE = [pair for pair in EVERY_OUTPUT if pair[0] != "levant-adaptive"]

RATES = [1_000, 10_000, 100_000, 1_000_000] if LONG else [10_000]
"""Sample rates at which words are compared with float64, in Hz: all of them by `make soak`."""
FEW = [("levant", "u"), ("period", "u"), ("window", "u")]
"""One estimator of each kind: its state is a few words or an array, and it has the count or the stamps of edges."""


@pytest.mark.parametrize("sample_hz", RATES)
@pytest.mark.parametrize(("estimator", "output"), REPEATABLE if LONG else FEW)
def test_words_cost_no_estimator_more_than_a_hundredth_of_its_error(estimator, output, sample_hz):
    """The RMS error of `fixed` is that of `float`; every estimator's own test also compares the samples."""
    signal = signals.load("paper")
    axis = axis_spec(estimator, sample_hz, signal.acceleration_max_m_per_s2)
    floating, fixed = (judged(signal, axis, output, backend) for backend in ("float", "fixed"))
    assert fixed.velocity.rms == pytest.approx(floating.velocity.rms, rel=0.01)
    if fixed.acceleration:
        assert fixed.acceleration.rms == pytest.approx(floating.acceleration.rms, rel=0.01)
    assert fixed.flags == 0


@pytest.mark.parametrize(("estimator", "output"), EVERY_OUTPUT if LONG else [*FEW, ("fdm", "u")])
def test_the_figures_of_a_row(estimator, output):
    row = measure(estimator, output, "hit", 100_000, "fixed")
    assert row["max_mm_s"] >= row["rms_mm_s"] >= row["chatter_mm_s"] >= 0
    assert abs(row["delay_s"]) < 0.01
    assert (row["estimator"], row["output"], row["sample_hz"]) == (estimator, output, 100_000)


def test_an_encoder_out_of_phase_is_seen():
    plain, late = (measure("levant", "u1", "paper", 100_000, encoder={PHASE: error}) for error in (0.0, 0.25))
    assert late["rms_mm_s"] > 1.02 * plain["rms_mm_s"]
    assert late["encoder_phase_error_counts"] == 0.25


def test_a_difference_is_half_a_sample_late():
    assert measure("fdm", "u", "paper", 1000)["delay_s"] == pytest.approx(0.5e-3, rel=0.01)


def test_gains_follow_the_bound():
    own, given = (
        measure("levant", "u", "steady:10", 10_000, bounds=b) for b in (None, {"acceleration_max_m_per_s2": 3.0})
    )
    assert own["gains"]["alpha_m_per_s2"] == pytest.approx(1.1 * signals.DEVICE_ACCELERATION)
    assert given["gains"] == pytest.approx({"alpha_m_per_s2": 3.3, "lambda_sqrt_m_per_s": math.sqrt(3)})
    other = measure("levant", "u", "steady:10", 10_000, gains={"alpha_m_per_s2": 1.0, "lambda_sqrt_m_per_s": 2.0})
    assert other["gains"]["alpha_m_per_s2"] == 1.0
    higher = (
        ("levant-2", "z1", "steady:10", 10_000) if LONG else ("levant-2-implicit", "z1", "steady:10", 10_000, "fixed")
    )
    own, given = (measure(*higher, bounds=b) for b in (None, {"jerk_max_m_per_s3": 3e3}))
    assert own["gains"]["jerk_m_per_s3"] == pytest.approx(signals.load("steady:10").jerk_max_m_per_s3)
    assert own["jerk_max_mm_s3"] == pytest.approx(own["gains"]["jerk_m_per_s3"] * 1e3)
    assert given["gains"] == {"jerk_m_per_s3": 3e3}


def test_kalman_is_told_only_a_jerk_that_is_given():
    """Its bound must hold at an impact, too, and the swing's does not."""
    bounds = {"acceleration_max_m_per_s2": 12.0}
    own, given = (
        measure("kalman", "u", "steady:10", 10_000, bounds=bounds | told) for told in ({}, {"jerk_max_m_per_s3": 3.0})
    )
    assert own["jerk_max_mm_s3"] is None
    assert own["gains"]["acceleration_rms_m_per_s2"] == pytest.approx(12 / math.sqrt(3))
    assert given["jerk_max_mm_s3"] == 3e3
    assert given["gains"]["acceleration_rms_m_per_s2"] < 0.1 * own["gains"]["acceleration_rms_m_per_s2"]


def test_the_clock_leaves_every_estimator_its_time():
    for rate, clock in ((1_000, 50_000_000), (30_000, 50_010_000), (1_000_000, 50_000_000), (10_000_000, 500_000_000)):
        assert axis_spec("levant", rate, 12.0).clock_hz == clock


def test_an_axis_that_cannot_be_says_which():
    with pytest.raises(ValueError, match=r"^levant at 1000 Hz with C 1e\+12 m/s\^2: lambda_sqrt_m_per_s must be"):
        measure("levant", "u", "paper", 1000, bounds={"acceleration_max_m_per_s2": 1e12})


def test_outputs_of_names():
    assert outputs("levant") == [("levant", "u"), ("levant", "u1")]
    assert outputs("levant:u1") == [("levant", "u1")]
    with pytest.raises(ValueError, match=r"^estimator must be one of fdm, "):
        outputs("nobody")
    with pytest.raises(ValueError, match=r"^output of levant must be one of u, u1, not 'v'$"):
        outputs("levant:v")


def test_the_window_floor_is_that_of_a_window():
    """The formula agrees with a run of the difference over that window."""
    signal = signals.load("paper")
    window_s = 2 * math.sqrt(figures.COUNT_M / 2 / signal.acceleration_max_m_per_s2)
    row = measure("window", "u", "paper", 100_000, gains={"window_s": round(window_s * 1e5) / 1e5})
    # The formula's roundings are independent; they are dependent and larger in a motion slower than a count a window.
    slow = sum(abs(v) * window_s < figures.COUNT_M for v in exact_velocity(signal.motion, np.arange(1, 5, 1e-3))) / 4000
    floor = 1e3 * figures.window_floor_m_per_s(signal, 100_000)
    assert floor * (1 - slow) <= row["rms_mm_s"] <= floor * (1 + slow)


def test_the_lower_bound():
    assert figures.lower_bound_m_per_s(12.0) == pytest.approx(2 * math.sqrt(12 * 0.5e-6))


@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_of_a_real_drive(recordings, name):
    recorded = load(recordings / name, "motor_counts")
    row = measure_recording(recorded, "levant", "u1", "fixed")
    result = replay(recorded, "levant", "u1", "fixed", coarsen=COARSEN)
    assert row["rms_counts_s"] == pytest.approx(result.rms_counts_per_s, rel=1e-12)
    plain = measure_recording(recorded, "fdm", "u")
    assert row["rms_counts_s"] < plain["rms_counts_s"] == pytest.approx(result.rms_fdm_counts_per_s, rel=1e-12)
    assert row["delay_s"] > plain["delay_s"] > 0
