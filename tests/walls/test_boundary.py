"""Tracing of a stable region: the walls hit and the boundaries found, on known regions."""

from dataclasses import replace

import pytest

from hardwall.sim.walls.boundary import BoundaryPoint, Grid, area, trace

GRID = Grid(10.0, 100.0, 1.0, 6.0, 0.5)


def traced(stable, grid: Grid = GRID) -> tuple[list[BoundaryPoint], list[tuple[float, float]]]:
    """Return the boundary, and the walls that were hit, for a region given by a function of K and B."""
    steps, asked = trace(grid), []
    try:
        wall = next(steps)
        while True:
            asked.append(wall)
            wall = steps.send(stable(*wall))
    except StopIteration as end:
        return end.value, asked


def limit(damping: float) -> float:
    """Return the largest stable K, which rises over B, falls, and ends."""
    return 5 + 30 * damping - 5.5 * damping**2


def test_the_boundary_is_found_on_the_grid_and_no_wall_is_hit_twice():
    boundary, asked = traced(lambda stiffness, damping: stiffness <= limit(damping))
    assert len(asked) == len(set(asked))
    assert boundary[-1].stable_n_per_m == 0
    assert [point.damping_n_s_per_m for point in boundary] == GRID.dampings[: len(boundary)]
    for point in boundary:
        exact = max(limit(point.damping_n_s_per_m), 0)
        assert point.stable_n_per_m == exact // 10 * 10
        assert point.marginal_n_per_m == point.stable_n_per_m + 10


def test_the_walls_are_hit_in_the_order_of_the_paper():
    """The search goes up from the softest wall; after every step of B it goes up or down from the marginal K."""
    _, asked = traced(lambda stiffness, damping: stiffness <= (30 if damping < 2 else 10))
    assert asked[:4] == [(10, 1), (20, 1), (30, 1), (40, 1)]
    assert asked[4:8] == [(40, 1.5), (30, 1.5), (40, 2), (30, 2)]
    assert asked[8:11] == [(20, 2), (10, 2), (20, 2.5)]


def test_a_region_that_leaves_the_map_has_no_marginal_wall_there():
    boundary, asked = traced(lambda *_: True)
    assert {point.stable_n_per_m for point in boundary} == {100.0}
    assert {point.marginal_n_per_m for point in boundary} == {None}
    assert len(asked) == 10 + len(GRID.dampings) - 1


def test_nothing_stable_is_looked_for_at_every_damping():
    boundary, asked = traced(lambda *_: False)
    assert boundary == [BoundaryPoint(damping, 0.0, 10.0) for damping in GRID.dampings]
    assert asked == [(stiffness, damping) for damping in GRID.dampings for stiffness in (10.0, 20.0, 40.0, 80.0)]


def test_a_region_that_begins_at_a_stiffer_wall_of_a_larger_damping_is_found():
    boundary, asked = traced(lambda stiffness, damping: 30 <= stiffness <= 70 and damping >= 2)
    assert [point.stable_n_per_m for point in boundary] == [0.0, 0.0, *[70.0] * 9]
    assert asked[8:15] == [(10, 2), (20, 2), (40, 2), (50, 2), (60, 2), (70, 2), (80, 2)]


def test_walls_below_the_boundary_are_hit_last_and_counted():
    """Four walls, a fifth of K apart, are hit below the boundary; the walls under 30 are not stable."""
    boundary, asked = traced(lambda stiffness, _: 30 <= stiffness <= 70, replace(GRID, walls_below=4))
    assert {point.held for point in boundary} == {0.75}
    assert asked[-4:] == [(10, 6), (30, 6), (40, 6), (60, 6)]
    soft, _ = traced(lambda stiffness, _: stiffness <= 10, replace(GRID, walls_below=4))
    assert {point.held for point in soft} == {None}, "there is no wall below the softest"


def test_rows_go_to_the_last_whole_step():
    assert Grid(35e3, 100e3, 1.0, 2.0, 1.0).rows == 2
    assert Grid(0.1, 0.3, 1.0, 2.0, 1.0).rows == 3


def test_area_is_that_of_trapezoids():
    boundary = [BoundaryPoint(1.0, 10.0, None), BoundaryPoint(3.0, 30.0, None), BoundaryPoint(4.0, 0.0, None)]
    assert area(boundary) == 2 * 20 + 15
    assert area(boundary[:1]) == 0


@pytest.mark.parametrize(("last", "count"), [(1.0, 1), (1.2, 1), (1.4999, 1), (1.5, 2), (6.0, 11)])
def test_dampings_go_to_the_last_whole_step(last, count):
    assert len(Grid(10.0, 100.0, 1.0, last, 0.5).dampings) == count
