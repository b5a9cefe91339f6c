"""The board under test with what a fault needs inside: ports that can be made wrong, and the amplifier of its drive."""

from amaranth.hdl import ClockDomain, Module, Shape, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.hdl.board.lead_out import lead_out

from .amplified import CLOCK_BITS, COUNTERS, FORCES, Amplified
from .staged import INSIDE, LIVE, Staged

SHOWN = ("driven", "state", "latched", "first", "count", "a_channel_idle", "drive_inverted")
"""Ports of the supervised axis that are watched."""


class Upset(wiring.Component):
    """A component, some ports of which are wrong in the bits that a mask has.

    Attributes:
        inner: the component.
        masks: the masks by the names of the ports.
    """

    def __init__(self, inner: wiring.Component, masks: dict[str, Value]):
        self.inner, self.masks = inner, masks
        super().__init__(inner.signature)

    @property
    def design(self):
        return self.inner.design

    def elaborate(self, platform):
        m = Module()
        m.submodules.inner = self.inner
        for name, member in self.signature.members.items():
            inner, outer = (Value.cast(getattr(each, name)) for each in (self.inner, self))
            mask = self.masks.get(name, 0)
            m.d.comb += inner.eq(outer ^ mask) if member.flow == In else outer.eq(inner ^ mask)
        return m


class Damaged(wiring.Component):
    """A board and its amplifier; a mask `upset_*` for each of `LIVE` and `INSIDE`; the watched ports; the force.

    The outputs of `Amplified` are there by its names. `now` counts the board's own clock edges.

    Args:
        stage: the drive stage, and what is behind it.
    """

    def __init__(self, stage: Staged):
        self.stage = stage
        self.board = stage.board()
        axis = self.board.axis
        masks = {
            f"upset_{name}": In(Shape.cast(getattr(part, name).shape()).width)
            for part, names in ((axis, LIVE), (axis._axis, INSIDE))
            for name in names
        }
        shown = {name: Out(getattr(axis, name).shape()) for name in SHOWN}
        ports = {"tick": In(1), "now": Out(CLOCK_BITS), **masks, **shown, **COUNTERS, **FORCES}
        super().__init__({**self.board.signature.members, **ports})
        axis._axis = Upset(axis._axis, {name: getattr(self, f"upset_{name}") for name in INSIDE})
        self.board.axis = Upset(axis, {name: getattr(self, f"upset_{name}") for name in LIVE})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += [getattr(self, name).eq(getattr(self.board.axis, name)) for name in SHOWN]
        m.submodules.board = self.board
        m.d.comb += lead_out(self.board, self, self.board.signature.members)
        m.domains.watch = watch = ClockDomain("watch", reset_less=True)
        m.d.comb += watch.clk.eq(self.clk)
        m.d.watch += self.now.eq(self.now + 1)
        m.submodules.amplified = amplified = Amplified(self.stage)
        pins = {name: getattr(self, name) for name in (*self.stage.spec.drive.pins, "alive", "tick")}
        m.d.comb += [getattr(amplified, name).eq(pin) for name, pin in pins.items()]
        m.d.comb += [getattr(self, name).eq(getattr(amplified, name)) for name in (*COUNTERS, *FORCES)]
        return m
