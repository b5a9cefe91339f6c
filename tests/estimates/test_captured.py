"""Captures through an axis: the words of every backend, the clock, the reference, and what stamps are worth."""

import re
from itertools import product

import numpy as np
import pytest

from hardwall.sim.estimates.captured import closest_s, coarse, position_counts
from hardwall.sim.estimates.replay import replay
from hardwall.sim.estimates.replay_plan import ReplayError, check_length
from hardwall.sim.recordings.decoded import counts_at
from hardwall.sim.recordings.recording import EdgeRecord, Recording
from stimuli.lengths import some_of

TICK_HZ = 25e6


def swing(seconds=1.5, amplitude=500.0, frequency_hz=1.0):
    """Return the edges of a swing about half a count, at the ticks of a logic analyser, and its exact velocity."""
    fine = np.arange(int(seconds * 1e6)) / 1e6
    position = 0.5 + amplitude * (1 - np.cos(2 * np.pi * frequency_hz * fine))
    cells = np.floor(position).astype(int)
    places = np.flatnonzero(np.diff(cells)) + 1
    assert np.abs(np.diff(cells)).max() == 1
    ticks = np.rint(fine[places] * TICK_HZ).astype(np.int64)
    return EdgeRecord(TICK_HZ, ticks, cells[places].astype(np.int64), int(cells[0]))


def recording(edges, rate_hz=1000.0, seconds=1.5):
    counts = counts_at(edges, rate_hz, int(seconds * rate_hz))
    return Recording("made.sr", "A,B", counts, rate_hz, edges=edges)


MADE = swing()


def velocity(rate_hz, samples):
    return 1000.0 * np.pi * np.sin(2 * np.pi * np.arange(samples) / rate_hz)


# The short form has stamps whose counts are coarse; counts have a test of their own.
EVERY_WAY = list(product((("levant", "u1"), ("period", "u"), ("edge-kalman", "u")), (1, 16)))


@pytest.mark.parametrize(("chosen", "coarsen"), some_of(EVERY_WAY, 3))
def test_edges_through_the_pins_of_the_hardware_give_the_words_of_the_model(chosen, coarsen):
    made, (estimator, output) = recording(MADE, seconds=0.4), chosen
    fixed = replay(made, estimator, output, "fixed", coarsen, 2e4)
    rtl = replay(made, estimator, output, "rtl", coarsen, 2e4)
    assert fixed.velocity_sha256 == rtl.velocity_sha256
    assert fixed.flags == rtl.flags == []
    assert rtl.by_edges
    assert rtl.clock_hz >= TICK_HZ


def test_counts_at_the_strobes_are_the_recorded_counts():
    """The plain difference, through pins on `rtl` and from counts on `fixed`, has the same words."""
    made = recording(MADE)
    assert replay(made, "fdm", backend="rtl").velocity_sha256 == replay(made, "fdm").velocity_sha256


