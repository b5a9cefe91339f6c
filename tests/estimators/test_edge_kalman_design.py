"""The rule of the Kalman filter of edges: memories, gains and what silence tells, from an axis's bounds."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from hardwall.model.estimators import edge_kalman
from hardwall.model.estimators.edge_kalman_tables import (
    AGILE_AT,
    GAIN_BITS,
    GAIN_FORMATS,
    GROW,
    HALVINGS,
    QUIET_AT,
    gain_words,
)
from stimuli.specs import spec


def design(name: str) -> edge_kalman.Design:
    return spec(name, "edge-kalman").design.estimator


HALF = 1 << 15
MIDDLES = (0, math.sqrt(1.5)), (1, math.sqrt(3))


@pytest.mark.parametrize("name", ["paper", "mhz"])
@pytest.mark.parametrize("halvings", range(HALVINGS + 1))
def test_the_memories_are_where_the_motion_may_do_what_the_edges_hide(name, halvings):
    """At the middle of every row J M^3 and C M^2 are the documented shares of the error of the place over M."""
    axis, d = spec(name, "edge-kalman"), design(name)
    length = np.arange(1, d.time_bits - 2)
    for half, middle in MIDDLES:
        units = 2.0 ** (length - 1) * middle
        time_s, row = units / axis.clock_hz, 2 * length + half
        quiet, agile = d.quiet_s[halvings, row], d.agile_s[halvings, row]
        # In a clock of an interval of T clocks 1 / T counts pass, or what the largest speed passes.
        passed = np.minimum(1 / units, axis.speed_max_m_per_s / axis.count_m / axis.clock_hz)
        error = np.hypot(0.1 / 2**halvings, passed / math.sqrt(12)) * axis.count_m
        limited, jerk = np.isclose(quiet, time_s / 2), axis.jerk_bound_m_per_s3
        assert np.all(np.isclose(jerk * quiet**3, 1.6 * error * np.sqrt(time_s / quiet)) | limited)
        own = axis.acceleration_max_m_per_s2 * agile**2
        assert np.all(np.isclose(own, 28 * error * np.sqrt(time_s / agile)) | np.isclose(agile, time_s / 2))
        assert np.all(agile <= quiet)
        assert np.all(quiet >= time_s / 2)
        words = d.limits[halvings << d.row_bits | row]
        for column, memory in ((QUIET_AT, quiet), (AGILE_AT, agile)):
            told = math.sqrt(1.5) / 2 * 2.0 ** (words[:, column] / 16 / 2) / axis.clock_hz
            # To the nearest sixteenth of half an octave.
            assert np.allclose(told, memory, rtol=2 ** (1 / 64) - 1 + 1e-12)


def gains_at(d: edge_kalman.Design, memory: int, time: int) -> np.ndarray:
    """Return the words' K_x, K_v and K_a for a memory and a time in half octaves, in units."""
    _, kx, kv, ka = gain_words()[2 * (memory - time + 2) + memory % 2] * [fmt.lsb for fmt in GAIN_FORMATS]
    kept = GAIN_BITS - 1 + d.shortest
    faster, bent = (math.floor(rate / 2 ** (memory // 2) * 2**kept) / 2**kept for rate in (kv, ka))
    return np.array([kx, kx * faster, kx * faster * bent])


def test_gains_are_those_of_the_riccati_equation():
    """Independent of `riccati`: SciPy's solution for a white jerk, to a 64th, and to the words' resolution."""
    d = design("mhz")
    for time in range(8, 40):
        for memory in range(max(time - 2, 2 * d.shortest), 45):
            units, length = (math.sqrt(1.5) / 2 * 2.0 ** (each / 2) for each in (time, memory))
            h = units / length
            moved = np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]])
            jerk = h**6 * np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1]])
            if h < 2**-7:  # the equation's own solution loses its digits
                continue
            p = scipy.linalg.solve_discrete_are(moved.T, np.array([[1.0, 0, 0]]).T, jerk, np.eye(1))
            gains = p[:, 0] / (p[0, 0] + 1) / units ** np.arange(3)
            assert gains_at(d, memory, time) == pytest.approx(gains, rel=1 / 64)


def growth(gains: np.ndarray, time: float) -> float:
    """Return the largest factor by which the filter's error grows from edge to edge, edges being `time` apart."""
    moved = np.array([[1, time, time**2 / 2], [0, 1, time], [0, 0, 1]])
    return max(abs(np.linalg.eigvals((np.eye(3) - np.outer(gains, [1, 0, 0])) @ moved)))


