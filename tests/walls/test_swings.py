"""How often a position turns round: held to a definition, and whatever the pieces are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardwall.sim.walls.swings import Swings, swung


def counted(positions, least: int) -> int:
    """Return the turns between the most positions that can be picked so that they go up and down by `least` in turn."""
    up, down = [1] * len(positions), [1] * len(positions)
    for k, last in enumerate(positions):
        for before, position in enumerate(positions[:k]):
            if last - position >= least:
                up[k] = max(up[k], down[before] + 1)
            if position - last >= least:
                down[k] = max(down[k], up[before] + 1)
    return max(*up, *down, 2) - 2


def of(positions, least: float, *cuts: int) -> int:
    swings = Swings()
    for piece in np.split(np.asarray(positions, float), cuts):
        swings = swung(swings, piece, least)
    return swings.turns


@pytest.mark.parametrize(
    ("positions", "turns"),
    [
        ([0], 0),
        ([0, 5], 0),
        ([0, 5, 10, 3], 1),
        ([0, 5, 10, 9, 8, 11, 10, 20], 0),
        ([0, -3, 0, -3, 0], 3),
        ([0, 2, 0, 2, 0], 0),
        ([0, 1, 2, 3, 2, 1, 0, 1, 2, 3], 2),
        ([7] * 9, 0),
    ],
)
def test_a_turn_is_where_a_position_is_the_least_way_behind_its_end(positions, turns):
    assert of(positions, 3.0) == turns
    assert of([-position for position in positions], 3.0) == turns


@given(st.lists(st.integers(-6, 6), min_size=1, max_size=40), st.integers(1, 8), st.integers(0, 40))
def test_turns_are_counted_whatever_the_pieces(positions, least, cut):
    assert of(positions, float(least), min(cut, len(positions))) == of(positions, float(least))


@given(st.lists(st.integers(-9, 9), min_size=1, max_size=30), st.integers(1, 6))
def test_turns_are_those_of_the_definition(positions, least):
    assert of(positions, float(least)) == counted(positions, least)
