"""The facts of the paper's Figure 5, on maps made by hand."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.figure_5 import NUMBER, facts, with_shares
from hardwall.sim.walls.methods import methods
from hardwall.sim.walls.zwidth import Map
from stimuli.figure_5 import PAPER


# As in the paper's figure: K (kN/m) at B = 10, 20 ... N s/m.
def maps(others: dict[str, list[int]]) -> dict[str, Map]:
    def boundary(stiffness: list[int]) -> list[BoundaryPoint]:
        return [BoundaryPoint(10.0 * (n + 1), 1e3 * k, 1e3 * (k + 1)) for n, k in enumerate(stiffness)]

    return {name: Map(Case(name, "", "", {}), boundary(k), 10, [True] * len(k)) for name, k in (PAPER | others).items()}


def lost(others: dict[str, list[int]]) -> set[int]:
    return {n for n, fact in enumerate(facts(maps(others))) if not fact.held}


def test_all_are_held_on_the_paper_s_figure():
    assert lost({}) == set()
    assert [fact.shortfall for fact in facts(maps({}))] == [0.0] * NUMBER


@pytest.mark.parametrize(
    ("others", "without"),
    [
        ({"fdm-100": [1, 1, 1, 0]}, {0}),
        ({"fdm-30": [12, 18, 24, 28, 30, 30, 29, 27, 25, 25, 0]}, {0}),
        ({"fdm-1000": [10, 14, 19, 22, 25, 60, 80, 80, 80, 70, 19, 14, 7, 0]}, {1}),
        ({"proposed": [12, 18, 24, 28, 30, 60, 90, 90, 90, 0]}, {2}),
        ({"fdm-1000": [10, 14, 20, 25, 31, 36, 40, 42, 42, 40, 30, 20, 5, 0]}, {3}),
        ({"proposed": [12, 18, 18, 28, 30, 30, 29, 27, 25, 0]}, {3}),
        ({"proposed": [12, 18, 24, 28, 30, 30, 20, 10, 4, 0]}, {4}),
        ({"proposed": [12, 18, 24, 28, 30, 0]}, {4}),
        ({"fdm-500": [10, 14, 19, 22, 25, 27, 28, 30, 32, 40, 49, 15, 8, 0]}, {5}),
        ({"fdm-500": [10, 14, 19, 22, 25, 27, 28, 27, 25, 0]}, {5}),
        ({"fdm-1000": [10, 14, 19, 22, 25, 27, 28, 28, 28, 28, 28, 28, 28, 29]}, {6}),
    ],
    ids=str,
)
def test_each_is_lost_where_it_is_not_so(others, without):
    assert lost(others) == without
    # A fact that holds has no shortfall.
    assert not any(fact.held and fact.shortfall for fact in facts(maps(others)))


@pytest.mark.parametrize(
    ("number", "others", "shortfall"),
    [
        # Areas up to 100 N s/m, trapezoids of 10: 30 Hz has 100 at first, then 20; 100 Hz 650, then 15.
        (0, {"fdm-30": [4, 5, 3, 0], "fdm-100": [1, 1, 0]}, 1 - 15 / 100),
        (1, {"fdm-1000": [60] * 10 + [0]}, 1 - (sum(PAPER["adjusted"]) - (13 + 48) / 2) / (9 * 60)),
        (2, {"proposed": [12, 18, 24, 28, 30, 60, 90, 90, 90, 0]}, 1 - (361 - 13 / 2) / (442 - 12 / 2)),
        (3, {"proposed": [12, 18, 17, 28, 30, 30, 29, 27, 25, 0]}, 2 / (10 + 14 + 19 + 22 + 25)),
        # The largest K is at 0.6 of the range instead of 0.9, and one step before the end K is 12 of 30.
        (4, {"proposed": [12, 18, 24, 30, 12, 4, 0]}, 0.2 + (0.5 - 0.4)),
        # At the map's end K still has its largest value.
        (4, {"adjusted": PAPER["adjusted"][:-1] + [48] * 4}, 1.0),
        (5, {"fdm-500": [10, 14, 19, 22, 25, 27, 28, 0]}, 0.3),
        (5, {"fdm-500": [10, 14, 19, 22, 25, 27, 28, 30, 32, 40, 60, 15, 8, 0]}, 60 / 48 - 1),
        (6, {"fdm-1000": [10, 14, 19, 22, 25, 27, 28, 28, 28, 28, 28, 28, 28, 29]}, 0.25),
    ],
)
def test_a_shortfall_is_how_much_is_lacking(number, others, shortfall):
    fact = facts(maps(others))[number]
    assert not fact.held
    assert fact.shortfall == pytest.approx(shortfall, rel=1e-12)


def test_the_adjusted_gains_are_the_scene_s_own():
    own = load("seed-2011", {"controller.gains.levant.alpha_m_per_s2": 70.0})
    assert methods(own)["adjusted"].gains["alpha_m_per_s2"] == 70.0
    assert methods(own)["proposed"] == methods()["proposed"]
    assert methods(load("seed-2011", {"controller.gains": None})) == methods() == methods(load("seed-2011"))


@pytest.mark.parametrize("adjusted", [[0], [5]])
def test_a_range_of_one_damping_or_none_is_judged_without_failing(adjusted):
    found = facts(maps({"adjusted": adjusted}))
    assert len(found) == NUMBER
    assert adjusted == [5] or not any(fact.held for fact in found)
    assert adjusted == [5] or [fact.shortfall for fact in found] == [1.0] * NUMBER


def test_they_are_json():
    assert json.loads(json.dumps([asdict(fact) for fact in facts(maps({}))]))[0]["held"] is True


def test_a_share_is_of_the_draws_that_show_a_fact():
    """In a quarter of the draws the filter of 100 Hz ends before that of 30 Hz."""
    made = {}
    for name, each in maps({}).items():
        drawn = np.repeat([[[point.stable_n_per_m] for point in each.boundary]], 8, axis=2).repeat(2, axis=0)
        if name == "fdm-100":
            drawn[:, 1:, :2] = 0.0
        made[name] = replace(each, drawn=drawn)
    found = with_shares(made)
    assert [fact.held for fact in found] == [True] * NUMBER
    assert [fact.share for fact in found] == [0.75] + [1.0] * 6
