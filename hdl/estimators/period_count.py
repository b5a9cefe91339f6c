"""Velocity by the time of one encoder cycle at low speed, and by the counts of a window at high speed."""

from amaranth.hdl import Cat, Module, Mux, Signal, signed
from amaranth.lib.wiring import connect, flipped

from hardwall.model.estimators.period_count import Design

from ..arithmetic.divide import Divide
from ..arithmetic.fixed import saturate
from .cycle_times import CycleTimes
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """The time of a cycle or the counts of a window, chosen by the number of counts in the last window.

    Equation, per sample, in counts and clocks, with c clocks a sample and windows of w samples:

        velocity = sign * 4 c / max(time of the last cycle, age of the edge three before the last)
        velocity = counts of the last full window / w     after one with more than `period_count_switch` counts, until
                                                          one with fewer than that less 1

    Start: 0 at the first sample and with `restart`, and until there is a cycle in one direction or a fast window.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the division; the next `strobe` may come with
    `valid`.

    Rounding and overflow: a cycle's speed rounds half up in magnitude, a window's speed is exact; both saturate at the
    velocity format, with a flag. Count and stamps may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.period_count.Design
        Formats; its module derives them.

    Source: Brown, Schneider, Mulligan, IEEE Trans. Industrial Electronics 1992.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        velocity, window_bits = design.velocity, design.window_bits

        m.submodules.times = times = CycleTimes(design.count_width, design.stamp_width, design.cycles_max)
        m.d.comb += [times.strobe.eq(self.strobe), times.restart.eq(self.restart)]
        connect(m, flipped(self.seen), times.seen)
        bursts = self._bursts(m)

        running, down = Signal(), Signal()
        samples = Signal(range(1 << window_bits)) if window_bits else Signal(1)
        first, moved = Signal.like(self.seen.count), Signal.like(self.seen.count)
        full, counting = Signal(), Signal()
        far_counted = Signal(signed(len(moved) + velocity.f - window_bits))
        size = Mux(moved < 0, -moved, moved)
        m.d.comb += far_counted.eq(moved << (velocity.f - window_bits))
        m.d.sync += full.eq(0)
        with m.If(self.strobe):
            m.d.sync += [down.eq(self.seen.down), running.eq(1), samples.eq(samples + 1)]
            with m.If(self.restart | ~running):
                m.d.sync += [samples.eq(0), first.eq(self.seen.count), moved.eq(0), counting.eq(0)]
            with m.Elif(samples == (1 << window_bits) - 1):
                # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                m.d.sync += [samples.eq(0), first.eq(self.seen.count), moved.eq(self.seen.count - first), full.eq(1)]
        with m.If(full):
            switch = self.period_count_switch
            m.d.sync += counting.eq((size > switch) | counting & (size + 1 >= switch))

        cycle = Signal(design.stamp_width)
        moving = Signal()
        m.submodules.divide = divide = Divide(design.dividend.bit_length(), design.stamp_width, velocity.width)
        m.d.comb += [
            divide.dividend.eq(design.dividend),
            divide.divisor.eq(Mux(times.cycle_age > cycle, times.cycle_age, cycle)),
        ]
        m.d.sync += moving.eq((cycle != 0) & (times.cycle_age != 0))
        far_timed = Mux(moving, (divide.quotient + 1) >> 1, 0)

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("OBSERVE"), m.If(times.valid):
                with m.If(times.age == 0):
                    m.d.sync += cycle.eq(0)
                with m.Elif(times.news & (times.cycles <= 1)):
                    # With more than one cycle in a sample the last timed cycle stays, until counting begins.
                    m.d.sync += cycle.eq(Mux(times.cycles == 1, times.cycle, 0))
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.comb += divide.start.eq(1)
                m.next = "OUTPUT"
            with m.State("OUTPUT"), m.If(divide.done):
                far = Mux(counting, far_counted, Mux(down, -far_timed, far_timed))
                held = saturate(far, -velocity.max, velocity.max)
                flags = Cat(held != far, bursts.found)
                m.d.sync += [self.velocity.eq(held), self.saturated.eq(flags), self.valid.eq(1)]
                m.next = "OBSERVE"
        return m
