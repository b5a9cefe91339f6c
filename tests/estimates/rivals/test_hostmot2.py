"""hostmot2's velocity, on edges made by hand: what a reading gives follows from two stamps and a difference."""

import pytest

from hardwall.sim.estimates.rivals.hostmot2 import TIMEOUT_S, Hostmot2
from stimuli.rivals import every, read_at, steady

USUAL = Hostmot2(TIMEOUT_S)


def readings(edges, times_s) -> list[float]:
    return read_at(USUAL, 5, edges, times_s)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("speed", [7, 300, 123_456])
def test_a_constant_speed_is_exact_from_the_second_change_on(speed, way):
    edges = steady(5, speed, way, 1000)
    found = readings(edges, every(max(1e-3, 0.3 / speed), edges[-1][0]))
    moving = next(k for k, velocity in enumerate(found) if velocity)
    assert found[moving:] == [pytest.approx(way * speed, rel=1e-9)] * (len(found) - moving)
    # Nothing is known of the first edge but that there was one.
    assert moving * max(1e-3, 0.3 / speed) >= edges[1][0] or speed > 1000


def test_counts_between_two_readings_are_over_the_time_of_their_last_edges():
    edges = [(0.0004, 6), (0.0012, 7), (0.0015, 8), (0.0026, 9)]
    found = readings(edges, [0, 0.001, 0.002, 0.003])
    assert found == [0, 0, pytest.approx(2 / 0.0011), pytest.approx(1 / 0.0011)]


@pytest.mark.parametrize("way", [1, -1])
def test_at_rest_it_is_bounded_by_the_time_since_the_edge_and_ends(way):
    edges = steady(5, 100, way, 10)
    last_s = edges[-1][0]
    since_s = [0.005, 0.02, 0.1, 0.499, 0.501, 3.0]
    found = readings(edges, [*every(1e-3, last_s), *(last_s + each for each in since_s)])[-len(since_s) :]
    expected = [way * 100, way / 0.02, way / 0.1, way / 0.499, 0, 0]
    assert found == [pytest.approx(each) for each in expected]


def test_the_first_edge_after_a_stop_is_a_beginning():
    edges = [*steady(5, 100, 1, 10), (2.0, 16), (2.01, 17)]
    times_s = [*every(1e-3, 0.1), 1.9, 2.001, 2.0105]
    assert readings(edges, times_s)[-3:] == [0, 0, pytest.approx(100)]


def test_a_single_count_back_reads_nothing_and_a_second_one_counts():
    edges = [*steady(5, 100, 1, 4), (0.05, 8), (0.06, 7), (0.07, 8)]
    found = readings(edges, [0, 0.011, 0.021, 0.031, 0.041, 0.051, 0.061, 0.071])
    assert found[-3:] == [0, pytest.approx(-100), 0]
    # Two counts back within one reading are no flicker.
    assert readings([*edges[:4], (0.05, 8), (0.06, 7)], [0, 0.021, 0.041, 0.061])[-1] == pytest.approx(-2 / 0.02)


def test_a_count_that_came_back_between_two_readings_is_no_change():
    edges = [*steady(5, 100, 1, 4), (0.0401, 8), (0.0402, 9)]
    found = readings(edges, [0, 0.011, 0.021, 0.031, 0.04, 0.041, 0.09])
    assert found[-3:] == [pytest.approx(100), pytest.approx(100), pytest.approx(1 / 0.05)]
