"""The schema of the JSON reports: it is a schema, has every command that prints JSON, and fits every study's result."""

import inspect
import math
from dataclasses import replace
from importlib import import_module

import pytest
from jsonschema import Draft202012Validator

from hardwall.cli.group import COMMANDS
from hardwall.sim.estimates.replay import replay
from stimuli import results
from stimuli.replays import COARSEN, swing
from support.reports import SCHEMA, check, check_text

PARTS = {"fact", "map", "placed", "struck", "trial"}
"""Definitions of the schema that are no command's, but parts of several."""
ELSEWHERE = {
    *("accuracy", "bench", "board", "capture", "choose", "config", "connect", "costs", "disarm", "fit", "home", "set"),
    *("assumptions", "rivals", "synth", "watch"),
}
"""Commands whose reports are held to the schema where their results are made."""
RESULTS = {
    "axes": results.axes_costs,
    "bits": results.bits_dropped,
    "cutoff": results.devices,
    "drop": results.dropped,
    "gains": results.search,
    "hit": results.hit,
    "lipschitz": results.fit,
    "rates": results.rate_gains,
    "rendered": results.rendered_walls,
    "response": results.responses,
    "mass": results.masses,
    "replay": lambda: replay(swing(), coarsen=COARSEN),
    "trade": results.traded,
    "zwidth": results.maps,
}


def prints_json(name: str) -> bool:
    command = import_module(f"hardwall.cli.{name}").command
    return "as_json" in inspect.signature(command).parameters


def test_every_command_that_prints_json_has_its_definition():
    Draft202012Validator.check_schema(SCHEMA)
    assert set(SCHEMA["$defs"]) - PARTS == {name for name in COMMANDS if prints_json(name)}


@pytest.mark.parametrize("name", [name for name in COMMANDS if name in SCHEMA["$defs"] and name not in ELSEWHERE])
def test_a_result_is_as_its_schema_says(name):
    check(name, RESULTS[name]().report())


def test_the_hits_of_several_axes_are_as_their_schema_says():
    report = results.hit_axes().report()
    check("hit", report)
    first, *others = report["rows"]
    for wrong in ({"axis": None}, {"rms_mm": -1.0}, {"more": 1}):
        with pytest.raises(AssertionError, match=r"^hit: "):
            check("hit", report | {"rows": [first | wrong, *others]})


def test_a_linear_loop_without_a_limit_has_null_in_the_report_of_rates():
    made = results.rate_gains()
    report = replace(made, limits=made.limits | {"rigid": [1e5, 1e6, math.inf]}).report()
    check("rates", report)
    assert report["linear_limits"]["rigid"] == [1e5, 1e6, None]


@pytest.mark.parametrize("motion", ["velocity_m_per_s", "acceleration_m_per_s2"])
def test_a_capture_has_the_largest_speed_or_the_largest_acceleration(motion):
    report = results.captured(motion).report()
    check("capture", report)
    with pytest.raises(AssertionError, match=r"^capture: "):
        check("capture", report | {"speed_most_m_per_s": 1.0, "acceleration_most_m_per_s2": 1.0})


def test_hits_side_by_side_are_as_their_schema_says():
    report = results.hit_beside().report()
    check("hit", report)
    with pytest.raises(AssertionError, match=r"^hit: "):
        check("hit", {"rows": report["rows"][:1]})


def test_what_is_not_as_the_schema_says_is_found():
    report = results.hit().report()
    for wrong in (report | {"rms_mm": -1.0}, report | {"more": 1}, {**report, "flags": "none"}, [report]):
        with pytest.raises(AssertionError, match=r"^hit: "):
            check("hit", wrong)
    with pytest.raises(AssertionError, match=r"^hit: NaN is not JSON"):
        check_text("hit", '{"rms_mm": NaN}')
    with pytest.raises(ValueError, match="Out of range float"):
        check("hit", report | {"rms_mm": float("inf")})
