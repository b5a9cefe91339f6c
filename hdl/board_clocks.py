"""The clocks of a board: the one of its axes with its reset, and the oscillator's, which watches it."""

from typing import Protocol

from amaranth.hdl import ClockDomain, DomainRenamer, Module, Signal
from amaranth.lib.cdc import FFSynchronizer

from hardwall.model import clock_monitor
from hardwall.model.requirements import AxisRequirements

from .clock_monitor import ClockMonitor


class Clocked(Protocol):
    """A board with its clocks: `clk` of `spec.clock_hz`, the pin `rst`, and `oscillator`."""

    spec: AxisRequirements
    clk: Signal
    rst: Signal
    oscillator: Signal


def board_clocks(m: Module, board: Clocked) -> tuple[Signal, Signal]:
    """Make the clock domains of a board; return whether its clock runs, as the oscillator has found, and its reset.

    The reset follows the pin 2 to 3 clocks later, and lasts as long after power-up.
    """
    m.domains.sync = domain = ClockDomain()
    m.d.comb += domain.clk.eq(board.clk)
    reset = Signal(init=1)
    m.submodules.rst_synchroniser = FFSynchronizer(board.rst, reset, init=1)
    m.d.comb += domain.rst.eq(reset)

    design = clock_monitor.Design(board.spec.clock_hz)
    m.domains.oscillator = oscillator = ClockDomain(reset_less=True)
    m.d.comb += oscillator.clk.eq(board.oscillator)
    monitor = ClockMonitor(design)
    m.submodules.clock_monitor = DomainRenamer("oscillator")(monitor)
    # The clock runs while a reset lasts, too.
    beat = Signal(design.beat_clocks.bit_length(), reset_less=True)
    m.d.sync += beat.eq(beat + 1)
    m.d.comb += monitor.beat.eq(beat[-1])
    return monitor.running, reset
