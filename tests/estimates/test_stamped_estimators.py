"""Estimators that time edges, on known motions of an encoder: their rounding, their bounds, and edges out of place."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators.cycle_times import AGE_LIMIT
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.period_count import START
from hardwall.sim.estimates import accuracy, motions, playback, signals
from hardwall.sim.world.encoder import offsets
from hardwall.testing.estimators import reset_words
from stimuli.lengths import LONG, WHOLE
from stimuli.papers_signal import RATES
from stimuli.specs import spec

WANTED = {0.01: 0.015, 0.05: 0.03, 0.1: 0.05}
"""The RMS error that edges displaced at random may cost `edge-kalman` on the paper's signal, mm/s, by their error in
counts."""


def velocities(signal, axis, backend, encoder=(0.0, 0.0, 0.0, 0.0)):
    """Return the velocity at every sample, m/s, and the flags."""
    chunks = list(playback.velocities(signal, axis, "u", backend, encoder))
    return np.concatenate([chunk for _, chunk, _ in chunks]), chunks[-1][2]


def exact(signal, axis, samples):
    """Return the exact velocity at every sample, m/s."""
    return accuracy.exact_velocity(signal.motion, np.arange(samples) / axis.sample_hz)


@pytest.mark.parametrize(
    ("name", "rate"),
    [
        *((name, rate) for name in ("period", "period-count") for rate in (RATES if WHOLE else RATES[-1:])),
        *((name, rate) for name in ("mt", "mt-divisionless") for rate in ((1_000, 100_000) if WHOLE else (100_000,))),
    ],
)
def test_fixed_point_is_the_algorithm_rounded(name, rate):
    """`fixed` is within half an LSB of `float`, and within 1 % of the estimator's own error in RMS."""
    signal = replace(signals.paper(), seconds=0.3)
    axis = accuracy.axis_spec(name, rate, signal.acceleration_max_m_per_s2)
    fixed, flags = velocities(signal, axis, "fixed")
    real, _ = velocities(signal, axis, "float")
    assert flags == 0
    half_lsb = axis.design.estimator.velocity.lsb / 2 * axis.velocity_unit_m_per_s
    assert np.abs(fixed - real).max() <= half_lsb * (1 + 1e-9)
    first = rate // 100  # the signal starts at full speed, so the error is the whole speed until the first edges
    own = real[first::7] - exact(signal, axis, len(real))[first::7]
    assert np.sqrt(np.mean((fixed - real) ** 2)) <= 0.01 * np.sqrt(np.mean(own**2))


@pytest.mark.parametrize("name", ["period", "mt", "mt-divisionless"])
def test_a_standing_axis_reads_zero_and_a_slowing_one_falls(name):
    """Behind the last edge the speed falls with the bound, to exactly 0 when that edge is forgotten."""
    signal = signals.Signal("stop", motions.Stop(5e-3, 0.1, 1.0), 1.2, 0.0, signals.DEVICE_ACCELERATION)
    axis = accuracy.axis_spec(name, 10_000, signals.DEVICE_ACCELERATION)
    seen, _ = velocities(signal, axis, "fixed")
    after = np.arange(len(seen)) / axis.sample_hz - 0.105
    d = axis.design.estimator
    assert (np.diff(seen[after > 0]) <= 0).all()
    standing = after > 0
    assert (seen[standing] <= 1.5 * axis.count_m / after[standing] + d.velocity.lsb * axis.velocity_unit_m_per_s).all()
    limit = AGE_LIMIT * (1 << d.stamp_width) / axis.clock_hz
    rest = seen[after > limit]
    assert len(rest) > 100
    assert not rest.any()


@pytest.mark.parametrize("displaced", [0.0, 0.1])
def test_the_error_of_mt_is_within_the_guaranteed_bound(displaced):
    """On the paper's signal from where a window is short of a count in motion, with edges in place and out of place."""
    rate, signal = 10_000, replace(signals.paper(), seconds=0.2)
    axis = accuracy.axis_spec("mt", rate, signal.acceleration_max_m_per_s2)
    d = axis.design.estimator
    late = offsets((displaced, -displaced, displaced, -displaced), 0.0)
    seen, flags = velocities(signal, axis, "float", late)
    true, unit = exact(signal, axis, len(seen)), axis.velocity_unit_m_per_s
    c = axis.acceleration_max_m_per_s2 / axis.count_m / rate**2
    fastest = np.abs(true).max() / unit
    # A stamp is late by less than a clock; the last edge is older than the sample by less than the time of an edge.
    stamps = fastest / (d.half * d.clocks)
    bound = c * (d.half + 1) + 2 * displaced / d.half + stamps + 2 * c
    error = np.abs(seen - true)[4 * d.half :] / unit
    assert flags == 0
    assert error.max() <= bound
    assert error.max() >= 0.3 * bound


@pytest.mark.parametrize("rate", [1_000, 1_000_000])
@pytest.mark.parametrize("speed", [1.03, 29.7, 973.0])
def test_misplaced_edges_change_nothing_in_period_at_constant_speed(speed, rate):
    """The speed is within the stamp's own error, v / D, of the exact one, for any errors of phase and duty."""
    signal = replace(signals.steady(speed), seconds=0.05 if speed > 2 else 0.5)
    axis = accuracy.axis_spec("period", rate, signals.DEVICE_ACCELERATION)
    v = speed * 1e-3 / axis.count_m / axis.clock_hz  # counts a clock
    samples_a_cycle = 4 / v / axis.clocks_per_sample
    for errors in ((0.0, 0.0), (0.25, 0.0), (-0.25, 0.0), (0.0, 0.4), ((0.2, -0.1, 0.0, 0.15), 0.1)):
        seen, flags = velocities(signal, axis, "float", offsets(*errors))
        settled = seen[math.ceil(3 * samples_a_cycle) + 2 :] / axis.count_m / axis.clock_hz
        assert (flags, len(settled) > 10) == (0, True)
        least_clocks = 4 / v - 1
        assert np.abs(settled - v).max() <= v / least_clocks


