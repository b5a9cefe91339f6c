"""How far one edge lies from another: areas, draws of the starts, steps, and edges that are not there."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.edge_shift import move
from hardwall.sim.walls.zwidth import Map

CASE = Case.of("seed-2011", {"zwidth.damping_from_n_s_per_m": 10.0, "zwidth.damping_to_n_s_per_m": 30.0})
DAMPINGS = 10.0, 20.0, 30.0
STEP = 1e3


def made(*stiffness, spread=0.0, undecided=0.0):
    """Return a map of these K, whose draws are uniform within `spread`, and lower by `undecided` at their lower end."""
    points = [BoundaryPoint(damping, each, each + STEP) for damping, each in zip(DAMPINGS, stiffness, strict=True)]
    shifts = np.linspace(-spread, spread, 201)
    high = np.array(stiffness)[:, np.newaxis] + shifts
    return Map(CASE, points, 9, [True] * 3, starts=10, drawn=np.stack([high - undecided, high]))


def test_an_edge_is_where_it_is():
    same = made(20e3, 30e3, 20e3, spread=5e3)
    found = move(same, same)
    assert (found.area, found.low, found.high, found.stiffness, found.dampings) == (1.0, 1.0, 1.0, 0.0, 0)
    assert found.step == pytest.approx(STEP * 20 / 500e3)
    assert not found.moved


def test_what_moves_is_said_with_its_sign_and_where():
    found = move(made(20e3, 36e3, 24e3), made(20e3, 30e3, 20e3))
    assert found.area == pytest.approx((28e3 + 30e3) / (25e3 + 25e3))
    assert (found.stiffness, found.dampings) == (pytest.approx(0.2), 2)
    assert found.moved
    assert move(made(20e3, 0.0, 20e3), made(20e3, 30e3, 20e3)).stiffness == -1.0


def test_a_step_of_k_is_no_move():
    found = move(made(21e3, 31e3, 21e3), made(20e3, 30e3, 20e3))
    assert (found.stiffness, found.dampings, found.moved) == (0.0, 0, False)
    assert move(made(21e3, 31e3, 22.1e3), made(20e3, 30e3, 20e3)).dampings == 1


def test_a_move_within_the_draws_is_none():
    """The draws of two maps are of the same starts: only what differs in a draw counts."""
    here, there = made(24e3, 34e3, 24e3, spread=10e3), made(20e3, 30e3, 20e3, spread=10e3)
    assert move(here, there).dampings == 3
    steady = made(20e3, 30e3, 20e3)
    found = move(here, steady)
    assert (found.dampings, found.moved) == (0, False)
    assert found.low < 1 < found.high


def test_undecided_hits_make_both_edges_uncertain():
    there = made(20e3, 30e3, 20e3)
    assert move(made(25e3, 35e3, 25e3), there).dampings == 3
    assert move(made(25e3, 35e3, 25e3, undecided=6e3), there).dampings == 0
    assert move(made(25e3, 35e3, 25e3), made(20e3, 30e3, 20e3, undecided=6e3)).dampings == 3
    assert move(made(25e3, 35e3, 25e3, undecided=6e3), made(20e3, 30e3, 20e3, undecided=6e3)).dampings == 0


def test_an_edge_where_there_was_none_has_moved():
    found = move(made(20e3, 30e3, 20e3), made(20e3, 30e3, 0.0))
    assert (found.stiffness, found.dampings) == (math.inf, 1)


def test_a_region_beyond_the_map_is_a_bound():
    whole = made(20e3, 30e3, 20e3)
    beyond = replace(whole, boundary=[replace(whole.boundary[0], marginal_n_per_m=None), *whole.boundary[1:]])
    pairs = (whole, whole), (beyond, whole), (whole, beyond)
    assert [move(*pair).clipped for pair in pairs] == [False, True, True]


def test_starts_are_compared_with_themselves():
    """Two edges of chance whose draws rise and fall together differ by a constant, and against each other by much."""
    here, there = made(24e3, 34e3, 24e3, spread=10e3), made(20e3, 30e3, 20e3, spread=10e3)
    turned = replace(there, drawn=there.drawn[:, :, ::-1])
    assert (move(here, there).dampings, move(here, turned).dampings) == (3, 0)
    assert move(here, turned).high - move(here, turned).low > 5 * (move(here, there).high - move(here, there).low)


def test_beside_an_area_that_may_be_none_nothing_is_said():
    found = move(made(20e3, 30e3, 20e3), made(5e3, 5e3, 5e3, undecided=5e3))
    assert (found.low, found.high, found.moved) == (0.0, math.inf, False)
