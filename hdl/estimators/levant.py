"""Levant's first-order sliding-mode differentiator."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed

from hardwall.model.arithmetic.sqrt import digits as sqrt_digits
from hardwall.model.estimators.levant import Design

from ..arithmetic.fixed import choice, fits, fitted, negated, shape, shift_floor
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
    two bits of the root; lambda is multiplied meanwhile. The next `strobe` may come with `valid`.

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
        e, rooting, by_u1 = distance_of(design), Signal(), Signal()
        next_u, far_u = self._corrected(m, e, u1, root, rooting)

        m.d.comb += self.velocity.eq(Mux(by_u1, u1, u))
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            # Since the last error, the tracked position has moved by u.
            first = arrive(m, self, e, e + u, velocity.f, "PREPARE")
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
                        by_u1.eq(self.levant_output),
                        self.saturated[1].eq(far_u | ~fits(far_u1, velocity.width)),
                        self.valid.eq(1),
                    ]
                    with m.If(first):
                        m.d.sync += [u.eq(0), u1.eq(0)]
                    m.next = "SAMPLE"
        return m

    def _corrected(self, m, e, u1, root, rooting):
        """Return u1 plus `step` (2 root + 1) within u's format, and whether it was beyond, in the root's last clock.

        No product waits for the root. Its digits come high ones first; at every clock the sum moves up by a digit's
        place and takes in two bits of u1 from below; then it adds the digit's multiple of the step.
        """
        design, velocity = self.design, self.design.velocity
        digits = sqrt_digits(design.radicand.width)
        # The product of the step and the root has `finer` bits more than u, if `coarser` zeros are added.
        finer = max(design.product - velocity.f, 1)
        coarser = finer - (design.product - velocity.f)
        step = Signal(signed(design.lambda_.width + coarser + 1))
        triple = Signal(signed(len(step) + 2))
        begun = Signal(signed(max(velocity.width + finer, len(step) + 2 * digits + 1) + 1))
        low, total, still = Signal(2 * digits), Signal(signed(len(begun) - 1)), Signal()

        # The step has the other sign than e. A complement is one less than the negative. So must be the half LSB of u
        # that is added for the rounding, because the product is rounded half up.
        lambda_ = Cat(Const(0, coarser), self.levant_lambda, Const(0, 1)).as_signed()
        inverse = ~e[-1]
        against, fourfold = _inverted(lambda_, inverse), _inverted(lambda_ << 2, inverse)
        m.d.comb += begun.eq(Cat(Const(1 << (finer - 1), finer), u1).as_signed() + against)
        with m.If(root.start):
            m.d.sync += [
                step.eq(against + inverse),
                # Three times a number is four times it, plus its complement, plus one.
                triple.eq(_plus_one(fourfold, _inverted(lambda_, e[-1]))),
                low.eq(begun[1 : len(low) + 1]),
                total.eq(begun >> len(low) + 1),
                still.eq(e == 0),
            ]

        shifted = Cat(low[-2:], total)[: len(total)].as_signed()
        sums = [Signal.like(total, name=f"sum_{number}") for number in range(4)]
        m.d.comb += [each.eq(shifted + more) for each, more in zip(sums, (0, step, step << 1, triple), strict=True)]
        with m.If(rooting):
            m.d.sync += [low.eq(low << 2), total.eq(choice(root.reached, sums))]

        # Whether the last sum fits is found for every digit before the digit is. An error of 0 has no sign.
        last = [each >> (finer - 1) for each in sums]
        last[0] = Mux(still, u1, last[0])
        beyond = choice(root.reached, [~fits(each, velocity.width) for each in last])
        limit = Mux(choice(root.reached, [each[-1] for each in last]), velocity.min, velocity.max)
        return Mux(beyond, limit, choice(root.reached, last)[: velocity.width].as_signed()), beyond


def _inverted(value, inverse):
    """Return a signed value, or its complement where `inverse` is high."""
    return value ^ inverse.replicate(len(value)).as_signed()


def _plus_one(first, second):
    """Return the sum of two signed values and one, in one chain of carries."""
    return (Cat(Const(1, 1), first).as_signed() + Cat(Const(1, 1), second).as_signed()) >> 1


def distance_of(design):
    """Return a register for the distance of the tracked position from the count, in the velocity's fraction."""
    led = max(design.error.width, design.velocity.width) + 1
    return Signal(signed(max(led, design.count_width + design.velocity.f) + 1))


def arrive(m, block, distance, lead, fraction, then):
    """Add the state of the strobe, with which the whole family begins: it takes the distance; state `then` follows.

    The distance is 0 at the first sample; the returned signal says, after the strobe, whether it is that one, and the
    block starts from zero then. `lead` is the distance from the last count; both have `fraction` bits of a count.
    """
    running, first = Signal(), Signal()
    last, moved = Signal.like(block.seen.count), Signal.like(block.seen.count)
    fresh = block.restart | ~running
    # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
    m.d.comb += moved.eq(block.seen.count - last)
    with m.State("SAMPLE"), m.If(block.strobe):
        m.d.sync += [
            distance.eq(Mux(fresh, 0, lead - (moved << fraction))),
            last.eq(block.seen.count),
            running.eq(1),
            first.eq(fresh),
        ]
        m.next = then
    return first


def magnitude(distance, error):
    """Return the magnitude of a distance, within the format of the error, and whether it was beyond."""
    size = negated(distance, distance[-1])
    # Within the width of the error, only the least number has a magnitude that is too large.
    over = ~fits(distance, error.width) | (distance[-1] & (distance[: error.width - 1] == 0))
    return Mux(over, error.max, size[: error.width - 1]), over
