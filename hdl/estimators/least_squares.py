"""The velocity of the polynomial that fits past counts best: a FIR filter of counts."""

from amaranth.hdl import Array, Const, Module, Signal, signed

from hardwall.model.estimators.history import LATENCY as HISTORY_LATENCY
from hardwall.model.estimators.least_squares import Design

from ..arithmetic.signed_divide import SignedDivide
from .estimate import EstimatorBlock
from .history import History

FIRST = HISTORY_LATENCY + 1
"""Clock at which the change over the first spacing is ready."""


class Estimator(EstimatorBlock):
    """The slope, at the newest count, of the least-squares polynomial through counts at equal spacings.

    Equation, with D_i the change over i spacings of T samples, and c_i constants of the design:

        velocity = (c_1 D_1 + ... + c_n D_n) / T

    Before the first sample the axis counts as having stood at its position, so velocity is 0 at the first sample.

    Latency: `latency` clocks from `strobe` to `valid`: one a difference, and the clocks of the division; the next
    `strobe` may come with `valid`. One multiplier makes the products.

    Rounding and overflow: the sum is exact; the velocity rounds toward zero. The change of a sample is limited, with a
    flag; the velocity then always fits. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.least_squares.Design
        Formats; its module derives them.

    Source: Brown, Schneider, Mulligan, IEEE Transactions on Industrial Electronics 1992.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        m.submodules.history = history = History(design.history)
        total = Signal(signed(design.largest_sum.bit_length() + 1))
        m.submodules.division = division = SignedDivide(
            len(total), design.divisor.bit_length(), design.fraction, design.velocity.width - 1
        )
        # A change meets its coefficient, which is looked up a clock before; else the coefficient is 0.
        widest = max(abs(value) for value in design.coefficients).bit_length() + 1
        constants = Array(Const(value, signed(widest)) for value in [0] * (FIRST - 1) + design.coefficients + [0])
        last = FIRST + design.taps
        clock, age = Signal(range(last + 1)), Signal.like(history.age, init=design.spacing)
        coefficient, product = Signal(signed(widest)), Signal(signed(widest + len(history.change)))
        m.d.comb += [
            history.strobe.eq(self.strobe),
            history.restart.eq(self.restart),
            history.count.eq(self.seen.count),
            history.age.eq(age),
            division.dividend.eq(total),
            division.divisor.eq(design.divisor),
        ]
        m.d.sync += [
            coefficient.eq(constants[clock]),
            product.eq(history.change * coefficient),
            total.eq(total + product),
            division.start.eq(clock == last),
            self.valid.eq(division.done),
        ]
        with m.If(clock != 0):
            m.d.sync += clock.eq(clock + 1)
        # Every clock reads the next change, from the clock at which the newest position is ready for the first.
        with m.If(clock >= FIRST - 2):
            m.d.sync += age.eq(age + design.spacing)
        with m.If((clock == 0) & self.strobe):
            m.d.sync += [clock.eq(1), total.eq(0)]
        with m.Elif(clock == last):
            m.d.sync += [clock.eq(0), age.eq(design.spacing)]
        with m.If(division.done):
            m.d.sync += self.saturated.eq(history.limited)
            with m.If(history.stored):
                m.d.sync += self.velocity.eq(division.quotient)
        return m
