"""A force law beside the clocks of an axis: its inputs are right only when it may look at them."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring

from hardwall.hdl.block import Block


class Sampled(wiring.Component):
    """A force law as an axis uses it, with all of a sample's inputs at its `strobe`, which is the law's `lead`.

    The velocity and the law's strobe come `after` clocks later. At any clock at which the law must not look at them,
    the velocity and the words are the complements of what they were or will be.
    """

    def __init__(self, law: Block, after: int):
        self.design, self.after, self._law = law.design, after, law
        self._words = [word.name for word in law.design.words]
        super().__init__({name: member for name, member in law.signature.members.items() if name != "lead"})

    @property
    def latency(self) -> int:
        return self.after + self._law.latency

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.law = law = self._law
        flight = Signal(self.after)
        m.d.sync += flight.eq(Cat(self.strobe, flight))
        m.d.comb += [law.lead.eq(self.strobe), law.count.eq(self.count), law.strobe.eq(flight[-1])]
        m.d.comb += [self.force.eq(law.force), self.valid.eq(law.valid)]
        for name, used in (("velocity", law.strobe), *((word, flight.any()) for word in self._words)):
            given, held = getattr(self, name), Signal.like(getattr(self, name), name=f"held_{name}")
            with m.If(self.strobe):
                m.d.sync += held.eq(given)
            m.d.comb += getattr(law, name).eq(Mux(used, held, ~held))
        return m
