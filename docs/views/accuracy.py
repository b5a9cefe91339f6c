"""Tables of `hardwall accuracy`."""

from statistics import median
from typing import Any

from hardwall.sim.studies.rendered_setting import rate_text

from .tables import Report, number, of_starts, table

Row = dict[str, Any]
MOTIONS = {
    "steady:1.037": "slow",
    "steady:301.7": "fast",
    "paper": "swing",
    "hit": "impact",
    "flicker": "standstill",
}
"""What a table calls the signals."""
PUBLISHED = {"FDM": 4.13, "FDM + Butterworth": 0.621, "Levant u": 0.626}
"""The errors that the founding paper gives for 10 kHz, in mm/s, by what a table calls its three estimators."""
THREE = {("fdm", "u"): "FDM", ("butterworth", "u"): "FDM + Butterworth", ("levant", "u"): "Levant u"}


def _name(row: Row) -> str:
    """Return an estimator, with its output where that is not the first."""
    return f"`{row['estimator']}`" if row["output"] == "u" else f"`{row['estimator']}` {row['output']}"


def _errors(report: Report) -> dict[str, dict[str, float]]:
    """Return the RMS errors in mm/s, by estimator and signal."""
    found: dict[str, dict[str, float]] = {}
    for row in report["rows"]:
        found.setdefault(_name(row), {})[row["signal"]] = row["rms_mm_s"]
    return found


def situations(report: Report) -> list[str]:
    """Return the RMS error of every estimator on every motion, the least bold, and the delay at an impact."""
    errors = _errors(report)
    delays = {_name(row): row["delay_s"] * 1e6 for row in report["rows"] if row["signal"] == "hit"}
    least = {signal: min(own[signal] for own in errors.values()) for signal in MOTIONS}

    def cell(name: str, signal: str) -> str:
        text = _small(errors[name][signal])
        return f"**{text}**" if text == _small(least[signal]) else text

    rows = [[name, *(cell(name, signal) for signal in MOTIONS), f"{delays[name]:.0f}"] for name in errors]
    return table(["RMS error (mm/s)", *MOTIONS.values(), "delay at the impact (µs)"], rows)


def accelerations(report: Report) -> list[str]:
    """Return the RMS error of every estimator's acceleration on swing and impact, the least bold."""
    signals = ("paper", "hit")
    found: dict[str, dict[str, float]] = {}
    for row in report["rows"]:
        found.setdefault(f"`{row['estimator']}`", {})[row["signal"]] = row["acceleration_rms_mm_s2"] / 1e3
    true = {row["signal"]: row["true_acceleration_rms_mm_s2"] / 1e3 for row in report["rows"]}
    least = {signal: min(own[signal] for own in found.values()) for signal in signals}

    def cell(error: float, signal: str) -> str:
        return f"**{number(error, 2)}**" if error == least[signal] else number(error, 2)

    rows = [[name, *(cell(own[signal], signal) for signal in signals)] for name, own in found.items()]
    heads = (f"{MOTIONS[signal]}, of {number(true[signal], 2)}" for signal in signals)
    return table(["RMS error of the acceleration (m/s²)", *heads], rows)


def _small(error_mm_s: float) -> str:
    """Return an error; less than a ten-thousandth of a mm/s is none."""
    return number(error_mm_s, 2) if error_mm_s >= 1e-4 else "0"


def by_rate(report: Report) -> list[str]:
    """Return the RMS error of every estimator by the sample rate."""
    rates = sorted({row["sample_hz"] for row in report["rows"]})
    found = {(_name(row), row["sample_hz"]): row["rms_mm_s"] for row in report["rows"]}
    names = dict.fromkeys(_name(row) for row in report["rows"])
    rows = ([name, *(number(found[name, rate]) for rate in rates)] for name in names)
    return table(["RMS error (mm/s)", *map(rate_text, rates)], rows)


def frontier(*reports: Report) -> list[str]:
    """Return the errors of estimators on the swing and at an impact, a row for each bound on the jerk."""
    found = [_errors(report) for report in reports]
    rows = [
        [
            number(report["rows"][0]["jerk_max_mm_s3"] / 1e3, 1),
            *(f"{number(own['paper'], 2)} / {number(own['hit'], 2)}" for own in errors.values()),
        ]
        for report, errors in zip(reports, found, strict=True)
    ]
    return table(["jerk (m/s³); swing / impact (mm/s)", *found[0]], rows)


def encoders(perfect: Report, late: Report, *misplaced: Report) -> list[str]:
    """Return the RMS errors with a perfect encoder, with edges that err, and with a channel out of phase.

    Args:
        perfect: the report of the perfect encoder.
        late: the report of a channel out of phase.
        misplaced: the reports of edges that err one by one, each of another scale.
    """
    clean, phased, every = _errors(perfect), _errors(late), [_errors(report) for report in misplaced]
    rows = [
        [
            name,
            *(
                text
                for signal in ("paper", "hit")
                for text in (
                    _small(clean[name][signal]),
                    of_starts([found[name][signal] for found in every], 2),
                    _small(phased[name][signal]),
                )
            ),
        ]
        for name in phased
    ]
    conditions = ("perfect", "edges err", "out of phase")
    heads = [f"{motion}: {condition}" for motion in ("swing", "impact") for condition in conditions]
    return table(["RMS error (mm/s)", *heads], rows)


def learned(*reports: Report) -> list[str]:
    """Return the RMS errors with all errors of an encoder, without a learned map of the scale and with one.

    Args:
        reports: first those without the map, then those with it.
    """
    found: dict[str, list[float]] = {}
    for report in reports:
        for row in report["rows"]:
            mapped = row["encoder"].get("learned_passes", 0)
            name = f"{_name(row)}, with a map from one pass" if mapped else _name(row)
            found.setdefault(name, []).append(row["rms_mm_s"])
    ordered = sorted(found.items(), key=lambda each: -median(each[1]))
    return table(["estimator", "RMS error (mm/s)"], ([name, of_starts(errors, 3)] for name, errors in ordered))


def published(report: Report) -> list[str]:
    """Return the errors of the founding paper's three estimators at 10 kHz, as published and as measured."""
    found = {}
    for row in report["rows"]:
        name = THREE.get((row["estimator"], row["output"]))
        # The paper's filter is at a tenth of the rate; Levant's gains are the default ones.
        if name and name not in found:
            found[name] = row["rms_mm_s"]
    rows = ([name, f"{PUBLISHED[name]:.3g}", number(found[name])] for name in PUBLISHED)
    return table(["RMS error at 10 kHz (mm/s)", "published", "here"], rows)
