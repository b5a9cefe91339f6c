"""How pages show the reports of commands: each view makes the lines of a Markdown table of one."""

from collections.abc import Callable, Iterable
from typing import Any

import reports

from hardwall.sim.studies.rendered_setting import rate_text
from support.reports import check

Report = dict[str, Any]


class UnknownError(Exception):
    """There is no such report or view, or the schema of the report's command does not describe it."""


def table(heads: Iterable[str], rows: Iterable[Iterable[str]], numbers_from: int = 1) -> list[str]:
    """Return the lines of a Markdown table, whose columns from a place on have numbers."""
    heads = list(heads)
    rules = ["---" if place < numbers_from else "---:" for place in range(len(heads))]
    return [f"| {' | '.join(line)} |" for line in (heads, rules, *rows)]


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many digits that matter, without an exponent."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text else text


def errors_by_rate(report: Report) -> list[str]:
    """Return the RMS error of every estimator at every rate, in mm/s."""
    rows = report["rows"]
    rates = sorted({row["sample_hz"] for row in rows})
    found = {(row["estimator"], row["output"], row["sample_hz"]): row["rms_mm_s"] for row in rows}
    names = dict.fromkeys((row["estimator"], row["output"]) for row in rows)
    cells = ([f"`{name}` {output}", *(number(found[name, output, each]) for each in rates)] for name, output in names)
    return table(["estimator", *(f"RMS error at {rate_text(each)} (mm/s)" for each in rates)], cells)


VIEWS: dict[str, Callable[[Report], list[str]]] = {"errors-by-rate": errors_by_rate}


def shown(name: str, view: str) -> list[str]:
    """Return the lines of a report's table, and where the report comes from.

    Raises:
        UnknownError: see there.
    """
    wanted, found = reports.wanted().get(name), reports.kept(name)
    if wanted is None or found is None:
        raise UnknownError("no such report was made")
    if view not in VIEWS:
        raise UnknownError(f"the view must be one of {', '.join(VIEWS)}")
    try:
        check(found.command.split()[1], found.report)
    except AssertionError as error:
        raise UnknownError(str(error)) from None
    made = f"`{found.command}`, version {found.version}, {found.date}, {found.machine}; it took {found.seconds:.0f} s."
    stale = " **Stale: its sources have changed since.**" if reports.is_stale(wanted) else ""
    return [*VIEWS[view](found.report), "", f"*{made}*{stale}", ""]
