"""The walk of the register file of several axes through the cells of a bank, and its counters."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value

from hardwall.model.axes.register_file import Design
from hardwall.model.axes.registers import BANK
from hardwall.model.axis.registers import END, WRITTEN

from ..arithmetic.fixed import less


class CommitWalk:
    """A walk through cells: all of them after a reset; and at a FINISH the words of a bank, if they are committed.

    Behind the words are the count of a preload and the causes that the host has read.

    Args:
        m: the module.
        design: the registers.
        commit: whether the words are.

    Attributes:
        step, low: the number of the value, or after a reset of the cell; and whether it is the low half.
        settling: clocks that are left of a wait.
        begin: the step with which a FINISH begins.
        copies: the value is a word.
        place: of the cell.
    """

    def __init__(self, m: Module, design: Design, commit: Value):
        registers, words = design.registers, len(design.registers.words)
        step, low, settling = Signal(range(BANK * design.banks)), Signal(), Signal(range(design.settle_clocks + 1))
        count, causes = registers["active_preload_count"].address, registers["acknowledged"].address
        copies, halfway = Signal(), Signal(range(END - WRITTEN))
        m.d.comb += copies.eq(less(step, words))
        beside = Mux(step == words, count - WRITTEN, causes - WRITTEN)
        m.d.comb += halfway.eq(Mux(copies, Cat(low, step[:4]), beside | low))
        self.step, self.low, self.settling, self.copies = step, low, settling, copies
        self.begin, self.place = Mux(commit, 0, words), halfway | WRITTEN
