"""Velocity from the changes of the count: a Kalman filter of edges that are made from counts."""

from amaranth.hdl import Module, Mux, Signal

from hardwall.model.estimators.count_kalman import UNITS, Design

from . import edge_kalman
from .estimate import EstimatorBlock


class Filter(edge_kalman.Estimator):
    """The filter of edges without its watch over bursts: edges that are made from counts do not show any."""

    def _watch(self, m, s):
        """Add nothing: there are no bursts, and no jolts."""


class Estimator(EstimatorBlock):
    """Position, velocity and acceleration, corrected when the count changes.

    Equation, with f the count, k the number of the sample, d the difference of f from the last sample:

        d != 0     an edge at the time 2 k - 1 if d is 1 or -1, else 2 k, in halves of a sample
        velocity   that of `edge_kalman` for this edge, at the time 2 k

    Start: at the first sample, and with `restart`, everything is forgotten; v = 0 until the second edge.

    Latency: `latency` clocks from `strobe` to `valid`, a clock more than the filter's; the next `strobe` may come with
    `valid`.

    Rounding and overflow: as in the filter. Counts and times may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.count_kalman.Design
        Formats and table; its module derives them.

    Source: as of `edge_kalman`; the edges made from counts are this project's.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        m.submodules.filter = core = Filter(self._design.filter)
        running, fresh, begin = Signal(), Signal(), Signal()
        count = Signal.like(self.seen.count)
        now, at, down = Signal.like(core.seen.stamp), Signal.like(core.seen.stamp), Signal()

        # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
        moved, alone = Signal.like(count), Signal()
        m.d.comb += [moved.eq(self.seen.count - count), alone.eq((moved == 1) | (moved == -1))]
        m.d.sync += begin.eq(self.strobe)
        with m.If(self.strobe):
            m.d.sync += [fresh.eq(self.restart | ~running), running.eq(1), count.eq(self.seen.count)]
            m.d.sync += now.eq(now + UNITS)
            with m.If(self.restart | ~running):
                m.d.sync += [at.eq(now + UNITS), down.eq(0)]
            with m.Elif(moved != 0):
                m.d.sync += [at.eq(Mux(alone, now + UNITS - 1, now + UNITS)), down.eq(moved < 0)]

        seen = core.seen
        stamps = seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall
        m.d.comb += [
            core.strobe.eq(begin),
            core.restart.eq(fresh),
            seen.count.eq(count),
            seen.stamp.eq(now),
            *(stamp.eq(at) for stamp in stamps),
            seen.down.eq(down),
            seen.run.eq(1),
            self.velocity.eq(core.velocity),
            self.saturated.eq(core.saturated),
            self.valid.eq(core.valid),
        ]
        return m
