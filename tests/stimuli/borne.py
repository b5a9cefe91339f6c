"""A virtual mass beside the clocks of an axis: its inputs are right only when it may look at them."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring

from hardwall.hdl.axis.virtual_mass import VirtualMass
from hardwall.hdl.wires import names_of, port
from hardwall.model.axis.virtual_mass import Design

WITH_THE_FORCE = "force", "may_be_positive", "may_be_negative"


class Borne(wiring.Component):
    """A virtual mass with all of a sample's inputs at one `strobe`.

    The block's own strobe comes a clock later, since its masses are there a clock before, and the force `behind` clocks
    later still. At any clock at which the block must not look at an input, it is the complement of what it was.
    """

    def __init__(self, design: Design, behind: int):
        self.design, self.behind = design, behind
        self._mass = VirtualMass(design)
        members = self._mass.signature.members.items()
        super().__init__({name: member for name, member in members if name != "forced"})

    @property
    def latency(self) -> int:
        return 1 + self.behind + self._mass.latency

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.mass = mass = self._mass
        strobe, waits = Signal(), Signal(self.behind)
        m.d.sync += [strobe.eq(self.strobe), waits.eq(Cat(strobe, waits))]
        m.d.comb += [mass.strobe.eq(strobe), mass.forced.eq(waits[-1])]
        m.d.comb += [self.given.eq(mass.given), self.valid.eq(mass.valid)]
        for name in ("acceleration", *WITH_THE_FORCE, *names_of(self.design.words)):
            value = port(self, name)
            kept = Signal.like(value, name=f"kept_{name}")
            with m.If(self.strobe):
                m.d.sync += kept.eq(value)
            if name in names_of(self.design.words):
                looks, kept = self.strobe | strobe, Mux(self.strobe, value, kept)
            elif name in WITH_THE_FORCE:
                late = Signal.like(kept, name=f"late_{name}")
                with m.If(strobe):
                    m.d.sync += late.eq(kept)
                looks, kept = waits[-1], late
            else:
                looks = strobe
            m.d.comb += port(mass, name).eq(Mux(looks, kept, ~kept))
        return m
