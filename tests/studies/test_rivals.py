"""The study of rivals: every estimator on every motion with every encoder, the usual settings, and the best ones."""

import json

import pytest

from hardwall.sim.estimates.rivals.known import LOOP, PROJECTS, choices
from hardwall.sim.studies import rivals
from hardwall.sim.studies.rivals import BEST, MOTIONS, OURS, OWN, REAL, USUAL, Bench, study
from stimuli.lengths import LONG
from stimuli.replays import swing
from support.command_line import call, said
from support.reports import check

RATE = 10_000
ENCODERS = {"perfect": {}, "real": REAL}


class Invented:
    """Answers jobs with errors that follow from their arguments, and keeps the jobs."""

    def __init__(self):
        self.jobs = []

    def error(self, job: dict) -> float:
        """Return an error that differs between all jobs of a rival at a place."""
        values = sorted((job.get("settings") or job.get("gains") or {}).items())
        return 1 + sum((1 + place) * float(value) for place, (_, value) in enumerate(values))

    def __call__(self, title, function, jobs):
        self.jobs += [(function.__name__, job) for job in jobs]
        if function.__name__ == "measure_acceleration":
            return [{"rms_mm_s2": 2.0, "signal_rms_mm_s2": 3.0} for _ in jobs]
        return [{"rms_mm_s": self.error(job), "max_mm_s": 9.0, "delay_s": None, "gains": {"some": 1.0}} for job in jobs]


@pytest.fixture(scope="module")
def made():
    run = Invented()
    return run, study(Bench(RATE, "float", ENCODERS, run), [])


def test_all_have_the_same_motions_encoders_and_rate(made):
    run, _ = made
    known = [job for name, job in run.jobs if name == "measure"]
    places = {(job["signal"], json.dumps(job["encoder"])) for job in known}
    assert places == {(signal, json.dumps(errors)) for signal in MOTIONS.values() for errors in (None, REAL)}
    assert {job["sample_hz"] for job in known} == {RATE}
    names = {job.get("name", job.get("estimator")) for job in known}
    assert names == {*PROJECTS, *OURS}


def test_this_projects_estimators_have_one_set_of_bounds(made):
    run, _ = made
    own = [job for name, job in run.jobs if name == "measure" and "estimator" in job]
    assert {json.dumps(job["bounds"]) for job in own} == {json.dumps(own[0]["bounds"])}
    assert own[0]["bounds"]["acceleration_max_m_per_s2"] == pytest.approx(28.5, abs=0.1)
    assert all((job["gains"] is None) == (job["estimator"] != LOOP) for job in own)
    assert {job["output"] for job in own if job["estimator"] == "levant-adaptive"} == {"z1"}


def test_a_rival_has_its_usual_settings_and_the_best_of_each_place(made):
    run, found = made
    check("rivals", found.report())
    for name in PROJECTS:
        usual, every = choices(name, RATE)
        rows = [row for row in found.rows if row["estimator"] == name]
        by = {setting: [row for row in rows if row["setting"] == setting] for setting in (USUAL, BEST)}
        assert {json.dumps(row["settings"]) for row in by[USUAL]} == {json.dumps(usual)}
        assert [(row["encoder"], row["motion"]) for row in by[USUAL]] == found_places()
        least = min(run.error({"settings": settings}) for settings in every)
        assert [row["rms_mm_s"] for row in by[BEST]] == [least] * (len(found_places()) if len(every) > 1 else 0)


def found_places() -> list[tuple[str, str]]:
    return [(encoder, motion) for encoder in ENCODERS for motion in MOTIONS]


def test_this_projects_estimators_come_last_with_their_gains(made):
    _, found = made
    own = [row for row in found.rows if row["setting"] == OWN]
    assert found.rows[-len(own) :] == own
    assert [row["estimator"] for row in own] == [name for name in OURS for _ in found_places()]
    assert own[0]["settings"] == {"some": 1.0}
    assert {row["project"] for row in own} == {"hardwall"}


