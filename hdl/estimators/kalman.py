"""All-integrator Kalman filter with steady-state gains."""

from amaranth.hdl import Module, Mux, Signal, signed

from hardwall.model.estimators.kalman import Design

from ..arithmetic.fixed import saturate, shape, shift_floor, shift_round_half_up
from .acceleration import AcceleratedBlock


class Estimator(AcceleratedBlock):
    """Position, velocity and acceleration tracked with constant gains, one sample at a time.

    Equation, per sample, in counts and sample periods:

        v <- v + a,  x <- x + v - a / 2
        r  = count - x
        x <- x + K_x r,  v <- v + K_v r,  a <- a + K_a r        a = 0 while K_a = 0

    The velocity is v, the acceleration a. Start: at the first sample, and with `restart`, x = count, v = 0 and a = 0.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with `valid`. One multiplier makes
    the three products.

    Rounding and overflow: r, the products and narrowed sums round down, the outputs half up. The difference of counts,
    x - count, v and a saturate, with flags. x - count, v and a saturate only with gains that belong to no noise model.
    The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.kalman.Design
        Formats; its module derives them.

    Source: Belanger, Dobrovolny, Helmy, Zhang, International Journal of Robotics Research 17 (1998), 1225.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        velocity, v_max = design.velocity, design.velocity.max << (design.v.f - design.velocity.f)

        moved = Signal.like(self.seen.count)
        d = Signal(range(-design.step_max, design.step_max + 1))
        # With a gain just below 2, lead may change to its own negative and slightly beyond.
        lead = Signal(signed(design.lead.width + 1))
        v = Signal(shape(design.v))
        a = Signal(shape(design.a))
        predicted = Signal(signed(max(len(v), len(a) - design.a.f + design.v.f) + 1))
        twice_moved = Signal(signed(len(predicted) + 1))
        behind = Signal(signed(max(len(lead), len(d) + design.lead.f) + 1))
        distance = Signal(signed(max(len(behind), len(twice_moved) - (design.v.f - design.lead.f + 1)) + 1))

        operand = Signal(signed(design.operand.width + 1))
        gain = Signal(max(word.format.width for word in design.words))
        product = Signal(signed(len(operand) + len(gain)))
        term = Signal(signed(len(product) - min(0, *design.shifts)))
        total = Signal(signed(max(len(term), len(predicted), len(a)) + 1))

        # With two integrators there is no third state. The word is a sample's from the clock after its strobe on.
        kept = Signal.like(a)
        m.d.comb += kept.eq(Mux(self.kalman_acceleration == 0, 0, a))

        def scaled(shift):
            return term.eq(shift_floor(product, shift))

        limited = saturate(moved, -design.step_max, design.step_max)
        held = saturate(distance, -design.lead.max, design.lead.max)
        held_v = saturate(total, -v_max, v_max)
        held_a = saturate(total, -design.a.max, design.a.max)
        for_x, for_v, for_a = design.shifts

        m.d.sync += [self.valid.eq(0), product.eq(operand * gain)]
        # Every state takes one clock. A product takes a clock and its shift another, while the next product follows.
        sequence = {
            "DIFFERENCE": [
                d.eq(limited),
                self.saturated[0].eq(limited != moved),
                predicted.eq(v + (kept >> (design.a.f - design.v.f))),
                a.eq(kept),
            ],
            "PREDICT": [behind.eq(lead - (d << design.lead.f)), twice_moved.eq(v + predicted)],
            "DISTANCE": [distance.eq(behind + (twice_moved >> (design.v.f - design.lead.f + 1)))],
            "LIMIT LEAD": [lead.eq(held), self.saturated[1].eq(held != distance)],
            "INNOVATION": [
                operand.eq(-lead >> (design.lead.f - design.operand.f)),
                gain.eq(self.kalman_velocity),
            ],
            "VELOCITY": [gain.eq(self.kalman_acceleration)],
            "ACCELERATION": [scaled(for_v), gain.eq(self.kalman_position)],
            "CORRECT VELOCITY": [total.eq(predicted + term), scaled(for_a)],
            "LIMIT VELOCITY": [
                v.eq(held_v),
                self.saturated[2].eq(held_v != total),
                total.eq(a + term),
                scaled(for_x),
            ],
            "LIMIT ACCELERATION": [
                a.eq(held_a),
                self.saturated[2].eq(self.saturated[2] | (held_a != total)),
                lead.eq(lead + term),
            ],
            "OUTPUT": [
                self.velocity.eq(shift_round_half_up(v, design.v.f - velocity.f)),
                self.acceleration.eq(shift_round_half_up(a, design.a.f - design.acceleration.f)),
                self.valid.eq(1),
            ],
        }

        def forget(fresh):
            with m.If(fresh):
                m.d.sync += [lead.eq(0), v.eq(0), a.eq(0)]

        self._step_by_step(m, moved, forget, sequence)
        return m
