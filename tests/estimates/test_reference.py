"""The reference of a replay: no delay, errors only after the first second, and the bound that it gives."""

import math

import numpy as np
import pytest

from hardwall.sim.estimates.replay import replay
from stimuli.replays import COARSEN, recording, reference_of, swing


def test_the_reference_has_no_delay():
    """It is the derivative of a sine, reduced as by a difference over two samples, within the rounding of counts."""
    amplitude, hertz, t = 1e9, 2.0, np.arange(4000) / 1000
    made = recording(np.round(amplitude * np.sin(2 * np.pi * hertz * t)))
    reference = replay(made, "fdm", "u", "float").reference_counts_per_s
    angle = 2 * np.pi * hertz / 1000
    truth = amplitude * np.sin(angle) * 1000 * np.cos(2 * np.pi * hertz * t)
    gain = 1 / (1 + (np.tan(angle / 2) / np.tan(np.pi * 40 / 1000)) ** 8)
    middle = slice(1000, 3000)
    assert np.abs(reference - gain * truth)[middle].max() <= 1e-9 * amplitude * angle * 1000 + 1000


def test_only_what_follows_the_first_second_is_judged():
    made = swing()
    result = replay(made, "fdm", backend="fixed", coarsen=COARSEN)
    error = result.velocity_counts_per_s - reference_of(made)
    assert result.rms_counts_per_s == pytest.approx(math.sqrt(np.mean(error[1000:] ** 2)), rel=1e-9)
    assert result.rms_counts_per_s == result.rms_fdm_counts_per_s
    assert replay(swing(1000), "fdm", backend="fixed").rms_counts_per_s is None


def test_the_bound_is_the_largest_acceleration_of_the_motion():
    made = swing(6000, 1e6)
    result = replay(made, "levant")
    largest = 1e6 * np.pi**2
    assert result.acceleration_max_counts_per_s2 == 9.9e6
    assert 0.98 * largest < result.acceleration_max_counts_per_s2 < 1.1 * largest
    assert result.gains == {
        "lambda_sqrt_counts_per_s": pytest.approx(math.sqrt(9.9e6)),
        "alpha_counts_per_s2": pytest.approx(1.1 * 9.9e6),
    }
    assert replay(made, "fdm").gains == {}
