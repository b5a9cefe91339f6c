"""SimpleFOC's two speeds and their low pass, on edges made by hand."""

import math

import pytest

from hardwall.sim.estimates.rivals.simplefoc import Differences, Mixed
from stimuli.rivals import every, read_at, steady

PLAIN = 0.0
"""No low pass."""


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("speed", [30, 1700, 90_000])
def test_the_encoder_is_exact_at_a_constant_speed(speed, way):
    edges = steady(0, speed, way, 300)
    found = read_at(Mixed(PLAIN), 0, edges, every(1e-3, edges[-1][0]))
    assert found[-1] == pytest.approx(way * speed, rel=1e-9)
    assert found[len(found) // 2 :] == [pytest.approx(way * speed, rel=1e-9)] * len(found[len(found) // 2 :])


def test_the_first_edge_is_timed_from_the_start():
    assert read_at(Mixed(PLAIN), 0, [(0.0205, 1)], [0, 0.01, 0.02, 0.021])[-1] == pytest.approx(1 / 0.0205)


def test_the_encoder_holds_its_speed_for_a_tenth_of_a_second_and_is_then_at_rest():
    edges = steady(0, 1000, 1, 50)
    found = read_at(Mixed(PLAIN), 0, edges, [*every(1e-3, 0.05), 0.1, 0.149, 0.151, 5.0])
    assert found[-4:] == [pytest.approx(1000), pytest.approx(1000), 0, 0]


def test_edges_closer_than_half_a_period_give_no_speed():
    edges = [(0.0098, 1), (0.0199, 2), (0.0201, 3), (0.0295, 4)]
    found = read_at(Mixed(PLAIN), 0, edges, [0, 0.01, 0.02, 0.03, 0.04])
    # The third edge comes 0.2 ms behind the second, and the fourth in the same period.
    assert found == [0, pytest.approx(1 / 0.0098), pytest.approx(1 / 0.0101), pytest.approx(2 / 0.0096), found[3]]
    close = read_at(Mixed(PLAIN), 0, edges[:3], [0, 0.01, 0.02, 0.03])
    assert close[-1] == close[-2]


def test_the_encoder_after_a_reversal():
    edges = [*steady(0, 100, 1, 4), (0.05, 3), (0.06, 2)]
    found = read_at(Mixed(PLAIN), 0, edges, [0.0, 0.015, 0.025, 0.035, 0.045, 0.055, 0.065])
    assert found[-3:] == [pytest.approx(100), pytest.approx(-100), pytest.approx(-100)]


def test_the_sensor_divides_a_change_by_the_time_since_the_last_change():
    edges = [(0.0042, 1), (0.0077, 2), (0.0078, 3)]
    found = read_at(Differences(PLAIN), 0, edges, every(1e-3, 0.01))
    expected = [0] * 5 + [1 / 0.005] * 3 + [2 / 0.003] * 3
    assert found == [pytest.approx(each) for each in expected]


def test_the_sensor_keeps_its_speed_at_rest():
    edges = steady(0, 1000, 1, 50)
    assert read_at(Differences(PLAIN), 0, edges, [*every(1e-3, 0.06), 1000.0])[-1] == pytest.approx(1000)


def test_the_sensor_waits_for_a_tenth_of_a_millisecond():
    edges = [(0.00105, 1), (0.00112, 2), (0.00119, 3)]
    found = read_at(Differences(PLAIN), 0, edges, [0, 0.0011, 0.00115, 0.00122])
    assert found == [0, pytest.approx(1 / 0.0011), pytest.approx(1 / 0.0011), pytest.approx(2 / 0.00012)]


@pytest.mark.parametrize("kind", [Mixed, Differences])
def test_the_low_pass_has_its_time_constant(kind):
    period_s, filter_s = 1e-4, 5e-3
    edges = steady(0, 10_000, 1, 1000)
    found = read_at(kind(filter_s), 0, edges, every(period_s, edges[-1][0]))
    share = filter_s / (filter_s + period_s)
    begun = next(k for k, velocity in enumerate(found) if velocity)
    for later in (0, 10, 200):
        assert found[begun + later] == pytest.approx(10_000 * (1 - share ** (later + 1)), rel=1e-6)
    after = found[begun + round(filter_s / period_s)]
    assert after == pytest.approx(10_000 * (1 - math.exp(-1)), rel=0.02)
