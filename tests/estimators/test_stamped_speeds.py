"""Estimators by clock stamps at steady speeds, against rational arithmetic: any speed, both ways, and in bursts."""

import math
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from hardwall.model import stamped
from hardwall.model.axis.axis import Axis
from hardwall.model.axis.monitors import Design as Monitors
from hardwall.model.estimators import registry
from hardwall.model.estimators.bursts import doubt_samples
from stimuli.emissions import Emission
from stimuli.lengths import LONG, WHOLE, some_of
from stimuli.specs import spec

STAMPED = [name for name in registry.ESTIMATORS if registry.design_of(name).uses_stamps()]
TIMED = "period", "period-count"
"""Estimators that time cycles, of which a burst has none."""
CLOCK_HZ, COUNTS_A_METRE = 50_000_000, 10**6
LEVELS = np.array([1, 3, 2, 0]), np.array([2, 3, 1, 0])
"""Levels of the pins from edge to edge, upwards and downwards, from 0."""
SLOWEST_M_PER_S = Fraction(1, 50_000)
TENTHS = (5, 10, 15, 20, 22, 30, 39) if LONG else (10, 22, 39)
SPEEDS = sorted({SLOWEST_M_PER_S * 7**k for k in range(6)} | {Fraction(k, 10) for k in TENTHS})
BEYOND = [Fraction(k, 10) for k in ((41, 50, 100, 200, 400, 500) if LONG else (41, 500))]
"""Speeds beyond the format of 4 m/s, up to an edge a clock: the decoder's limit."""


def axis_of(name: str, sample_hz: int = 1_000_000):
    return replace(spec("mhz", name), sample_hz=sample_hz, actuation_hz=sample_hz)


