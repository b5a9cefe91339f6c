"""The Pico's sub-step speed, on edges made by hand."""

import pytest

from hardwall.sim.estimates.rivals.pico import UNIFORM, Substep
from stimuli.rivals import every, read_at, steady

PLAIN = Substep(UNIFORM)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("speed", [150, 6400, 250_000])
def test_a_constant_speed_is_exact(speed, way):
    edges = steady(7, speed, way, 400)
    found = read_at(PLAIN, 7, edges, every(min(0.01, 100 / speed), edges[-1][0]))
    assert found[-1] == pytest.approx(way * speed, rel=1e-9)


def test_the_first_edge_bounds_the_speed_by_the_cells():
    # Five counts in the first period, the last of them just now: from half a count, or just, to 5 counts in its time.
    edges = [(0.002 * (k + 1), 1 + k) for k in range(5)]
    (_, found) = read_at(PLAIN, 0, edges, [0, 0.0101])
    # The edge into cell 5 is at place 5. At the last reading the handle was in cell 0: between 0 and 1.
    assert found == pytest.approx((5 - 1) / 0.01)


def test_a_change_is_over_the_time_of_the_last_edges():
    edges = [(0.004, 1), (0.013, 2), (0.017, 3), (0.028, 4)]
    found = read_at(PLAIN, 0, edges, [0, 0.01, 0.02, 0.03])
    assert found[2:] == [pytest.approx(2 / 0.013), pytest.approx(1 / 0.011)]


@pytest.mark.parametrize("way", [1, -1])
def test_at_rest_the_cell_bounds_the_speed_and_the_third_reading_ends_it(way):
    edges = steady(0, 1000, way, 105)
    last_s = edges[-1][0]
    times_s = [*every(0.01, 0.1), 0.11, 0.12, 0.13, 0.14, 5.0]
    found = read_at(PLAIN, 0, edges, times_s)[-5:]
    # The cell ends a count beyond the last edge.
    bounds = [way / (at_s - last_s) for at_s in (0.12, 0.13)]
    assert found == [pytest.approx(way / (0.11 - last_s)), *(pytest.approx(each) for each in bounds), 0, 0]


def test_after_a_reversal_the_edge_is_at_the_other_end_of_the_cell():
    # Down through the edge between cells 4 and 3, which is at place 4, from place 4: no distance.
    edges = [*steady(0, 100, 1, 4), (0.06, 3), (0.07, 2)]
    found = read_at(PLAIN, 0, edges, [0, 0.012, 0.022, 0.032, 0.042, 0.062, 0.072])
    assert found[-2:] == [0, pytest.approx(-100)]


def test_a_calibration_takes_the_errors_of_the_four_kinds_out():
    offsets = (0.0, 0.25, 0.1, -0.2)
    speed = 130.0
    # Edge n is at n + its offset.
    edges = [((n + offsets[n & 3]) / speed, n) for n in range(1, 200)]
    times_s = every(0.02, edges[-1][0])
    known, unknown = (read_at(Substep(each), 0, edges, times_s)[3:] for each in (offsets, UNIFORM))
    assert known == [pytest.approx(speed, rel=1e-9)] * len(known)
    assert max(abs(each - speed) for each in unknown) > 5
