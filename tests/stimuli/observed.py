"""A passivity controller beside the clocks of an axis: its inputs are right only when it may look at them."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring

from hardwall.hdl.axis.passivity import Passivity
from hardwall.model.axis.passivity import Design

AT_THE_STROBE = "velocity", "drive", "passivity_damping"


class Observed(wiring.Component):
    """A controller with all of a sample's inputs at its `strobe`, which is the controller's `lead`.

    The controller's strobe comes `after` clocks later, and the force `behind` clocks later still. At any clock at which
    the controller must not look at an input, it is the complement of what it was or will be.
    """

    def __init__(self, design: Design, after: int, behind: int):
        self.design, self.after, self.behind = design, after, behind
        self._controller = Passivity(design)
        members = self._controller.signature.members.items()
        super().__init__({name: member for name, member in members if name not in ("lead", "forced")})

    @property
    def latency(self) -> int:
        return self.after + self.behind + self._controller.latency

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.controller = controller = self._controller
        flight, forces, uses = Signal(self.after), Signal(self.behind), Signal(controller.latency - 1)
        strobe, forced = flight[-1], forces[-1]
        m.d.sync += [flight.eq(Cat(self.strobe, flight)), forces.eq(Cat(strobe, forces)), uses.eq(Cat(forced, uses))]
        m.d.comb += [controller.lead.eq(self.strobe), controller.strobe.eq(strobe), controller.forced.eq(forced)]
        m.d.comb += [getattr(controller, name).eq(getattr(self, name)) for name in ("count", "restart")]
        m.d.comb += [getattr(self, name).eq(getattr(controller, name)) for name in ("given", "active", "valid")]
        for name in AT_THE_STROBE:
            value = self._kept(m, self.strobe, getattr(self, name))
            m.d.comb += getattr(controller, name).eq(Mux(strobe, value, ~value))
        # The next sample's lead may come with this one's strobe, and its strobe with this one's force.
        at_forced = self._kept(m, strobe, self._kept(m, self.strobe, self.force))
        force = Mux(forced, at_forced, self._kept(m, forced, at_forced))
        m.d.comb += controller.force.eq(Mux(forced | uses.any(), force, ~force))
        return m

    def _kept(self, m: Module, when: Value, value: Value) -> Signal:
        """Return what a value was at the last pulse of `when`."""
        kept = Signal.like(value)
        with m.If(when):
            m.d.sync += kept.eq(value)
        return kept