def test_misplaced_edges_change_little_in_period_on_the_way():
    """On the paper's signal the RMS error is that of ideal edges except for the few edges of every turn."""
    signal, rate = signals.paper(), 10_000
    axis = accuracy.axis_spec("period", rate, signal.acceleration_max_m_per_s2)
    true = exact(signal, axis, int(signal.seconds * rate))[rate:]
    ideal, misplaced = (
        np.sqrt(np.mean((velocities(signal, axis, "fixed", late)[0][rate:] - true) ** 2))
        for late in (offsets(), offsets((0.0, 0.25, 0.0, 0.25)))
    )
    assert misplaced <= 1.02 * ideal


@pytest.mark.parametrize("rate", [10_000, 1_000_000])
def test_a_hundredth_of_a_millimetre_a_second_is_read_by_period(rate):
    """A step of 1 um lasts 0.1 s; stamps are exact to 0.2 ppm of it, so what is off is the rounding."""
    row = accuracy.measure("period", "u", "steady:0.01", rate, "fixed")
    assert 0 < row["max_mm_s"] < 0.01 * 0.01


@pytest.mark.parametrize("rate", [10_000, 1_000_000])
def test_errors_and_jumps_of_period_count_are_within_the_bounds(rate):
    """Both modes keep their promise while the axis brakes through the switching speed at its largest acceleration."""
    bound = 12.0
    axis = accuracy.axis_spec("period-count", rate, bound)
    d, unit = axis.design.estimator, axis.velocity_unit_m_per_s
    window, switch = 1 << d.window_bits, axis.design.gains.switch_m_per_s
    seconds = switch / bound + 4 * window / rate
    slowing = motions.Stop(1.5 * switch, 4 * window / rate, bound)
    signal = signals.Signal("slowing", slowing, seconds, 0.0, bound, 1e-4)
    seen, flags = velocities(signal, axis, "float")
    assert flags == 0
    v = np.array([motions.velocity(slowing, k / rate) for k in range(len(seen))])
    c, acceleration = axis.clocks_per_sample, bound / unit / rate
    counted = 1 / window + 1.5 * acceleration * window
    timed = (v / unit) ** 2 / (4 * c) * (1 + 1e-3) + 3 * acceleration / (v / unit)
    settled = slice(2 * window + 8, None)
    error = np.abs(seen - v)[settled] / unit
    assert (error <= np.maximum(counted, timed[settled])).all()
    whole = np.abs(seen * window / unit - np.round(seen * window / unit)) < 1e-9
    assert whole[settled][0]
    assert not whole[-1]


@pytest.mark.parametrize("errors", [(0.0, 0.0), (0.25, 0.0), (-0.25, 0.0), (0.0, 0.4)])
def test_misplaced_edges_change_nothing_in_period_count_below_the_switching_speed(errors):
    """The speed is within the stamp's own error, v / D, of the exact one."""
    signal = replace(signals.steady(29.7), seconds=0.05)
    axis = accuracy.axis_spec("period-count", 100_000, signals.DEVICE_ACCELERATION)
    seen, _ = velocities(signal, axis, "float", offsets(*errors))
    v = 29.7e-3 / axis.count_m / axis.clock_hz  # counts a clock
    settled = seen[math.ceil(12 / v / axis.clocks_per_sample) :] / axis.count_m / axis.clock_hz
    assert len(settled) > 1000
    assert np.abs(settled - v).max() <= v / (4 / v - 1)


@pytest.mark.parametrize(("name", "switch"), [("paper", None), ("narrow", 5)])
def test_constant_speed_does_not_chatter_in_period_count(name, switch):
    """There is at most one switch around the switching speed, with edges misplaced by a quarter count."""
    d = spec(name, "period-count").design.estimator
    window, switch, half = 1 << d.window_bits, switch or reset_words(d)[0], 1 << (d.count_width - 1)
    params, late, counted = d.params({"period_count_switch": switch}), offsets((0.0, 0.25, 0.0, -0.25)), []
    for speed in np.linspace(switch - 3, switch + 3, 13) / window:
        state, modes = START, []
        for k in range(50 * window):
            n = math.floor(speed * k)
            count = n + 1 if speed * k >= n + 1 + late[(n + 1) & 3] else n - 1 if speed * k < n + late[n & 3] else n
            state, *_ = estimate(params, state, seen_count((count + half) % (2 * half) - half), 0)
            modes.append(state.counting)
        assert np.abs(np.diff(modes)).sum() <= 1
        counted.append(modes[-1])
    assert counted[0] == 0
    assert counted[-1] == 1


@pytest.mark.parametrize("error", WANTED if LONG else [0.05])
def test_one_set_of_gains_bears_edges_of_their_own_and_an_impact(error):
    """The gains are those for the impact's acceleration and the swing's jerk, in both."""
    bound = signals.load("hit").acceleration_max_m_per_s2
    encoder = {"encoder.edge_error_counts": error, "encoder.seed": 2}
    of_one = {"backend": "fixed", "encoder": encoder, "bounds": {"acceleration_max_m_per_s2": bound}}
    swing, impact = (accuracy.measure("edge-kalman", "u", name, 1_000_000, **of_one) for name in ("paper", "hit"))
    assert swing["rms_mm_s"] < WANTED[error]
    assert impact["rms_mm_s"] < 0.3
    assert abs(impact["delay_s"]) < 10e-6
    assert swing["flags"] == impact["flags"] == []
