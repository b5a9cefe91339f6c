"""Levant's first-order sliding-mode differentiator."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed

from hardwall.model.estimators.levant import Design

from ..arithmetic.fixed import saturate, shape, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import Sqrt
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """Levant's differentiator, explicit Euler, one sample at a time.

    Equation, per sample, in counts and sample periods:

        e  = x - count
        u  = u1 - lambda sqrt(|e|) sign(e)
        x  <- x + u
        u1 <- u1 - alpha sign(e)

    Start: at the first sample, and with `restart`, x = count and u1 = 0, so u = 0: a start from rest has no transient.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the root; the next `strobe` may come with
    `valid`.

    Rounding and overflow: the root rounds down and half of its LSB is added back; u rounds half up; e, u and u1
    saturate, with flags. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.levant.Design
        Formats; its module derives them.

    Source: Chawda, Celik, O'Malley, World Haptics 2011, the first-order differentiator; Levant 1998.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        velocity, error = design.velocity, design.error

        lead = Signal(signed(max(error.width, velocity.width) + 1))
        u1 = Signal(shape(velocity))

        # A step takes one clock; state PRODUCT waits for the root.
        e = Signal(shape(error))
        product = Signal(design.lambda_.width + design.root.width + 1)
        correction = Signal(max(design.lambda_.width + design.root.width + 2 - (design.product - velocity.f), 1))
        u = Signal(shape(velocity))
        next_u1 = Signal(shape(velocity))
        positive, negative = Signal(), Signal()

        m.submodules.root = root = Sqrt(design.radicand.width)
        m.d.comb += root.radicand.eq(shift_floor(Mux(e < 0, -e, e), velocity.f - design.radicand.f))

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            arrive(m, self, lead, u1, e, "ROOT")
            with m.State("ROOT"):
                m.d.comb += root.start.eq(1)
                m.d.sync += [positive.eq(e > 0), negative.eq(e < 0)]
                m.next = "PRODUCT"
            with m.State("PRODUCT"), m.If(root.done):
                m.d.sync += product.eq(self.levant_lambda * Cat(Const(1, 1), root.root))
                m.next = "CORRECTION"
            with m.State("CORRECTION"):
                m.d.sync += correction.eq(shift_round_half_up(product, design.product - velocity.f))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                held_u, far_u = _moved(u1, correction, negative, positive, velocity.max)
                held_u1, far_u1 = _moved(u1, self.levant_alpha, negative, positive, velocity.max)
                m.d.sync += [u.eq(held_u), next_u1.eq(held_u1), self.saturated[1].eq(far_u | far_u1)]
                m.next = "UPDATE"
            with m.State("UPDATE"):
                m.d.sync += [
                    lead.eq(e + u),
                    u1.eq(next_u1),
                    self.velocity.eq(Mux(self.levant_output, next_u1, u)),
                    self.valid.eq(1),
                ]
                m.next = "SAMPLE"
        return m


def arrive(m, block, lead, u1, e, then):
    """Add the states from the strobe to the error e, with which the whole family begins; state `then` follows.

    The first sample clears `lead` and `u1`; the returned signal says, after the strobe, whether it is the first sample.
    """
    velocity, error = block.design.velocity, block.design.error
    running = Signal()
    last, moved = Signal.like(block.seen.count), Signal.like(block.seen.count)
    distance = Signal(signed(max(len(lead), len(moved) + velocity.f) + 1))
    first = Signal()
    fresh = block.restart | ~running
    with m.State("SAMPLE"), m.If(block.strobe):
        # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
        m.d.sync += [
            moved.eq(Mux(fresh, 0, (block.seen.count - last)[: len(moved)].as_signed())),
            lead.eq(Mux(fresh, 0, lead)),
            u1.eq(Mux(fresh, 0, u1)),
            last.eq(block.seen.count),
            running.eq(1),
            first.eq(fresh),
        ]
        m.next = "DISTANCE"
    with m.State("DISTANCE"):
        m.d.sync += distance.eq(lead - (moved << velocity.f))
        m.next = "ERROR"
    with m.State("ERROR"):
        held = saturate(distance, -error.max, error.max)
        m.d.sync += [e.eq(held), block.saturated[0].eq(held != distance)]
        m.next = then
    return first


def _moved(value, step, up, down, most):
    """Return `value` plus or minus `step`, or unchanged, held within +-`most`; and whether it was limited.

    Sum and difference are computed in parallel; either needs a limit on one side only, since `value` is within both.
    """
    above, below = value + step > most, value - step < -most
    higher, lower = Mux(above, most, value + step), Mux(below, -most, value - step)
    return Mux(up, higher, Mux(down, lower, value)), up & above | down & below
