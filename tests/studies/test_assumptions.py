"""What the facts of Figure 5 depend on: every assumed value is changed alone, within its range, and told."""

import json
from dataclasses import replace

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.studies.assumptions import FACTOR, GRIDS, changes_of, study
from hardwall.sim.studies.fit import MEAN, PARAMETERS
from hardwall.sim.walls.methods import methods
from hardwall.sim.walls.zwidth import Map
from stimuli.known_device import DELAY_S, MASS_KG, NAMES, KnownDevice, verdict
from stimuli.lengths import LONG
from support.command_line import call

PROPOSED = methods()["proposed"].label
KNOWN = {"handle.mass_kg": MASS_KG, "amplifier.delay_s": DELAY_S}


def device(**changes) -> Case:
    return Case.of("seed-2011", KNOWN | changes)


def test_every_value_is_changed_alone_and_within_the_range_of_the_search():
    first, *changes = changes_of(device().scene)
    assert first == {}
    values = [each for each in changes if each.keys() <= PARAMETERS.keys()]
    assert all(len(each) == 1 for each in values)
    assert {key for each in values for key in each} == {*PARAMETERS}
    for key, value in (item for each in values for item in each.items()):
        assert PARAMETERS[key].low <= value <= PARAMETERS[key].high
    masses = [value for each in values for key, value in each.items() if key == "handle.mass_kg"]
    assert masses == pytest.approx([MASS_KG / FACTOR, MASS_KG * FACTOR], rel=5e-3)
    delays = [value for each in values for key, value in each.items() if key == "amplifier.delay_s"]
    assert delays == pytest.approx([DELAY_S - 1e-4, DELAY_S + 1e-4])
    grids = [each for each in changes if any(key.startswith("zwidth.") for key in each)]
    assert [each.keys() for each in grids] == [each.keys() for each in GRIDS]
    assert changes[-1] == {"protocol.verdict": "literal"}


def test_a_value_at_the_end_of_its_range_goes_one_way_only():
    at_once = device(**{"amplifier.delay_s": 0.0, "handle.mass_kg": 1.9})
    changes = list(changes_of(at_once.scene))
    assert [each for each in changes if "amplifier.delay_s" in each] == [{"amplifier.delay_s": 1e-4}]
    assert [each for each in changes if "handle.mass_kg" in each] == [{"handle.mass_kg": 1.27}]


def test_the_time_of_the_mean_is_changed_where_the_verdict_takes_it():
    literal = device(**{"protocol.verdict": "literal"})
    keys = {key for each in changes_of(literal.scene) for key in each}
    assert keys >= MEAN.keys()
    assert {"protocol.verdict": "detrended"} in changes_of(literal.scene)


class Sticks(KnownDevice):
    """A device whose adjusted gains are worth nothing with less friction."""

    def _map(self, case: Case) -> Map:
        slips = case.changes.get("handle.coulomb_n", 0.1) < 0.1 and NAMES[case.label] == "adjusted"
        return super()._map(replace(case, label=PROPOSED) if slips else case)


def test_the_facts_of_a_known_device_depend_on_what_moves_its_maps():
    done: list[int] = []
    found = study(device(), Sticks(), done.append)
    own, *others = found.rows
    assert done == list(range(1, len(found.rows) + 1))
    assert own.held == sum(fact.held for fact in own.facts)
    assert own.facts[2].held
    assert {fact.share for fact in own.facts} <= {0.0, 1.0}
    slipping = [row.text for row in others if not row.facts[2].held]
    assert slipping == ["coulomb_n=0.0667"]


def test_report_and_table_and_what_is_known_is_not_hit_again(monkeypatch, capsys):
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", verdict)
    steps = ("stiffness_step_n_per_m=10e3", "damping_step_n_s_per_m=49" if LONG else "damping_step_n_s_per_m=98")
    coarse = [word for key in steps for word in ("--set", key)]
    words = ["assumptions", "seed-2011", "--workers", 1, *(w if w == "--set" else f"zwidth.{w}" for w in coarse)]
    code, out, _ = call(monkeypatch, capsys, *words, "--json")
    assert code == 0
    report = json.loads(out)
    assert report["scene"] == "seed-2011"
    assert report["rows"][0]["changes"] == {}
    assert all(0 <= fact["share"] <= 1 for row in report["rows"] for fact in row["facts"])
    assert [row["held"] for row in report["rows"]] == [sum(f["held"] for f in row["facts"]) for row in report["rows"]]
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", None)
    code, out, err = call(monkeypatch, capsys, *words, "--resume")
    assert code == 0
    assert "mass_kg=0.525" in out
    assert "1: 30 Hz has the smallest region of all" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: amplifier.delay_s is missing"),
        (["seed-2011", "--set", "controller.output=u1"], "--set 'controller.output' must be absent"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "assumptions", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
