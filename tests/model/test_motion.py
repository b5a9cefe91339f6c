"""Bounds of a recorded motion: from its counts within what the rounding allows, or as given."""

import numpy as np
import pytest

from hardwall.model.motion import ENOUGH, Motion, acceleration_of, ranges
from hardwall.testing import rng


@pytest.mark.parametrize("offset", [0, 12345, -(2**40)])
def test_the_acceleration_is_that_of_a_parabola_but_for_the_rounding(offset):
    k = np.arange(4000)
    for acceleration in (1e-4, 3e-3, 0.4, 17.0):
        counts = np.floor(acceleration / 2 * k**2 + 0.3).astype(np.int64) + offset
        found = acceleration_of(counts)
        assert acceleration * (1 - 2 / ENOUGH) <= found <= acceleration * ENOUGH / (ENOUGH - 2)


def test_a_jump_of_fewer_counts_is_no_other_motion():
    """A jump of n counts: n - 2 counts a sample^2 at least, and n at most, whether or not that is enough to be sure."""
    for counts in range(3, 40):
        jump = np.zeros(1000, np.int64)
        jump[500:] = counts
        assert counts - 2 <= acceleration_of(jump) <= counts


def test_the_acceleration_of_several_lanes_is_the_largest():
    k = np.arange(2000)
    lanes = np.stack([np.floor(a / 2 * k**2).astype(np.int64) for a in (0.01, 0.5, 0.1)])
    assert acceleration_of(lanes) == max(acceleration_of(lane) for lane in lanes) == acceleration_of(lanes[1])


def test_ranges_are_powers_of_two_that_hold_the_record():
    random = rng()
    for _ in range(200):
        counts = np.cumsum(random.integers(-50, 60, random.integers(2, 400)))
        travel, speed = ranges(counts)
        assert np.log2(travel) % 1 == np.log2(speed) % 1 == 0
        assert travel / 2 < max(np.ptp(counts), 1) <= travel or np.ptp(counts) == 1
        assert speed / 2 < np.abs(np.diff(counts)).max() + 1 <= speed


def test_bounds_that_are_given_are_kept_and_the_others_are_named():
    counts = np.cumsum(rng().integers(-3, 4, 500))[None]
    motion, found = Motion.of(counts, 1e3, 1e-6, speed_max=2.0, travel=None)
    assert motion.speed_max == 2.0
    assert found.keys() == {"acceleration_max", "travel"}
    assert found == {name: getattr(motion, name) for name in found}
    _, scaled = Motion.of(counts, 2e3, 1e-6, speed_max=2.0)
    assert scaled["acceleration_max"] == pytest.approx(4 * found["acceleration_max"])
    assert scaled["travel"] == found["travel"]


def test_a_record_at_rest_has_bounds():
    motion, _ = Motion.of(np.zeros((1, 100), np.int64), 1e3)
    assert motion.acceleration_max > 0
    assert motion.speed_max == 1e3


def test_what_is_no_bound_is_refused():
    counts = np.arange(10)[None]
    with pytest.raises(ValueError, match="sped_max is no bound; bounds are count, acceleration_max, speed_max, travel"):
        Motion.of(counts, 1e3, sped_max=1.0)
    with pytest.raises(TypeError, match="counts must be integers, not float64"):
        Motion.of(np.zeros((1, 5)), 1e3)
    with pytest.raises(ValueError, match=r"counts must have two samples or more, not the shape \(3, 1\)"):
        Motion.of(np.zeros((3, 1), np.int64), 1e3)
    assert Motion.of(np.array([3, 2, 1], np.uint32), 1.0)[0].speed_max == 2.0
    with pytest.raises(TypeError, match="count must be a number, not None"):
        Motion.of(counts, 1e3, None)
    for wrong in (0.0, -1.0, float("nan"), 1e31):
        with pytest.raises(ValueError, match=r"speed_max must be 1e-30 to 1e\+30, not"):
            Motion(acceleration_max=1.0, speed_max=wrong, travel=1.0)
