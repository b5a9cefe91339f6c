"""Levant's first-order sliding-mode differentiator."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed

from hardwall.model.arithmetic.sqrt import digits as sqrt_digits
from hardwall.model.estimators.levant import Design

from ..arithmetic.fixed import fits, fitted, negated, shape, shift_floor
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

    Latency: `latency` clocks from `strobe` to `valid`: one for the distance, one for its magnitude, and one for every
    two bits of the root, beside which lambda is multiplied; the next `strobe` may come with `valid`.

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
        design = self.design
        velocity, error = design.velocity, design.error
        u, u1 = Signal(shape(velocity)), Signal(shape(velocity))
        relay = Signal(signed(len(self.levant_alpha) + 1))
        m.submodules.square_root = root = Sqrt(design.radicand.width)

        # The distance from the count, and from state PREPARE on the error.
        e, rooting = distance_of(design), Signal()
        next_u, far_u = self._corrected(m, e, u1, root, rooting)

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            # Since the last error, the tracked position has moved by u.
            arrive(m, self, e, e + u, u1, "PREPARE")
            with m.State("PREPARE"):
                size, over = magnitude(e, error)
                m.d.comb += [root.start.eq(1), root.radicand.eq(shift_floor(size, velocity.f - design.radicand.f))]
                m.d.sync += [
                    e.eq(Mux(over, Mux(e[-1], -error.max, error.max), e)),
                    self.saturated[0].eq(over),
                    relay.eq(Mux(e == 0, 0, negated(self.levant_alpha, ~e[-1]))),
                ]
                m.next = "ROOT"
            with m.State("ROOT"):
                m.d.comb += rooting.eq(1)
                far_u1 = u1 + relay
                next_u1 = fitted(far_u1, velocity.width)
                with m.If(root.last):
                    m.d.sync += [
                        u.eq(next_u),
                        u1.eq(next_u1),
                        self.velocity.eq(Mux(self.levant_output, next_u1, next_u)),
                        self.saturated[1].eq(far_u | ~fits(far_u1, velocity.width)),
                        self.valid.eq(1),
                    ]
                    m.next = "SAMPLE"
        return m

    def _corrected(self, m, e, u1, root, rooting):
        """Return u1 plus `step` (2 root + 1) within u's format, and whether it was beyond, in the root's last clock.

        No product waits for the root. Its digits come high ones first; at every clock the sum so far goes up by a digit's
        place, takes in two bits of u1 from below, and adds the digit's multiple of the step.
        """
        design, velocity = self.design, self.design.velocity
        digits = sqrt_digits(design.radicand.width)
        # The product of the step and the root has `finer` bits more than u, or `coarser` bits less.
        finer, coarser = max(design.product - velocity.f, 0), max(velocity.f - design.product, 0)
        step = Signal(signed(design.lambda_.width + coarser + 1))
        triple = Signal(signed(len(step) + 2))
        whole = Signal(signed(max(velocity.width + finer, len(step) + 2 * digits + 1) + 1))
        low, total = Signal(2 * digits + 1), Signal(signed(len(whole) - 1))

        # The step has the other sign than e. Half an LSB of u is added to round half up the product, not the sum.
        against = negated(self.levant_lambda << coarser, ~e[-1])
        half = Mux(e[-1], 1 << finer >> 1, (1 << finer >> 1) - 1)[:finer]
        m.d.comb += whole.eq(Cat(half, u1).as_signed() + Mux(e == 0, 0, against))

        shifted = Cat(low[-2:], total)[: len(total)].as_signed()
        sums = [Signal.like(total, name=f"sum_{number}") for number in range(4)]
        m.d.comb += [each.eq(shifted + more) for each, more in zip(sums, (0, step, step << 1, triple), strict=True)]
        chosen = _choice(root.digit, sums)
        with m.If(root.start):
            m.d.sync += [step.eq(against), triple.eq(against + (against << 1)), Cat(low, total).eq(whole)]
        with m.If(rooting):
            m.d.sync += [low.eq(low << 2), total.eq(chosen)]

        # Whether the last sum fits is found for every digit before the digit is.
        whole_sums = [Cat(low[-3], each).as_signed() >> finer for each in sums]
        far = ~_choice(root.digit, [fits(each, velocity.width) for each in whole_sums])
        limit = Mux(chosen[-1], velocity.min, velocity.max)
        return Mux(far, limit, _choice(root.digit, whole_sums)[: velocity.width].as_signed()), far


def distance_of(design):
    """Return a register for the distance of the tracked position from the count, in the velocity's fraction."""
    led = max(design.error.width, design.velocity.width) + 1
    return Signal(signed(max(led, design.count_width + design.velocity.f) + 1))


def arrive(m, block, distance, lead, u1, then):
    """Add the state of the strobe, with which the whole family begins: it takes the distance; state `then` follows.

    The first sample clears `distance` and `u1`; the returned signal says, after the strobe, whether it is the first one.
    `lead` is the distance from the last count.
    """
    running, first = Signal(), Signal()
    last, moved = Signal.like(block.seen.count), Signal.like(block.seen.count)
    fresh = block.restart | ~running
    # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
    m.d.comb += moved.eq(block.seen.count - last)
    with m.State("SAMPLE"), m.If(block.strobe):
        m.d.sync += [
            distance.eq(Mux(fresh, 0, lead - (moved << block.design.velocity.f))),
            u1.eq(Mux(fresh, 0, u1)),
            last.eq(block.seen.count),
            running.eq(1),
            first.eq(fresh),
        ]
        m.next = then
    return first


def magnitude(distance, error):
    """Return the magnitude of a distance, within the format of the error, and whether it was beyond."""
    size = negated(distance, distance[-1])
    over = size[error.width - 1 :].any()
    return Mux(over, error.max, size[: error.width - 1]), over


def _choice(digit, values):
    """Return the value at `digit`, 0 to 3."""
    return Mux(digit[1], Mux(digit[0], values[3], values[2]), Mux(digit[0], values[1], values[0]))
