"""Tables of gain and lead on a sine: `hardwall response`."""

from typing import Any

from .tables import Report, number, table

SHOWN = 2.0, 3.0, 5.0, 20.0, 200.0
"""The amplitudes of the table, counts."""


def responses(report: Report) -> list[str]:
    """Return gain and lead: a row for each estimator and frequency, a column for each of some amplitudes."""
    found: dict[tuple[str, float], dict[float, str]] = {}
    for row in report["rows"]:
        found.setdefault((row["label"], row["frequency_hz"]), {})[row["amplitude_counts"]] = _cell(row)
    heads = ["gain and lead; amplitude (counts)", *(number(each) for each in SHOWN)]
    lines = sorted(found.items(), key=lambda line: line[0][1])
    return table(heads, ([f"{name}, {hz:g} Hz", *(cells[each] for each in SHOWN)] for (name, hz), cells in lines))


def _cell(row: dict[str, Any]) -> str:
    return f"{row['gain']:.2f}, {row['lead_deg']:+.0f}°" if row["gain"] else "0"
