"""Tracking loop: a type-2 phase-locked loop on the count."""

from amaranth.hdl import Module, Signal, signed

from hardwall.model.estimators.tracking_loop import Design

from ..arithmetic.fixed import saturate, shape, shift_round_half_up
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """Position and velocity that follow the count, both poles at one bandwidth, one sample at a time.

    Equation, per sample, in counts and sample periods, with h = 2 pi bandwidth / sample rate:

        x <- x + v
        e  = count - x
        x <- x + 2 h e,  v <- v + h^2 e

    The velocity is v. Start: at the first sample, and with `restart`, x = count and v = 0.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with `valid`. One multiplier makes
    both products: h e, and h times that.

    Rounding and overflow: v where it is added to x, e and the products round down, the velocity half up. The difference
    of counts, x - count and v saturate, with flags. x - count saturates only with a bandwidth below the design's range,
    v only after a change of the bandwidth. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.tracking_loop.Design
        Formats; its module derives them.

    Source: the loop of servo drives, as in the firmware of ODrive and moteus; see the model's module.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        velocity, v_max = design.velocity, design.velocity.max << (design.v.f - design.velocity.f)
        less = design.lead.f - design.operand.f

        moved = Signal.like(self.seen.count)
        d = Signal(range(-design.step_max, design.step_max + 1))
        # The correction is opposite to the lead, but has steps of its own.
        lead = Signal(signed(design.lead.width + 1))
        v = Signal(shape(design.v))
        advanced = v >> (design.v.f - design.lead.f)
        ahead = Signal(signed(max(len(lead), len(advanced)) + 1))
        distance = Signal(signed(max(len(ahead), len(d) + design.lead.f) + 1))

        # It takes the lead, and then the first product, which has the lead's fraction bits.
        operand = Signal(shape(design.operand))
        product = Signal(signed(len(operand) + len(self.tracking_loop_bandwidth)))
        for_x, for_v = design.shifts
        pull, push = product >> for_x, product >> for_v
        total = Signal(signed(max(len(v), len(push)) + 1))

        limited = saturate(moved, -design.step_max, design.step_max)
        held = saturate(distance, -design.lead.max, design.lead.max)
        held_v = saturate(total, -v_max, v_max)

        m.d.sync += [self.valid.eq(0), product.eq(operand * self.tracking_loop_bandwidth)]
        # Every state takes one clock, and so does a product.
        sequence = {
            "DIFFERENCE": [d.eq(limited), self.saturated[0].eq(limited != moved), ahead.eq(lead + advanced)],
            "DISTANCE": [distance.eq(ahead - (d << design.lead.f))],
            "LIMIT LEAD": [lead.eq(held), operand.eq(held >> less), self.saturated[1].eq(held != distance)],
            "FIRST PRODUCT": [],
            "CORRECT POSITION": [lead.eq(lead - (pull << 1)), operand.eq(pull)],
            "SECOND PRODUCT": [],
            "CORRECT VELOCITY": [total.eq(v - push)],
            "LIMIT VELOCITY": [v.eq(held_v), self.saturated[2].eq(held_v != total)],
            "OUTPUT": [self.velocity.eq(shift_round_half_up(v, design.v.f - velocity.f)), self.valid.eq(1)],
        }

        def forget(fresh):
            with m.If(fresh):
                m.d.sync += [lead.eq(0), v.eq(0)]

        self._step_by_step(m, moved, forget, sequence)
        return m
