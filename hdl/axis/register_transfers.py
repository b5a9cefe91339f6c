"""The moves of registers, bit by bit: from a chain of status to their cells, or from the cells to words at ports."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component

from hardwall.model.axis.register_file import CELL_BITS, NEXT, SOURCE, Area, Source
from hardwall.model.axis.registers import ACTIVE, EDGE_STAMPS, WRITTEN

from ..link.line import UNMIXED
from ..wires import names_of, port, ports
from .register_cells import Cells


class Transfers:
    """The chain: the bits of status that wait for their cells, or the words at their ports.

    The bits of a stamp are the bits of a number that is 1 too high: `borrow` takes it off, bit by bit.

    Args:
        m: the module.
        file: the `RegisterFile`.
        cells: its cells.

    Attributes:
        committing: the words move, and not the status.
        turned: `cells.shift`, turned by a bit.
    """

    def __init__(self, m: Module, file: Component, cells: Cells):
        self._cells = cells
        stamp, self._unseen = _edges(m, file, cells.step[1:3])
        by_source = {source: [] for source in Source}
        for source, turn in file.design.turns:
            by_source[source] += [port(file, each.name) for each in turn if each.name not in EDGE_STAMPS]
        by_source[Source.EDGE].insert(0, stamp)
        loads = {source: Cat(values) for source, values in by_source.items()}
        words = Cat(ports(file, names_of(file.design.registers.words)).values())
        self.chain = Signal(max(len(words), *map(len, loads.values())), reset_less=True)
        shifted = Cat(self.chain[1:], cells.shift[0])
        self.source, self.left = Signal(3), Signal(range(CELL_BITS + 1))
        self.bit = Signal(range(CELL_BITS))
        self.extended, self.borrow, self.hidden, self.last, self.committing = (Signal() for _ in range(5))
        self.fresh = self.left != 0
        self.moving = Signal()
        taken = (self.chain[0] ^ self.borrow) & ~self.hidden
        self.turned = Cat(cells.shift[1:], Mux(self.fresh, taken, self.extended & cells.shift[-1]))
        m.d.comb += words.eq(self.chain[-len(words) :])
        head = max(len(loads[each]) for each in (Source.EDGE, Source.EVENTS))
        shifted, moment, edge, events = (Cat(load, shifted[len(load) :]) for load in loads.values())
        # Two cells of four inputs a bit: the first gives one of two, or which of the two others it is. `source` has
        # three bits: with one shared bit for both cells, that signal would take three cells. They are words, so that a
        # simulator has a few operations for all the bits.
        first = Mux(self.source[0], moment, shifted)
        which = Mux(self.source[1], self.source[0].replicate(head), first[:head])
        one_of_two = (which & events[:head]) | (~which & edge[:head])
        with m.If(self.moving):
            m.d.sync += self.chain.eq(Cat(Mux(self.source[2], one_of_two, which), first[head:]))

    def add_states(self, m: Module, commit: Value) -> None:
        """Add the states that move registers, the low half of a value first, from `cells.step` on.

        Args:
            m: the module.
            commit: the written words move, and to their active ones, too.
        """
        cells, step, read = self._cells, self._cells.step, self._cells.read
        with m.State("COPY"):
            m.d.comb += cells.place.eq(step)
            with m.If(commit):
                m.d.comb += cells.place.eq(step & ~(ACTIVE ^ WRITTEN))
            m.next = "COPIED"
        with m.State("COPIED"):
            m.d.comb += cells.fetched.eq(1)
            m.next = "SWEEP"
        with m.State("SWEEP"):
            m.d.comb += [cells.place.eq(step), cells.area.eq(Area.LEAST)]
            m.next = "LOOK"
        with m.State("LOOK"):
            m.d.comb += [cells.place.eq(step), cells.area.eq(Area.LEAST), cells.write.en.eq(self.committing)]
            m.d.sync += [self.left.eq(read.data), self.source.eq(read.data[SOURCE:]), self.extended.eq(read.data[-1])]
            # The block of a cell that follows has no zero address.
            m.d.sync += self.last.eq(~read.data[NEXT + 4 : SOURCE].any())
            with m.If(step[0]):
                stamped = read.data[SOURCE : SOURCE + 3] == Source.EDGE
                m.d.sync += [self.borrow.eq(stamped), self.hidden.eq(stamped & self._unseen)]
            m.next = "LOAD"
        with m.State("LOAD"):
            m.d.comb += [cells.place.eq(step), cells.area.eq(Area.LEAST), self.moving.eq(self.source != Source.NOTHING)]
            m.d.sync += [self.source.eq(Source.NOTHING), self.bit.eq(0)]
            m.next = "SHIFT"
        with m.State("SHIFT"):
            m.d.comb += [cells.place.eq(step), cells.area.eq(Area.LEAST), self.moving.eq(self.fresh)]
            m.d.comb += cells.turning.eq(1)
            m.d.sync += self.bit.eq(self.bit + 1)
            with m.If(self.fresh):
                m.d.sync += [self.left.eq(self.left - 1), self.borrow.eq(self.borrow & ~self.chain[0])]
            with m.If(self.bit.all()):
                m.next = "STORE"
        with m.State("STORE"):
            m.d.comb += [cells.place.eq(step), cells.write.en.eq(~self.committing)]
            m.d.sync += step.eq(Cat(~step[0], read.data[NEXT:SOURCE]))
            m.next = "SWEEP"
            with m.If(self.committing):
                m.next = "COPY"
            with m.If(self.last):
                m.next = "DONE"
                with m.If(self.committing):
                    m.next = "PULSE"


def _edges(m: Module, file: Component, place: Value) -> tuple[Signal, Signal]:
    """Return one more than the stamp of the last edge of a kind, a clock after its place, and whether it has none.

    A kind's place is the address of its status, halved; four in a row differ in the two lowest bits. A place that is
    written is not read: the word read before it stays. So a read must last two clocks. Edges of one kind are two clocks
    apart, for one of another kind is between them.
    """
    places = [file.design.registers[name].address >> 1 & 3 for name in EDGE_STAMPS]
    # A memory is no logic: without the attribute so small a one would be made of flip-flops.
    of_kind = {"shape": len(file.stamp), "depth": len(places), "init": []}
    m.submodules.edges = edges = Memory(**of_kind, attrs=UNMIXED | {"ram_style": "block"})
    write, read = edges.write_port(), edges.read_port()
    stamped = Signal(len(places))
    with m.Switch(file.edge_kind):
        for kind, place_of_kind in enumerate(places):
            with m.Case(kind):
                m.d.comb += write.addr.eq(place_of_kind)
    m.d.comb += [write.data.eq(file.stamp), write.en.eq(file.stepped), read.addr.eq(place)]
    m.d.comb += read.en.eq(~file.stepped | (write.addr != place))
    with m.If(file.stepped):
        m.d.sync += stamped.bit_select(write.addr, 1).eq(1)
    return read.data, ~stamped.bit_select(place, 1)
