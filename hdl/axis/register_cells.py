"""The cells of a register file, and the shift register through which they are read and written."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import PureInterface

from hardwall.model.axis.register_file import CELL_BITS, Area, Design
from hardwall.model.axis.registers import END

from ..link.line import UNMIXED


class Cells:
    """The memory, and what is asked of it.

    Args:
        m: the module.
        design: the registers.
        host: what the server asks for.

    Attributes:
        read, write: the memory's ports.
        step: a cell that is not at the host's address.
        shift: what a cell has or gets, one bit after the other or at once.
        place, area, window: the lowest bits of the address, an area, and whether it is in the window.
        counting: the cell gets one more.
        found, captured: what the memory gives, or the capture memory.
        fetched, given, turning: `shift` takes what is found, the host's value, or one bit.
    """

    def __init__(self, m: Module, design: Design, host: PureInterface):
        # The window lies behind the book, at a power of two. A depth that is one too needs no logic between the blocks
        # that the memory is made of.
        within = (max(len(design.book), len(design.map_cells)) - 1).bit_length()
        cells = design.book + [0] * ((1 << within) - len(design.book)) + design.map_cells
        m.submodules.cells = memory = Memory(shape=CELL_BITS, depth=2 << within, init=cells, attrs=UNMIXED)
        read, write = memory.read_port(), memory.write_port()
        self.read, self.write = read, write
        self.step, self.found = Signal(range(END)), Signal(CELL_BITS)
        self.shift = Signal(CELL_BITS)
        self.place, self.area, self.window, self.counting = Signal(range(END)), Signal(Area), Signal(), Signal()
        self.captured = Signal()
        self.fetched, self.given = Signal(), Signal()
        self.turning = Signal()
        upper = Mux(self.window, host.address[len(self.place) : within], self.area)
        m.d.comb += [
            read.addr.eq(Cat(self.place, upper, self.window)),
            write.addr.eq(self.place),
            write.data.eq(self.shift + self.counting),
            host.data.eq(self.shift),
        ]
        # A memory is slow: what it gives goes to a register, and from there to the host.
        m.d.comb += self.found.eq(read.data)

    def take(self, m: Module, value: Value, turned: Value) -> None:
        """Load `shift` as asked: the found word, a value, or itself rotated by a bit."""
        with m.If(self.fetched | self.given | self.turning):
            m.d.sync += self.shift.eq(Mux(self.turning, turned, Mux(self.given, value, self.found)))
