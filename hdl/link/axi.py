"""An AXI4-Lite subordinate over a register file: for those who have a processor beside the axis."""

from typing import ClassVar

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.axis.register_file import CELL_BITS, Operation
from hardwall.model.axis.registers import COUNTERS, TELEMETRY
from hardwall.model.link.axi import ADDRESS_BITS, STROBES, Response

from .requests import Requests


class Subordinate(wiring.Component):
    """Transfers on a bus carried out on a register file, one after the other; a write goes before a read.

    Equation: the model's, word for word.

    Latency: to the answer less than 20 clocks; a status that is read out of order, and a commit, take the register
    file's times besides. Address and data of a write are taken together.

    Rounding and overflow: none.

    Members
    -------
    axi_awaddr, axi_awprot, axi_awvalid : In, axi_awready : Out
        The address of a write; its protection has no effect.
    axi_wdata, axi_wstrb, axi_wvalid : In, axi_wready : Out
        What is written, and its byte strobes.
    axi_bresp, axi_bvalid : Out, axi_bready : In
        How a write ended.
    axi_araddr, axi_arprot, axi_arvalid : In, axi_arready : Out
        The address of a read; its protection has no effect.
    axi_rdata, axi_rresp, axi_rvalid : Out, axi_rready : In
        What was read, and how the read ended.
    file : Out(Requests)
        The register file.

    Source: "AMBA AXI Protocol Specification", issue J, chapter B1 (AXI4-Lite).
    """

    PINS: ClassVar = {
        "axi_awaddr": In(ADDRESS_BITS),
        "axi_awprot": In(3),
        "axi_awvalid": In(1),
        "axi_awready": Out(1),
        "axi_wdata": In(32),
        "axi_wstrb": In(4),
        "axi_wvalid": In(1),
        "axi_wready": Out(1),
        "axi_bresp": Out(2),
        "axi_bvalid": Out(1),
        "axi_bready": In(1),
        "axi_araddr": In(ADDRESS_BITS),
        "axi_arprot": In(3),
        "axi_arvalid": In(1),
        "axi_arready": Out(1),
        "axi_rdata": Out(32),
        "axi_rresp": Out(2),
        "axi_rvalid": Out(1),
        "axi_rready": In(1),
    }

    def __init__(self):
        super().__init__({**self.PINS, "file": Out(Requests())})

    def elaborate(self, platform):
        m = Module()
        file = self.file
        # A word's address in registers is even: `half` is the lowest bit of a register's.
        place, following = Signal(ADDRESS_BITS - 2), Signal(ADDRESS_BITS - 1)
        data, halves, half = Signal(32), Signal(2), Signal()
        writing, phase = Signal(), Signal(Operation)
        # Nothing is taken during a reset, which the bus may not see.
        awake = Signal()
        m.d.sync += awake.eq(1)
        strobes = {strobe: sum(2 >> each for each in those) for strobe, those in STROBES.items()}
        m.d.comb += [
            file.operation.eq(phase),
            file.address.eq(Cat(half, place)),
            file.first.eq(~half | ~halves[1]),
            file.last.eq(half | ~halves[0]),
            file.value.eq(data.word_select(~half, CELL_BITS)),
        ]

        def begin(operation: Operation, first=0):
            """Do an operation at the upper half, or at the only one."""
            m.d.sync += [phase.eq(operation), half.eq(first)]
            m.next = "DO"

        with m.FSM():
            with m.State("IDLE"):
                m.d.comb += file.clear.eq(1)
                asked = self.axi_awvalid & self.axi_wvalid
                m.d.sync += writing.eq(asked)
                with m.If(awake & asked):
                    m.d.comb += [self.axi_awready.eq(1), self.axi_wready.eq(1)]
                    m.d.sync += [place.eq(self.axi_awaddr[2:]), data.eq(self.axi_wdata)]
                    m.d.sync += self.axi_bresp.eq(Response.SLVERR)
                    m.next = "WRITTEN"
                    with m.Switch(self.axi_wstrb):
                        for strobe, those in strobes.items():
                            with m.Case(strobe):
                                m.d.sync += [halves.eq(those), self.axi_bresp.eq(Response.OKAY)]
                                if those:
                                    begin(Operation.CHECK_WRITE, int(not those & 2))
                with m.Elif(awake & self.axi_arvalid):
                    m.d.comb += self.axi_arready.eq(1)
                    m.d.sync += [place.eq(self.axi_araddr[2:]), halves.eq(3), following.eq(self.axi_araddr[2:] + 1)]
                    begin(Operation.CHECK_READ)
                    status = (self.axi_araddr[1:] >= TELEMETRY) & (self.axi_araddr[1:] < COUNTERS)
                    with m.If(status & (self.axi_araddr[2:] != following)):
                        begin(Operation.SNAPSHOT)
            with m.State("DO"):
                m.d.comb += file.start.eq(1)
                with m.If(file.done):
                    with m.If(half):
                        m.d.sync += data[:CELL_BITS].eq(Mux(writing, data[:CELL_BITS], file.data))
                    with m.Else():
                        m.d.sync += data[CELL_BITS:].eq(Mux(writing, data[CELL_BITS:], file.data))
                    m.next = "NEXT"
            with m.State("NEXT"):
                # The second half of the same operation, or the next one.
                m.d.sync += half.eq(1)
                m.next = "DO"
                whole = (phase == Operation.SNAPSHOT) | (phase == Operation.FINISH)
                with m.If(half | ~halves[0] | whole), m.Switch(phase):
                    with m.Case(Operation.SNAPSHOT):
                        begin(Operation.CHECK_READ)
                    with m.Case(Operation.CHECK_READ):
                        begin(Operation.READ)
                        m.d.sync += self.axi_rresp.eq(Response.OKAY)
                        with m.If(file.refused):
                            m.d.sync += [self.axi_rresp.eq(Response.SLVERR), data.eq(0)]
                            m.next = "READ"
                        with m.If(file.absent):
                            m.d.sync += [self.axi_rresp.eq(Response.DECERR), data.eq(0)]
                            m.next = "READ"
                    with m.Case(Operation.READ):
                        m.next = "READ"
                    with m.Case(Operation.CHECK_WRITE):
                        begin(Operation.WRITE, ~halves[1])
                        with m.If(file.outside | file.refused):
                            m.d.sync += self.axi_bresp.eq(Response.SLVERR)
                            m.next = "WRITTEN"
                        with m.If(file.absent):
                            m.d.sync += self.axi_bresp.eq(Response.DECERR)
                            m.next = "WRITTEN"
                    with m.Case(Operation.WRITE):
                        begin(Operation.FINISH)
                    with m.Case(Operation.FINISH):
                        m.next = "WRITTEN"
            with m.State("WRITTEN"):
                m.d.comb += self.axi_bvalid.eq(1)
                with m.If(self.axi_bready):
                    m.next = "IDLE"
            with m.State("READ"):
                m.d.comb += [self.axi_rvalid.eq(1), self.axi_rdata.eq(data)]
                with m.If(self.axi_rready):
                    m.next = "IDLE"
        return m
