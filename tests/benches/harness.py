"""The simulated top around a component: the component's ports, one word that packs them all, and a sequencer.

A turn of cocotb takes longer than hundreds of clocks of Verilator. The sequencer for campaigns is hardware beside the
component: it takes a batch of rows, puts them through at their clocks, and keeps the values of the ports at strobes and
answers. It makes those clocks itself, in no time of the simulator.
"""

from pathlib import Path

from amaranth.hdl import (
    Cat,
    ClockDomain,
    ClockSignal,
    DomainRenamer,
    Instance,
    Module,
    Mux,
    ResetSignal,
    Shape,
    Signal,
    Value,
)
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Member, Out

from .packing import Packing

SPACING_BITS = 16
"""Width of the extra clocks until the next row, above the inputs of a row."""
RESERVED = "bench_"
"""The beginning of the names of the harness's own ports."""
SEQUENCER = Path(__file__).with_name("sequencer.v")


def ports_of(component: wiring.Component) -> dict[str, tuple[Member, Value]]:
    """Return the ports of a component by their names in Verilog, where member `b` of its member `a` is `a__b`.

    Raises:
        ValueError: if a port has a name that the harness reserves for its own ports.
    """
    ports = {"__".join(map(str, path)): (member, port) for path, member, port in component.signature.flatten(component)}
    for name in ports:
        if name.startswith(RESERVED):
            raise ValueError(f"a port under test must not begin with {RESERVED}, not {name!r}")
    return ports


def packing_of(component: wiring.Component) -> Packing:
    """Return how all ports of a component lie in the harness's `bench_seen`."""
    return Packing({name: Shape.cast(member.shape) for name, (member, _) in ports_of(component).items()})


def inputs_of(component: wiring.Component) -> Packing:
    """Return how the inputs of a component lie in a row of the sequencer."""
    ports = ports_of(component)
    return Packing({name: Shape.cast(member.shape) for name, (member, _) in ports.items() if member.flow == In})


class Harness(wiring.Component):
    """A component with its own ports; `bench_seen`, which carries them all; and ports of `sequencer.v` as `bench_*`.

    While `bench_campaign` is high the sequencer drives the component's inputs, otherwise the ports of the same names.
    """

    def __init__(self, component: wiring.Component):
        self.component, self.seen, self.inputs = component, packing_of(component), inputs_of(component)
        own = {
            "campaign": In(1),
            "go": In(1),
            "strobe": In(self.inputs.width),
            "momentary": In(self.inputs.width),
            "watched": In(self.seen.width),
            "seen": Out(self.seen.width),
            "done": Out(1),
            "clocks": Out(32),
        }
        ports = {name: member for name, (member, _) in ports_of(component).items()}
        super().__init__({**ports, **{RESERVED + name: member for name, member in own.items()}})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        ports = {name: port for name, (_, port) in ports_of(self.component).items()}
        by_hand, by_sequencer = Cat(getattr(self, name) for name in self.inputs.shapes), Signal(self.inputs.width)
        inputs = Cat(ports[name] for name in self.inputs.shapes)
        m.d.comb += inputs.eq(Mux(self.bench_campaign, by_sequencer, by_hand))
        m.d.comb += [getattr(self, name).eq(port) for name, port in ports.items() if name not in self.inputs.shapes]
        m.d.comb += self.bench_seen.eq(Cat(ports.values()))
        if "clk" in ports:
            # It clocks itself by a pin, and has no campaigns.
            m.submodules.component = self.component
            return m
        clocked = m.domains.component = ClockDomain("component")
        m.d.comb += clocked.rst.eq(ResetSignal())
        m.submodules.component = DomainRenamer("component")(self.component)
        m.submodules.sequencer = Instance(
            "bench_sequencer",
            p_INPUTS=self.inputs.width,
            p_SEEN=self.seen.width,
            p_SPACING=SPACING_BITS,
            i_bench_clk=ClockSignal(),
            i_rst=ResetSignal(),
            i_seen=self.bench_seen,
            o_clk=clocked.clk,
            o_driven=by_sequencer,
            **{f"i_{name}": getattr(self, RESERVED + name) for name in ("go", "strobe", "momentary", "watched")},
            **{f"o_{name}": getattr(self, RESERVED + name) for name in ("done", "clocks")},
        )
        return m
