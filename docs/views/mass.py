"""The table of stable virtual masses: `hardwall mass`."""

from collections.abc import Sequence
from typing import Any

from .tables import Report, number, table


def masses(*reports: Report) -> list[str]:
    """Return the range of stable masses: a row for theory and each estimator, a column for each wall and rate.

    Of several reports it is the range that is stable in all of them.
    """
    columns, cells = [], {"in theory": []}
    for of in zip(*(report["rows"] for report in reports), strict=True):
        row = of[0]
        column = (row["stiffness_n_per_m"], row["damping_n_s_per_m"], row["rate_hz"])
        if column not in columns:
            columns.append(column)
            cells["in theory"].append(_range([row], "theory_"))
        cells.setdefault(row["label"], []).append(_range(of))
    heads = ["virtual mass / handle's; kN/m, N s/m", *(_head(*column) for column in columns)]
    return table(heads, ([name, *found] for name, found in cells.items()))


def _head(stiffness_n_per_m: float, damping_n_s_per_m: float, rate_hz: int | None) -> str:
    rate = "10 and 1 kHz" if rate_hz is None else f"{number(rate_hz / 1e3)} kHz"
    return f"{number(stiffness_n_per_m / 1e3)}, {number(damping_n_s_per_m)}: {rate}"


def _range(rows: Sequence[dict[str, Any]], of: str = "") -> str:
    if any(row[f"{of}from_share"] is None for row in rows):
        return "none"
    low, high = max(row[f"{of}from_share"] for row in rows), min(row[f"{of}to_share"] for row in rows)
    return f"{low:+.2g} to {high:+.2g}" if low <= high else "none"
