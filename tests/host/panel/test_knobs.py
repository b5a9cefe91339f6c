"""The words of a board as a page shows them: every setting, with a slider of its range and the unit of a hand."""

import pytest

from hardwall.host.panel.knobs import Field, Group, Knob, Way, knob_of, knobs_of
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.spec import AxisSpec
from hardwall.sim.scene.load import load

REGISTERS = RegisterMap(load("seed-2011").spec)
KNOBS = [
    knob_of(word)
    for word in (*REGISTERS.words, *REGISTERS.live)
    if word.name not in ("preload_count", "heartbeat", "acknowledged", "supervisor_causes")
]
NAMES = {knob.name: knob for knob in KNOBS}


@pytest.mark.parametrize("knob", KNOBS, ids=[knob.name for knob in KNOBS])
def test_a_slider_has_the_range_of_the_board(knob: Knob):
    assert knob.from_slider(0.0) == pytest.approx(knob.least, abs=knob.step)
    assert knob.from_slider(1.0) == pytest.approx(knob.most, abs=knob.step)
    places = [place / 200 for place in range(201)]
    values = [knob.from_slider(place) for place in places]
    assert values == sorted(values)
    assert all(knob.least <= value <= knob.most for value in values)
    assert [knob.to_slider(value) for value in values[1:]] == pytest.approx(places[1:], abs=0.06)
    assert 0 <= knob.to_slider(knob.least) <= knob.to_slider(knob.most) <= 1
    word = REGISTERS[knob.name]
    for number in (word.low, word.low + 1, word.reset, word.high):
        value = number * word.lsb
        assert round(knob.in_si(knob.shown(value)) / word.lsb) == number


def test_what_a_hand_feels_by_ratios_goes_by_decades():
    stiffness = NAMES["wall_stiffness"]
    assert (stiffness.way, stiffness.unit, stiffness.group) == (Way.DECADES, "N/m", Group.WALL)
    assert stiffness.from_slider(0.5) == pytest.approx(stiffness.most / 100)
    assert stiffness.from_slider(0.0) == 0
    assert stiffness.to_slider(0.0) == 0


def test_units_are_those_of_hands():
    position = NAMES["wall_position"]
    assert (position.unit, position.shown(5e-3), position.way) == ("mm", 5.0, Way.CUBE)
    assert position.from_slider(0.5) == 0
    assert NAMES["supervisor_watchdog"].shown(0.2) == 200
    assert NAMES["supervisor_velocity_limit"].unit == "mm/s"
    assert NAMES["supervisor_reference"].way is NAMES["wall_left"].way is Way.SWITCH


def test_virtual_masses_are_of_the_wall_s_group_in_grams(accelerated_axis):
    knobs = {knob.name: knob for knob in knobs_of(accelerated_axis.device)}
    wall, free = knobs["wall_mass"], knobs["free_mass"]
    assert (wall.spoken, free.spoken) == ("Virtual mass in the wall, g", "Virtual mass in free space, g")
    for knob in (wall, free):
        assert (knob.group, knob.way) == (Group.WALL, Way.CUBE)
        assert (knob.shown(knob.least), knob.shown(knob.most)) == pytest.approx((-50.0, 50.0), abs=0.01)
        assert knob.from_slider(0.5) == 0


def test_every_setting_has_its_group(axis):
    knobs = knobs_of(axis.device)
    groups = {knob.name: knob.group for knob in knobs}
    assert groups["levant_lambda"] is Group.ESTIMATOR
    assert groups["supervisor_force_limit"] is Group.LIMITS
    assert groups["encoder_invert"] is Group.WIRING
    hidden = {*axis.names} - {*groups}
    assert {name for name in hidden if not name.startswith("capture_")} == {"preload_count", "supervisor_causes"}


def test_an_estimator_of_any_kind_has_its_knobs():
    spec: AxisSpec = load("seed-2011", {"controller.estimator": "kalman"}).spec
    knobs = [knob_of(word) for word in RegisterMap(spec).words]
    assert any(knob.group is Group.ESTIMATOR and knob.name.startswith("kalman") for knob in knobs)


@pytest.mark.parametrize("knob", KNOBS, ids=[knob.name for knob in KNOBS])
def test_a_field_that_is_left_as_it_was_shown_wishes_nothing(knob: Knob):
    """The field keeps seven digits when it is left, which is fewer than some words have."""
    word, field = REGISTERS[knob.name], Field(knob)
    for part in (0.0, 0.1, 1 / 3, 0.7123, 1.0):
        value = (word.low + round(part * (word.high - word.low))) * word.lsb
        shown = field.show(value)
        assert not field.takes(float(f"{shown:.7g}"))
        assert not field.takes(None)
    assert field.takes(shown + knob.step * knob.scale)
    # Back at once, before the board has said what it uses, is a wish again.
    assert field.takes(shown)
    assert not field.takes(shown)


def test_a_knob_is_called_by_its_label_and_its_unit():
    assert NAMES["wall_stiffness"].spoken == "Stiffness K, N/m"
    assert NAMES["wall_forbid_pull"].spoken == "Never pull"
    assert len({knob.spoken for knob in KNOBS}) == len(KNOBS)
