"""The errors of rivals on known motions and on recordings, against errors by another way."""

from dataclasses import replace

import numpy as np
import pytest

from hardwall.sim.estimates import signals
from hardwall.sim.estimates.accuracy import COARSEN
from hardwall.sim.estimates.accuracy import measure as measure_own
from hardwall.sim.estimates.motions import encoded
from hardwall.sim.estimates.replay import replay
from hardwall.sim.estimates.rivals.dvrk import ACCELERATION, Dvrk
from hardwall.sim.estimates.rivals.judged import measure, measure_acceleration, measure_recording, spread
from hardwall.sim.estimates.rivals.known import LOOP, choices
from hardwall.sim.estimates.rivals.rival import estimates, seen_of
from hardwall.sim.recordings.recording import EdgeRecord
from hardwall.sim.world.encoder import Encoder
from stimuli.replays import reference_of, swing

RATE = 10_000


def test_a_steady_speed_has_no_error_but_the_stamps():
    row = measure("dvrk-measured", {"period_s": 0.0}, "steady:20.03", RATE, None)
    # A cycle of four counts takes 200 us, and a stamp is right to 20 ns.
    assert row["rms_mm_s"] < 20.03 * 20e-9 / 200e-6
    assert 0 < row["rms_mm_s"] <= row["max_mm_s"]
    assert row["delay_s"] is None


def test_an_error_of_phase_shows_where_edges_are_single_and_not_over_a_cycle():
    encoder = {"encoder.phase_error_counts": 0.25}
    cycle, single = (
        measure(name, {"period_s": 0.0}, "steady:5.03", 100_000, encoder) for name in ("dvrk-measured", "hostmot2")
    )
    # The times are 1.25 and 0.75 counts long in turn. The speed of the short one holds in the long one, until the time
    # since the edge bounds it; the speed of the long one holds in the short one.
    bounded = (1.25 - 1 / 1.25 - 2 * np.log(1.25)) - (0.75 - 1 / 0.75 - 2 * np.log(0.75))
    mean = (0.75 * (1 / 0.75 - 1) ** 2 + bounded + 0.75 * (1 / 1.25 - 1) ** 2) / 2
    assert single["rms_mm_s"] == pytest.approx(5.03 * np.sqrt(mean), rel=0.01)
    assert cycle["rms_mm_s"] < 0.001


def test_a_calibrated_pico_knows_the_encoder_that_it_sees():
    encoder = {"encoder.phase_error_counts": 0.25}
    known, unknown = (
        measure("pico", {"period_s": 3e-4, "calibrated": each}, "steady:20.03", RATE, encoder) for each in (True, False)
    )
    assert known["rms_mm_s"] < 0.01
    assert unknown["rms_mm_s"] > 0.1


def test_a_sensor_is_late_by_its_filter():
    settings = {"period_s": 1e-3, "filter_s": 5e-3}
    row = measure("simplefoc-sensor", settings, "paper", RATE, None)
    # The filter, and half of the period over which a difference is, and half of the time that it is held.
    assert row["delay_s"] == pytest.approx(6e-3, abs=0.2e-3)


def test_the_acceleration_of_the_papers_signal():
    """The true one is the second derivative of the signal's formula."""
    times_s = np.arange(5 * RATE) / RATE
    p = complex(-1.0, 2 * np.pi)
    exact = (50e-3 * p**2 * np.exp(p * times_s)).imag
    signal, estimate = signals.load("paper"), np.zeros(5 * RATE)
    found = encoded(signal.motion, Encoder(1e-6, 50e6), 5.0, 1e-3, 0)
    estimates(Dvrk(ACCELERATION), seen_of(found, 50e6), float(RATE), 1, estimate)
    row = measure_acceleration("dvrk", "paper", RATE, None)
    assert row["signal_rms_mm_s2"] == pytest.approx(1e3 * np.sqrt(np.mean(exact[RATE:] ** 2)), rel=1e-6)
    error = (1e-6 * estimate - exact)[RATE:]
    assert row["rms_mm_s2"] == pytest.approx(1e3 * np.sqrt(np.mean(error**2)), rel=1e-6)


def test_edges_are_spread_over_their_sample():
    seen = spread(np.array([5, 5, 7, 7, 4]), 10.0)
    assert seen.start == 5
    assert seen.times_s.tolist() == pytest.approx([0.125, 0.175, 0.3 + 1 / 60, 0.35, 0.4 - 1 / 60])
    assert seen.numbers.tolist() == [6, 7, 6, 5, 4]


def test_a_recording_is_judged_against_its_reference():
    recorded = swing()
    row = measure_recording(recorded, "simplefoc-sensor", {"period_s": 0.0, "filter_s": 0.0}, "float")
    counts, reference = recorded.counts // COARSEN, reference_of(recorded)
    velocity, held, last = np.zeros(len(counts)), 0.0, 0
    for k in range(1, len(counts)):
        if counts[k] != counts[last]:
            held, last = (counts[k] - counts[last]) / (k - last) * recorded.rate_hz, k
        velocity[k] = held * COARSEN
    error = (velocity - reference)[1000:]
    assert row["rms_counts_s"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
    assert row["max_counts_s"] == pytest.approx(np.abs(error).max(), rel=1e-6)


def test_a_capture_has_its_own_edges():
    """The second half of the counts of every sample: no estimator of single edges could be right of it by spreading."""
    recorded = swing()
    whole = spread(recorded.counts, recorded.rate_hz)
    ticks = np.round(whole.times_s * 1e6).astype(np.int64)
    capture = replace(recorded, edges=EdgeRecord(1e6, ticks, whole.numbers, whole.start))
    settings = {"period_s": 0.0, "calibrated": False}
    own, even = (measure_recording(each, "pico", settings, "float") for each in (capture, recorded))
    assert own["rms_counts_s"] < even["rms_counts_s"]


def test_the_loop_is_the_estimator_of_this_project():
    recorded, settings = swing(), {"bandwidth_hz": 30.0}
    row = measure_recording(recorded, LOOP, settings, "float")
    _, every = choices(LOOP, recorded.rate_hz)
    assert settings in every
    h = 2 * np.pi * 30.0 / recorded.rate_hz
    x = v = 0.0
    velocity = []
    counts = recorded.counts // COARSEN
    for count in counts - counts[0]:
        x += v
        e = count - x
        x, v = x + 2 * h * e, v + h * h * e
        velocity.append(v * COARSEN * recorded.rate_hz)
    error = (np.array(velocity) - reference_of(recorded))[1000:]
    assert row["rms_counts_s"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
    assert replay(recorded, LOOP, coarsen=COARSEN).rms_counts_per_s != row["rms_counts_s"]


def test_own_estimators_and_rivals_have_the_same_truth():
    """A difference of counts over a sample, as a rival and as this project's estimator."""
    own = measure_own("fdm", "u", "sweep", RATE)
    rival = measure("simplefoc-sensor", {"period_s": 0.0, "filter_s": 0.0}, "sweep", RATE, None)
    # Where the count changes in every sample both are the same; at turns one is 0 and the other holds.
    fast_own = measure_own("fdm", "u", "steady:301.7", RATE)
    fast = measure("simplefoc-sensor", {"period_s": 0.0, "filter_s": 0.0}, "steady:301.7", RATE, None)
    assert fast["rms_mm_s"] == pytest.approx(fast_own["rms_mm_s"], rel=1e-9)
    assert fast["max_mm_s"] == pytest.approx(fast_own["max_mm_s"], rel=1e-9)
    assert rival["rms_mm_s"] != own["rms_mm_s"]
