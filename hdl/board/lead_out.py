"""Ports of a part, led out to the component around it."""

from collections.abc import Collection

from amaranth.lib import wiring
from amaranth.lib.wiring import In

from ..wires import ports


def lead_out(part: wiring.Component, around: wiring.Component, names: Collection[str]) -> list:
    """Return the assignments that join the ports of a part to the ports of the same names around it, in their
    direction."""
    outside, members = ports(around, names), part.signature.members
    return [
        inner.eq(outside[name]) if members[name].flow == In else outside[name].eq(inner)
        for name, inner in ports(part, names).items()
    ]
