"""What a page says of a board: the state, why, and what to do, for the tab that armed and for others."""

from dataclasses import replace

import pytest

from hardwall.host.panel.view import ADVICE, View, told
from hardwall.host.status import State, Status, Trip
from hardwall.model.axis.supervisor import CAUSES

RESTS = Status(State.DISARMED, 0.0, 0.0, None, 0.0, 0.0, 0.0, True, True, True, (), False, None)
VIEW = View(status=RESTS, connected=True, values={"supervisor_force_limit": 12.0, "wall_stiffness": 2e3})


def tripped(*names: str) -> View:
    trip = Trip(5, names, names[:1], {})
    return replace(VIEW, status=replace(RESTS, state=State.TRIPPED, trip=trip))


def test_every_cause_has_its_advice():
    assert set(ADVICE) == {cause.name for cause in CAUSES}


@pytest.mark.parametrize("name", ADVICE)
def test_a_trip_says_why_and_what_to_do(name):
    now = told(tripped(name, "velocity_limit"), "a")
    meaning = next(cause.doc for cause in CAUSES if cause.name == name)
    assert (now["state"], now["may"], now["latched"]) == ("TRIPPED", ["acknowledge"], 5)
    assert meaning in now["why"]
    assert now["do"] == f"{ADVICE[name]}. Then acknowledge, and arm again."


def test_the_tab_that_armed_is_told_other_words_than_the_others():
    view = replace(VIEW, status=replace(RESTS, state=State.ARMED), holder="a")
    own, other = told(view, "a"), told(view, "b")
    assert own["state"] == other["state"] == "ARMED"
    assert own["why"] == "The axis drives, with up to 12 N."
    assert "This tab keeps it armed" in own["do"]
    assert "Another tab armed it" in other["do"]
    assert (own["locked"], own["holds"], other["locked"], other["holds"]) == (False, True, True, False)
    assert own["may"] == other["may"] == ["disarm"]


@pytest.mark.parametrize(("lease", "who"), [("walk.py, process 7", "walk.py, process 7"), (None, "Another program")])
def test_another_program_that_armed_is_named(lease, who):
    view = replace(VIEW, status=replace(RESTS, state=State.ARMED), lease=lease)
    assert told(view, "a")["do"] == f"{who} armed it. Here you may disarm."


def test_a_board_that_rests_may_be_armed():
    now = told(VIEW, "a")
    assert (now["state"], now["may"], now["latched"]) == ("DISARMED", ["arm"], 0)
    assert now["wall"]["stiffness"] == 2e3


def test_a_cause_that_is_latched_while_disarmed_is_a_trip():
    view = replace(VIEW, status=replace(RESTS, trip=Trip(1, ("encoder_illegal",), (), {})))
    assert told(view, "a")["state"] == "TRIPPED"


@pytest.mark.parametrize(("connected", "state", "may"), [(True, "SILENT", []), (False, "NO BOARD", ["connect"])])
def test_a_board_that_is_not_reached_is_no_state_of_it(connected, state, may):
    now = told(replace(VIEW, status=None, connected=connected, lost="gone"), "a")
    assert (now["state"], now["why"], now["may"]) == (state, "gone", may)


def test_flags_are_told():
    view = replace(VIEW, status=replace(RESTS, flags=("estimator_saturated",), a_channel_idle=True))
    assert told(view, "a")["flags"] == ["estimator_saturated", "a_channel_idle"]
