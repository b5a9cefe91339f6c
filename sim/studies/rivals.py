"""Rivals on one bench: the velocity estimators of other projects beside this project's own, in one table.

All see the same edges, and are judged at the same samples against the same truth. This project's estimators have one
set of default gains for all motions: for the largest acceleration of the impact, and for the swing's largest jerk. A
rival has its usual settings, and for each motion the best of some settings, a choice that no device has.
"""

from dataclasses import dataclass, field
from typing import Any

from ...model.estimators.registry import design_of
from ...model.runtime.result import Table, table_of
from ..estimates import signals
from ..estimates.accuracy import COARSEN, measure, measure_recording, said_of, spec_of
from ..estimates.replay_plan import check_length, plan
from ..estimates.rivals import judged
from ..estimates.rivals.known import ACCELERATIONS, LOOP, PROJECTS, Settings, choices
from ..jobs.parallel import Run
from ..recordings.recording import Recording
from .choose import EDGE_ERROR_COUNTS, PHASE_ERROR_COUNTS

MOTIONS = {"swing": "paper", "impact": "hit", "dither": "flicker", "rest": "stop", "creep": "steady:1.037"}
"""Names of signals, by what tables call the motions: the paper's signal, a hit of a wall, a hand that trembles about an
edge, a handle that has stopped, and about 1 mm/s."""
OURS = ("kalman", "levant-adaptive", "count-kalman", "edge-kalman", "levant-edge")
REAL = {"encoder.edge_error_counts": EDGE_ERROR_COUNTS, "encoder.phase_error_counts": PHASE_ERROR_COUNTS}
"""The errors of the encoder that is called real, unless others are given."""
USUAL, BEST, OWN = "usual", "best", "default"
OF = {"swing": ("rms_mm_s",), "impact": ("rms_mm_s",), "dither": ("rms_mm_s", "max_mm_s"), "creep": ("rms_mm_s",)}
OF["rest"] = OF["dither"]
"""The figures that the tables have of each motion."""
FIGURES = "rms_mm_s", "max_mm_s", "rms_counts_s", "max_counts_s", "delay_s"
Row = dict[str, Any]


@dataclass(frozen=True)
class Rivals:
    """The result of the study.

    Attributes:
        encoders: the errors of each encoder, by its name.
        rows: the errors of every estimator, rivals first.
        accelerations: the errors of the rivals' accelerations.
    """

    encoders: dict[str, dict[str, Any]]
    rows: list[Row]
    accelerations: list[Row] = field(default_factory=list)

    def report(self) -> dict[str, Any]:
        """Return the rows, units in the keys."""
        return {"encoders": self.encoders, "rows": self.rows, "accelerations": self.accelerations}

    def tables(self) -> list[Table]:
        """Return a table of errors for each encoder, one of the accelerations, and one of the recordings."""
        known = [row for row in self.rows if "rms_mm_s" in row]
        tables = [_errors([row for row in known if row["encoder"] == name], name) for name in self.encoders]
        lines = [
            [row["estimator"], row["encoder"], f"{row['rms_mm_s2']:.4g}", f"{row['signal_rms_mm_s2']:.4g}"]
            for row in self.accelerations
        ]
        tables.append(table_of(("acceleration", "encoder"), ("RMS error (mm/s2)", "RMS of the true one"), lines))
        recorded = [row for row in self.rows if "rms_counts_s" in row]
        lines = [
            [
                row["estimator"],
                row["setting"],
                row["signal"],
                f"{row['rms_counts_s']:.4g}",
                f"{row['max_counts_s']:.4g}",
            ]
            for row in recorded
        ]
        named = ("estimator", "settings", "recording")
        return tables + ([table_of(named, ("RMS (counts/s)", "largest"), lines)] if recorded else [])

    @property
    def _recorded(self) -> bool:
        return any("rms_counts_s" in row for row in self.rows)

    def notes(self) -> list[str]:
        """Return the meaning of the settings, and the errors of the encoders."""
        return [
            f"{USUAL}: the settings of its project; {BEST}: of the settings that were tried, the best for each motion; "
            f"{OWN}: the gains of this project, one set for the impact's acceleration and the swing's jerk",
            "swing: the paper's signal; impact: a hit of a wall; dither: 0.3 um about an edge; creep: 1.037 mm/s",
            *(f"{name} encoder: {said_of(errors)}" for name, errors in self.encoders.items() if errors),
            *["recordings: the gains of this project follow from each recording's own acceleration"] * self._recorded,
        ]


def _errors(rows: list[Row], encoder: str) -> Table:
    """Return the table of the errors with one encoder."""
    lines: dict[tuple[str, str], dict[str, Row]] = {}
    for row in rows:
        lines.setdefault((row["estimator"], row["setting"]), {})[row["motion"]] = row
    heads = [motion + ", largest" * (key == "max_mm_s") for motion in MOTIONS for key in OF[motion]]
    found = [
        [*names, *(f"{of[motion][key]:.3g}" for motion in MOTIONS for key in OF[motion])] for names, of in lines.items()
    ]
    return table_of((f"RMS error (mm/s), {encoder} encoder", "settings"), tuple(heads), found)


