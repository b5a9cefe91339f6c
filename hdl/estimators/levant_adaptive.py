"""Levant's differentiator with gains that adapt to the signal."""

from amaranth.hdl import Mux, Signal, Value, signed

from hardwall.model.estimators.levant_adaptive import LOST, RAISED, Design

from ..arithmetic.fixed import shift_floor, shift_round_half_up
from . import levant_semi_implicit


class Estimator(levant_semi_implicit.Estimator):
    """Levant's differentiator without numerical chatter, with gains from 2**RAISED to 2**-levels of the axis's.

    Equation, per sample, in counts and sample periods, at level j:

        b  = x + u1 - count
        u1 <- u1 - sign(b) near,    near = min(|b|, alpha 2**-j)
        u  = u1 - sign(b) g,        g = min(lambda 2**(-j/2) sqrt(beyond), beyond),    beyond = |b| - near
        x  <- x + u

    As soon as |b| is more than quantisation explains, j falls to the level that the time since the last change of b's
    sign requires. If |b| doubles it falls further, below 0 too. It rises by one after a time of calm. The design's
    module has the law.

    Start: at the first sample, and with `restart`, x = count, u1 = 0 and j = 0, so u = 0: a start from rest has no
    transient.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the root; the next `strobe` may come with
    `valid`.

    Rounding and overflow: alpha 2**-j rounds down. The root rounds down and half of its LSB is added back. g rounds
    half up, and everything else is exact. b, u and u1 saturate, with flags. The count may wrap; no counter of the law
    can.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_adaptive.Design
        Formats and thresholds; its module derives them.

    Source: this project, based on Levant 1998 and the projection of `levant_semi_implicit`.
    """

    design_class = Design

    def elaborate(self, platform):
        # The level is counted from the least, -RAISED, an even number.
        self._level = Signal(range(RAISED + max(self.design.levels, 1) + 1), init=RAISED)
        self._scaled = Signal(len(super()._alpha()) + RAISED)
        return super().elaborate(platform)

    def _alpha(self):
        return self._scaled

    def _radicand(self, beyond):
        # At odd levels the radicand is halved, which divides the root by sqrt(2).
        shift = self.design.velocity.f - self.design.radicand.f
        return Mux(self._level[0], shift_floor(beyond, shift + 1), shift_floor(beyond, shift))

    def _correction(self, product):
        scaled = (product << self.design.spare + RAISED // 2) >> (self._level >> 1)
        return shift_round_half_up(scaled, self.design.product + self.design.spare - self.design.velocity.f)

    def _adapt(self, m, first, negative, size):
        design, level = self.design, self._level
        whole = size[design.velocity.f :]
        # Time thresholds in whole samples, by level: to reach the next level from 0 on, and to leave any level.
        reach = [design.reach_samples(n + 1) for n in range(design.levels)]
        hold = [design.hold_samples(n) for n in range(-RAISED, design.levels)]
        side = Signal(signed(2))
        elapsed, calm = Signal(range(max(reach, default=0) + 1)), Signal(range(max(hold, default=0) + 1))
        reached = Signal(range(max(design.levels, 1) + 1))
        limit = Signal(len(whole) + 2, init=LOST)

        with m.State("SIDE"):
            sign = Mux(negative, -1, size != 0)
            with m.If(first | (size != 0) & (sign != side)):
                m.d.sync += [side.eq(sign), elapsed.eq(0), reached.eq(0), limit.eq(LOST)]
            with m.If(first):
                m.d.sync += [level.eq(RAISED), calm.eq(0)]
            m.next = "REACH"
        with m.State("REACH"):
            longer = elapsed + 1
            with m.If(reached < design.levels):
                m.d.sync += [elapsed.eq(longer), reached.eq(reached + (longer >= _choose(m, reached, reach)))]
            m.next = "LEVEL"
        with m.State("LEVEL"):
            least = Mux(limit == 2 * LOST, RAISED, 0)
            two_less = Mux(level < least + 2, least, level - 2)
            lower = Mux((limit == LOST) | (two_less > level), level, two_less)
            required = reached + RAISED
            with m.If(whole >= limit):
                m.d.sync += [level.eq(Mux(lower < required, lower, required)), limit.eq(limit << 1)]
            m.next = "CALM"
        with m.State("CALM"):
            longer = calm + 1
            with m.If(whole >= LOST):
                m.d.sync += calm.eq(0)
            with m.Elif(level < design.levels + RAISED):
                risen = longer >= _choose(m, level, hold)
                m.d.sync += [calm.eq(Mux(risen, 0, longer)), level.eq(level + risen)]
            m.next = "SHIFT"
        with m.State("SHIFT"):
            m.d.sync += self._scaled.eq((super()._alpha() << RAISED) >> level)
            m.next = "BAND"
        return "SIDE"


def _choose(m, index, values) -> Value:
    """Return the value at `index`."""
    chosen = Signal(range(max(values, default=0) + 1))
    with m.Switch(index):
        for n, value in enumerate(values):
            with m.Case(n):
                m.d.comb += chosen.eq(value)
    return chosen
