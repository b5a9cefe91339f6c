"""The finite difference over a chosen window."""

from amaranth.hdl import Module, Mux, Signal

from hardwall.model.estimators.window import Design

from ..arithmetic.signed_divide import SignedDivide
from .estimate import EstimatorBlock
from .history import History


class Estimator(EstimatorBlock):
    """The mean velocity over the last `window_length` stored positions.

    Equation: velocity = (count - count n samples ago) / n; before the first sample the axis counts as having stood at
    its position, so velocity is 0 at the first sample. If the history stores only every M-th sample, n is a multiple of
    M, and the velocity is held between.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the division; the next `strobe` may come with
    `valid`.

    Rounding and overflow: rounds toward zero. The change of a sample is limited to the velocity format, with a flag;
    the velocity then always fits. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.window.Design
        Formats; its module derives them.

    Source: the minimax window; see the model.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        m.submodules.history = history = History(design.history)
        length = Signal.like(self.window_length)
        m.submodules.division = division = SignedDivide(
            design.history.width, len(length), design.fraction, design.velocity.width - 1
        )
        # A window has at least one sample.
        m.d.sync += length.eq(Mux(self.window_length == 0, 1, self.window_length))
        m.d.comb += [
            history.strobe.eq(self.strobe),
            history.restart.eq(self.restart),
            history.count.eq(self.seen.count),
            history.age.eq(length),
            division.dividend.eq(history.change),
            division.divisor.eq(length),
        ]
        m.d.sync += [division.start.eq(history.valid), self.valid.eq(division.done)]
        with m.If(division.done):
            m.d.sync += self.saturated.eq(history.limited)
            with m.If(history.stored):
                m.d.sync += self.velocity.eq(division.quotient)
        return m
