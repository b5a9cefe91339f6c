"""The cells of the register file of several axes, and the shift register through which they are read and written."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component

from hardwall.model.axes.register_file import Design
from hardwall.model.axes.registers import BANK
from hardwall.model.axis.register_file import CELL_BITS, Area

from ..link.axis_status import Moments, held_status
from ..link.line import UNMIXED


class Cells:
    """Cells of all banks; and what never changes: the areas of one bank, and behind them the window to the map.

    Args:
        m: the module.
        design: the registers.

    Attributes:
        depth: how many cells of banks there are.
        cell, write: the ports of the banks.
        text: the port of what never changes.
        area, window: what `text` is asked for: an area, and whether it is in the window.
        shift, upper: the content of a cell, old or new; and the content of `shift` before.
        moments: when the status of an axis is taken.
        taking: by name, whether `shift` takes a cell, a text, a status, or the host's value.
    """

    def __init__(self, m: Module, design: Design):
        self._within = (max(len(design.book), len(design.map_cells)) - 1).bit_length()
        book = design.book + [0] * ((1 << self._within) - len(design.book)) + design.map_cells
        self.depth = 1 << (BANK * design.banks - 1).bit_length()
        m.submodules.cells = cells = Memory(shape=CELL_BITS, depth=self.depth, init=[], attrs=UNMIXED)
        m.submodules.book = fixed = Memory(shape=CELL_BITS, depth=2 << self._within, init=book, attrs=UNMIXED)
        cell, write, text = cells.read_port(), cells.write_port(), fixed.read_port()
        self.cell, self.write, self.text = cell, write, text
        shift, upper = Signal(CELL_BITS), Signal(CELL_BITS)
        self.shift, self.upper = shift, upper
        area, window = Signal(Area), Signal()
        self.area, self.window = area, window
        self.moments = Moments(*(Signal(name=name) for name in Moments._fields))
        self.taking: dict[str, Signal] = {}

    def take(self, m: Module, file: Component, asked: Signal) -> None:
        """Load `shift` as told, from the file's host and inputs; a status comes from the axis asked."""
        host = file.host
        status = held_status(m, file, asked, self.moments)
        takes = {"value": host.value, "status": status}
        if file.design.registers.capture:
            # That memory is large and far away: its output has its own register first.
            takes["capture"] = arrived = Signal(CELL_BITS)
            m.d.comb += file.capture_address.eq(host.address)
            m.d.sync += arrived.eq(file.capture_data & file.capture_done.replicate(CELL_BITS))
        # A memory is slow, and the last of these has the shortest way.
        takes |= {"text": self.text.data, "cell": self.cell.data}
        self.taking |= {name: Signal(name=f"taking_{name}") for name in takes}
        for name, taken in self.taking.items():
            with m.If(taken):
                m.d.sync += [self.shift.eq(takes[name]), self.upper.eq(self.shift)]

    def address(self, m: Module, address: Value, place: Value, bank: Value) -> None:
        """Read the memories at an address that has a place in a bank."""
        upper = Mux(self.window, address[len(place) : self._within], self.area)
        m.d.comb += [
            self.text.addr.eq(Cat(place, upper, self.window)),
            self.cell.addr.eq(Cat(place, bank)),
            self.write.addr.eq(Cat(place, bank)),
            self.write.data.eq(self.shift),
        ]
