"""Velocity as the difference of successive counts."""

from amaranth.hdl import Module, Mux, Signal

from hardwall.model.estimators.finite_difference import Design

from ..arithmetic.fixed import saturate
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """The finite difference of the last two counts.

    Equation: velocity = count - last count, modulo the count's width; 0 at the first sample.

    Latency: `latency` clocks from `strobe` to `valid`; a strobe may come every clock.

    Rounding and overflow: exact; saturates at the velocity format, with a flag.

    Parameters
    ----------
    design : hardwall.model.estimators.finite_difference.Design
        Formats.

    Source: Chawda, Celik, O'Malley, World Haptics 2011, "FDM".
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        fmt = self._design.velocity
        running = Signal()
        last = Signal.like(self.seen.count)
        moved = Signal.like(self.seen.count)
        taken = Signal()

        m.d.sync += taken.eq(self.strobe)
        with m.If(self.strobe):
            # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
            m.d.sync += [
                moved.eq(Mux(running & ~self.restart, (self.seen.count - last)[: len(moved)].as_signed(), 0)),
                last.eq(self.seen.count),
                running.eq(1),
            ]

        limited = saturate(moved, fmt.min, fmt.max)
        m.d.sync += self.valid.eq(taken)
        with m.If(taken):
            m.d.sync += [self.velocity.eq(limited), self.saturated.eq(limited != moved)]
        return m