@pytest.mark.parametrize("edge_error_counts", [1e-3, 1e-2, 0.1, 1.0])
@pytest.mark.parametrize("name", ["paper", "mhz", "wide"])
def test_the_gains_of_every_row_are_stable_over_all_of_its_times(name, edge_error_counts):
    """A row has one set of gains for times of 2 to 3, or 3 to 4, times a power of two: they fit its ends the least."""
    d = replace(spec(name, "edge-kalman"), edge_error_max_counts=edge_error_counts).design.estimator
    met = set()
    for row, words in enumerate(d.limits):
        time = row % (1 << d.row_bits)
        if 4 <= time < 2 * d.time_bits:
            shortest, longest = (int(words[column] + 8) >> 4 for column in (AGILE_AT, QUIET_AT))
            met.update((memory, time) for memory in range(shortest, longest + 1))
    for memory, number in met:
        gains = gains_at(d, memory, number)
        first = 2.0 ** (number // 2 - 1) * (1.5 if number % 2 else 1.0)
        for time in first * np.array([1.0, 4 / 3 if number % 2 else 1.5]):
            assert growth(gains, time) < 1.0, f"memory {memory}, {time} units"


@pytest.mark.parametrize("edge_error_counts", [1e-30, 1e-6, 0.1, 1.0, 1e30])
@pytest.mark.parametrize("estimator", ["edge-kalman", "count-kalman"])
@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "wide"])
def test_what_every_memory_and_time_make_is_within_its_word(name, estimator, edge_error_counts):
    """The proof of widths does not know the words of the tables: these are all of them, for every time and error."""
    d = replace(spec(name, estimator), edge_error_max_counts=edge_error_counts).design.estimator
    d = getattr(d, "filter", d)
    assert d.limits.min() >= 0
    assert gain_words().min() >= 0
    for words, formats in ((d.limits, d.columns), (gain_words(), GAIN_FORMATS)):
        assert np.all(words.max(axis=0) <= [fmt.max for fmt in formats])
    growths = gain_words()[::2, GROW].tolist()
    # A time in use has a bit less than a stamp.
    for row in (row for row in range(len(d.limits)) if row % (1 << d.row_bits) < 2 * d.time_bits):
        time = row % (1 << d.row_bits)
        shortest, longest = (int(d.limits[row, column]) << 12 for column in (AGILE_AT, QUIET_AT))
        assert shortest <= longest
        for memory in range((shortest + HALF) >> 16, ((longest + HALF) >> 16) + 1):
            # T is at most twice M, which is two half octaves; a memory may be as long as 6 bits of half octaves.
            assert 0 <= memory - time + 2 < 64
            assert memory < 64
            assert 0 <= (memory >> 1) - d.shortest < 32
            assert longest + growths[memory - time + 2] < 64 << 16


def test_bounds_of_the_axis_are_the_gains():
    axis = replace(spec("mhz", "edge-kalman"), jerk_max_m_per_s3=7.0, edge_error_max_counts=0.02)
    assert axis.design.gains == edge_kalman.Gains(0.02, 7.0, 12.0)
    shorter = replace(axis, jerk_max_m_per_s3=70.0)
    assert np.all(shorter.design.estimator.quiet_s <= axis.design.estimator.quiet_s)
    usual = spec("mhz", "edge-kalman")
    assert usual.jerk_bound_m_per_s3 == pytest.approx(12.0 * math.sqrt(12e6) / 128)
    assert {"jerk_max_m_per_s3", "edge_error_max_counts"} & usual.facts.keys() == set()
    assert axis.facts["jerk_max_m_per_s3"] == 7.0
    assert axis.facts["edge_error_max_counts"] == 0.02


@pytest.mark.parametrize("field", ["jerk_max_m_per_s3", "edge_error_max_counts"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_bounds_that_are_none_are_refused(field, value):
    with pytest.raises(ValueError, match=rf"^{field} must be 1e-30 to 1e\+30, not {value!r}$"):
        replace(spec("mhz", "edge-kalman"), **{field: value})


@pytest.mark.parametrize(
    ("edge_error_counts", "apart_counts"), [(1e-3, 1.25), (0.05, 1.25), (0.1, 1.5), (0.2, 2.0), (1.0, 6.0)]
)
@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_silence_bounds_beyond_what_edges_may_be_apart(name, edge_error_counts, apart_counts):
    """Five errors of an edge beyond a count, and a quarter at least; on both models."""
    d = replace(spec(name, "edge-kalman"), edge_error_max_counts=edge_error_counts).design.estimator
    bound = 2 * apart_counts * d.clocks / (1 << d.unit)
    assert d.params({}).bound * d.motion.lsb == pytest.approx(bound, abs=d.motion.lsb)
    assert d.float_params(edge_kalman.Gains(edge_error_counts, 1.0, 1.0), "u", {}).bound == pytest.approx(bound)
