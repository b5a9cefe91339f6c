"""A component and its netlist side by side: the same inputs, and all outputs compared at every clock edge."""

from amaranth.hdl import Cat, ClockDomain, Instance, Module, Shape, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.sim.rtl.netlist import GATES, RTL
from hardwall.testing.packing import Packing

COUNTER_BITS = 32
START = 0x5354_4152
"""The word that lets the clock through; nothing random is this."""


class Pair(wiring.Component):
    """The modules `RTL` and `GATES` of a component, and what tells them apart.

    Outputs are compared as every clock edge finds them, the first edge after power-up too. Nothing here is ever reset;
    `rst` is an input of the component like any other. There is a clock only while `start` has the word `START`: a
    simulator that gives random values to what has none gives them to inputs too, and a `clk` that is high at power-up
    would be an edge.

    Attributes:
        outputs: how the component's outputs lie in `first_rtl`, `first_gates`, `seen_low` and `seen_high`.

    Members
    -------
    clk, rst, the inputs of the component : In
        As of the component.
    start : In(32)
        As above.
    the outputs of the component : Out
        As the RTL has them.
    clocks, different : Out(32)
        Clock edges so far, and how many of them found an output different.
    first, first_rtl, first_gates : Out
        The number of the first of these, and the outputs then.
    seen_low, seen_high : Out
        The bits of the RTL's outputs that were ever low, and ever high.
    """

    def __init__(self, component: wiring.Component):
        self._ports = {
            name: member for name, member in component.signature.members.items() if name not in ("clk", "rst")
        }
        outputs = {name: Shape.cast(member.shape) for name, member in self._ports.items() if member.flow == Out}
        self.outputs = Packing(outputs)
        words = dict.fromkeys(("first_rtl", "first_gates", "seen_low", "seen_high"), Out(self.outputs.width))
        numbers = dict.fromkeys(("clocks", "different", "first"), Out(COUNTER_BITS))
        super().__init__({"clk": In(1), "rst": In(1), "start": In(32), **self._ports, **numbers, **words})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.domains.sync = domain = ClockDomain(reset_less=True)
        m.d.comb += domain.clk.eq(self.clk & (self.start == START))
        given = {"clk": domain.clk, "rst": self.rst}
        given |= {name: getattr(self, name) for name, member in self._ports.items() if member.flow == In}
        found = {}
        for module in (RTL, GATES):
            own = {name: Signal(shape, name=f"{module}_{name}") for name, shape in self.outputs.shapes.items()}
            m.submodules[module] = Instance(
                module,
                **{f"i_{name}": port for name, port in given.items()},
                **{f"o_{name}": port for name, port in own.items()},
            )
            found[module] = Cat(own.values())
        m.d.comb += Cat(getattr(self, name) for name in self.outputs.shapes).eq(found[RTL])
        m.d.sync += [
            self.clocks.eq(self.clocks + 1),
            self.seen_low.eq(self.seen_low | ~found[RTL]),
            self.seen_high.eq(self.seen_high | found[RTL]),
        ]
        with m.If(found[RTL] != found[GATES]):
            m.d.sync += self.different.eq(self.different + 1)
            with m.If(self.different == 0):
                m.d.sync += [
                    self.first.eq(self.clocks),
                    self.first_rtl.eq(found[RTL]),
                    self.first_gates.eq(found[GATES]),
                ]
        return m
