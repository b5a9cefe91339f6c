"""The likelihood of stable walls: its curve, its boundary and its interval, on verdicts whose chances are known."""

import numpy as np
import pytest
from scipy.optimize import isotonic_regression

from hardwall.sim.walls.likelihood import Column, Wall, draws, held, islands

STIFFNESS = np.arange(1, 21) * 1e3


def walls(stable: np.ndarray, undecided: np.ndarray | None = None) -> list[Wall]:
    """Return walls of one B whose rows of verdicts are given, one column a start."""
    undecided = np.zeros(stable.shape, bool) if undecided is None else undecided
    names = np.where(undecided, "undecided", np.where(stable, "stable", "unstable"))
    return [
        Wall(6.0, stiffness, {start: {"verdict": str(name)} for start, name in enumerate(row)})
        for stiffness, row in zip(STIFFNESS.tolist(), names, strict=False)
    ]


def test_the_curve_is_the_most_likely_of_all_that_fall():
    """Against a search over all falling curves of a fine grid of chances, by dynamic programming."""
    rng = np.random.default_rng(7)
    chances = np.linspace(0.0025, 0.9975, 400)
    for _ in range(20):
        tries = rng.integers(1, 11, 12)
        stable = rng.binomial(tries, np.clip(1.1 - 0.09 * np.arange(12), 0, 1))
        likely = stable[:, None] * np.log(chances) + (tries - stable)[:, None] * np.log(1 - chances)
        best = likely[0]
        for row in likely[1:]:
            best = row + np.maximum.accumulate(best[::-1])[::-1]
        column = Column([], 1)
        column._stiffness = STIFFNESS[:12]
        found = column._half(stable.astype(float), tries.astype(float))
        # The curve that the regression gives is as likely as the best of the grid, to the grid's steps.
        curve = isotonic_regression(stable / tries, weights=tries.astype(float), increasing=False).x
        curve = np.clip(curve, chances[0], chances[-1])
        own = (stable * np.log(curve) + (tries - stable) * np.log(1 - curve)).sum()
        assert own >= best.max() - 1e-9
        below = STIFFNESS[:12][curve >= 0.5]
        assert (found == 0) if not len(below) else below.max() <= found <= below.max() + 1e3


def test_the_boundary_is_between_the_last_stable_and_the_first_unstable_wall():
    stable = np.arange(20)[:, None] < np.full(10, 7)
    column = Column(walls(stable), 10)
    assert column.boundary() == 7.5e3
    low, high = column.bounds(draws(10))
    assert (low == 7.5e3).all()
    assert (high == low).all()
    assert Column(walls(np.ones((20, 3), bool)), 3).boundary() == 20e3
    assert Column(walls(np.zeros((20, 3), bool)), 3).boundary() == 0.0


def test_an_island_does_not_move_the_boundary_far_and_is_said():
    stable = np.arange(20)[:, None] < np.full(10, 12)
    stable[3] = False
    stable[17] = True
    found = walls(stable)
    # The hole is one of nine walls that share a chance, the island one of six.
    assert Column(found, 10).boundary() == pytest.approx(12e3 + 1e3 * (8 / 9 - 1 / 2) / (8 / 9 - 1 / 6))
    assert [wall.stiffness_n_per_m for wall in islands(found, lambda _: 12.5e3)] == [4e3, 18e3]
    share = held(found, 12.5e3)
    assert share == pytest.approx(1 - 1 / 12.5)
    assert held(found, 500.0) is None


def test_undecided_hits_widen_the_interval_and_leave_the_curve_alone():
    stable = np.arange(20)[:, None] < np.full(10, 7)
    undecided = np.zeros(stable.shape, bool)
    undecided[5:9] = True
    column = Column(walls(stable, undecided), 10)
    low, high = column.bounds(draws(10))
    assert (low == 5.5e3).all()
    assert (high == 9.5e3).all()
    # Straight between the walls that are decided, 5 and 10 kN/m.
    assert column.boundary() == 7.5e3


def test_the_interval_covers_the_truth_about_as_often_as_it_says():
    """Every start has an edge of its own, uniform from 4 to 16 kN/m: half of them are stable at 10 kN/m."""
    rng, covered, widths = np.random.default_rng(11), 0, []
    for _ in range(150):
        edges = rng.uniform(4e3, 16e3, 20)
        low, high = Column(walls(STIFFNESS[:, None] <= edges), 20).bounds(draws(20))
        ends = np.percentile(low, 2.5), np.percentile(high, 97.5)
        covered += ends[0] <= 10.5e3 <= ends[1] or ends[0] <= 10e3 <= ends[1]
        widths.append(ends[1] - ends[0])
    assert covered / 150 >= 0.88
    assert np.mean(widths) < 8e3


def test_draws_are_of_the_starts_and_always_the_same():
    drawn = draws(10)
    assert (drawn.sum(axis=0) == 10).all()
    assert (drawn == draws(10)).all()
    assert drawn.std() == pytest.approx(np.sqrt(0.9), rel=0.05)
