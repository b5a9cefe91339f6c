"""What pages take from `docs/results/reports/`: a line `%report NAME VIEW%` becomes a table of a report.

Below it stand the command, the version, the date and the machine; and where sources have changed since, that the report
is stale, which fails nothing. A report that is not there, a view that is none, or a report that the schema of its
command does not know is a warning, and so fails the build.
"""

import json
import re
from typing import Any

import reports
import views
from jsonschema import Draft202012Validator
from sphinx.application import Sphinx
from sphinx.util import logging

log = logging.getLogger(__name__)
LINE = re.compile(r"^%report ([\w-]+) ([\w-]+)%$", re.MULTILINE)
SCHEMA = json.loads((reports.TREE / "cli/reports.schema.json").read_text(encoding="utf-8"))


def unknown_to_schema(command: str, report: dict[str, Any]) -> str:
    """Return why the schema of a command does not describe a report; nothing if it does."""
    schema = {"$ref": f"#/$defs/{command.split()[1]}", "$defs": SCHEMA["$defs"]}
    error = next(iter(Draft202012Validator(schema).iter_errors(report)), None)
    return f"{error.json_path}: {error.message[:200]}" if error else ""


def shown(name: str, view: str) -> str:
    """Return a table of a report, and where it comes from."""
    wanted, found = reports.wanted().get(name), reports.kept(name)
    if wanted is None or found is None or view not in views.VIEWS:
        log.warning("%%report %s %s%%: no such report was made, or there is no such view", name, view)
        return ""
    if wrong := unknown_to_schema(found.command, found.report):
        log.warning("the report %s is not one of %s: %s", name, found.command, wrong)
    lines = [*views.VIEWS[view](found.report), ""]
    made = f"`{found.command}`, version {found.version}, {found.date}, {found.machine}; it took {found.seconds:.0f} s."
    stale = " **Stale: its sources have changed since.**" if reports.is_stale(wanted) else ""
    return "\n".join([*lines, f"*{made}*{stale}", ""])


def fill(_: Sphinx, __: str, source: list[str]) -> None:
    """Put the tables where a page wants them."""
    source[0] = LINE.sub(lambda match: shown(match[1], match[2]), source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the tables to Sphinx."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
