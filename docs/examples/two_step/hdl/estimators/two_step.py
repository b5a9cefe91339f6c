"""Velocity as the mean of the last two differences of counts."""

from amaranth.hdl import Module, Mux, Signal, signed

from hardwall.model.estimators.two_step import Design

from ..arithmetic.fixed import saturate
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """The mean of the last two differences of counts.

    Equation: velocity = (difference + difference before) / 2, each modulo the count's width; 0 at the first sample.

    Latency: `latency` clocks from `strobe` to `valid`; a strobe may come every clock.

    Rounding and overflow: exact; saturates at the velocity format, with a flag.

    Parameters
    ----------
    design : hardwall.model.estimators.two_step.Design
        Formats.

    Source: elementary.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        fmt = self._design.velocity
        count = self.seen.count
        running, taken = Signal(), Signal()
        last, before = Signal.like(count), Signal.like(count)
        change = Signal(signed(len(count) + 1))

        m.d.sync += taken.eq(self.strobe)
        with m.If(self.strobe):
            goes_on = running & ~self.restart
            moved = (count - last)[: len(count)].as_signed()
            m.d.sync += [
                change.eq(Mux(goes_on, moved + before, 0)),
                before.eq(Mux(goes_on, moved, 0)),
                last.eq(count),
                running.eq(1),
            ]

        # The velocity has one fraction bit, so its word is the sum of two differences.
        limited = saturate(change, fmt.min, fmt.max)
        m.d.sync += self.valid.eq(taken)
        with m.If(taken):
            m.d.sync += [self.velocity.eq(limited), self.saturated.eq(limited != change)]
        return m
