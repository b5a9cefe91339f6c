"""Levant's differentiator with an implicit sign and an explicit square root."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed

from hardwall.model.levant_semi_implicit import Design

from . import EstimatorBlock
from .fixed import shape, shift_floor, shift_round_half_up
from .levant import arrive, moved_by
from .sqrt import Sqrt


class Estimator(EstimatorBlock):
    """Levant's differentiator without numerical chatter, one sample at a time.

    Equation, per sample, in counts and sample periods:

        b  = x + u1 - count
        u1 <- u1 - sign(b) near,    near = min(|b|, alpha)
        u  = u1 - sign(b) g,        g = min(lambda sqrt(beyond), beyond),    beyond = |b| - near
        x  <- x + u

    Start: at the first sample, and with `restart`, x = count and u1 = 0, so u = 0: no false transient.

    Latency: `latency` clocks from `strobe` to `valid`, most of them the root's; the next `strobe` may come with
    `valid`.

    Rounding and overflow: the root rounds down and half of its LSB is added back; g rounds half up, and the rest is
    exact; b, u and u1 saturate, with flags. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.levant_semi_implicit.Design
        Formats; its module derives them.

    Source: Acary, Brogliato, Orlov 2012; Michel et al. 2021; the module of the design says what is our own.
    """

    def __init__(self, design: Design, kind: type = Design):
        super().__init__(design, kind)

    # What those of the family that project do in their own way.

    def _word(self, number: int) -> Value:
        """Return a run-time word: 0 for lambda, 1 for alpha, 2 for the output."""
        return getattr(self, self.design.words[number].name)

    def _alpha(self) -> Value:
        """Return alpha, as from state BAND on."""
        return self._word(1)

    def _adapt(self, m, fresh, e, size) -> str:
        """Add states between MAGNITUDE and BAND; return the name of the first of them, or BAND."""
        return "BAND"

    def _factor(self, root) -> Value:
        """Return what lambda is multiplied by, in states MAGNITUDE and PRODUCT."""
        return Cat(Const(1, 1), root.root)

    def _square(self, m, product) -> None:
        """Use the product of state MAGNITUDE, in state BAND."""

    def _radicand(self, beyond) -> Value:
        """Return what the root is taken of, in state ROOT."""
        return shift_floor(beyond, self.design.velocity.f - self.design.radicand.f)

    def _correction(self, product) -> Value:
        """Return g before its limits, from the product of state PRODUCT."""
        return shift_round_half_up(product, self.design.product - self.design.velocity.f)

    def elaborate(self, platform):
        m = Module()
        velocity, error = self.design.velocity, self.design.error

        lead = Signal(signed(max(error.width, velocity.width) + 1))
        u1 = Signal(shape(velocity))

        # One clock a step; the root takes its own time between ROOT and PRODUCT.
        e = Signal(shape(error))
        size = Signal(error.width - 1)
        near = Signal(min(self.design.alpha.width, len(size)))
        beyond = Signal(len(size))
        positive, negative = Signal(), Signal()
        next_u1, far_u1 = Signal.like(u1), Signal()
        u, correction, rest = Signal.like(u1), Signal.like(size), Signal.like(size)

        m.submodules.root = root = Sqrt(self.design.radicand.width)
        factor = self._factor(root)
        product = Signal(len(self._word(0)) + len(factor))
        full = Signal.like(self._correction(product))
        below = full[-1] if full.shape().signed else Const(0)
        m.d.comb += root.radicand.eq(self._radicand(beyond))

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            first = arrive(m, self, lead, u1, e, "MAGNITUDE")
            after = self._adapt(m, first, e, size)
            with m.State("MAGNITUDE"):
                m.d.sync += [
                    size.eq(Mux(e < 0, -e, e)),
                    positive.eq(e > 0),
                    negative.eq(e < 0),
                    product.eq(self._word(0) * factor),
                ]
                m.next = after
            with m.State("BAND"):
                within = size < self._alpha()
                m.d.sync += [
                    near.eq(Mux(within, size, self._alpha())),
                    beyond.eq(Mux(within, 0, size - self._alpha())),
                ]
                self._square(m, product)
                m.next = "ROOT"
            with m.State("ROOT"):
                m.d.comb += root.start.eq(1)
                held, far = moved_by(u1, near, negative, positive, velocity.max)
                m.d.sync += [next_u1.eq(held), far_u1.eq(far)]
                m.next = "PRODUCT"
            with m.State("PRODUCT"), m.If(root.done):
                m.d.sync += product.eq(self._word(0) * factor)
                m.next = "CORRECTION"
            with m.State("CORRECTION"):
                m.d.sync += full.eq(self._correction(product))
                m.next = "LIMIT"
            with m.State("LIMIT"):
                m.d.sync += correction.eq(Mux(below, 0, Mux(full > beyond, beyond, full)))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                held, far = moved_by(next_u1, correction, negative, positive, velocity.max)
                m.d.sync += [u.eq(held), rest.eq(beyond - correction), self.saturated[1].eq(far | far_u1)]
                m.next = "UPDATE"
            with m.State("UPDATE"):
                m.d.sync += [
                    lead.eq(Mux(negative, next_u1 - rest, next_u1 + rest)),
                    u1.eq(next_u1),
                    self.velocity.eq(Mux(self._word(2), next_u1, u)),
                    self.valid.eq(1),
                ]
                m.next = "SAMPLE"
        return m
