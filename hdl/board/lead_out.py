"""Ports of a part, led out to the component around it."""

from collections.abc import Iterable

from amaranth.lib import wiring
from amaranth.lib.wiring import In


def lead_out(part: wiring.Component, around: wiring.Component, names: Iterable[str]) -> list:
    """Return the assignments that join ports of a part to those of the same names around it, in their direction."""
    assignments = []
    for name in names:
        inner, outer = getattr(part, name), getattr(around, name)
        inward = part.signature.members[name].flow == In
        assignments.append(inner.eq(outer) if inward else outer.eq(inner))
    return assignments
