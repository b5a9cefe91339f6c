"""How pages show the reports of commands: each view makes the lines of a Markdown table of one."""

from collections.abc import Callable

import reports

from support.reports import check

from . import accuracy, rendered
from .tables import Report


class UnknownError(Exception):
    """There is no such report or view, or the schema of the report's command does not describe it."""


VIEWS: dict[str, Callable[[Report], list[str]]] = {
    "errors-by-rate": accuracy.errors_by_rate,
    "late-damping": rendered.late_damping,
    "bandwidth": rendered.bandwidth,
    "every-output": rendered.every_output,
    "contact": rendered.contact,
}


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