def test_tables_have_a_line_an_estimator_and_settings(made):
    _, found = made
    *errors, accelerations = found.tables()
    assert len(errors) == len(ENCODERS)
    for table in errors:
        assert len(table.rows) == 2 * len(PROJECTS) - 2 + len(OURS)
        assert {len(row) for row in table.rows} == {len(table.columns)}
    assert accelerations.rows == [["dvrk", "perfect", "2", "3"], ["dvrk", "real", "2", "3"]]
    assert found.notes()[-1] == "real encoder: edge_error_counts 0.05, phase_error_counts 0.25"


def test_a_low_rate_has_no_usual_bandwidth():
    found = study(Bench(1000, "float", {"perfect": {}}, Invented()), [])
    rows = [row for row in found.rows if row["estimator"] == LOOP]
    assert [row["setting"] for row in rows] == [BEST] * len(MOTIONS)


def test_a_rate_that_suits_no_period_leaves_a_rival_out():
    found = study(Bench(1500, "float", {"perfect": {}}, Invented()), [])
    left_out = {name for name in PROJECTS if not choices(name, 1500)[1]}
    assert left_out == {"simplefoc-encoder", "simplefoc-sensor"}
    assert {row["estimator"] for row in found.rows} == {*PROJECTS, *OURS} - left_out


JUDGED = OURS if LONG else ("kalman", "levant-edge")
"""This project's estimators on a recording: one of counts and one of stamps, by `make soak` all."""


def test_recordings_are_judged_by_all(monkeypatch):
    monkeypatch.setattr(rivals, "MOTIONS", {})
    monkeypatch.setattr(rivals, "OURS", JUDGED)
    found = study(Bench(RATE, "float", {"perfect": {}}, Invented()), [swing()])
    check("rivals", found.report())
    assert {row["estimator"] for row in found.rows} == {*PROJECTS, *JUDGED}
    assert {row["signal"] for row in found.rows} == {"made.csv:counts"}
    assert all(row["rms_counts_s"] > 0 for row in found.rows)
    for name in PROJECTS:
        own = {row["setting"]: row["rms_counts_s"] for row in found.rows if row["estimator"] == name}
        assert own.get(BEST, 0) <= own.get(USUAL, own.get(BEST, 0))
    table = found.tables()[-1]
    assert len(table.rows) == len(found.rows)
    assert found.notes()[-1] == "recordings: the gains of this project follow from each recording's own acceleration"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--sample-rate", "10"], "--sample-rate must be whole numbers of 1000 to 1e+07 Hz"),
        (["--signal", "paper"], "--signal must be FILE:COLUMN, or FILE, with a suffix such as .csv, not 'paper'"),
        (["--rate", "1000"], "--rate must be absent without a recording"),
        (["--set", "handle.mass_kg=1"], "--set must be of an error of the encoder, encoder.KEY=VALUE"),
        (["--signal", "none.csv:a"], "none.csv"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(monkeypatch, capsys, tmp_path, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = call(monkeypatch, capsys, "rivals", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_the_command_prints_real_errors(monkeypatch, capsys):
    """With two rivals, one motion and one own estimator: a real run, small."""
    monkeypatch.setattr(rivals, "MOTIONS", {"rest": "stop"})
    monkeypatch.setattr(rivals, "PROJECTS", {"dvrk": "dVRK", "hostmot2": "LinuxCNC"})
    monkeypatch.setattr(rivals, "OURS", ("kalman",))
    order = ["rivals", "--sample-rate", RATE, "--backend", "float", "--workers", 1]
    code, out, err = call(monkeypatch, capsys, *order, "--json")
    assert code == 0, err
    rows = {(row["estimator"], row["setting"], row["encoder"]): row for row in json.loads(out)["rows"]}
    # 0.1 s after a stop the bound is a count over this time, and falls.
    assert 0 < rows["hostmot2", USUAL, "perfect"]["rms_mm_s"] < rows["hostmot2", USUAL, "perfect"]["max_mm_s"] < 0.0101
    assert rows["dvrk", USUAL, "perfect"]["max_mm_s"] < 0.0101
    assert rows["kalman", OWN, "real"]["rms_mm_s"] < 1e-3
    code, out, err = call(monkeypatch, capsys, *order)
    assert code == 0, err
    assert "hostmot2" in out
    assert "real encoder" in "".join(said(err))
