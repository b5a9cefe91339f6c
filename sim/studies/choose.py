"""The table to choose an estimator by: its errors in several situations, with one set of gains, and its cost.

The gains follow from the bound C on the acceleration of the impact: a device keeps its gains in every situation. Errors
are RMS, in mm/s.
"""

from dataclasses import dataclass, field
from typing import Any

from ...model.estimators import registry
from ...model.runtime.result import Table, table_of
from ..estimates import signals
from ..estimates.accuracy import said_of

PHASE_ERROR_COUNTS = 0.25
EDGE_ERROR_COUNTS = 0.05
Situations = dict[str, dict[str, Any]]
"""Arguments of `accuracy.measure`, by the name of the situation."""

SITUATIONS: Situations = {
    "slow": {"signal": "steady:1.037"},
    "fast": {"signal": "steady:301.7"},
    "moving": {"signal": "paper"},
    "impact": {"signal": "hit"},
    "standstill": {"signal": "flicker"},
    "bad encoder": {"signal": "paper", "encoder": {"encoder.phase_error_counts": PHASE_ERROR_COUNTS}},
    "single edges": {"signal": "paper", "encoder": {"encoder.edge_error_counts": EDGE_ERROR_COUNTS}},
}
"""Motions of a handle: about 1 and 300 mm/s; the paper's swing, a hit of a wall, and a count that flickers. Round
speeds are avoided: their counts lock to the samples. Two more are the swing seen by bad encoders: the errors of the
first repeat every four edges, in the second each edge has its own error."""
OWN = "own encoder"
"""The situation of an encoder that the user describes: the swing, too."""


def situations_with(encoder: dict[str, Any]) -> Situations:
    """Return the situations, and `OWN` if an encoder is given, as for `accuracy.measure`."""
    return SITUATIONS | ({OWN: {"signal": "paper", "encoder": encoder}} if encoder else {})


@dataclass(frozen=True)
class Choice:
    """The table to choose by: rows of `table`, and the situations that they are of."""

    rows: list[dict[str, Any]]
    situations: Situations = field(default_factory=lambda: SITUATIONS)

    def report(self) -> dict[str, Any]:
        """Return the rows and the situations, units in the keys."""
        return {"rows": self.rows, "situations": self.situations}

    def tables(self) -> list[Table]:
        """Return the table of errors and the table of costs."""
        names = list(self.situations)
        best = {name: min(row["rms_mm_s"][name] for row in self.rows) for name in names}
        errors, costs = [], []
        for row in self.rows:
            estimator = f"{row['estimator']} {row['output']}".strip()
            own = [f"{row['rms_mm_s'][name]:.3g}{'*' * (row['rms_mm_s'][name] == best[name])}" for name in names]
            delay = "" if row["impact_delay_s"] is None else f"{row['impact_delay_s'] * 1e6:.3g}"
            errors.append([estimator, *own, delay])
            logic = [str(row[name]) for name in ("lut4", "ff", "dsp", "bram", "latency_clocks")]
            rate = row["max_sample_hz"]
            costs.append([estimator, *logic, "does not fit" if rate is None else f"{rate:,}"])
        numbers = ("LUT4", "FF", "DSP", "BRAM", "clocks", "max samples/s")
        return [
            table_of(("RMS error (mm/s)",), (*names, "impact delay (us)"), errors),
            table_of((f"cost on {self.rows[0]['device']}",), numbers, costs),
        ]

    def notes(self) -> list[str]:
        """Return the meaning of a star, and the errors of each bad encoder."""
        encoders = {name: situation.get("encoder", {}) for name, situation in self.situations.items()}
        return ["*: the least error", *(f"{name}: {said_of(keys)}" for name, keys in encoders.items() if keys)]


def jobs(pairs: list[tuple[str, str]], sample_hz: int, backend: str, situations: Situations = SITUATIONS) -> list[dict]:
    """Return the arguments of `accuracy.measure` for every situation of every (estimator, output) pair."""
    bound = signals.load("hit").acceleration_max_m_per_s2
    common = {"sample_hz": sample_hz, "backend": backend, "bounds": {"acceleration_max_m_per_s2": bound}}
    return [
        {"estimator": estimator, "output": output, **common, **situation}
        for estimator, output in pairs
        for situation in situations.values()
    ]


def table(
    pairs: list[tuple[str, str]], measured: list[dict], costs: list[dict], situations: Situations = SITUATIONS
) -> list[dict]:
    """Return a row for every (estimator, output) pair: its errors by situation, its delay and its cost.

    Args:
        pairs: estimators and their outputs.
        measured: results of `accuracy.measure` for `jobs`, in the same order.
        costs: results of `costs.cost`, one for every estimator.
        situations: as of `jobs`.
    """
    by_name = {row["estimator"]: row for row in costs}
    rows, each = [], len(situations)
    for index, (estimator, output) in enumerate(pairs):
        own = dict(zip(situations, measured[index * each : (index + 1) * each], strict=True))
        cost = by_name[estimator]
        rows.append(
            {
                "estimator": estimator,
                "output": output if len(registry.design_of(estimator).outputs) > 1 else "",
                "rms_mm_s": {name: row["rms_mm_s"] for name, row in own.items()},
                "impact_delay_s": own["impact"]["delay_s"],
                **{name: cost[name] for name in ("device", "lut4", "ff", "dsp", "bram", "latency_clocks")},
                "max_sample_hz": cost["board"] and cost["board"]["max_sample_hz"],
            }
        )
    return rows
