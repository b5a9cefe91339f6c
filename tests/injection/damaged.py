"""The board under test with what a fault needs inside: ports that can be made wrong, and counters of its pulses."""

from amaranth.hdl import ClockDomain, Module, Shape, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.hdl.lead_out import lead_out

from .scene import board

LIVE = ("supervisor_force_limit", "supervisor_ramp", "supervisor_watchdog")
"""Live words that have a range, between the link and the axis."""
INSIDE = ("strobe_busy",)
"""Outputs of the bare axis that no motion and no host can make high."""
SHOWN = ("driven", "state", "latched", "first", "count", "a_channel_idle", "drive_inverted")
"""Ports of the supervised axis that are watched."""
CLOCK_BITS = 40


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
            inner, outer, mask = getattr(self.inner, name), getattr(self, name), self.masks.get(name, 0)
            m.d.comb += inner.eq(outer ^ mask) if member.flow == In else outer.eq(inner ^ mask)
        return m


class Damaged(wiring.Component):
    """A board; a mask `upset_*` for each of `LIVE` and `INSIDE`; the watched ports; and what its drive pins did.

    `now` counts clock edges from power-up, `pulses` the pulses at the pin with their signs, and `last_pulse` is the
    edge of the last one.
    """

    def __init__(self):
        self.board = board()
        axis = self.board.axis
        masks = {
            f"upset_{name}": In(Shape.cast(getattr(part, name).shape()).width)
            for part, names in ((axis, LIVE), (axis._axis, INSIDE))
            for name in names
        }
        shown = {name: Out(getattr(axis, name).shape()) for name in SHOWN}
        counters = {"pulses": Out(signed(CLOCK_BITS)), "last_pulse": Out(CLOCK_BITS), "now": Out(CLOCK_BITS)}
        super().__init__({**self.board.signature.members, **masks, **shown, **counters})
        axis._axis = Upset(axis._axis, {name: getattr(self, f"upset_{name}") for name in INSIDE})
        self.board.axis = Upset(axis, {name: getattr(self, f"upset_{name}") for name in LIVE})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += [getattr(self, name).eq(getattr(self.board.axis, name)) for name in SHOWN]
        m.submodules.board = self.board
        m.d.comb += lead_out(self.board, self, self.board.signature.members)
        # The pin is read by a clock of its own, which no reset holds.
        m.domains.watch = watch = ClockDomain("watch", reset_less=True)
        m.d.comb += watch.clk.eq(self.clk)
        pulse = Signal(signed(2))
        with m.If(self.drive_pdm):
            m.d.comb += pulse.eq(1)
            m.d.watch += self.last_pulse.eq(self.now)
        with m.If(self.drive_pdm & self.drive_sign):
            m.d.comb += pulse.eq(-1)
        m.d.watch += [self.now.eq(self.now + 1), self.pulses.eq(self.pulses + pulse)]
        return m
