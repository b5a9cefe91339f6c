"""Velocity from the time of whole encoder cycles."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib.wiring import connect, flipped

from hardwall.model.estimators.period import Design

from ..arithmetic.divide import Divide
from .cycle_times import CycleTimes
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """The mean velocity over whole cycles of the encoder, bounded by the time since the last edge.

    Equation, per sample, in counts and clocks, with c clocks a sample:

        speed    = 4 m c / (time of the last m cycles), or c / (time between the last two edges), or 0
        velocity = sign * min(speed, 3 c / (2 age), 4 c / (age of the edge three before))

    Start: 0 at the first sample and with `restart`, and until there are two edges in one direction.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the two divisions, which run in parallel; the
    next `strobe` may come with `valid`.

    Rounding and overflow: rounds half up in magnitude; saturates at the velocity format, with a flag. Count and stamps
    may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.period.Design
        Formats; its module derives them.

    Source: Brown, Schneider, Mulligan 1992; Ohmae et al. 1982.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        width, clocks = design.stamp_width, design.clocks
        quotient_width, fraction = design.velocity.width, design.velocity.f + 1

        m.submodules.times = times = CycleTimes(design.count_width, design.stamp_width, design.cycles_max)
        m.d.comb += [times.strobe.eq(self.strobe), times.restart.eq(self.restart)]
        connect(m, flipped(self.seen), times.seen)
        bursts = self._bursts(m)

        # The quotient of the speed is held until there is a new edge.
        scaled = Signal(range(4 * clocks * design.cycles_max + 1))
        whole = times.cycles != 0
        m.submodules.speed = speed = Divide(len(scaled) + fraction, width, quotient_width)
        m.submodules.limit = limit = Divide((8 * clocks << (fraction - 1)).bit_length(), width, quotient_width)
        tighter = Signal()
        m.d.sync += [
            scaled.eq(times.cycles * (4 * clocks)),
            tighter.eq((times.cycle_age != 0) & (times.age << 3 < times.cycle_age * 3)),
        ]
        m.d.comb += [
            speed.dividend.eq(Mux(whole, scaled, clocks) << fraction),
            speed.divisor.eq(Mux(whole, times.cycle, times.gap)),
            limit.dividend.eq(Mux(tighter, 8 * clocks, 3 * clocks) << (fraction - 1)),
            limit.divisor.eq(Mux(tighter, times.cycle_age, times.age)),
        ]

        moving = Signal()
        least = Signal(quotient_width)
        down = Signal()
        far = (least + 1) >> 1
        saturated = far > design.velocity.max
        magnitude = Mux(saturated, design.velocity.max, far)
        m.d.sync += self.valid.eq(0)
        with m.If(self.strobe):
            m.d.sync += down.eq(self.seen.down)
        with m.FSM():
            with m.State("OBSERVE"), m.If(times.valid):
                m.d.comb += limit.start.eq(1)
                with m.If(times.age == 0):
                    m.d.sync += moving.eq(0)
                with m.Elif(times.news):
                    m.d.comb += speed.start.eq(1)
                    m.d.sync += moving.eq(whole | (times.gap != 0))
                m.next = "TIGHTEN"
            with m.State("TIGHTEN"), m.If(limit.done):
                slower = speed.quotient < limit.quotient
                m.d.sync += least.eq(Mux(moving, Mux(slower, speed.quotient, limit.quotient), 0))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                m.d.sync += [
                    self.velocity.eq(Mux(down, -magnitude, magnitude)),
                    self.saturated.eq(Cat(saturated, bursts.found)),
                    self.valid.eq(1),
                ]
                m.next = "OBSERVE"
        return m
