"""Levant's differentiator by implicit Euler."""

from amaranth.hdl import Mux, Signal

from hardwall.model.estimators.levant_implicit import Design

from ..arithmetic.fixed import shift_floor, shift_round_half_up
from . import levant_semi_implicit


class Estimator(levant_semi_implicit.Estimator):
    """Levant's differentiator with implicit sign and root, one sample at a time.

    Equation, per sample, in counts and sample periods:

        b  = x + u1 - count
        u1 <- u1 - sign(b) near,    near = min(|b|, alpha)
        u  = u1 - sign(b) g,        g = lambda sqrt(beyond + lambda^2 / 4) - lambda^2 / 2,    beyond = |b| - near
        x  <- x + u

    Start: at the first sample, and with `restart`, x = count and u1 = 0, so u = 0: a start from rest has no transient.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the root; the next `strobe` may come with
    `valid`. One multiplier makes lambda^2 before the root, and lambda times the root after it.

    Rounding and overflow: the root rounds down and half of its LSB is added back. lambda^2 / 4 rounds down to the
    root's radicand. g is the difference of two parts that round half up, and is held within 0 to beyond. b, u and u1
    saturate, with flags. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_implicit.Design
        Formats; its module derives them.

    Source: Acary, Brogliato 2010; Brogliato, Polyakov, Efimov 2020; Mojallizadeh, Brogliato, Acary 2021.
    """

    design_class = Design

    def elaborate(self, platform):
        self._quarter = Signal(max(2 * len(self._word(0)) - self.design.quarter_shift, 1))
        self._half = Signal(max(2 * len(self._word(0)) + 1 - self.design.half_shift, 1))
        return super().elaborate(platform)

    def _factor(self, root):
        # `done` is high for one clock, in which the second product is taken.
        return Mux(root.done, super()._factor(root), self._word(0))

    def _square(self, m, product):
        square = product[: 2 * len(self._word(0))]
        m.d.sync += [
            self._quarter.eq(shift_floor(square, self.design.quarter_shift)),
            self._half.eq(shift_round_half_up(square, self.design.half_shift)),
        ]

    def _radicand(self, beyond):
        return super()._radicand(beyond) + self._quarter

    def _correction(self, product):
        return super()._correction(product) - self._half
