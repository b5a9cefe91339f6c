"""How pages show the reports of commands: each view makes the lines of a Markdown table of one report or of several."""

from collections.abc import Callable, Sequence

import reports

from support.reports import check

from . import accuracy, hardware, mass, rendered, response, rivals, trade, walls


class UnknownError(Exception):
    """There is no such report or view, or the schema of the report's command does not describe it."""


VIEWS: dict[str, Callable[..., list[str]]] = {
    "situations": accuracy.situations,
    "encoders": accuracy.encoders,
    "accelerations": accuracy.accelerations,
    "learned": accuracy.learned,
    "published": accuracy.published,
    "frontier": accuracy.frontier,
    "by-rate": accuracy.by_rate,
    "jerks": walls.jerks,
    "without-jerk": walls.without_jerk,
    "samples": walls.samples,
    "responses": response.responses,
    "masses": mass.masses,
    "regions": walls.maps,
    "facts": walls.facts,
    "assumptions": walls.assumptions,
    "devices": walls.devices,
    "frictions": walls.frictions,
    "conditions": walls.conditions,
    "hands": walls.hands,
    "gains": walls.gains,
    "cutoffs": walls.cutoffs,
    "cures": walls.cures,
    "stiffest": walls.stiffest,
    "same-verdicts": walls.same_verdicts,
    "late-damping": rendered.late_damping,
    "bandwidth": rendered.bandwidth,
    "every-output": rendered.every_output,
    "contact": rendered.contact,
    "rivals-perfect": rivals.perfect,
    "rivals-real": rivals.real,
    "rivals-settings": rivals.settings,
    "rivals-accelerations": rivals.accelerations,
    "parts": trade.parts,
    "shortcuts": trade.shortcuts,
    "speed": trade.speed,
    "waiting": trade.waiting,
    "costs-of-parts": trade.costs_of_parts,
    "costs": hardware.costs,
    "placed": hardware.placed,
    "axes": hardware.axes,
    "bits": hardware.bits,
}
"""The views: each takes the reports that a page names, in their order."""


def shown(names: Sequence[str], view: str) -> list[str]:
    """Return the lines of a table of reports, and where the reports come from.

    Raises:
        UnknownError: see there.
    """
    every = [_kept(name) for name in names]
    if view not in VIEWS:
        raise UnknownError(f"the view must be one of {', '.join(VIEWS)}")
    return [*VIEWS[view](*(each.report for each in every)), "", *_made(every), *_stale(names), ""]


def _kept(name: str) -> reports.Kept:
    """Return a report of which the schema of its command knows every key."""
    found = reports.kept(name)
    if name not in reports.wanted() or found is None:
        raise UnknownError(f"no such report was made: {name}")
    try:
        check(found.command.split()[1], found.report)
    except AssertionError as error:
        raise UnknownError(str(error)) from None
    return found


def _made(every: Sequence[reports.Kept]) -> list[str]:
    """Return a line that says which commands made reports: the first whole, of the others the words that differ."""
    first, *others = every
    known, differing = {*first.command.split()}, []
    for each in others:
        differing.append(f"`{' '.join(word for word in each.command.split() if word not in known)}`")
        known |= {*each.command.split()}
    also = f" Also with {', '.join(differing)}." if others else ""
    dates = " to ".join(dict.fromkeys((min(each.date for each in every), max(each.date for each in every))))
    seconds = sum(each.seconds for each in every)
    return [f"*`{first.command}`, version {first.version}, {dates}, {first.machine}; it took {seconds:.0f} s.{also}*"]


def _stale(names: Sequence[str]) -> list[str]:
    """Return a line if the sources of a report have changed."""
    wanted = reports.wanted()
    if any(reports.is_stale(wanted[name]) for name in names):
        return ["", "**Stale: its sources have changed since.**"]
    return []
