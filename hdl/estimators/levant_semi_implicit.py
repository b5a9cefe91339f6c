"""Levant's differentiator with an implicit sign and an explicit square root."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed

from hardwall.model.estimators.levant_semi_implicit import Design

from ..arithmetic.fixed import saturate, shape, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import Sqrt
from ..wires import port
from .estimate import EstimatorBlock
from .levant import arrive, distance_of, magnitude


class Estimator(EstimatorBlock):
    """Levant's differentiator without numerical chatter, one sample at a time.

    Equation, per sample, in counts and sample periods:

        b  = x + u1 - count
        u1 <- u1 - sign(b) near,    near = min(|b|, alpha)
        u  = u1 - sign(b) g,        g = min(lambda sqrt(beyond), beyond),    beyond = |b| - near
        x  <- x + u

    Start: at the first sample, and with `restart`, x = count and u1 = 0, so u = 0: a start from rest has no transient.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the root; the next `strobe` may come with
    `valid`.

    Rounding and overflow: the root rounds down and half of its LSB is added back; g rounds half up, and everything else
    is exact; b, u and u1 saturate, with flags. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_semi_implicit.Design
        Formats; its module derives them.

    Source: Acary, Brogliato, Orlov 2012; Michel et al. 2021; the design's module says what is this project's own.
    """

    design_class = Design

    # Subclasses, which share the projection, override these methods.

    def _word(self, number: int) -> Value:
        """Return a run-time word: 0 for lambda, 1 for alpha, 2 for the output."""
        return port(self, self.design.words[number].name)

    def _factor(self, root) -> Value:
        """Return the factor of lambda in states MAGNITUDE and PRODUCT."""
        return Cat(Const(1, 1), root.root)

    def _square(self, m, product) -> None:
        """Use the product of state MAGNITUDE, in state BAND."""

    def _radicand(self, beyond) -> Value:
        """Return the radicand of the root, in state ROOT."""
        return shift_floor(beyond, self.design.velocity.f - self.design.radicand.f)

    def _correction(self, product) -> Value:
        """Return g before its limits, from the product of state PRODUCT."""
        return shift_round_half_up(product, self.design.product - self.design.velocity.f)

    def elaborate(self, platform):
        m = Module()
        velocity, error = self.design.velocity, self.design.error
        most, alpha = velocity.max, self._word(1)

        lead = Signal(signed(max(error.width, velocity.width) + 1))
        u1 = Signal(shape(velocity))

        distance, negative = distance_of(self.design), Signal()
        size, near, beyond, rest = (Signal(error.width - 1) for _ in range(4))
        difference = Signal(signed(max(len(size), len(alpha)) + 1))
        far_u1, far_u = (Signal(signed(max(len(size), len(u1)) + 2)) for _ in range(2))
        next_u1 = Signal.like(u1)
        # `near` is ready long before u1 is used.
        m.d.sync += [far_u1.eq(Mux(negative, u1 + near, u1 - near)), next_u1.eq(saturate(far_u1, -most, most))]

        m.submodules.root = root = Sqrt(self.design.radicand.width)
        factor = self._factor(root)
        product = Signal(len(self._word(0)) + len(factor))

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            first = arrive(m, self, distance, lead, velocity.f, "MAGNITUDE")
            with m.State("MAGNITUDE"):
                limited, over = magnitude(distance, error)
                m.d.sync += [
                    size.eq(limited),
                    negative.eq(distance[-1]),
                    self.saturated[0].eq(over),
                    product.eq(self._word(0) * factor),
                ]
                m.next = "BAND"
            with m.State("BAND"):
                m.d.sync += difference.eq(size - alpha)
                self._square(m, product)
                m.next = "SPLIT"
            with m.State("SPLIT"):
                within = difference < 0
                m.d.sync += [near.eq(Mux(within, size, alpha)), beyond.eq(Mux(within, 0, difference))]
                m.next = "ROOT"
            correction = self._correct(m, root, factor, product, beyond)
            with m.State("OUTPUT"):
                m.d.sync += far_u.eq(Mux(negative, next_u1 + correction, next_u1 - correction))
                m.d.sync += rest.eq(beyond - correction)
                m.next = "UPDATE"
            with m.State("UPDATE"):
                u = saturate(far_u, -most, most)
                m.d.sync += [
                    lead.eq(Mux(negative, next_u1 - rest, next_u1 + rest)),
                    u1.eq(next_u1),
                    self.velocity.eq(Mux(self._word(2), next_u1, u)),
                    self.saturated[1].eq((u != far_u) | (next_u1 != far_u1)),
                    self.valid.eq(1),
                ]
                with m.If(first):
                    m.d.sync += [lead.eq(0), u1.eq(0), self.velocity.eq(0)]
                m.next = "SAMPLE"
        return m

    def _correct(self, m, root, factor, product, beyond) -> Value:
        """Add the states from ROOT up to OUTPUT (not included) and return g; state PRODUCT waits for the root."""
        full, correction = Signal.like(self._correction(product)), Signal.like(beyond)
        below, above = Signal(), Signal()
        m.d.comb += root.radicand.eq(self._radicand(beyond))
        with m.State("ROOT"):
            m.d.comb += root.start.eq(1)
            m.next = "PRODUCT"
        with m.State("PRODUCT"), m.If(root.done):
            m.d.sync += product.eq(self._word(0) * factor)
            m.next = "CORRECTION"
        with m.State("CORRECTION"):
            m.d.sync += full.eq(self._correction(product))
            m.next = "COMPARE"
        with m.State("COMPARE"):
            m.d.sync += [below.eq(full[-1] & full.shape().signed), above.eq(full > beyond)]
            m.next = "LIMIT"
        with m.State("LIMIT"):
            m.d.sync += correction.eq(Mux(below, 0, Mux(above, beyond, full)))
            m.next = "OUTPUT"
        return correction