@dataclass(frozen=True)
class Bench:
    """What all estimators have in common.

    Attributes:
        sample_hz: sample rate.
        backend: backend of this project's estimators, the loop among them; the other rivals are in float64.
        encoders: the errors of each encoder, by its name.
        run: what does the jobs.
    """

    sample_hz: int
    backend: str
    encoders: dict[str, dict[str, Any]]
    run: Run

    @property
    def places(self) -> list[tuple[str, str]]:
        """Every encoder with every motion, by their names."""
        return [(encoder, motion) for encoder in self.encoders for motion in MOTIONS]

    def own_job(self, estimator: str, encoder: str, motion: str, gains: Settings | None = None) -> dict[str, Any]:
        """Return the arguments of `accuracy.measure`, with the bound of the impact for every motion."""
        return self.job(encoder, MOTIONS[motion]) | {
            "estimator": estimator,
            "output": design_of(estimator).outputs[0],
            "backend": self.backend,
            "bounds": {"acceleration_max_m_per_s2": signals.load("hit").acceleration_max_m_per_s2},
            "gains": gains,
        }

    def rival_job(self, name: str, encoder: str, motion: str, settings: Settings) -> dict[str, Any]:
        """Return the arguments of `judged.measure`; for the loop, which this project has, of `accuracy.measure`."""
        if name == LOOP:
            return self.own_job(LOOP, encoder, motion, settings)
        return self.job(encoder, MOTIONS[motion]) | {"name": name, "settings": settings}

    def job(self, encoder: str, signal: str) -> dict[str, Any]:
        """Return the arguments that every estimator takes."""
        return {"signal": signal, "sample_hz": self.sample_hz, "encoder": self.encoders[encoder] or None}


def study(bench: Bench, recorded: list[Recording]) -> Rivals:
    """Return the errors of rivals and of this project's estimators; input is checked before any is measured.

    Args:
        bench: what they have in common.
        recorded: recordings to try them on, too.

    Raises:
        ValueError: if an encoder's errors are not valid, or the rate does not suit an estimator.
        ReplayError: if a recording is too short to be judged, or an estimator cannot take it.
        RuntimeError: if the RTL could not be built.
    """
    own = [bench.own_job(name, *place) for name in OURS for place in bench.places]
    for job in own:
        spec_of(job)
    for each in recorded:
        check_length(each)
        for name in OURS:
            plan(each, name, bench.backend, COARSEN)
    rows = [row for name in PROJECTS for row in _of_rival(bench, name)]
    found = bench.run(f"hardwall, {bench.backend}", measure, own)
    for job, place, row in zip(own, bench.places * len(OURS), found, strict=True):
        rows.append(_row(job["estimator"], OWN, row["gains"], row) | _where(*place))
    rows += [row for each in recorded for row in _on_recording(each, bench.backend)]
    return Rivals(bench.encoders, rows, _accelerations(bench))


def _where(encoder: str, motion: str) -> Row:
    return {"encoder": encoder, "motion": motion, "signal": MOTIONS[motion]}


def _row(estimator: str, setting: str, settings: Settings, figures: Row) -> Row:
    """Return a row of the report, with the figures of a row of errors."""
    project = PROJECTS.get(estimator, "hardwall")
    kept = {key: figures[key] for key in FIGURES if key in figures}
    return {"estimator": estimator, "project": project, "setting": setting, "settings": settings, **kept}


def _of_rival(bench: Bench, name: str) -> list[Row]:
    """Return the rows of a rival: with its usual settings, if the rate allows them, and with the best for a motion."""
    usual, every = choices(name, bench.sample_hz)
    if not every:
        return []
    keys = [(place, settings) for place in bench.places for settings in every]
    jobs = [bench.rival_job(name, *place, settings) for place, settings in keys]
    found = bench.run(name, measure if name == LOOP else judged.measure, jobs)
    rows = [_row(name, BEST, key[1], row) | _where(*key[0]) for key, row in zip(keys, found, strict=True)]
    return _chosen(rows, usual, len(every))


def _chosen(rows: list[Row], usual: Settings | None, each: int) -> list[Row]:
    """Return, of rows with `each` settings for every place, those with the usual one, and the best of every place."""
    first = [row | {"setting": USUAL} for row in rows if row["settings"] == usual]
    if each == 1 and first:
        return first
    groups = [rows[start : start + each] for start in range(0, len(rows), each)]
    return first + [min(group, key=lambda row: next(row[key] for key in FIGURES if key in row)) for group in groups]


def _on_recording(recorded: Recording, backend: str) -> list[Row]:
    """Return the rows of all estimators on a recording."""
    signal, rows = {"signal": f"{recorded.file}:{recorded.column}"}, []
    for name in PROJECTS:
        usual, every = choices(name, recorded.rate_hz)
        found = [judged.measure_recording(recorded, name, settings, backend) for settings in every]
        own = [_row(name, BEST, *each) | signal for each in zip(every, found, strict=True)]
        rows += _chosen(own, usual, len(every)) if own else []
    for name in OURS:
        row = measure_recording(recorded, name, design_of(name).outputs[0], backend)
        rows.append(_row(name, OWN, row["gains"], row) | signal)
    return rows


def _accelerations(bench: Bench) -> list[Row]:
    """Return the errors of the rivals' accelerations on the paper's signal."""
    keys = [(name, encoder) for name in ACCELERATIONS for encoder in bench.encoders]
    jobs = [bench.job(encoder, "paper") | {"name": name} for name, encoder in keys]
    found = bench.run("accelerations", judged.measure_acceleration, jobs)
    return [{"estimator": name, "encoder": encoder, **row} for (name, encoder), row in zip(keys, found, strict=True)]
