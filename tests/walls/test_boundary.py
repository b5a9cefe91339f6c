"""The walls of a map: on invented regions, the search finds the edge, and everyone hits what they should."""

from collections.abc import Callable

import numpy as np
import pytest

from hardwall.sim.walls.boundary import SCOUTS, BoundaryPoint, Grid, area, share, walls

GRID = Grid(10.0, 1000.0, 1.0, 5.0, 1.0)
STARTS = 10
Hits = dict[tuple[float, float], dict[int, str]]


def hit(stable: Callable[[float, float, int], bool], grid: Grid = GRID, starts: int = STARTS) -> Hits:
    """Return the verdicts on all walls that are asked for; none is asked for twice from one start."""
    steps, found, hits = walls(grid, starts), None, {}
    while True:
        try:
            stiffness, damping, asked = steps.send(found)
        except StopIteration:
            return hits
        assert stiffness in [row * 10.0 for row in range(1, grid.rows + 1)]
        own = hits.setdefault((stiffness, damping), {})
        assert asked
        assert not set(asked) & set(own)
        found = ["stable" if stable(stiffness, damping, start) else "unstable" for start in asked]
        own.update(zip(asked, found, strict=True))


def column(hits: Hits, damping: float) -> dict[float, dict[int, str]]:
    return {stiffness: of for (stiffness, at), of in sorted(hits.items()) if at == damping}


def full(of: dict[float, dict[int, str]]) -> list[float]:
    """Return the walls that every start has hit."""
    return [stiffness for stiffness, verdicts in of.items() if len(verdicts) == STARTS]


@pytest.mark.parametrize("edge", [10.0, 20.0, 120.0, 130.0, 470.0, 980.0, 990.0])
def test_every_start_hits_both_sides_of_an_edge(edge):
    for damping in GRID.dampings:
        of = column(hit(lambda stiffness, _, __: stiffness <= edge), damping)
        assert full(of) == [edge, edge + 10]
        # Others are hit by the scouts, and far away by one.
        assert {len(verdicts) for verdicts in of.values()} <= {1, SCOUTS, STARTS}
        assert (min(of), max(of)) == (10.0, 1000.0)
        assert len(of) < 30


def test_a_region_that_ends_has_one_start_in_the_rest_and_all_at_the_first_step():
    hits = hit(lambda stiffness, damping, _: stiffness <= 300 and damping < 3)
    ended = column(hits, 5.0)
    assert full(ended) == [10.0]
    assert sum(map(len, ended.values())) < STARTS + SCOUTS + 12


def test_a_region_beyond_the_map_is_hit_at_its_last_step():
    of = column(hit(lambda *_: True), 3.0)
    assert full(of) == [1000.0]


def test_what_differs_among_starts_is_hit_until_most_agree():
    """Start n is stable up to 200 + 50 n: all starts hit walls from where 9 of 10 are stable to where 1 of 10 is."""
    of = column(hit(lambda stiffness, _, start: stiffness <= 200 + 50 * start), 3.0)
    everywhere = full(of)
    assert min(everywhere) <= 250
    assert max(everywhere) > 600
    assert len(everywhere) < 20


def test_an_island_above_soft_walls_that_are_unstable_is_found():
    hits = hit(lambda stiffness, _, __: 250 <= stiffness <= 560)
    for damping in GRID.dampings:
        of = column(hits, damping)
        assert full(of) == [560.0, 570.0]
        assert "unstable" in of[10.0].values()


@pytest.mark.parametrize(("number", "looked"), [(5, 5), (31, 31), (32, 16), (50, 17), (160, 16)])
def test_far_from_the_edge_a_map_of_many_b_is_looked_at_in_some(number, looked):
    grid = Grid(10.0, 1000.0, 1.0, float(number), 1.0)
    hits = hit(lambda stiffness, _, __: stiffness <= 300, grid)
    far = [damping for damping in grid.dampings if (1000.0, damping) in hits]
    assert len(far) == looked
    assert len(set(np.diff(far))) == 1
    # Every start looks, in turn.
    assert {start for damping in far for start in hits[1000.0, damping]} == set(range(min(looked, STARTS)))
    # The edge is found in all of them.
    assert all(len(hits[300.0, damping]) == len(hits[310.0, damping]) == STARTS for damping in grid.dampings)


def test_one_start_alone_has_a_map():
    hits = hit(lambda stiffness, damping, _: stiffness <= 100 * damping, starts=1)
    assert {len(verdicts) for verdicts in hits.values()} == {1}
    assert all((100 * damping, damping) in hits and (100 * damping + 10, damping) in hits for damping in GRID.dampings)


def test_a_grid_of_one_step_and_one_damping():
    grid = Grid(10.0, 10.0, 5.0, 5.0, 2.0)
    assert grid.dampings == [5.0]
    for stable in (True, False):
        of = hit(lambda *_, stable=stable: stable, grid)
        assert list(of) == [(10.0, 5.0)]
        assert len(of[10.0, 5.0]) == STARTS


def test_steps_that_do_not_fit_exactly_are_whole():
    assert Grid(1.0, 100.0, 3.0, 39.0, 2 / 3).dampings[-1] == pytest.approx(39.0)
    assert Grid(0.1, 0.3, 1.0, 1.0, 1.0).rows == 3


def test_an_undecided_one_counts_half():
    assert share(["stable", "undecided", "unstable", "unstable"]) == 0.375


def test_the_area_is_numpys():
    rng = np.random.default_rng(3)
    at, heights = np.cumsum(rng.random(9)), rng.random(9)
    boundary = [BoundaryPoint(b, k, None) for b, k in zip(at.tolist(), heights.tolist(), strict=True)]
    assert area(boundary) == pytest.approx(np.trapezoid(heights, at))
