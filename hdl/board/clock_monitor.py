"""The monitor of a clock: whether it still runs, found out by a second clock."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.board import clock_monitor

from ..block import Block


class ClockMonitor(Block):
    """Low `running` says that the beat of a clock has not changed for too long.

    The block is in the domain of the second clock, the oscillator; what it watches makes the beat.

    Equation: as in `hardwall.model.board.clock_monitor`.

    Latency, in clocks of the oscillator: `running` is high `SYNCHRONISER + 1` edges after the second change of the
    beat; the first of these edges sees it. It is low `limit` edges after a change is seen so, if no other change came.

    Rounding and overflow: none; the counter stops at 0.

    Reset: from power-up `running` is low until the beat has changed twice.

    Parameters
    ----------
    design : hardwall.model.board.clock_monitor.Design
        The numbers for the watched clock.

    Members
    -------
    beat : In(1)
        A level that changes every `design.beat_clocks` of the watched clock; asynchronous.
    running : Out(1)
        The watched clock runs.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = clock_monitor.Design

    @staticmethod
    def members(design: clock_monitor.Design) -> dict[str, Member]:
        return {"beat": In(1), "running": Out(1)}

    def elaborate(self, platform):
        m = Module()
        limit = self._design.params.limit
        level, before, left, now = Signal(), Signal(), Signal(range(limit + 1)), Signal(range(limit + 1))
        m.submodules.synchroniser = FFSynchronizer(self.beat, level, stages=clock_monitor.SYNCHRONISER)
        changed, began, stands = level ^ before, Signal(), now == 0
        m.d.comb += now.eq(Mux(changed, limit, Mux(left == 0, 0, left - 1)))
        m.d.sync += [before.eq(level), left.eq(now), began.eq((began | changed) & ~stands)]
        m.d.sync += self.running.eq((self.running | (changed & began)) & ~stands)
        return m
