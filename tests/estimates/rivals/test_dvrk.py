"""dVRK's velocity and acceleration, against the exact arithmetic of rationals on edges made by hand."""

from fractions import Fraction

import pytest

from hardwall.sim.estimates.rivals.dvrk import ACCELERATION, LONGEST_S, MEASURED, PREDICTED, Dvrk
from stimuli.rivals import read_at, steady

OUTPUTS = MEASURED, PREDICTED, ACCELERATION
START = 17
"""The cell at time 0: of no kind of edge by itself."""


def outputs(edges, at_s) -> list[float]:
    """Return what the three outputs read at one time."""
    return [read_at(Dvrk(output), START, edges, [at_s])[0] for output in OUTPUTS]


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("speed", [3, 1000, 250_000])
def test_a_constant_speed_is_exact(speed, way):
    edges = steady(START, speed, way, 12)
    measured, predicted, acceleration = outputs(edges, float(Fraction(12, speed) + Fraction(1, 3 * speed)))
    assert measured == pytest.approx(way * speed, rel=1e-12)
    assert predicted == pytest.approx(way * speed, rel=1e-9)
    assert acceleration == pytest.approx(0, abs=1e-9 * speed**2)


def test_it_needs_a_full_cycle_and_a_quarter_more_for_the_acceleration():
    edges = [(1, 18), (2, 19), (4, 20), (7, 21), (11, 22), (16, 23)]
    scaled = [(at / 100, number) for at, number in edges]
    found = [outputs(scaled[:many], scaled[many - 1][0]) for many in range(1, 7)]
    assert [measured for measured, _, _ in found[:4]] == [0, 0, 0, 0]
    assert found[4][0] == pytest.approx(4 / float(Fraction(10, 100)))
    # The fifth quarter began before the first edge: its counter has come to its end.
    assert found[4][2] == pytest.approx((40 - 4 / LONGEST_S) / ((LONGEST_S + 0.04) / 2), rel=0.1)
    # Quarters of 1, 2, 3, 4 and 5 hundredths: cycles of 10 and of 14.
    newest, before = Fraction(400, 14), Fraction(400, 10)
    between = (Fraction(5, 100) + Fraction(1, 100)) / 2
    assert found[5][0] == pytest.approx(float(newest))
    assert found[5][2] == pytest.approx(float((newest - before) / between))
    # Half a cycle later, and no time since the last edge.
    assert found[5][1] == pytest.approx(max(float(newest + (newest - before) / between * Fraction(7, 100)), 0))


@pytest.mark.parametrize("way", [1, -1])
def test_the_prediction_has_a_limit_and_keeps_its_sign(way):
    edges = steady(START, 100, way, 12)
    last_s = edges[-1][0]
    for since_s in (0.02, 0.5, 1.0):
        assert read_at(Dvrk(PREDICTED), START, edges, [last_s + since_s]) == [pytest.approx(way / since_s)]
    # A braking handle, whose next cycle would be of the other sign.
    braking = [(at, START + way * (number + 1)) for number, at in enumerate((0.1, 0.11, 0.12, 0.13, 0.14, 0.3))]
    measured, predicted, acceleration = outputs(braking, 0.3)
    assert way * measured > 0 > way * acceleration
    assert predicted == 0


def test_the_prediction_reaches_from_the_middle_of_the_cycle_to_now():
    # Quarters of 20, 18, 16, 15 and 14 ms: cycles of 69 and of 63 ms.
    ends_ms = (20, 40, 58, 74, 89, 103)
    edges = [(at / 1000, START + 1 + k) for k, at in enumerate(ends_ms)]
    newest, before = Fraction(4000, 63), Fraction(4000, 69)
    acceleration = (newest - before) / (Fraction(20 + 14, 1000) / 2)
    for since_ms in (0, 5, 10):
        expected = newest + acceleration * (Fraction(63, 2000) + Fraction(since_ms, 1000))
        assert outputs(edges, (103 + since_ms) / 1000)[1] == pytest.approx(float(expected))


def test_at_rest_the_measured_speed_stays_and_the_predicted_one_falls_to_the_end_of_its_counter():
    edges = steady(START, 100, 1, 12)
    measured, predicted, _ = outputs(edges, edges[-1][0] + 1000.0)
    assert measured == pytest.approx(100)
    assert predicted == pytest.approx(1 / LONGEST_S)
    assert pytest.approx(1.3653, rel=1e-4) == LONGEST_S


def test_a_cycle_longer_than_the_counter_is_no_speed():
    slow = steady(START, 4 / (0.99 * LONGEST_S), 1, 8)
    assert outputs(slow, slow[-1][0])[0] == pytest.approx(4 / (0.99 * LONGEST_S))
    slower = steady(START, 4 / (1.01 * LONGEST_S), 1, 8)
    assert outputs(slower, slower[-1][0]) == [0, 0, 0]


def test_after_a_reversal_it_reads_nothing_until_four_quarters_are_of_one_direction():
    there, turned = steady(START, 100, 1, 8), START + 8
    back = [(there[-1][0] + (k + 1) / 50, turned - k - 1) for k in range(6)]
    found = [outputs(there + back[:many], back[many - 1][0] if many else there[-1][0])[0] for many in range(7)]
    assert found == [pytest.approx(100), 0, 0, 0, pytest.approx(-50), pytest.approx(-50), pytest.approx(-50)]


def test_errors_that_repeat_every_four_edges_do_not_show():
    late_s = (0.0, 0.003, -0.002, 0.001)
    edges = [(at + late_s[number & 3], number) for at, number in steady(START, 100, 1, 12)]
    for many in range(6, 13):
        measured, _, acceleration = outputs(edges[:many], edges[many - 1][0])
        assert measured == pytest.approx(100)
        assert acceleration == pytest.approx(0, abs=1e-8)


def test_the_acceleration_of_two_kinds_of_edges_is_none():
    # Up four, down one, up again: the newest and the fifth quarter have one direction, and other kinds of edges.
    numbers = [18, 19, 20, 21, 20, 21]
    edges = [(0.01 * (k + 1) + 0.001 * k * k, number) for k, number in enumerate(numbers)]
    assert outputs(edges, edges[-1][0])[2] == 0
