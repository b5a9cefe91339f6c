"""The limit to the velocity that edges tell: against the Riccati equation, and what it is for the paper's signal."""

import math

import numpy as np
import pytest
import scipy.linalg

from hardwall.model.record_axis import DECODER_CLOCKS
from hardwall.sim.estimates import edge_limit, signals
from hardwall.sim.estimates.accuracy import axis_spec, errors_of, measure
from stimuli.lengths import LONG


def test_at_a_constant_speed_it_is_the_steady_state_of_the_filter():
    """SciPy's solution of the Riccati equation, read right after edges."""
    t, error, density = 1e-3, 0.05, 1e9
    times = t * np.arange(3000)
    bound = edge_limit.rms_at(times, np.arange(3000.0), error, density, times[2000:])
    moved = np.array([[1, t, t**2 / 2], [0, 1, t], [0, 0, 1]])
    noise = np.array([[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]])
    p = scipy.linalg.solve_discrete_are(moved.T, np.eye(3)[:, :1], density * noise, np.eye(1) * error**2)
    after = p - np.outer(p[:, 0], p[0]) / (p[0, 0] + error**2)
    assert bound == pytest.approx(math.sqrt(after[1, 1]), rel=1e-4)


def test_places_of_edges_are_those_of_the_motion():
    """An edge is where the motion is at its time, less the lead of the pins, to a clock, either way."""
    signal = signals.load("paper")
    spec = axis_spec("edge-kalman", 100_000, signal.acceleration_max_m_per_s2)
    times, places = edge_limit.edges_of(signal, spec, *errors_of(None))
    moved = times - (spec.clocks_per_sample - 1 - DECODER_CLOCKS) / spec.clock_hz
    motion = 50e3 * np.exp(-moved) * np.sin(2 * np.pi * moved)
    assert np.ptp(places - motion) < 2 * 0.32e6 / spec.clock_hz


LIMITS = {0.0: 0.0023, 0.002: 0.0038, 0.01: 0.0070, 0.02: 0.0097, 0.05: 0.0153, 0.1: 0.0222}
"""RMS error of the velocity, mm/s, by the error of an edge, counts: what the page says."""


@pytest.mark.parametrize("error", LIMITS if LONG else [0.05])
def test_the_paper_signal(error):
    signal = signals.load("paper")
    encoder = {"encoder.edge_error_counts": error, "encoder.seed": 2} if error else None
    spec = axis_spec("edge-kalman", 1_000_000, signal.acceleration_max_m_per_s2)
    _, bound = edge_limit.limit(signal, spec, error, *errors_of(encoder))
    assert bound * 1e3 == pytest.approx(LIMITS[error], rel=0.03)
    # The estimator knows neither the density nor the error, and is within twice the bound.
    backend = "float" if LONG else "fixed"
    found = measure("edge-kalman", "u", "paper", 1_000_000, backend, encoder=encoder)
    assert found["rms_mm_s"] < 2 * bound * 1e3
