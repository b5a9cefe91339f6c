"""Tables of `hardwall rendered`."""

from typing import Any

from hardwall.sim.studies.rendered_setting import rate_text

from .tables import Report, number, spread, table

Row = dict[str, Any]
ONE = "kalman"
"""The estimator of the tables by rate: at a low frequency and at contact the estimator matters little."""


def _rate(row: Row) -> str:
    """Return what a table calls the rates of a row."""
    return "own" if row["own_rates"] else rate_text(row["actuation_hz"])


def _by_rate(report: Report) -> list[Row]:
    """Return the rows of one estimator, a row a rate."""
    return [row for row in report["rows"] if row["estimator"] == ONE]


def _at(row: Row, hz: int) -> dict[str, Any]:
    """Return what a row renders at a frequency."""
    return next(each for each in row["impedance"] if each["frequency_hz"] == hz)


def _name(row: Row) -> str:
    """Return an estimator and its output, with its filter if it has one."""
    return f"`{row['estimator']}` {row['output']}" if row["label"].startswith(row["estimator"]) else row["label"]


def late_damping(report: Report) -> list[str]:
    """Return what a late spring takes of the damping at 10 Hz, by rate."""
    rows = [
        [
            _rate(row),
            number(row["mean_delay_s"] * 1e6),
            number(report["stiffness_n_per_m"] * row["mean_delay_s"]),
            spread(row, "spring_takes_n_s_per_m"),
            spread(_at(row, 10), "damping_n_s_per_m"),
        ]
        for row in _by_rate(report)
    ]
    rendered = f"B rendered of {number(report['damping_n_s_per_m'])} (N s/m)"
    return table(["rates", "T (µs)", "K T (N s/m)", "the spring takes (N s/m)", rendered], rows)


def bandwidth(report: Report) -> list[str]:
    """Return the frequencies up to which every start renders K and B within a tenth, by estimator and rate."""
    rates = list(dict.fromkeys(map(_rate, report["rows"])))
    names = list(dict.fromkeys(map(_name, report["rows"])))
    found = {(_name(row), _rate(row)): row for row in report["rows"]}

    def cell(row: Row) -> str:
        return " / ".join(str(row[f"{part}_rendered_to_hz"] or "-") for part in ("stiffness", "damping"))

    heads = ["K / B to (Hz), by rates", *rates]
    return table(heads, ([name, *(cell(found[name, rate]) for rate in rates)] for name in names))


def every_output(report: Report) -> list[str]:
    """Return what each estimator renders at one rate, the best first."""
    rows = sorted(
        (row for row in report["rows"] if not row["own_rates"]),
        key=lambda row: (-(row["stiffness_rendered_to_hz"] or 0), -(row["damping_rendered_to_hz"] or 0)),
    )
    heads = ["estimator", "K to (Hz)", "B to (Hz)", "K at 100 Hz (kN/m)", "B at 100 Hz (N s/m)", "rest at 10 Hz (mN)"]
    return table(
        heads,
        (
            [
                _name(row),
                str(row["stiffness_rendered_to_hz"] or "-"),
                str(row["damping_rendered_to_hz"] or "-"),
                spread(_at(row, 100), "stiffness_n_per_m", 1e3),
                spread(_at(row, 100), "damping_n_s_per_m"),
                number(_at(row, 10)["rest_n"] * 1e3),
            ]
            for row in rows
        ),
    )


def contact(report: Report) -> list[str]:
    """Return the rate-hardness by rate at the slowest and the fastest speed, and the first force at the middle one."""
    rows = _by_rate(report)
    speeds = [each["speed_m_per_s"] for each in rows[0]["contact"]]
    middle = len(speeds) // 2
    heads = [
        "rates",
        *(f"hardness at {number(speed * 1e3)} mm/s (kN/m)" for speed in (speeds[0], speeds[-1])),
        f"first force at {number(speeds[middle] * 1e3)} mm/s (N)",
        "after (ms)",
    ]
    return table(
        heads,
        (
            [
                _rate(row),
                *(spread(each, "rate_hardness_n_per_m", 1e3) for each in (row["contact"][0], row["contact"][-1])),
                spread(row["contact"][middle], "first_n"),
                spread(row["contact"][middle], "first_s", 1e-3),
            ]
            for row in rows
        ),
    )
