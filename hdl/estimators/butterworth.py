"""The finite difference behind a second-order Butterworth low pass."""

from amaranth.hdl import Module, Signal, signed

from hardwall.model.estimators.butterworth import Design

from ..arithmetic.fixed import saturate, shape, shift_floor, shift_round_half_up
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """FDM and a second-order Butterworth low pass, one sample at a time.

    Equation, per sample, in counts and sample periods, with d the difference of the last two counts:

        x  = (d + 2 d' + d'') / 4
        w <- w + gamma (x - y) - beta w
        y <- y + gamma w

    The velocity is y. Start: at the first sample, and with `restart`, d and all states are 0.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with `valid`. One multiplier makes
    the three products.

    Rounding and overflow: operands and products round down, the velocity half up. d, w and y saturate, with flags. w
    and y saturate only while the coefficients belong to no single cutoff, or just after a change of cutoff. A third
    flag is up while the coefficients are unstable. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.butterworth.Design
        Formats; its module derives them.

    Source: Chawda, Celik, O'Malley, World Haptics 2011, "FDM" with a Butterworth filter.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        velocity, state = design.velocity, design.state
        drop = state.f - design.operand.f
        state_max = velocity.max << (state.f - velocity.f)

        moved = Signal.like(self.seen.count)
        d, d1, d2 = (Signal(range(-design.step_max, design.step_max + 1), name=name) for name in ("d", "d1", "d2"))
        four_x = Signal(signed(len(d) + 2))
        w, y = (Signal(shape(state), name=name) for name in "wy")

        operand = Signal(shape(design.operand))
        coefficient = Signal(shape(design.coefficient))
        product = Signal(signed(len(operand) + len(coefficient)))
        shifts = [design.product_shift(exponent) for exponent in range(design.exponent_max + 1)]
        term = Signal(signed(len(product) - min(shifts)))
        total = Signal(signed(max(len(term), len(w)) + 2))

        scaled = Signal.like(term)
        with m.Switch(self.butterworth_exponent):
            for exponent, shift in enumerate(shifts[:-1]):
                with m.Case(exponent):
                    m.d.comb += scaled.eq(shift_floor(product, shift))
            with m.Default():
                m.d.comb += scaled.eq(shift_floor(product, shifts[-1]))
        one, frequency, twice = 1 << design.coefficient.f, self.butterworth_frequency, self.butterworth_damping << 1
        unstable = (twice + frequency >= 4 * one) | (twice + (frequency << 1) + frequency >= 6 * one)
        if design.exponent_max:
            unstable &= self.butterworth_exponent == 0
        held = saturate(total, -state_max, state_max)
        limited = saturate(moved, -design.step_max, design.step_max)

        m.d.sync += [self.valid.eq(0), product.eq(operand * coefficient), term.eq(scaled)]
        # Every state takes one clock. A product takes a clock and its shift another, while the next product follows.
        sequence = {
            "DIFFERENCE": [d.eq(limited), self.saturated[0].eq(limited != moved)],
            "INPUT": [four_x.eq(d + (d1 << 1) + d2), d1.eq(d), d2.eq(d1)],
            "ERROR": [
                operand.eq((four_x << (design.operand.f - 2)) - (y >> drop)),
                coefficient.eq(self.butterworth_frequency),
            ],
            "PUSH": [operand.eq(w >> drop), coefficient.eq(self.butterworth_damping)],
            "DRAG": [],
            "ADD PUSH": [total.eq(w + term)],
            "SUBTRACT DRAG": [total.eq(total - term)],
            "LIMIT W": [w.eq(held), self.saturated[1].eq(held != total)],
            "OPERAND": [operand.eq(w >> drop), coefficient.eq(self.butterworth_frequency)],
            "MOVE": [],
            "SHIFT": [],
            "ADD MOVE": [total.eq(y + term)],
            "LIMIT Y": [y.eq(held), self.saturated[1].eq(self.saturated[1] | (held != total))],
            "OUTPUT": [
                self.velocity.eq(shift_round_half_up(y, state.f - velocity.f)),
                self.saturated[2].eq(unstable),
                self.valid.eq(1),
            ],
        }

        def forget(fresh):
            with m.If(fresh):
                m.d.sync += [d1.eq(0), d2.eq(0), w.eq(0), y.eq(0)]

        self._step_by_step(m, moved, forget, sequence)
        return m
