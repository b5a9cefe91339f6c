"""Missing and repeated samples: refused, held, or the longest piece; and a sensor that stood."""

import re

import numpy as np
import pytest

from hardwall.sim.recordings import gaps
from stimuli.forms import COUNTS

SWING = np.round(4000 * np.sin(np.arange(1000) / 100)).astype(int)


def rows(kept):
    return [f"{k / 1000:.3f},{SWING[k]}" for k in kept]


LOST = [k for k in range(1000) if not 300 <= k < 310 and k != 700]


def test_gaps_are_refused_with_both_cures(refused):
    said = refused(rows(LOST))
    assert "line 302, column time_s: times must be uniform within 0.001 s, not go by 0.011 s" in said
    assert said.endswith("fill them with the count before (--gaps hold), or keep the longest piece (--gaps split)")


def test_gaps_are_held(read):
    found = read(rows(LOST), gaps="hold")
    exact = SWING.copy()
    exact[300:310], exact[700] = SWING[299], SWING[699]
    assert (found.counts == exact).all()
    assert found.rate_hz == 1000.0
    assert "11 missing samples in 2 gaps held" in found.notes
    assert (read(rows(LOST), gaps="hold", rate_hz=1000).counts == exact).all()


def test_the_longest_piece_is_kept(read):
    found = read(rows(LOST), gaps="split")
    assert (found.counts == SWING[310:700]).all()
    assert (found.rate_hz, found.start_s) == (1000.0, 0.31)
    assert "the longest of 3 pieces, samples 300 to 689" in found.notes


@pytest.mark.parametrize("rule", ["hold", "split"])
def test_repeated_samples_are_taken_out(read, refused, rule):
    kept = sorted([*range(1000), 200, 200, 555])
    found = read(rows(kept), gaps=rule)
    assert (found.counts == SWING).all()
    assert "3 repeated samples taken out" in found.notes
    said = refused(rows(kept))
    assert "line 203, column time_s: times must increase, not go by 0 s" in said
    assert said.endswith("or take repeated samples out (--gaps hold)")


@pytest.mark.parametrize("rule", ["refuse", "hold", "split"])
def test_two_counts_at_one_time_are_refused_by_every_rule(refused, rule):
    lines = rows(range(1000))
    lines[500] = lines[499].partition(",")[0] + ",7"
    assert "times must increase, not go by 0 s" in refused(lines, gaps=rule)


@pytest.mark.parametrize("rule", ["refuse", "hold", "split"])
def test_jitter_is_no_gap(refused, rule):
    lines = [f"{k / 1000 + (0.0003 if k == 400 else 0):.4f},{SWING[k]}" for k in range(1000)]
    assert "times must be uniform within 0.0001 s" in refused(lines, gaps=rule)


def test_a_sensor_that_stood_is_held_or_cut(read, refused):
    counts = SWING.copy()
    counts[400:450] = counts[400]
    lines = [f"{k / 1000:.3f},{count}" for k, count in enumerate(counts)]
    assert "if the sensor or its reading stood" in refused(lines)
    assert (read(lines, gaps="hold").counts == counts).all()
    found = read(lines, gaps="split")
    assert (found.counts == counts[450:]).all()
    assert found.start_s == 0.45


def test_a_piece_of_a_counter_that_wraps_is_unwrapped(read):
    """Where the counter has moved on by more than its range while the sensor stood."""
    counts = np.concatenate([SWING[:400], np.full(5, SWING[399]), SWING[399:]])
    lines = [f"{k / 1000:.3f},{count % 2048}" for k, count in enumerate(counts)]
    jumped = [*lines[:405], *(f"{k / 1000:.3f},{(c + 700) % 2048}" for k, c in enumerate(counts[405:], 405))]
    found = read(jumped, gaps="split", counter_bits=11)
    assert (np.diff(found.counts) == np.diff(counts[405:])).all()
    assert found.start_s == 0.405


def test_a_gap_too_long_for_memory_is_refused(refused):
    lines = ["0.000,1", "0.001,1", "0.002,1", "90000.000,2"]
    assert "must have at most 10000000 samples, missing ones included" in refused(lines, gaps="hold")


def test_nothing_to_mend_changes_nothing(read):
    lines = [f"{k / 1000:.3f},{count}" for k, count in enumerate(COUNTS)]
    for rule in gaps.RULES:
        assert (read(lines, gaps=rule).counts == COUNTS).all()


