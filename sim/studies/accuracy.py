"""How accurate estimators are, side by side: every estimator on every signal, at every rate."""

from dataclasses import dataclass, replace
from typing import Any

from ...model.runtime.result import Table, table_of
from ..estimates.accuracy import COARSEN, encoder_of, measure, measure_recording, said_of, spec_of
from ..estimates.replay_plan import check_length, plan
from ..jobs.parallel import Run
from ..recordings.recording import Recording
from ..walls.methods import Curve


@dataclass(frozen=True)
class Accuracy:
    """The measurements.

    Attributes:
        figure: number of the founding paper's figure that they reproduce; None for none.
        curves: the estimators.
        rows: results of `accuracy.measure`, followed by results of `accuracy.measure_recording`.
        labels: labels of the curves, one for every row of a known motion.
    """

    figure: int | None
    curves: list[Curve]
    rows: list[dict[str, Any]]
    labels: list[str]

    def report(self) -> dict[str, Any]:
        """Return the rows, units in the keys."""
        return {"rows": self.rows}

    def tables(self) -> list[Table]:
        """Return a table of the known motions, and a table of the recordings, which have another unit."""
        ordered = sorted(self.rows, key=lambda row: (row["signal"], row["sample_hz"]))
        by_unit = {unit: [row for row in ordered if f"rms_{unit}" in row] for unit in ("mm_s", "counts_s")}
        return [_table(rows, unit) for unit, rows in by_unit.items() if rows]

    def notes(self) -> list[str]:
        """Return what is wrong with the encoder, the same in all rows."""
        said = {said_of(encoder_of(row)) for row in self.rows if "encoder_phase_error_counts" in row}
        return [f"encoder: {errors}" for errors in sorted(filter(None, said))]


def _table(rows: list[dict[str, Any]], unit: str) -> Table:
    flagged = any(row["flags"] for row in rows)
    accelerated = any(row.get("acceleration_rms_mm_s2") is not None for row in rows)
    lines = []
    for row in rows:
        errors = [f"{row[f'{kind}_{unit}']:.4g}" for kind in ("rms", "max", "chatter")]
        delay = _shown(row["delay_s"], 1e6)
        flags = [", ".join(row["flags"])] * flagged
        bent = [_shown(row.get("acceleration_rms_mm_s2"), 1)] * accelerated
        name = f"{row['estimator']} {row['output']}"
        lines.append([name, row["signal"], f"{row['sample_hz']:g}", *errors, delay, *bent, *flags])
    written = unit.replace("_", "/")
    numbers = ("rate (Hz)", f"RMS ({written})", "largest", "chatter", "delay (us)")
    more = [*["acceleration RMS (mm/s2)"] * accelerated, *["flags"] * flagged]
    return table_of(("estimator", "signal"), (*numbers, *more), lines)


def _shown(value: float | None, scale: float) -> str:
    """Return a number with a scale, as a table shows it; None is empty."""
    return "" if value is None else f"{value * scale:.4g}"


def jobs(curves: list[Curve], names: list[str], rates_hz: list[int], options: dict) -> list[tuple[str, dict]]:
    """Return label and arguments of `accuracy.measure` for every estimator on every known motion at every rate.

    The fastest rates come first, because they take longest.
    """
    return [
        (curve.label, curve.job(name, rate, **options))
        for rate in sorted(rates_hz, reverse=True)
        for name in names
        for curve in curves
    ]


@dataclass(frozen=True)
class Recordings:
    """Recordings, each read once: a job has the digest of its counts.

    Attributes:
        read: the recordings, by digest and column.
        jobs: the arguments of `measure`, which JSON can hold.
    """

    read: dict[tuple[str, str], Recording]
    jobs: list[dict]

    def measure(self, file: str, column: str, content: str, **how: str) -> dict:
        """Return the row of a job: see `measure_recording`."""
        return measure_recording(replace(self.read[content, column], file=file), **how)


def recordings_of(curves: list[Curve], recorded: list[Recording], backend: str) -> Recordings:
    """Return recordings, to be put through every estimator.

    Raises:
        ReplayError: if a recording is too short to be judged, or an estimator cannot take it.
    """
    read, jobs = {}, []
    for counts in recorded:
        check_length(counts)
        for estimator in dict.fromkeys(curve.estimator for curve in curves):
            plan(counts, estimator, backend, COARSEN)
        read[counts.content, counts.column] = counts
        keys = {"file": counts.file, "column": counts.column, "content": counts.content, "backend": backend}
        jobs += [{"estimator": curve.estimator, "output": curve.output} | keys for curve in curves]
    return Recordings(read, jobs)


def study(
    figure: int | None,
    curves: list[Curve],
    motions: list[tuple[str, dict]],
    recorded: list[Recording],
    backend: str,
    run: Run,
) -> Accuracy:
    """Return the errors of estimators on known motions and on recordings; all input is checked before any is measured.

    Args:
        figure: number of the founding paper's figure; None for none.
        curves: the estimators.
        motions: result of `jobs`.
        recorded: the recordings.
        backend: one of `backends.BACKENDS`.
        run: what does the jobs.

    Raises:
        ValueError: if the arguments of a motion are not valid.
        ReplayError: see `recordings_of`.
        RuntimeError: if the RTL could not be built.
    """
    labels, known = [label for label, _ in motions], [job for _, job in motions]
    for job in known:
        spec_of(job)
    recordings = recordings_of(curves, recorded, backend)
    rows = run(f"accuracy, {backend}", measure, known)
    rows += run(f"recordings, {backend}", recordings.measure, recordings.jobs)
    return Accuracy(figure, curves, rows, labels)
