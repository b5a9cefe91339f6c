"""The watchdog of a device of several axes: whether its one host still beats."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis import watchdog
from hardwall.model.axis.supervisor import BEAT_BITS

from ..arithmetic.fixed import shape
from ..block import Block


class Watchdog(Block):
    """`live` is low if the host has been silent for too long. A free-running square wave comes beside it.

    Equation: the host is live from a change of `heartbeat` until so many ticks later as `supervisor_watchdog` says, up
    to one less because they run freely. The word is taken with the change.

    Latency: one clock from a change of `heartbeat` to `live`.

    Rounding and overflow: none. The tick is a whole number of half periods of the wave, 1 ms or just below.

    Parameters
    ----------
    design : hardwall.model.axis.watchdog.Design
        The dividers of the clock.

    Members
    -------
    heartbeat : In
        A word of the host; every change of it is a beat.
    supervisor_watchdog : In
        The run-time word, ms.
    live : Out(1)
        The heartbeat is not overdue.
    wave : Out(1)
        The square wave.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = watchdog.Design

    @staticmethod
    def members(design: watchdog.Design) -> dict[str, Member]:
        return {
            "heartbeat": In(BEAT_BITS),
            "supervisor_watchdog": In(shape(design.word.format)),
            "live": Out(1),
            "wave": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        pump_clocks, tick_turns = self._design.params
        pump, tick = Signal(range(max(pump_clocks, 2))), Signal(range(max(tick_turns, 2)))
        left, last_beat = Signal.like(self.supervisor_watchdog), Signal.like(self.heartbeat)
        turns, ticks = pump == pump_clocks - 1, tick == tick_turns - 1
        m.d.sync += [pump.eq(Mux(turns, 0, pump + 1)), self.wave.eq(self.wave ^ turns), last_beat.eq(self.heartbeat)]
        with m.If(turns):
            m.d.sync += tick.eq(Mux(ticks, 0, tick + 1))
        with m.If(self.heartbeat != last_beat):
            m.d.sync += left.eq(self.supervisor_watchdog)
        with m.Elif(turns & ticks & left.any()):
            m.d.sync += left.eq(left - 1)
        m.d.comb += self.live.eq(left.any())
        return m
