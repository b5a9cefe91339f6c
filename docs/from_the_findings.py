"""What pages take from `tests/signoff/findings/`, which the tasks that sign the hardware off write.

A line `%findings mutate%` in a page becomes the table of what that task has kept, and `%findings every-fault%` a table
of every fault for each drive stage. A task that has kept nothing is a warning, and so fails the build.
"""

import re
from collections import Counter
from collections.abc import Callable
from typing import Any

from from_the_program import cell, table
from sphinx.application import Sphinx
from sphinx.util import logging

from hardwall.model.axis.supervisor import CAUSES
from signoff.kept import OURS, Findings

log = logging.getLogger(__name__)
KINDS = ("line", "branch", "toggle")
CELLS = ("lut4", "ff", "dsp", "bram")
CAME = [*(cause.name for cause in CAUSES), "DISARMED", "no clock", "ARMED"]
"""What may come of a fault, in the order of the tables."""
CLOCKS_PER_US = 12
"""Clocks of the board with faults: `CLOCK_HZ` in `tests/signoff/injection/scene.py`."""


def proofs(found: dict[str, Any]) -> list[str]:
    """Return a table of the properties: how long each took, and at which clocks its bugs were found."""
    rows = [
        [cell(name), f"{verdict['seconds']:.0f}", ", ".join(str(bug["clock"]) for bug in bugs)]
        for name, (verdict, *bugs) in found.items()
    ]
    return table(["block and property", "seconds", "its bugs fail at clock"], rows)


def _by_stage(found: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Return the outcomes of the faults of every drive stage."""
    stages: dict[str, list[dict[str, Any]]] = {}
    for name, outcome in found.items():
        stages.setdefault(name.partition(": ")[0], []).append(outcome)
    return stages


def faults(found: dict[str, Any]) -> list[str]:
    """Return a table of the stages: how many faults were injected, and what the worst of them did."""
    rows = [
        [
            cell(stage),
            str(len(every)),
            str(sum(not outcome["wrong"] for outcome in every)),
            str(sum(outcome["clocks"] is not None for outcome in every)),
            str(max(outcome["clocks"] or 0 for outcome in every)),
            f"{max(outcome['largest_n'] for outcome in every):.1f}",
        ]
        for stage, every in _by_stage(found).items()
    ]
    heads = ["drive stage", "faults", "safe", "drive brought down", "in at most, clocks", "largest force, N"]
    return table(heads, rows)


def every_fault(found: dict[str, Any]) -> list[str]:
    """Return a table for each drive stage: every fault, what came of it, and what is promised; first what trips."""
    heads = ["fault", "what came", "promised", "clocks", "µs", "largest force, N", "impulse, mN s", "over, ms"]
    lines = []
    for stage, every in _by_stage(found).items():
        ordered = sorted(every, key=lambda outcome: (CAME.index(outcome["came"].partition(" + ")[0]), outcome["name"]))
        lines += [f"### `{stage}`", "", *table(heads, [_fault(outcome) for outcome in ordered]), ""]
    return lines


def _fault(outcome: dict[str, Any]) -> list[str]:
    """Return the row of a fault."""
    clocks, impulse = outcome["clocks"], outcome["impulse_n_s"] * 1e3
    promised = outcome["expected"].partition(", ")[2]
    return [
        cell(outcome["name"]),
        outcome["came"] if not outcome["wrong"] else f"{outcome['came']} (not safe)",
        promised,
        *(("", "") if clocks is None else (str(clocks), f"{clocks / CLOCKS_PER_US:.{2 if clocks < 1000 else 0}f}")),
        f"{outcome['largest_n']:.1f}",
        f"{impulse:.{3 if impulse < 10 else 0}f}",
        f"{outcome['observed_ms']:.0f}",
    ]


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


TABLES: dict[str, tuple[str, Callable[[dict[str, Any]], list[str]]]] = {
    "prove": ("prove", proofs),
    "faults": ("faults", faults),
    "every-fault": ("faults", every_fault),
    "gate": ("gate", netlists),
    "coverage": ("coverage", coverage),
    "mutate": ("mutate", mutants),
}
"""The tables by their names in a page: the task whose findings they show, and what makes them."""


def told(name: str) -> str:
    """Return a table of what its task has kept."""
    task, made = TABLES[name]
    kept = Findings(OURS / task).every()
    if not kept:
        log.warning("nothing is kept of make %s", task)
        return ""
    return "\n".join(made({of: each["found"] for of, each in kept.items()}))


def fill(_: Sphinx, __: str, source: list[str]) -> None:
    """Put the tables where a page wants them."""
    source[0] = re.sub(r"^%findings ([\w-]+)%$", lambda wanted: told(wanted[1]), source[0], flags=re.MULTILINE)


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the tables to Sphinx."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
