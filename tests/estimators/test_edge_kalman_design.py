"""The rule of the Kalman filter of edges: memories, gains and what silence tells, from an axis's bounds."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from hardwall.model.estimators import edge_kalman
from hardwall.model.estimators.edge_kalman_design import KA, KX, LEVELS
from stimuli.specs import spec


def design(name: str) -> edge_kalman.Design:
    return spec(name, "edge-kalman").design.estimator


@pytest.mark.parametrize("name", ["paper", "mhz"])
def test_the_memories_are_where_the_motion_may_do_what_the_edges_hide(name):
    """At the middle of every row J M^3 and C M^2 are the documented shares of the error of the place over M."""
    axis, d = spec(name, "edge-kalman"), design(name)
    length = np.arange(4, d.time_bits - 2)
    for half, middle in ((0, math.sqrt(1.5)), (1, math.sqrt(3))):
        time_s = 2.0 ** (length - 1) * middle / axis.clock_hz
        memory = d.memories_s[:, 2 * length + half]
        stamp = axis.speed_max_m_per_s / axis.count_m / axis.clock_hz / math.sqrt(12)
        error = math.hypot(axis.edge_error_max_counts, stamp) * axis.count_m
        hidden = error * np.sqrt(time_s / memory)
        assert axis.jerk_bound_m_per_s3 * memory[0] ** 3 == pytest.approx(1.6 * hidden[0])
        agile = axis.acceleration_max_m_per_s2 * memory[-1] ** 2
        assert np.all(np.isclose(agile, 28 * hidden[-1]) | (memory[-1] == memory[0]))
        assert np.allclose(np.diff(np.log(memory), 2, axis=0), 0)


def test_gains_are_those_of_the_riccati_equation():
    """Independent of `riccati`: SciPy's solution for a white jerk, and the rounding of the table's words."""
    d, axis = design("mhz"), spec("mhz", "edge-kalman")
    for level in range(LEVELS):
        for length in (6, 9, 13, 18):
            row = level * (1 << d.row_bits) + 2 * length
            units = 2.0 ** (length - 1) * math.sqrt(1.5)
            h = min(units / (d.memories_s[level, 2 * length] * axis.clock_hz), 2.0)
            moved = np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]])
            jerk = h**6 * np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1]])
            p = scipy.linalg.solve_discrete_are(moved.T, np.array([[1.0, 0, 0]]).T, jerk, np.eye(1))
            gains = p[:, 0] / (p[0, 0] + 1) / units ** np.arange(3)
            words = [int(d.table[row, n]) * d.columns[n].lsb for n in (3, 4, 5)]
            for word, gain, fmt in zip(words, gains, d.columns[3:], strict=True):
                assert word == pytest.approx(gain, rel=1e-4, abs=0.51 * fmt.lsb)


def growth(gains: np.ndarray, time: float) -> float:
    """Return the largest factor by which the filter's error grows from edge to edge, edges being `time` apart."""
    moved = np.array([[1, time, time**2 / 2], [0, 1, time], [0, 0, 1]])
    return max(abs(np.linalg.eigvals((np.eye(3) - np.outer(gains, [1, 0, 0])) @ moved)))


@pytest.mark.parametrize("edge_error_counts", [1e-3, 1e-2, 0.1, 1.0])
@pytest.mark.parametrize("name", ["paper", "mhz", "wide"])
def test_the_gains_of_every_row_are_stable_over_all_of_its_times(name, edge_error_counts):
    """A row has one set of gains for times of 2 to 3, or 3 to 4, times a power of two: they fit its ends the least."""
    d = replace(spec(name, "edge-kalman"), edge_error_max_counts=edge_error_counts).design.estimator
    lsb = [column.lsb for column in d.columns]
    for level in range(LEVELS):
        for number in range(4, 2 * d.time_bits):
            row = d.table[level << d.row_bits | number] * lsb
            first = 2.0 ** (number // 2 - 1) * (1.5 if number % 2 else 1.0)
            for time in first * np.array([1.0, 4 / 3 if number % 2 else 1.5]):
                assert growth(row[KX : KA + 1], time) < 1.0, f"level {level}, {time} units"


def test_bounds_of_the_axis_are_the_gains():
    axis = replace(spec("mhz", "edge-kalman"), jerk_max_m_per_s3=7.0, edge_error_max_counts=0.02)
    assert axis.design.gains == edge_kalman.Gains(0.02, 7.0, 12.0)
    shorter = replace(axis, jerk_max_m_per_s3=70.0)
    assert np.all(shorter.design.estimator.memories_s[0] <= axis.design.estimator.memories_s[0])
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
