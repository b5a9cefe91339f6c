"""The M/T method: counts between two edges that are a window apart, over the time between them."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib.wiring import connect, flipped

from hardwall.model.estimators.mt import Design

from ..arithmetic.divide import Divide
from .estimate import EstimatorBlock
from .kept_edges import KeptEdges


class Estimator(EstimatorBlock):
    """The mean velocity from an edge of half a window to a whole one ago to the last edge, bounded by the time since.

    Equation, per sample, in counts and clocks, with c clocks a sample:

        speed    = c |number of the last edge - number of the older| / (stamp of the last edge - stamp of the older)
        velocity = sign * min(speed, 3 c / (2 age)), or sign * speed for some samples after a burst

    `KeptEdges` has the two edges and their start.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the two divisions, which run in parallel; the
    next `strobe` may come with `valid`.

    Rounding and overflow: rounds half up in magnitude; saturates at the velocity format, with a flag. Count and stamps
    may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.mt.Design
        Formats; its module derives them.

    Source: Ohmae, Matsuda, Kamiyama, Tachikawa 1982.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        width, fraction, bound = design.velocity.width, design.velocity.f + 1, 3 * design.clocks << design.velocity.f
        m.submodules.edges = edges = KeptEdges(design)
        m.d.comb += [edges.strobe.eq(self.strobe), edges.restart.eq(self.restart)]
        connect(m, flipped(self.seen), edges.seen)
        bursts = self._bursts(m)
        product = Signal(len(edges.moved) + max(len(edges.quiet), design.clocks.bit_length()))
        scaled = product[: (design.clocks * design.edges_max).bit_length()]
        m.submodules.speed = speed = Divide(len(scaled) + fraction, len(edges.time), width)
        m.submodules.limit = limit = Divide(bound.bit_length(), len(edges.age), width)
        m.d.comb += [
            speed.dividend.eq(scaled << fraction),
            speed.divisor.eq(edges.time),
            limit.dividend.eq(bound),
            limit.divisor.eq(edges.age),
        ]
        factor, least = Signal(len(product) - len(edges.moved)), Signal(width)
        far = (least + 1) >> 1
        saturated = far > design.velocity.max
        magnitude = Mux(saturated, design.velocity.max, far)
        m.d.comb += factor.eq(edges.quiet)
        m.d.sync += [product.eq(edges.moved * factor), self.valid.eq(0)]
        with m.FSM():
            with m.State("WEIGH"), m.If(edges.valid):
                m.next = "SCALE"
            with m.State("SCALE"):
                m.d.comb += [
                    factor.eq(design.clocks),
                    edges.refuted.eq(edges.news & (product << 1 > (edges.time << 1) + edges.time)),
                ]
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.comb += [speed.start.eq(1), limit.start.eq(1)]
                m.next = "LEAST"
            with m.State("LEAST"), m.If(speed.done):
                bounded = ~edges.doubted & (limit.quotient < speed.quotient)
                m.d.sync += least.eq(Mux(bounded, limit.quotient, speed.quotient))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                m.d.sync += [
                    self.velocity.eq(Mux(edges.down, -magnitude, magnitude)),
                    self.saturated.eq(Cat(saturated, bursts.found)),
                    self.valid.eq(1),
                ]
                m.next = "WEIGH"
        return m
