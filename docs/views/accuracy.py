"""Tables of `hardwall accuracy`."""

from hardwall.sim.studies.rendered_setting import rate_text

from .tables import Report, number, table


def errors_by_rate(report: Report) -> list[str]:
    """Return the RMS error of every estimator at every rate, in mm/s."""
    rows = report["rows"]
    rates = sorted({row["sample_hz"] for row in rows})
    found = {(row["estimator"], row["output"], row["sample_hz"]): row["rms_mm_s"] for row in rows}
    names = dict.fromkeys((row["estimator"], row["output"]) for row in rows)
    cells = ([f"`{name}` {output}", *(number(found[name, output, each]) for each in rates)] for name, output in names)
    return table(["estimator", *(f"RMS error at {rate_text(each)} (mm/s)" for each in rates)], cells)
