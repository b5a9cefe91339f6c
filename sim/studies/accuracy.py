"""How accurate estimators are, side by side: every estimator on every signal, at every rate."""

from dataclasses import dataclass
from typing import Any

from ...model.runtime.result import Table, table_of
from ..estimates.accuracy import encoder_of, said_of
from ..walls.methods import Curve


@dataclass(frozen=True)
class Accuracy:
    """The measurements.

    Attributes:
        figure: number of the founding paper's figure that they reproduce; None for none.
        curves: the estimators.
        rows: results of `accuracy.measure`, followed by those of `accuracy.measure_recording`.
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
    lines = []
    for row in rows:
        errors = [f"{row[f'{kind}_{unit}']:.4g}" for kind in ("rms", "max", "chatter")]
        delay = "" if row["delay_s"] is None else f"{row['delay_s'] * 1e6:.4g}"
        flags = [", ".join(row["flags"])] * flagged
        name = f"{row['estimator']} {row['output']}"
        lines.append([name, row["signal"], f"{row['sample_hz']:g}", *errors, delay, *flags])
    written = unit.replace("_", "/")
    numbers = ("rate (Hz)", f"RMS ({written})", "largest", "chatter", "delay (us)")
    return table_of(("estimator", "signal"), (*numbers, *["flags"] * flagged), lines)


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
