"""The M/T method without a divider: the counts between two edges times the reciprocal of the time between them."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib.wiring import connect, flipped

from hardwall.model.estimators.mt_divisionless import Design

from ..arithmetic.divisionless import Divisionless
from .estimate import EstimatorBlock
from .kept_edges import KeptEdges


class Estimator(EstimatorBlock):
    """The mean velocity between two edges a window apart, bounded by the time since the last, by multiplications.

    Equation, per sample, in counts and clocks, with c clocks a sample:

        velocity = sign * c moved / time, or sign * 3 c / (2 age) if 2 moved age > 3 time, but for some samples
                   after a burst

    `KeptEdges` has the two edges and their start, `Divisionless` makes the quotient, and its multiplier moved * age and
    c moved before.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with `valid`.

    Rounding and overflow: rounds half up in magnitude, exactly; saturates at the velocity format, with a flag. Count
    and stamps may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.mt_divisionless.Design
        Formats; its module derives them.

    Source: Ohmae, Matsuda, Kamiyama, Tachikawa 1982; the arithmetic is this project's.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        clocks, stamp, velocity = design.clocks, design.stamp_width, design.velocity
        m.submodules.edges = edges = KeptEdges(design)
        m.d.comb += [edges.strobe.eq(self.strobe), edges.restart.eq(self.restart)]
        connect(m, flipped(self.seen), edges.seen)
        bursts = self._bursts(m)
        scaled = max(clocks * design.edges_max, 3 * clocks)
        m.submodules.speed = speed = Divisionless(
            scaled.bit_length(), stamp + 1, velocity.f, velocity.width - 1, len(edges.moved), stamp
        )
        bounded, faster = Signal(), speed.product << 1 > (edges.time << 1) + edges.time
        m.d.comb += [
            speed.factor.eq(edges.moved),
            speed.dividend.eq(Mux(bounded, 3 * clocks, speed.product)),
            speed.divisor.eq(Mux(bounded, edges.age << 1, edges.time)),
        ]
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("LISTEN"):
                m.d.comb += speed.term.eq(edges.quiet)
                with m.If(edges.valid):
                    m.next = "WEIGH"
            with m.State("WEIGH"):
                m.d.comb += [speed.term.eq(edges.age), edges.refuted.eq(edges.news & faster)]
                m.next = "CHOOSE"
            with m.State("CHOOSE"):
                m.d.comb += speed.term.eq(clocks)
                m.d.sync += bounded.eq(~edges.doubted & faster)
                m.next = "START"
            with m.State("START"):
                m.d.comb += speed.start.eq(1)
                m.next = "OUTPUT"
            with m.State("OUTPUT"), m.If(speed.done):
                m.d.sync += [
                    self.velocity.eq(Mux(edges.down, -speed.quotient, speed.quotient)),
                    self.saturated.eq(Cat(speed.saturated, bursts.found)),
                    self.valid.eq(1),
                ]
                m.next = "LISTEN"
        return m
