"""The hand at a virtual board: orders that a board takes, no faster than a handle may move, and faults that end."""

from itertools import pairwise

import pytest

from hardwall.host.panel import hand as module
from hardwall.host.panel.hand import FAULTS, SPEED_M_PER_S, STEP_S, Hand
from hardwall.sim.virtual.orders import ORDERS


class Clock:
    def __init__(self):
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch) -> Clock:
    found = Clock()
    monkeypatch.setattr(module, "time", found)
    return found


def test_a_hand_comes_from_where_the_handle_is_and_no_faster_than_it_may(clock):
    orders = []
    hand = Hand(orders.append, origin_m=-0.07, reach_m=0.15)
    hand.hold(60e-3, 10e-3)
    places = [hand.held_m]
    for _ in range(10):
        clock.now_s += 0.01
        hand.hold(60e-3, 0.0)
        places.append(hand.held_m)
    steps = [after - before for before, after in pairwise(places)]
    assert places[0] == pytest.approx(10e-3 + SPEED_M_PER_S * STEP_S)
    assert steps[:7] == pytest.approx([SPEED_M_PER_S * 0.01] * 7)
    assert places[-1] == 60e-3
    assert orders[-1] == "hold -10.000000"
    # A page that hung is no leap.
    clock.now_s += 10
    hand.hold(-0.1, 0.0)
    assert hand.held_m == pytest.approx(60e-3 - SPEED_M_PER_S * STEP_S)
    hand.free()
    hand.free()
    assert orders[-2:] == [orders[-2], "hold free"]
    assert orders.count("hold free") == 1
    assert hand.held_m is None


def test_a_hand_stays_within_what_a_board_takes(clock):
    orders = []
    hand = Hand(orders.append, origin_m=-0.07, reach_m=0.15)
    for _ in range(200):
        clock.now_s += STEP_S
        hand.hold(5.0, 0.0)
    assert orders[-1] == "hold 150.000000"


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_broken_and_mended_by_orders_that_there_are(name):
    orders = []
    hand = Hand(orders.append, 0.0, 0.15)
    hand.turn(name)
    assert hand.broken == {name}
    hand.turn(name)
    assert hand.broken == set()
    assert orders == [FAULTS[name].cut, FAULTS[name].mend]
    for order in orders:
        verb, operand = order.split()
        assert operand in ORDERS[verb].accepted


def test_a_fault_that_is_none_is_refused():
    with pytest.raises(KeyError):
        Hand(print, 0.0, 0.15).turn("motor swapped")
