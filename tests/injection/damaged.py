"""The board under test with what a fault needs inside: ports that can be made wrong, and the amplifier of its drive."""

from amaranth.hdl import ClockDomain, Instance, Module, Mux, Shape, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.hdl.lead_out import lead_out

from .scene import PUMP_CLOCKS
from .staged import Staged

LIVE = ("supervisor_force_limit", "supervisor_ramp", "supervisor_watchdog")
"""Live words that have a range, between the link and the axis."""
INSIDE = ("strobe_busy",)
"""Outputs of the bare axis that no motion and no host can make high."""
SHOWN = ("driven", "state", "latched", "first", "count", "a_channel_idle", "drive_inverted")
"""Ports of the supervised axis that are watched."""
CLOCK_BITS, STEP_BITS = 40, 32


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
    """A board and its amplifier; a mask `upset_*` for each of `LIVE` and `INSIDE`; the watched ports; the force.

    The amplifier is that of `sim/rtl/amplifiers.v` for the board's stage. It is looked at by `tick`, a clock that never
    stops: `steps` is the force that the pins ask for now, `given` the sum of it over the ticks at which the amplifier
    had its enable, from a charge pump at `alive`. `ticks` counts the ticks; `last_asked` and `last_given` are the last
    ones with a force at the pins, and with one behind the amplifier. `now` counts the board's own clock edges. `shot`
    is high once both gates of a leg have been on.

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
        counters = dict.fromkeys(("now", "ticks", "last_asked", "last_given"), Out(CLOCK_BITS))
        forces = {"steps": Out(signed(STEP_BITS)), "given": Out(signed(CLOCK_BITS + STEP_BITS)), "shot": Out(1)}
        ports = {"tick": In(1), **masks, **shown, **counters, **forces}
        super().__init__({**self.board.signature.members, **ports})
        axis._axis = Upset(axis._axis, {name: getattr(self, f"upset_{name}") for name in INSIDE})
        self.board.axis = Upset(axis, {name: getattr(self, f"upset_{name}") for name in LIVE})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += [getattr(self, name).eq(getattr(self.board.axis, name)) for name in SHOWN]
        m.submodules.board = self.board
        m.d.comb += lead_out(self.board, self, self.board.signature.members)
        m.domains.watch = watch = ClockDomain("watch", reset_less=True)
        m.domains.ticked = ticked = ClockDomain("ticked", reset_less=True)
        m.d.comb += [watch.clk.eq(self.clk), ticked.clk.eq(self.tick)]
        m.d.watch += self.now.eq(self.now + 1)

        shoots = Signal()
        m.submodules.amplifier = self._amplifier(shoots)
        m.d.ticked += self.shot.eq(self.shot | shoots)
        # Ticks since the last edge at the charge pump, which has run down before the first one.
        before, since = Signal(), Signal(range(PUMP_CLOCKS + 1), init=PUMP_CLOCKS)
        enabled = Signal()
        m.d.comb += enabled.eq(since != PUMP_CLOCKS)
        m.d.ticked += [before.eq(self.alive), since.eq(Mux(self.alive != before, 0, since + enabled))]
        m.d.ticked += self.ticks.eq(self.ticks + 1)
        with m.If(self.steps != 0):
            m.d.ticked += self.last_asked.eq(self.ticks)
        with m.If((self.steps != 0) & enabled):
            m.d.ticked += [self.last_given.eq(self.ticks), self.given.eq(self.given + self.steps)]
        return m

    def _amplifier(self, shoots: Signal) -> Instance:
        """Return the amplifier, at the pins before `outputs_enable` leaves them to their pulls.

        Args:
            shoots: is high while a leg of a bridge shoots through.
        """
        stage = self.stage
        shot = {"o_shot": shoots} if stage.name == "pwm" else {}
        tick = {"i_tick": self.tick} if stage.name == "dac" else {}
        pins = {f"i_{name}": getattr(self, name) for name in stage.spec.drive.pins}
        return Instance(f"{stage.name}_amplifier", *stage.parameters, **pins, **shot, **tick, o_steps=self.steps)
