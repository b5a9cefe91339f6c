"""A component at every clock: its inputs in one word and its outputs in another, for one write and one read a clock.

The sequencer of campaigns records strobes and answers. What acts at every clock is played a record of its inputs.
"""

import numpy as np
from amaranth.hdl import Cat, Module, ResetSignal, Shape, unsigned
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from cocotb.handle import HierarchyObject
from cocotb.triggers import RisingEdge

from .bench import Bench
from .packing import Packing, Rows


class Recorded(wiring.Component):
    """A component whose inputs are in the word `stimulus`, and whose inputs and outputs are in the word `record`.

    Ports have their own names; the members of an interface have theirs, without the interface's.

    Attributes:
        component: the component under test.
        stimuli: how its inputs lie in `stimulus`.
        records: how the reset, its inputs and its outputs lie in `record`.
        outputs: the names of the outputs.
    """

    def __init__(self, component: wiring.Component):
        self.component = component
        ports = [(str(path[-1]), member, port) for path, member, port in component.signature.flatten(component)]
        self._ports = {name: port for name, _, port in ports}
        shapes = {name: Shape.cast(member.shape) for name, member, _ in ports}
        inputs = [name for name, member, _ in ports if member.flow == In]
        self.outputs = tuple(name for name in shapes if name not in inputs)
        self.stimuli = Packing({name: shapes[name] for name in inputs})
        self.records = Packing({"reset": unsigned(1), **{name: shapes[name] for name in (*inputs, *self.outputs)}})
        super().__init__({"stimulus": In(self.stimuli.width), "record": Out(self.records.width)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.component = self.component
        ports = self._ports
        m.d.comb += Cat(ports[name] for name in self.stimuli.shapes).eq(self.stimulus)
        m.d.comb += self.record.eq(Cat(ResetSignal(), (ports[name] for name in self.records.shapes if name != "reset")))
        return m


async def play(dut: HierarchyObject, recorded: Recorded, inputs: dict[str, np.ndarray]) -> tuple[Rows, Rows]:
    """Play a record of inputs, one row a clock; return what the component saw.

    Args:
        dut: cocotb's handle.
        recorded: the component in the simulator.
        inputs: the values at every clock, by the names of the inputs and `reset`.

    Returns:
        The reset and the inputs at every clock edge, and the outputs after that edge, as the pins carried them.
    """
    bench = Bench(dut, recorded)
    await bench.reset()
    names = ("reset", *recorded.stimuli.shapes)
    columns = [np.asarray(inputs[name]).tolist() for name in names]
    words = recorded.stimuli.pack_rows(names[1:], list(zip(*columns[1:], strict=True)))
    stimulus, reset, record, edge = bench.dut.stimulus, bench.dut.rst, bench.dut.record, RisingEdge(bench.dut.clk)
    seen = []
    # The last edge, under reset, shows what the edge before it made.
    for word, restart in zip([*words, 0], [*columns[0], 1], strict=True):
        stimulus.value = word
        reset.value = restart
        await edge
        # The values before the edge: the inputs that this edge takes, the outputs that the last edge made.
        seen.append(int(record.value))
    clocks = list(range(len(words)))
    taken = Rows(names, recorded.records, seen[:-1], clocks)
    return taken, Rows(recorded.outputs, recorded.records, seen[1:], clocks)
