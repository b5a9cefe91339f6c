"""The M/T method: counts between two edges that are a window apart, over the time between them."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib.wiring import connect, flipped

from hardwall.model.estimators.mt import Design

from ..arithmetic.divide import Divide
from .estimate import EstimatorBlock
from .kept_edges import KeptEdges


class Estimator(EstimatorBlock):
    """The mean velocity from an edge of half a window to a whole one ago to the last edge, bounded by the time since.

    Equation, per sample, in counts and clocks, with c clocks a sample:

        speed    = c |number of the last edge - number of the older| / (stamp of the last edge - stamp of the older)
        velocity = sign * min(speed, 3 c / (2 age))

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
        scaled = Signal(range(design.clocks * design.edges_max + 1))
        m.submodules.speed = speed = Divide(len(scaled) + fraction, len(edges.time), width)
        m.submodules.limit = limit = Divide(bound.bit_length(), len(edges.age), width)
        m.d.comb += [
            speed.dividend.eq(scaled << fraction),
            speed.divisor.eq(edges.time),
            limit.dividend.eq(bound),
            limit.divisor.eq(edges.age),
        ]
        least = Signal(width)
        far = (least + 1) >> 1
        saturated = far > design.velocity.max
        magnitude = Mux(saturated, design.velocity.max, far)
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("SCALE"), m.If(edges.valid):
                m.d.sync += scaled.eq(edges.moved * design.clocks)
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.comb += [speed.start.eq(1), limit.start.eq(1)]
                m.next = "LEAST"
            with m.State("LEAST"), m.If(speed.done):
                m.d.sync += least.eq(Mux(speed.quotient < limit.quotient, speed.quotient, limit.quotient))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                m.d.sync += [
                    self.velocity.eq(Mux(edges.down, -magnitude, magnitude)),
                    self.saturated.eq(saturated),
                    self.valid.eq(1),
                ]
                m.next = "SCALE"
        return m