@cache
def edges(speed: Fraction, seconds: Fraction, downwards: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of a steady speed: the clocks from which a register has them, exactly, and the levels."""
    a_clock = speed * COUNTS_A_METRE / CLOCK_HZ
    numbers = np.arange(1, math.floor(a_clock * CLOCK_HZ * seconds) + 1)
    return -(-numbers * a_clock.denominator // a_clock.numerator), LEVELS[downwards][(numbers - 1) % 4]


def emitted(speed: Fraction, seconds: Fraction, downwards: bool, emission: Emission) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of an encoder that emits its edges on a clock of its own."""
    clocks, _ = edges(speed, seconds, downwards)
    return emission.clocks(clocks), LEVELS[downwards][np.arange(len(clocks)) % 4]


def read(axis, passed, seconds: Fraction, floating: bool = False) -> stamped.Record:
    samples = int(axis.sample_hz * seconds)
    return stamped.run(Axis(axis, floating, encoder_glitch_clocks=0), *passed, samples=samples)


@pytest.mark.parametrize(("floating", "downwards"), some_of([(0, 0), (0, 1), (1, 0), (1, 1)], 1, 2))
@pytest.mark.parametrize("name", STAMPED)
def test_a_steady_speed_is_read_however_fast_it_is(name, floating, downwards):
    """The mean is the speed, but for a clock in a cycle; so it grows with the speed. It ends with the format.

    Two words are for rounding, and four for a time that `levant-edge` cuts to its mantissa. Fixed point says by a flag
    where it leaves the speed.
    """
    axis, sign, before = axis_of(name), -1 if downwards else 1, 0.0
    velocity, unit = axis.design.estimator.velocity, axis.velocity_unit_m_per_s
    for speed in SPEEDS + BEYOND:
        rate = float(speed) / axis.count_m / axis.clock_hz
        # Half is to begin with: a start in motion is forgotten in some memories, which are edges or a time.
        a_count = 1 / (speed * COUNTS_A_METRE)
        seconds = max(40 * a_count, min(200 * a_count, Fraction(1, 4)), Fraction(1, 125))
        record = read(axis, edges(speed, seconds, downwards), seconds, floating)
        half = len(record.velocity) // 2
        mean = sign * float(np.mean(record.velocity_m_per_s[half:]))
        if floating or speed < velocity.max * velocity.lsb * unit:
            assert abs(mean - speed) <= float(speed) * rate / 4 + 6 * velocity.lsb * unit, speed
        else:
            assert (np.abs(record.velocity[half:]) >= velocity.max).all(), speed
            assert "velocity_saturated" in axis.design.flag_names(int(record.flags[-1])), speed
        assert mean >= before * (1 - rate / 4), speed
        before = mean
    # The monitor's limit after reset is below what the estimate reaches.
    (limit,) = [
        word for word in Monitors(axis, axis.design.estimator).words if word.name == "supervisor_velocity_limit"
    ]
    assert before > limit.to_si(limit.reset)


PERIODS_S = [Fraction(n, 10**6) for n in (4, 10, 20, 50, 100, 200, 1000, 10_000)]
IN_BURSTS = [Fraction(n, 1000) for n in (5, 20, 60, 150, 400, 1000, 1800)]
APART = 20
"""Clocks between two edges of a burst."""


def certain(axis, speed: Fraction, period_s: Fraction) -> bool:
    """Return whether every burst has three edges, and a silence behind it that a sample sees to be one."""
    edges_a_period = speed * COUNTS_A_METRE * period_s
    silence = period_s * CLOCK_HZ - math.ceil(edges_a_period) * APART
    shortest = max(4 * (2 * APART + 2), axis.design.estimator.bursts.tolerated + 1)
    return edges_a_period >= 3 and silence > shortest + axis.clocks_per_sample


def of_cycles(axis, speed: Fraction, period_s: Fraction) -> tuple[float, float]:
    """Return the least and the largest velocity by cycles, of edges that wait for a period and the burst before them.

    A cycle, or the cycles of a sample, then last longer or shorter by a wait; so does a window; and the age of an edge,
    which bounds the speed, is at most that of the next edge in its place, and a wait.
    """
    edge, burst = 1 / (speed * COUNTS_A_METRE), Fraction(CLOCK_HZ, APART * COUNTS_A_METRE)
    wait = period_s + math.ceil(period_s / edge) * Fraction(APART + 1, CLOCK_HZ)
    time = max(4 * edge, Fraction(1, axis.sample_hz) - 4 * edge)
    low = min(time / (time + wait), Fraction(3, 2) * edge / (wait + edge))
    # Nothing is read faster than a burst.
    high = min(time / (time - wait), burst / speed) if time > wait else burst / speed
    if axis.estimator == "period-count":
        late = (wait + edge) * axis.sample_hz / (1 << axis.design.estimator.window_bits)
        low, high = min(low, 1 - late), max(high, 1 + late)
    lsb = 2 * axis.design.estimator.velocity.lsb * axis.velocity_unit_m_per_s
    return float(speed * low) - lsb, float(speed) * float(high) + lsb


@pytest.mark.parametrize("sample_hz", [1_000_000, 100_000, 10_000] if WHOLE else [100_000])
@pytest.mark.parametrize("name", STAMPED)
def test_edges_in_bursts_are_read_as_the_speed_that_made_them_or_flagged(name, sample_hz):
    """Whatever the period, of which every speed has another phase, and either way.

    Without a flag the mean is the speed, and no sample reads rest; estimators of cycles are as far off as edges wait.
    """
    axis, flagged = axis_of(name, sample_hz), 0
    for period_s in PERIODS_S:
        seconds = max(20 * period_s, Fraction(1, 25))
        for place, speed in enumerate(IN_BURSTS):
            emission = Emission(int(period_s * CLOCK_HZ), APART, place * int(period_s * CLOCK_HZ) // 7)
            for floating in (False, True):
                record = read(axis, emitted(speed, seconds, bool(place % 2), emission), seconds, floating)
                seen = (-1 if place % 2 else 1) * record.velocity_m_per_s[len(record.velocity) // 2 :]
                if "edges_in_bursts" in axis.design.flag_names(int(record.flags[-1])):
                    flagged += 1
                    continue
                assert not certain(axis, speed, period_s), (speed, period_s)
                if name in TIMED:
                    low, high = of_cycles(axis, speed, period_s)
                    assert low <= seen.min() <= seen.max() <= high, (speed, period_s)
                else:
                    assert np.mean(seen) == pytest.approx(float(speed), rel=0.05), (speed, period_s)
                    assert np.abs(seen - float(speed)).max() < 0.6 * speed, (speed, period_s)
    assert flagged > 20


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("name", [name for name in STAMPED if name not in TIMED])
def test_a_stop_after_bursts_reads_0_when_their_evidence_is_old(name, floating):
    axis, speed, moving = axis_of(name), Fraction(1), Fraction(1, 50)
    record = read(axis, emitted(speed, moving, False, Emission(1000, 25)), 2 * moving, floating)
    stopped = int(axis.sample_hz * (moving + Fraction(20, 10**6)))
    # Then the bound holds: a word is less than half an LSB after so many samples without an edge.
    rest = record.velocity_m_per_s[stopped + doubt_samples(axis) + 10 :]
    assert np.abs(rest[20:]).max() <= 2.5 * axis.count_m * axis.sample_hz / doubt_samples(axis)
    if name in ("edge-kalman", "levant-edge"):
        assert (rest[20:] == 0).all()


@pytest.mark.parametrize("name", STAMPED)
def test_edges_in_their_place_are_no_bursts(name):
    """Channel B late by 0.45 counts: edges in turns 0.55 and 1.45 counts apart, at any speed."""
    axis = axis_of(name)
    for speed in (Fraction(1, 100), Fraction(15, 100), Fraction(1)):
        passed = edges(speed, Fraction(1, 20), False)
        late = np.array([0, 0.45])[np.arange(len(passed[0])) % 2] * axis.count_m * axis.clock_hz / float(speed)
        record = read(axis, (passed[0] + late.astype(np.int64), passed[1]), Fraction(1, 20))
        assert record.flags[-1] == 0


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("name", ["edge-kalman", "levant-edge"])
def test_a_single_pair_of_close_edges_is_no_sign_of_rest(name, floating):
    """One edge in a thousand is 0.9 counts late, 0.1 before the next edge, ten times as close as the others."""
    axis, speed = axis_of(name), Fraction(15, 100)
    clocks, levels = edges(speed, Fraction(1, 20), False)
    late = np.zeros(len(clocks), np.int64)
    late[2000::1000] = int(0.9 * axis.count_m * axis.clock_hz / speed)
    seen = read(axis, (clocks + late, levels), Fraction(1, 20), floating).velocity_m_per_s[len(late) * 3 :]
    # The bound after 1.9 counts of silence, for a cell of 1.25 counts, less the speed.
    assert seen.min() > (2.5 / 1.9 - 1) * speed
    # The mean velocity of the shortest interval that levant-edge takes from a late edge; edge-kalman stays below it.
    shortest = Fraction(1 << axis_of("levant-edge").design.estimator.shortest, axis.clock_hz)
    counts = math.ceil(shortest * speed * COUNTS_A_METRE + Fraction(9, 10))
    assert seen.max() < counts / (counts - 0.9) * speed


@pytest.mark.parametrize("floating", [False, True])
def test_edges_in_pairs_about_the_shortest_interval_do_not_bias_levant_edge(floating):
    """Intervals of 0.8 counts are too short to be used, and those of 1.2 are not: the mean takes in both."""
    axis, speed = axis_of("levant-edge"), Fraction(2, 100)
    clocks, levels = edges(speed, Fraction(1, 5), False)
    count = axis.count_m * axis.clock_hz / speed
    assert 0.8 * count < 1 << axis.design.estimator.shortest < 1.2 * count
    late = np.array([0, round(0.2 * count)])[np.arange(len(clocks)) % 2]
    record = read(axis, (clocks + late, levels), Fraction(1, 5), floating)
    assert np.mean(record.velocity_m_per_s[100_000:]) == pytest.approx(float(speed), rel=1e-3)


def test_no_switch_of_period_count_leaves_a_speed_unread():
    """At 10 kHz a fast axis makes many cycles a sample, which are counted whatever the word is."""
    axis = axis_of("period-count", 10_000)
    (word,) = axis.design.estimator.words
    for switch in (word.si_min, word.si_max):
        for speed in (Fraction(2, 100), Fraction(1, 10), Fraction(1)):
            of = Axis(axis, period_count_switch=switch, encoder_glitch_clocks=0)
            record = stamped.run(of, *edges(speed, Fraction(1, 10), False), samples=1000)
            assert np.mean(record.velocity_m_per_s[500:]) == pytest.approx(float(speed), rel=0.01)


def test_no_gains_make_levant_edge_swing():
    """With the largest alpha and no lambda the acceleration has nothing to damp it: it does not change."""
    axis = axis_of("levant-edge")
    _, alpha = axis.design.estimator.words
    of = Axis(axis, levant_edge_lambda=0.0, levant_edge_alpha=alpha.si_max, encoder_glitch_clocks=0)
    for speed in (Fraction(2, 100), Fraction(1, 10), Fraction(1)):
        record = stamped.run(of, *edges(speed, Fraction(1, 20), False), samples=50_000)
        assert np.ptp(record.velocity_m_per_s[25_000:]) < 1e-3