@pytest.mark.parametrize(("rate_hz", "sample", "tick"), [(1000.0, 2007, 2_007_000), (10_000.0, 51, 5100)])
def test_an_edge_at_the_time_of_a_sample_is_seen_at_it(rate_hz, sample, tick):
    """In float64 such an edge is a part in 10^16 late: a clock later, its sample would not see it."""
    assert np.ceil(tick / 1e6 * rate_hz * 1024) > sample * 1024
    edges = EdgeRecord(1e6, np.array([tick - 2 * 1_000_000 // int(rate_hz), tick]), np.array([1, 2]), 0)
    made = Recording("made.sr", "A,B", counts_at(edges, rate_hz, sample + 40), rate_hz, edges=edges)
    seen = replay(made, "period", acceleration_max_counts_per_s2=1e6).velocity_counts_per_s
    assert int(np.flatnonzero(seen)[0]) == sample


def test_real_stamps_are_worth_more_than_edges_that_are_spread():
    """With the same counts, an estimator by stamps is closer to the exact velocity where it sees the real edges."""
    made = recording(MADE)
    bare = Recording("made.csv", "counts", made.counts, made.rate_hz)
    exact = velocity(made.rate_hz, len(made.counts))
    errors = []
    for each in (made, bare):
        found = replay(each, "levant-edge", acceleration_max_counts_per_s2=2e4)
        errors.append(float(np.sqrt(np.mean((found.velocity_counts_per_s - exact)[500:] ** 2))))
    assert errors[0] < errors[1] / 20


def test_the_reference_is_closer_than_that_of_sampled_counts():
    """Places of edges are exact, counts are floors."""
    made = recording(MADE)
    bare = Recording("made.csv", "counts", made.counts, made.rate_hz)
    exact = velocity(made.rate_hz, len(made.counts))[200:-200]
    off = [np.abs(replay(each, "fdm").reference_counts_per_s[200:-200] - exact).max() for each in (made, bare)]
    assert off[0] < 0.01 * off[1]


def test_the_position_goes_through_the_edges_and_stays_within_a_count_of_them():
    """Also where a fast motion ends in a long rest, and where edges come in pairs."""
    ticks = np.array([10, 20, 21, 40, 41, 42, 43, 5000, 5001, 5002, 9000])
    counts = np.array([1, 2, 3, 4, 5, 6, 7, 6, 5, 6, 7])
    edges = EdgeRecord(1e3, ticks, counts, 0)
    found = position_counts(edges, 1e3, 10_000)
    places = counts + (np.diff(counts, prepend=0) < 0)
    assert found[ticks] == pytest.approx(places, abs=1e-9)
    seen = counts_at(edges, 1e3, 10_000)
    assert (found >= seen - 1e-9).all()
    assert (found <= seen + 1 + 1e-9)[10:].all()
    assert (np.diff(found[10:44]) >= 0).all()


def test_the_position_of_few_edges():
    for ticks, counts, place in (([], [], 7.0), ([100], [8], 8.0)):
        edges = EdgeRecord(1e3, np.array(ticks, np.int64), np.array(counts, np.int64), 7)
        assert position_counts(edges, 1e3, 3).tolist() == [place] * 3


def test_coarser_edges_are_those_of_coarser_counts():
    edges = coarse(MADE, 16)
    assert (np.abs(np.diff(edges.counts)) == 1).all()
    for rate in (1000.0, 333.0):
        assert (counts_at(edges, rate, 400) == counts_at(MADE, rate, 400) // 16).all()


def test_edges_too_close_for_any_clock_are_refused():
    edges = EdgeRecord(1e9, np.array([1000, 500_000, 500_005]), np.array([1, 2, 3]), 0)
    assert closest_s(edges) == 5e-9
    with pytest.raises(
        ReplayError, match=r"edges must be at least 10 ns apart .*, not 5 ns at 0\.000500005 s: if these"
    ):
        replay(Recording("made.sr", "A,B", np.arange(100), 1000.0, edges=edges), "period")


def test_a_capture_shorter_than_a_second_is_judged_after_its_first_quarter():
    short = recording(swing(0.4), seconds=0.4)
    check_length(short)
    assert replay(short, "fdm").judged_from == 100
    assert replay(short, "fdm").rms_counts_per_s > 0
    assert replay(recording(MADE), "fdm").judged_from == 375


@pytest.mark.parametrize("seconds", [0.9, 1.1])
def test_the_bound_of_a_capture_is_that_of_its_judged_samples(seconds):
    """The swing accelerates most at its turn, at 0.71 s: a bound from what follows the first second is too small."""
    made = recording(swing(seconds, 5000.0, 0.7), seconds=seconds)
    found = replay(made, "fdm")
    acceleration = np.abs(np.gradient(found.reference_counts_per_s) * made.rate_hz)[found.judged_from :]
    assert acceleration.max() <= found.acceleration_max_counts_per_s2 <= 1.1 * acceleration.max()


def test_a_capture_without_edges_is_at_rest():
    none = EdgeRecord(1e6, np.zeros(0, np.int64), np.zeros(0, np.int64), 0)
    found = replay(Recording("made.sr", "A,B", np.zeros(500, int), 1000.0, edges=none), "period")
    assert not found.velocity_counts_per_s.any()


@pytest.mark.parametrize("rate_hz", [1e3, 1e4, 1e5])
@pytest.mark.parametrize("estimator", ["period", "mt"])
def test_slow_edges_are_a_motion_at_any_rate(estimator, rate_hz):
    """Four edges a second, from the capture itself and from its counts: no edges for a second are a standstill."""
    edges = EdgeRecord(TICK_HZ, (np.arange(1, 13) * TICK_HZ / 4).astype(np.int64), np.arange(1, 13), 0)
    captured = recording(edges, rate_hz, 3.0)
    counted = Recording("made.csv", "counts", captured.counts, rate_hz)
    for made in (captured, counted):
        seen = replay(made, estimator, acceleration_max_counts_per_s2=100.0)
        judged = seen.velocity_counts_per_s[int(2 * rate_hz) :]
        # Half an LSB, and two edges that are each a sample late at most.
        lsb = seen.spec.design.estimator.velocity.lsb * rate_hz
        assert np.abs(judged - 4.0).max() <= 0.5 * lsb + 4.0 * 2 * 4.0 / rate_hz


def test_a_rate_too_low_for_the_ticks_of_a_capture_is_refused_by_the_file():
    """The message named a rate of the scene, which a replay does not have."""
    edges = EdgeRecord(1e9, np.arange(1, 40) * 10**8, np.arange(1, 40), 0)
    with pytest.raises(ReplayError) as error:
        replay(recording(edges, 0.5, 8.0), "period")
    said = r"made\.sr, column A,B: period cannot take this capture at 0\.5 Hz, for a sample has too many ticks .*: "
    assert re.fullmatch(said + r"give a higher rate \(--rate\)", str(error.value))
