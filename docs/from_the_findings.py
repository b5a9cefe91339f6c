"""What pages take from `tests/signoff/findings/`, which the tasks that sign the hardware off write.

A line `%findings mutate%` in a page becomes the table of what that task has kept. A task that has kept nothing is a
warning, and so fails the build.
"""

import json
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from from_the_program import cell, table
from sphinx.application import Sphinx
from sphinx.util import logging

log = logging.getLogger(__name__)
FINDINGS = Path(__file__).parent.parent / "tests" / "signoff" / "findings"
KINDS = ("line", "branch", "toggle")
CELLS = ("lut4", "ff", "dsp", "bram")


def proofs(found: dict[str, Any]) -> list[str]:
    """Return a table of the properties: how long each took, and at which clocks its bugs were found."""
    rows = [
        [cell(name), f"{verdict['seconds']:.0f}", ", ".join(str(bug["clock"]) for bug in bugs)]
        for name, (verdict, *bugs) in found.items()
    ]
    return table(["block and property", "seconds", "its bugs fail at clock"], rows)


def faults(found: dict[str, Any]) -> list[str]:
    """Return a table of the stages: how many faults were injected, and what the worst of them did."""
    stages: dict[str, list[dict[str, Any]]] = {}
    for name, outcome in found.items():
        stages.setdefault(name.partition(": ")[0], []).append(outcome)
    rows = [
        [
            cell(stage),
            str(len(every)),
            str(sum(not outcome["wrong"] for outcome in every)),
            str(sum(outcome["clocks"] is not None for outcome in every)),
            str(max(outcome["clocks"] or 0 for outcome in every)),
            f"{max(outcome['largest_n'] for outcome in every):.1f}",
        ]
        for stage, every in stages.items()
    ]
    heads = ["drive stage", "faults", "safe", "drive brought down", "in at most, clocks", "largest force, N"]
    return table(heads, rows)


def netlists(found: dict[str, Any]) -> list[str]:
    """Return a table of the netlists that are equal to their RTL: their cells, and how long they were compared."""
    rows = [
        [cell(name), *(str(each["cells"][kind]) for kind in CELLS), str(each["samples"]), str(each["clocks"])]
        for name, each in found.items()
    ]
    return table(["netlist", *map(str.upper, CELLS), "samples", "clocks compared"], rows)


def coverage(found: dict[str, Any]) -> list[str]:
    """Return a table of the blocks: the share of every kind of points that their tests reach, and what they miss."""
    rows = []
    for block, each in found.items():
        points, missed = each["points"], Counter(kind for kind, *_ in each["missed"])
        shares = [f"{100 * (1 - missed[kind] / points[kind]):.2f}" if points.get(kind) else "none" for kind in KINDS]
        rows.append([f"`{block}`", *shares, str(sum(points.values())), str(sum(missed.values()))])
    return table(["block", "lines, %", "branches, %", "toggles, %", "points", "missed, each with its reason"], rows)


def mutants(found: dict[str, Any]) -> list[str]:
    """Return a table of the blocks: what came of their mutants."""
    rows = []
    for block, each in found.items():
        fates = each["fates"]
        killed = sum(fate["killed_by"] is not None for fate in fates)
        equivalent = sum(fate["killed_by"] is None and fate["known"] == "equivalent" for fate in fates)
        others = len(fates) - equivalent
        share = f"{100 * killed / others:.1f}" if others else "100.0"
        rows.append([f"`{block}`", *map(str, (len(fates), killed, equivalent, others - killed)), share])
    return table(["block", "mutants", "killed", "equivalent", "left", "killed of the others, %"], rows)


TABLES: dict[str, Callable[[dict[str, Any]], list[str]]] = {
    "prove": proofs,
    "faults": faults,
    "gate": netlists,
    "coverage": coverage,
    "mutate": mutants,
}


def told(task: str) -> str:
    """Return the table of what a task has kept."""
    files = [json.loads(file.read_text(encoding="utf-8")) for file in (FINDINGS / task).rglob("*.json")]
    if not files:
        log.warning("nothing is kept of make %s", task)
        return ""
    kept = sorted((name, each["found"]) for file in files for name, each in file.items())
    return "\n".join(TABLES[task](dict(kept)))


def fill(_: Sphinx, __: str, source: list[str]) -> None:
    """Put the tables where a page wants them."""
    source[0] = re.sub(r"^%findings (\w+)%$", lambda wanted: told(wanted[1]), source[0], flags=re.MULTILINE)


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the tables to Sphinx."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
