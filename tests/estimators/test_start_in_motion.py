"""A start in motion of Levant's estimators: how long it lasts, by the legs of the phase plane."""

import dataclasses
import math

import levants
import numpy as np
import pytest

from hardwall.model.estimators import levant
from stimuli.specs import spec


def passed(ratio: float) -> float:
    """Return what is left of an error of u1 when the tracked position has passed the true one, for lambda^2 / alpha."""
    return math.exp(-math.pi / math.sqrt(8 / ratio - 1)) if ratio < 8 else 0.0


def settling_s(speed: float, acceleration: float, gains: levant.Gains, left: float) -> float:
    """Return when the error of u1, which begins with the speed, is at most `left` of it for good, without counts."""
    error, time, way = speed, 0.0, 1
    while True:
        # From one passing to the next the error falls at a constant rate.
        rate = gains.alpha_m_per_s2 - way * acceleration
        after = error * passed(gains.lambda_sqrt_m_per_s**2 / rate)
        if after <= left * speed:
            return time + (error - left * speed) / rate
        time, error, way = time + (error + after) / rate, after, -way


@pytest.mark.parametrize("acceleration", [-9.0, 0.0, 9.0])
@pytest.mark.parametrize("speed", [0.2, 0.5])
@pytest.mark.parametrize("name", ["levant", "levant-semi-implicit", "levant-implicit"])
def test_a_start_in_motion_settles_in_the_derived_time(name, speed, acceleration):
    """With the paper's gains, to 4 %."""
    axis = dataclasses.replace(spec("mhz", name), gains=None)
    gains, left = levant.Gains.default(axis), 0.04
    expected = settling_s(speed, acceleration, gains, left)
    time = np.arange(round(2 * expected * axis.sample_hz)) / axis.sample_hz
    counts = np.floor((speed * time + acceleration * time**2 / 2) / axis.count_m).astype(np.int64)
    error = levants.axis(axis, "u1").run(counts).velocity_m_per_s - speed - acceleration * time
    settled = time[np.flatnonzero(np.abs(error) > left * speed)[-1]]
    assert settled == pytest.approx(expected, rel=0.03)
