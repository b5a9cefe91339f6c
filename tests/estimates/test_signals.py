"""The signals by name: their properties, and refused names."""

import math

import numpy as np
import pytest

from hardwall.sim.estimates import motions, signals
from hardwall.sim.estimates.accuracy import exact_velocity


@pytest.mark.parametrize("name", [*signals.SIGNALS, "steady:0.01", "steady:1000"])
def test_no_signal_exceeds_the_bound_that_it_gives(name):
    signal = signals.load(name)
    assert signal.name == name
    step = 1e-7 if name == "hit" else 1e-5
    times = np.arange(signal.judged_from_s, signal.seconds, step)
    acceleration = np.abs(np.diff(exact_velocity(signal.motion, times))) / step
    assert acceleration.max() <= signal.acceleration_max_m_per_s2 * (1 + 1e-6)


def test_the_papers_bound_is_the_largest_acceleration():
    signal = signals.load("paper")
    assert signal.acceleration_max_m_per_s2 * 1e3 == pytest.approx(1678.5, abs=0.05)
    times = np.arange(0, 1, 1e-5)
    largest = np.abs(np.diff(exact_velocity(signal.motion, times))).max() / 1e-5
    assert signal.acceleration_max_m_per_s2 == pytest.approx(largest, rel=1e-6)


def test_a_hit_has_its_impact_in_what_is_judged():
    signal = signals.load("hit")
    speed = exact_velocity(signal.motion, np.arange(signal.judged_from_s, signal.seconds, 1e-4))
    assert speed.max() > 0.15
    assert speed.min() < -0.02
    assert signal.acceleration_max_m_per_s2 > 20


def test_steady_speeds_pass_ten_counts_while_judged():
    for speed in (0.01, 1.0, 1000.0):
        signal = signals.steady(speed)
        assert (signal.seconds - signal.judged_from_s) * speed * 1e-3 >= 10e-6 * (1 - 1e-12)


NO_SIGNALS = ["", "papers", "steady:", "steady:0", "steady:0.001", "steady:2e3", "steady:1e", "steady:nan"]


@pytest.mark.parametrize("name", NO_SIGNALS)
def test_what_is_no_signal_is_refused(name):
    with pytest.raises(ValueError, match=rf"^signal must be one of paper, .* steady:1000 \(mm/s\), not '{name}'$"):
        signals.load(name)


def test_the_flicker_crosses_an_edge_and_stays_within_a_count():
    signal = signals.load("flicker")
    times = np.linspace(0, 0.1, 1001)
    positions = np.array([motions.position(signal.motion, t) for t in times])
    assert positions.min() < 0 < positions.max() < 1e-6
    assert math.isclose(positions.max(), 0.3e-6, rel_tol=1e-3)
