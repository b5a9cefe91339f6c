"""The fit: a known device is found again, trials far off are not mapped, and the facts that fail are named."""

import json
import math

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.studies import fit
from hardwall.sim.walls.boundary import BoundaryPoint
from hardwall.sim.walls.figure_5 import Fact
from hardwall.sim.walls.mapping import NeverReached
from hardwall.sim.walls.zwidth import Map
from stimuli.known_device import DELAY_S, MASS_KG, NAMES, KnownDevice, verdict
from stimuli.lengths import LONG
from support.command_line import call


def found(evaluations: int, mapper: KnownDevice, seed: int = 1) -> fit.Fit:
    return fit.study(Case.of("seed-2011"), "3-30", evaluations, seed, mapper, lambda done: None)


def test_a_known_device_is_found_again():
    known = KnownDevice()
    result = found(240, known)
    assert result.before.held < fit.NUMBER
    best = result.finalists[0]
    assert best.held == fit.NUMBER
    assert best.score == pytest.approx(best.off_b, abs=1e-9)
    assert best.off_b < 0.05
    assert best.values["handle.mass_kg"] == pytest.approx(MASS_KG, rel=0.2)
    # The tolerance is 10 % of the area of 1000 Hz, which counts as about equal.
    assert best.values["amplifier.delay_s"] == pytest.approx(DELAY_S, abs=0.12e-3)
    assert [each.score for each in result.finalists] == sorted(each.score for each in result.finalists)
    # The scene's own values are among the first.
    assert any(trial.values["handle.mass_kg"] == 0.35 for trial in result.trials[:24])
    # The cases are the maps made; a trial that is far off has only one map.
    coarse = sum(6 if trial.facts else bool(trial.maps) for trial in result.trials)
    again = sum(bool(trial.facts) for trial in result.trials)
    assert len(known.cases) == 6 + coarse + again + 6 * len(result.finalists)
    far = [trial for trial in result.trials if not trial.facts]
    assert far
    assert all(trial.off_b > fit.FAR and trial.score > fit.NUMBER for trial in far)


def test_a_search_is_its_seed_s():
    first, again, other = (found(24, KnownDevice(), seed).trials for seed in (1, 1, 2))
    assert [each.values for each in first] == [each.values for each in again] != [each.values for each in other]


def test_both_the_map_of_a_trial_and_its_judgement_have_the_trial_s_alpha():
    known = KnownDevice()
    result = found(24, known)
    key = "controller.gains.levant"
    for case in known.cases:
        if NAMES[case.label] == "adjusted":
            assert case.scene.controller.gains.levant.model_dump() == case.changes[key]
    alphas = {trial.values[f"{key}.alpha_m_per_s2"] for trial in result.trials}
    assert {case.changes[key]["alpha_m_per_s2"] for case in known.cases if NAMES[case.label] == "adjusted"} >= alphas


@pytest.mark.parametrize(
    ("where", "part", "value"),
    [
        (fit.Range(0.02, 2.0, "log"), 0.5, 0.2),
        (fit.Range(1.0, 3.0, "linear"), 0.123456, 1.25),
        (fit.Range(0.0, 6e-3, "samples"), 0.2551, 1.5e-3),
    ],
)
def test_a_range_is_walked_as_its_scale_says(where, part, value):
    assert where.at(part, 10_000) == pytest.approx(value, rel=1e-12)
    assert where.part(where.at(part, 10_000)) == pytest.approx(part, abs=0.01)
    assert (where.at(0.0, 10_000), where.at(1.0, 10_000)) == pytest.approx((where.low, where.high))
    assert (where.part(where.low / 2 - 1), where.part(where.high * 2)) == (0.0, 1.0)


def test_what_lacks_least_beside_the_others_is_what_stood_in_the_way():
    def trial(*shortfalls: float) -> fit.Trial:
        return fit.Trial({}, [Fact("", lack == 0, lack, "") for lack in shortfalls], 0.0, 0.0, {})

    trials = [trial(0, 0.3, *[0] * 5), trial(0, 0.2, *[0] * 5), trial(0.5, 0, 0, 0.1, *[0] * 3), trial()]
    assert fit.Fit("3-30", {}, trials[0], trials, []).least_shortfalls() == [None, 0.2, *[None] * 5]
    assert trials[2].score == pytest.approx(0.6 + 2 * fit.MISSED)
    assert trials[3].score == pytest.approx(fit.NUMBER * (1 + fit.MISSED))


def test_report_and_table_and_what_is_known_is_not_hit_again(monkeypatch, capsys):
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", verdict)
    if not LONG:
        monkeypatch.setattr(fit, "FULL", fit.COARSE)
        monkeypatch.setattr(fit, "FINALISTS", 2)
    words = ["fit", "--axis", "3-30", "--evaluations", 24, "--workers", 1]
    code, out, _ = call(monkeypatch, capsys, *words, "--json")
    assert code == 0
    report = json.loads(out)
    (of_axis,) = report["fits"]
    assert (report["seed"], of_axis["b_axis"], of_axis["evaluations"]) == (1, "3-30", 24)
    assert of_axis["values_before"]["handle.mass_kg"] == 0.35
    assert len(of_axis["before"]["facts"]) == fit.NUMBER
    assert of_axis["finalists"][0]["score"] == min(each["score"] for each in of_axis["finalists"])
    assert set(of_axis["finalists"][0]["values"]) == set(fit.PARAMETERS)
    monkeypatch.setattr("hardwall.sim.walls.mapping.verdict", None)
    code, out, _ = call(monkeypatch, capsys, *words, "--resume")
    assert code == 0
    assert "protocol.threshold_mm" in out
    assert "the paper's Figure 5" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mhz"], "mhz: amplifier.delay_s is missing, which this command changes"),
        (["--axis", "1-10"], "--axis must be one of 3-30, 30-300, not '1-10'"),
        (
            ["--set", "controller.output=u1"],
            "--set 'controller.output' must be absent (this command sets it)",
        ),
        (
            ["--set", "zwidth.stiffness_step_n_per_m=123.0"],
            "--set 'zwidth.stiffness_step_n_per_m' must be absent (this command",
        ),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], "give it or --workers, not both"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, "fit", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_nothing_stable_is_far_off():
    class Nothing(KnownDevice):
        def _map(self, case: Case) -> Map:
            return Map(case, [BoundaryPoint(3.0, 0.0, 1e3)], 1, [False])

    result = found(24, Nothing())
    assert all(trial.off_b == fit.HOPELESS for trial in result.trials)
    assert result.finalists[0].score == pytest.approx(fit.NUMBER * (1 + fit.MISSED) + fit.HOPELESS)
    assert math.isfinite(result.finalists[0].score)


def test_a_device_that_does_not_reach_the_wall_ends_no_search():
    class Rough(KnownDevice):
        def _map(self, case: Case) -> Map:
            if case.scene.handle.coulomb_n > 0.1:
                raise NeverReached("the handle did not reach the wall: no verdict on the wall K 1000, B 3")
            return super()._map(case)

    result = found(48, Rough())
    rough = [trial for trial in result.trials if trial.values["handle.coulomb_n"] > 0.1]
    assert 0 < len(rough) < len(result.trials)
    assert all((trial.off_b, trial.facts, trial.maps) == (fit.HOPELESS, [], {}) for trial in rough)
    assert all(each.values["handle.coulomb_n"] <= 0.1 for each in result.finalists)