@pytest.mark.parametrize("header", ["time", "t_ms", "clock"])
def test_times_of_any_name_tell_where_samples_are_missing_beside_a_rate(read, header):
    """With a rate, times that were not asked for were passed over, and with them the gaps."""
    unit = 1000 if "ms" in header else 1
    lines = [f"{k / 1000 * unit:.3f},{SWING[k]}" for k in LOST]
    held = read(lines, rate_hz=1000, header=f"{header},counts", gaps="hold")
    assert (np.flatnonzero(held.counts != SWING) == sorted(set(range(1000)) - set(LOST))).all()
    found = read(lines, rate_hz=1000, header=f"{header},counts", gaps="split")
    assert (found.counts == SWING[310:700]).all()


# ---- stamps as coarse as the interval --------------------------------------------------------------------------------


def coarse(rate_hz, kept=range(1000)):
    return [f"{k / rate_hz:.3f},{k}" for k in kept]


@pytest.mark.parametrize("rate", [550, 700, 900, 990])
@pytest.mark.parametrize("rule", ["hold", "split"])
def test_rounded_stamps_are_no_gaps(read, refused, rate, rule):
    """Of stamps in ms, 1 ms is usual and 2 ms frequent: 700 Hz was made into 1 kHz, two samples of five held."""
    for kept in (range(1000), [*range(400), *range(410, 1000)]):
        found = read(coarse(rate, kept), rate_hz=rate, gaps=rule)
        assert found.rate_hz == rate
        assert len(found.counts) == (590 if rule == "split" and len(kept) < 1000 else 1000)
        assert found.counts[-1] == 999
        if rate < 990:  # else a piece has too few to tell
            assert re.search(
                r"give the rate \(--rate [5-9]\d\d(\.\d+)?\), because", refused(coarse(rate, kept), gaps=rule)
            )


@pytest.mark.parametrize("lost", [1, 20])
def test_single_samples_that_are_lost_are_held_at_any_resolution(read, refused, lost):
    """At 1 kHz in ms, a lost sample makes one interval of two units."""
    without = np.sort(np.random.default_rng(7).choice(np.arange(1, 999, 2), lost, replace=False))
    kept = [k for k in range(1000) if k not in without]
    for rate in (None, 1000):
        found = read(coarse(1000, kept), rate_hz=rate, gaps="hold")
        assert (found.counts == [k if k in kept else k - 1 for k in range(1000)]).all()
    assert "(--gaps hold)" in refused(coarse(1000, kept), rate_hz=1000)


@pytest.mark.parametrize(
    ("steps", "unit", "rate", "longer"),
    [
        ([1.0, 1.49, 1.0, 1.0], 1e-6, None, []),
        ([1.0, 1.51, 1.0, 1.0], 1e-6, None, [(1, 2)]),
        ([1.0, 1.0, 2.49, 1.0, 1.0, 4.0, 1.0], 1e-6, None, [(2, 2), (5, 4)]),
        ([1.0, 1.0, 2.0] * 7, 1.0, None, [(place, 2) for place in range(2, 21, 3)]),
        ([1.0, 1.0, 2.0] * 8, 1.0, None, []),
        ([1.0, 1.0, 2.0] * 7, 1.0, 0.75, []),
        ([1.0, 1.0, 2.0, 1.0, 1.0], 1.0, 1.0, [(2, 2)]),
        ([1.0] * 9 + [3.0] + [1.0] * 9, 1.0, None, [(9, 3)]),
        ([1.0] * 9 + [2.0] * 9 + [1.0] * 9, 1.0, None, [(place, 2) for place in range(9, 18)]),
    ],
)
def test_how_many_intervals_pass(steps, unit, rate, longer):
    passed = gaps.passed_in(np.array(steps), unit, rate)
    assert [(int(place), passed[place]) for place in np.flatnonzero(passed != 1)] == longer


@pytest.mark.parametrize("rate", [0.7, None])
def test_a_lost_sample_is_told_from_rounded_intervals(rate):
    """At 1.43 units a sample, intervals are 1 or 2 units; where a sample is missing, 3."""
    times = np.rint(np.arange(200) / 0.7)
    lost = int(np.flatnonzero(times[2:] - times[:-2] == 3)[30]) + 1
    passed = gaps.passed_in(np.diff(np.delete(times, lost)), 1.0, rate)
    assert np.flatnonzero(passed != 1).tolist() == [lost - 1]
    assert passed[lost - 1] == 2
