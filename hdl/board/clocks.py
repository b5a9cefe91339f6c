"""The clocks of a board: the axes' clock with its reset, and the oscillator's, which watches the first."""

from typing import NamedTuple, Protocol

from amaranth.hdl import ClockDomain, DomainRenamer, Module, Signal
from amaranth.lib.cdc import FFSynchronizer

from hardwall.model.board import clock_monitor
from hardwall.model.requirements import AxisRequirements

from .clock_monitor import ClockMonitor


class Clocked(Protocol):
    """A board with its clocks: `clk` of `spec.clock_hz`, the pin `rst`, and `oscillator`."""

    spec: AxisRequirements
    clk: Signal
    rst: Signal
    oscillator: Signal


class Clocks(NamedTuple):
    """The clocks of a board.

    Attributes:
        running: whether the clock runs, as the oscillator has found; asynchronous.
        stood: whether it did not, at the clock: it still says so when the clock comes back.
        reset: the reset, which follows the pin 2 to 3 clocks later, and lasts as long after power-up.
    """

    running: Signal
    stood: Signal
    reset: Signal


def board_clocks(m: Module, board: Clocked) -> Clocks:
    """Make the clock domains of a board; return what is known of its clocks.

    `running` rises behind the second change of a beat that the clock makes, so `stood` is high for many clocks then.
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
    stood = Signal(init=1)
    m.submodules.running_synchroniser = FFSynchronizer(~monitor.running, stood, init=1)
    return Clocks(monitor.running, stood, reset)
