"""Tables of `hardwall rivals`."""

from typing import Any

from .tables import Report, number, table

Row = dict[str, Any]
COLUMNS = {
    "swing": ("swing", "rms_mm_s"),
    "impact": ("impact", "rms_mm_s"),
    "tremor": ("dither", "rms_mm_s"),
    "rest": ("rest", "rms_mm_s"),
    "rest, largest": ("rest", "max_mm_s"),
    "1 mm/s": ("creep", "rms_mm_s"),
}
"""Motions and figures, by what a table calls them."""
LEAST_MM_S = 1e-4
"""An error that is shown as none."""


def _name(row: Row) -> str:
    """Return an estimator with its project and its settings; this project's has its name alone."""
    if row["setting"] == "default":
        return f"`{row['estimator']}`"
    return f"{row['project']}: `{row['estimator']}`, {row['setting']}"


def _by_name(report: Report, encoder: str) -> dict[str, dict[str, Row]]:
    """Return the rows of the known motions with an encoder, by estimator and motion."""
    found: dict[str, dict[str, Row]] = {}
    for row in report["rows"]:
        if row.get("encoder") == encoder:
            found.setdefault(_name(row), {})[row["motion"]] = row
    return found


def _small(error_mm_s: float) -> str:
    return number(error_mm_s, 2) if error_mm_s >= LEAST_MM_S else "0"


def _errors(report: Report, encoder: str) -> list[str]:
    """Return the errors with an encoder, the least of each motion bold."""
    found = _by_name(report, encoder)
    least = {head: min(of[motion][key] for of in found.values()) for head, (motion, key) in COLUMNS.items()}

    def cell(of: dict[str, Row], head: str) -> str:
        motion, key = COLUMNS[head]
        text = _small(of[motion][key])
        return f"**{text}**" if text == _small(least[head]) else text

    rows = [[name, *(cell(of, head) for head in COLUMNS)] for name, of in found.items()]
    return table(["RMS error (mm/s)", *COLUMNS], rows)


def perfect(report: Report) -> list[str]:
    """Return the errors with a perfect encoder."""
    return _errors(report, "perfect")


def real(report: Report) -> list[str]:
    """Return the errors with an encoder whose edges are misplaced."""
    return _errors(report, "real")


def settings(report: Report) -> list[str]:
    """Return the usual settings of the rivals, and the best ones on swing and impact, with each encoder."""
    usual = {row["estimator"]: row["settings"] for row in report["rows"] if row["setting"] == "usual"}
    best = {
        (row["estimator"], row["motion"], row["encoder"]): row["settings"]
        for row in report["rows"]
        if row["setting"] == "best" and "encoder" in row
    }
    names = [(name, motion) for name in usual for motion in ("swing", "impact")]
    rows = [
        [f"`{name}`, {motion}", _said(usual[name]), *(_said(best[name, motion, each]) for each in report["encoders"])]
        for name, motion in names
        if (name, motion, "real") in best
    ]
    return table(["settings", "usual", *(f"best, {encoder} encoder" for encoder in report["encoders"])], rows)


def _said(chosen: dict[str, Any]) -> str:
    """Return settings in words."""
    texts = []
    if "period_s" in chosen:
        texts.append(f"every {_time(chosen['period_s'])}" if chosen["period_s"] else "every sample")
    if "filter_s" in chosen:
        texts.append(f"filter {_time(chosen['filter_s'])}" if chosen["filter_s"] else "no filter")
    if chosen.get("calibrated"):
        texts.append("calibrated")
    if "bandwidth_hz" in chosen:
        texts.append(f"{chosen['bandwidth_hz']:.0f} Hz")
    return ", ".join(texts)


def _time(seconds: float) -> str:
    return f"{seconds * 1e3:g} ms"


def accelerations(report: Report) -> list[str]:
    """Return the errors of the rivals' accelerations, beside the true acceleration."""
    rows = [
        [f"`{row['estimator']}`", row["encoder"], number(row["rms_mm_s2"] / 1e3), number(row["signal_rms_mm_s2"] / 1e3)]
        for row in report["accelerations"]
    ]
    return table(["acceleration", "encoder", "RMS error (m/s²)", "RMS of the true one (m/s²)"], rows, 2)
