"""The eight facts of the paper's Figure 5, on maps made by hand."""

import json
from dataclasses import asdict

import pytest

from hardwall.sim.boundary import Edge
from hardwall.sim.figure_5 import facts
from hardwall.sim.zwidth import Case, Map

# As in the paper's figure: K (kN/m) at B = 10, 20 ... N s/m.
PAPER = {
    "fdm-30": [4, 5, 3, 0],
    "fdm-100": [8, 11, 12, 12, 10, 8, 5, 2, 0],
    "fdm-500": [10, 14, 19, 22, 25, 27, 28, 27, 25, 23, 20, 15, 8, 0],
    "fdm-1000": [10, 14, 19, 22, 25, 27, 29, 28, 26, 23, 19, 14, 7, 0],
    "proposed": [12, 18, 24, 28, 30, 30, 29, 27, 25, 0],
    "adjusted": [13, 20, 27, 33, 38, 42, 45, 47, 48, 48, 0],
}


def maps(others: dict[str, list[int]]) -> dict[str, Map]:
    def edges(stiffness: list[int]) -> list[Edge]:
        return [Edge(10.0 * (n + 1), 1e3 * k, 1e3 * (k + 1)) for n, k in enumerate(stiffness)]

    return {name: Map(Case(name, "", "", {}), edges(k), 10, [True] * len(k)) for name, k in (PAPER | others).items()}


def lost(others: dict[str, list[int]]) -> set[int]:
    return {n for n, fact in enumerate(facts(maps(others))) if not fact.held}


def test_all_are_held_on_the_paper_s_figure():
    assert lost({}) == set()


@pytest.mark.parametrize(
    ("others", "without"),
    [
        ({"fdm-100": [1, 1, 1, 0]}, {0}),
        ({"fdm-1000": [10, 14, 20, 25, 31, 36, 40, 42, 42, 40, 30, 20, 5, 0]}, {1, 4}),
        ({"adjusted": [13, 20, 20, 33, 38, 42, 45, 47, 48, 48, 0]}, {3}),
        ({"adjusted": [13, 20, 18, 33, 38, 42, 45, 47, 48, 48, 0]}, {2, 3}),
        ({"proposed": [12, 18, 18, 28, 30, 30, 29, 27, 25, 0]}, {4}),
        ({"proposed": [12, 18, 24, 28, 30, 30, 20, 10, 4, 0]}, {5}),
        ({"proposed": [12, 18, 24, 28, 30, 0]}, {5}),
        ({"fdm-500": [10, 14, 19, 22, 25, 27, 28, 30, 32, 40, 49, 15, 8, 0]}, {6}),
        ({"fdm-500": [10, 14, 19, 22, 25, 27, 28, 27, 25, 0]}, {6}),
        ({"fdm-1000": [10, 14, 19, 22, 25, 27, 28, 28, 28, 28, 28, 28, 28, 29]}, {7}),
    ],
    ids=str,
)
def test_each_is_lost_where_it_is_not_so(others, without):
    assert lost(others) == without


@pytest.mark.parametrize("adjusted", [[0], [5]])
def test_a_range_of_one_damping_or_none_is_judged_without_failing(adjusted):
    found = facts(maps({"adjusted": adjusted}))
    assert len(found) == 8
    assert adjusted == [5] or not any(fact.held for fact in found)


def test_they_are_json():
    assert json.loads(json.dumps([asdict(fact) for fact in facts(maps({}))]))[0]["held"] is True
