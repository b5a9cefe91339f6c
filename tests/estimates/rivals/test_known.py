"""The settings of the rivals: the usual ones of their projects, and what is tried beside them."""

import math

import pytest

from hardwall.sim.estimates.rivals.known import LOOP, PROJECTS, RIVALS, choices
from hardwall.sim.estimates.rivals.pico import Substep


def test_every_rival_that_the_page_names_is_there():
    assert {*PROJECTS.values()} == {"dVRK", "LinuxCNC", "ODrive, moteus", "SimpleFOC", "Raspberry Pi Pico"}


@pytest.mark.parametrize("name", PROJECTS)
def test_settings_are_tried_once_and_the_usual_ones_are_among_them(name):
    usual, every = choices(name, 1e6)
    assert every.count(usual) == 1
    assert all(every.count(settings) == 1 for settings in every)
    assert all(settings.keys() == every[0].keys() for settings in every)


@pytest.mark.parametrize("name", RIVALS)
def test_every_choice_makes_the_rival(name):
    for settings in choices(name, 1e6)[1]:
        made = RIVALS[name].make(settings, (0.0, 0.1, 0.2, 0.3))
        assert isinstance(made, tuple)
        if isinstance(made, Substep):
            assert made.offsets == ((0.0, 0.1, 0.2, 0.3) if settings["calibrated"] else (0.0,) * 4)


def test_the_usual_settings_are_the_published_ones():
    usual = {name: choices(name, 1e6)[0] for name in PROJECTS}
    assert math.tau * usual[LOOP]["bandwidth_hz"] == pytest.approx(1000)
    assert usual["hostmot2"] == {"period_s": 1e-3}
    assert usual["simplefoc-encoder"] == usual["simplefoc-sensor"] == {"period_s": 1e-3, "filter_s": 5e-3}
    assert usual["pico"] == {"period_s": 1e-2, "calibrated": False}


def test_a_rate_limits_the_bandwidth():
    """ODrive refuses 2 w at or above the rate: 1000 rad/s need more than 2 kHz."""
    usual, every = choices(LOOP, 1900.0)
    assert usual is None
    assert [settings["bandwidth_hz"] for settings in every] == [30.0, 60.0, 100.0]
    usual, every = choices(LOOP, 2100.0)
    assert usual in every
    assert choices(LOOP, 100.0) == (None, [])


def test_a_period_of_reading_is_a_whole_number_of_samples():
    usual, every = choices("hostmot2", 2000.0)
    assert usual in every
    assert {settings["period_s"] * 2000 % 1 for settings in every} == {0.0}
    assert choices("hostmot2", 100.0) == (None, [{"period_s": 0.01}, {"period_s": 0.0}])
    assert choices("simplefoc-encoder", 1500.0) == (None, [])
    assert choices("dvrk", 100.0)[0] == {"period_s": 0.0}
