"""Velocity from the changes of the count: a Kalman filter of edges that are made from counts."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib.wiring import In, Member

from hardwall.model.estimators.count_kalman import UNITS, Design
from hardwall.model.estimators.count_kalman import Filter as FilterDesign

from ..arithmetic.fixed import saturate
from . import edge_kalman
from .acceleration import AcceleratedBlock


class Filter(edge_kalman.Estimator):
    """The filter of edges that are made from counts: a flag of the counts takes the place of its watch over bursts.

    Members, beside those of every estimator
    ----------------------------------------
    limited : In(1)
        The count moved further than the largest difference, constant from `strobe` to `valid`.
    """

    @staticmethod
    def members(design: FilterDesign) -> dict[str, Member]:
        return edge_kalman.Estimator.members(design) | {"limited": In(1)}

    def _watch(self, m, s):
        m.d.comb += s.bursts.eq(self.limited)


class Estimator(AcceleratedBlock):
    """Position, velocity and acceleration, corrected when the count changes.

    Equation, with f the count, k the number of the sample, d the difference of f from the last sample:

        d          limited to the largest difference
        d != 0     an edge at the time 2 k - 1 if d is 1 or -1, else 2 k, in halves of a sample
        outputs    those of `edge_kalman` for this edge, at the time 2 k

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
        d = self._design
        running, fresh, begin = Signal(), Signal(), Signal()
        count, cell, moved = (Signal.like(self.seen.count) for _ in range(3))
        now, at, down = Signal.like(core.seen.stamp), Signal.like(core.seen.stamp), Signal()

        # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
        held = saturate(moved, -d.step_max, d.step_max)
        alone = (moved == 1) | (moved == -1)
        m.d.comb += [fresh.eq(self.restart | ~running), moved.eq(self.seen.count - count)]
        m.d.sync += begin.eq(self.strobe)
        with m.If(self.strobe):
            m.d.sync += [core.restart.eq(fresh), running.eq(1), count.eq(self.seen.count), now.eq(now + UNITS)]
            with m.If(fresh):
                m.d.sync += [cell.eq(self.seen.count), at.eq(now + UNITS), down.eq(0), core.limited.eq(0)]
            with m.Else():
                m.d.sync += [cell.eq(cell + held), core.limited.eq(held != moved)]
                with m.If(moved != 0):
                    m.d.sync += [at.eq(Mux(alone, now + UNITS - 1, now + UNITS)), down.eq(moved < 0)]

        seen = core.seen
        stamps = seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall
        m.d.comb += [
            core.strobe.eq(begin),
            seen.count.eq(cell),
            seen.stamp.eq(now),
            *(stamp.eq(at) for stamp in stamps),
            seen.down.eq(down),
            seen.run.eq(1),
            self.velocity.eq(core.velocity),
            self.acceleration.eq(core.acceleration),
            self.saturated.eq(core.saturated.any()),
            self.valid.eq(core.valid),
        ]
        return m
