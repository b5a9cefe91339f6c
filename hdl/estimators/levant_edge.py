"""A sliding-mode differentiator driven by the clock-stamped edges of the encoder."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, signed

from hardwall.model.arithmetic.sqrt import latency as sqrt_latency
from hardwall.model.encoder.quadrature import RUN_MAX
from hardwall.model.estimators.levant_edge import Design
from hardwall.model.estimators.levant_edge_design import QUOTIENT_BITS

from ..arithmetic.divide import Divide
from ..arithmetic.fixed import at_most, fitted, length_of, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import Sqrt
from .acceleration import AcceleratedBlock
from .levant_edge_signals import Signals


class Estimator(AcceleratedBlock):
    """Levant's differentiator on edges: the error is taken at an edge, against the place predicted for it.

    Equation, in counts, samples and clocks; an edge comes T clocks and n edges after the last edge in use, with
    2**(L-1) <= T < 2**L:

        E = (v + a T/2) T - (n + the difference of the two edges' places) D
        v <- v + a T - min(|E| / T, lambda sqrt(|E| 2**L)) sign(E)
        a <- a - min(change of v / 2**L, alpha 2**L) sign(E)

    (where |E| >= D, without the limit by lambda); and at every sample, s clocks after that edge, velocity = v + a s,
    held within the bound for no further edge; 0 at rest. The acceleration is a D, and 0 at rest. The places of the four
    edges of a cycle are learnt from E. `hardwall.model.estimators.levant_edge` has the whole law.

    Start: at the first sample, and with `restart`, v = a = 0 and no edge is known; the first edge to come is the
    anchor, the second gives a velocity.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the root; the next `strobe` may come with
    `valid`.

    Rounding and overflow: as the model says; times of more than `mantissa` bits are cut to that many. Velocity and
    error saturate, with flags; acceleration and places saturate without a flag, as part of the algorithm. The count may
    wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_edge.Design
        Formats; its module derives them.

    Source: Levant 1998 for the law; its use on edges is this project's.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        s = Signals(self._design)
        m.d.comb += s.bursts.eq(self._bursts(m).found)
        self._measure(m, s)
        self._solve(m, s)
        self._learn(m, s)
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            self._states_of_the_sample(m, s)
            self._states_of_the_error(m, s)
            self._states_of_the_correction(m, s)
            self._states_of_the_line(m, s)
        return m

    def _measure(self, m, s):
        """Add the multiplier, the top bits of a time for it, and the change of velocity from an acceleration."""
        d, p = self._design, s.params
        m.d.sync += [s.size.eq(length_of(s.measure)), s.product.eq(s.left * s.right)]
        m.d.comb += [
            s.cut.eq(Mux(s.size > d.mantissa, s.size - d.mantissa, 0)),
            s.time.eq(s.measure >> s.cut),
            # A time with its top bit set is cut by one more bit, but then no acceleration is used.
            s.kept.eq(d.turn_span - s.cut),
            s.turned.eq(fitted(shift_floor(s.product, p.turn_shift) >> s.drop, len(s.turned))),
            s.room.eq(Mux(s.v < 0, s.bound + s.v, s.bound - s.v)),
        ]

    def _solve(self, m, s):
        """Add the root and the quotient of the error, and the limits of the changes, ready well before their use."""
        d, p = self._design, s.params
        error, velocity = d.error, d.velocity
        m.submodules.root = root = Sqrt(d.radicand.width + 1)
        m.submodules.quotient = quotient = Divide(
            error.width - 1 + p.error_shift, d.mantissa, velocity.width - 1, QUOTIENT_BITS
        )
        magnitude = Mux(s.e < 0, -s.e, s.e)[: error.width - 1]
        radicand = shift_floor(magnitude, p.radicand_shift)
        root_is_last = sqrt_latency(d.radicand.width + 1) >= d.quotient_latency
        m.d.comb += [
            root.start.eq(s.start),
            root.radicand.eq(Mux(s.length[0], radicand << 1, radicand)),
            quotient.start.eq(s.start),
            quotient.dividend.eq(magnitude << p.error_shift),
            quotient.divisor.eq(s.right),
            s.root.eq(root.root),
            s.solved.eq(root.done if root_is_last else quotient.done),
        ]
        first = d.shortest + 1
        most, steepest = len(s.slope), len(s.bent)
        # The interval's bits beyond the shortest one's; `few` is the same number if the interval is not cut.
        more = Signal(range(max(d.stamp_width - first, 2)))
        few = Signal(range(max(d.mantissa - first, 0) + 1))
        halves = Signal(range(max((d.mantissa >> 1) - (first >> 1), 0) + 1))
        m.d.sync += [
            s.lost.eq(magnitude >= p.lost),
            more.eq(s.length - first),
            few.eq(s.length - first),
            halves.eq((s.length >> 1) - (first >> 1)),
            s.slope.eq(quotient.quotient),
            s.far_slope.eq(quotient.saturated),
            s.bent.eq(at_most(shift_floor(s.change[: len(s.slope)], p.slope_shift + first) >> more, steepest)),
            s.limit.eq(at_most(_shifted(s.root_product, p.limit_shift - (first >> 1), halves), most)),
            s.relay.eq(at_most(_shifted(self.levant_edge_alpha, p.alpha_shift - first, few), steepest)),
        ]

    def _learn(self, m, s):
        """Add the learning of the places, which goes on while the root is computed."""
        p, place = s.params, self._design.place
        residual = Signal(signed(p.learn_max.bit_length() + 1))
        learnt = Signal(signed(max(len(residual) - p.learn_shift, 1) + 1))
        m.d.comb += [s.here.eq(s.places[s.to_kind]), s.there.eq(s.places[s.kind])]
        m.d.sync += [
            residual.eq(fitted(s.e, len(residual))),
            learnt.eq(shift_round_half_up(residual, p.learn_shift)),
            s.next_here.eq(fitted(s.here + learnt, place.width)),
            s.next_there.eq(fitted(s.there - learnt, place.width)),
        ]

    def _states_of_the_sample(self, m, s):
        """Add the states that take the sample's last edge and decide how to use it."""
        d, seen = self._design, self.seen
        with m.State("SAMPLE"), m.If(self.strobe):
            stamps = Array([seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall])
            m.d.sync += [
                s.fresh.eq(self.restart | ~s.running),
                s.running.eq(1),
                s.now.eq(seen.stamp),
                s.at.eq(stamps[seen.edge]),
                s.to.eq(seen.count + seen.down),
                s.to_kind.eq(seen.edge ^ Cat(0, seen.down)),
                s.full_run.eq(seen.run == RUN_MAX),
            ]
            m.next = "DIFFERENCE"
        with m.State("DIFFERENCE"):
            half = _size(s.v) >> 1
            m.d.sync += [
                s.measure.eq(Mux(s.fresh, 0, s.at - s.stamp)),
                s.waited.eq(((s.now - s.stamp)[: d.stamp_width] >> (d.shortest + 1)) != 0),
                # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                s.passed.eq(Mux(s.fresh, 0, (s.to - s.number)[: len(s.passed)].as_signed())),
                s.was_down.eq(s.v < 0),
                s.was_still.eq(s.v == 0),
                # The fastest that the axis is at the next edge, if the bound of the last sample was one.
                s.fastest.eq(Mux(s.room < half, half, s.room)),
                s.doubt.eq(s.doubt - (s.doubt != 0)),
            ]
            with m.If(s.fresh):
                m.d.sync += [s.known.eq(0), s.doubt.eq(0), s.v.eq(0), s.a.eq(0)]
                m.d.sync += [s.number.eq(s.to), s.stamp.eq(s.at), s.kind.eq(s.to_kind)]
                m.d.sync += [s.places[n].eq(0) for n in range(4)]
            m.next = "DECISION"
        with m.State("DECISION"):
            came = (s.measure != 0) | (s.passed != 0)
            unknown = ~s.known | s.measure[-1]
            timed = (s.measure >> d.shortest) != 0
            held = fitted(s.passed, d.distance.width)
            m.d.sync += [
                s.correct.eq(came & ~unknown & timed),
                s.anchor.eq(came & (unknown | timed)),
                s.loose.eq(came & ~(unknown | timed)),
                s.young.eq(came & ~(unknown | timed | s.waited)),
                s.distance.eq(held),
                s.beyond.eq(held != s.passed),
                s.apart.eq(s.here - s.there),
            ]
            with m.If(came & unknown):
                m.d.sync += [s.known.eq(1), s.doubt.eq(0), s.v.eq(0), s.a.eq(0)]
            m.next = "TIME"

    def _states_of_the_error(self, m, s):
        """Add the states that predict the velocity at the edge and compute the error of its place over the interval."""
        d, p = self._design, s.params
        with m.State("TIME"):
            m.d.sync += [
                s.left.eq(s.a),
                s.right.eq(s.time),
                s.e_cut.eq(s.cut),
                s.drop.eq(s.kept),
                s.way.eq(((s.distance * d.clocks) << d.place.f) + s.apart),
                s.measure.eq(s.now - Mux(s.anchor, s.at, s.stamp)),
            ]
            with m.If(s.correct):
                m.d.sync += s.length.eq(s.size)
            m.next = "TURN PRODUCT"
        with m.State("TURN PRODUCT"):
            m.d.sync += s.moved.eq(shift_floor(s.way, -p.place_shift) >> s.e_cut)
            m.next = "TURN"
        with m.State("TURN"):
            gone = ~s.young & s.measure[-1]
            # Half of the time since the anchor, at most, has passed since an edge that is too close to it.
            since = Mux(s.size <= s.loose, 0, s.size - 1 - s.loose)[: len(s.size)]
            bound = Const(p.bound) >> since
            m.d.sync += [
                s.turn.eq(s.turned),
                s.age_time.eq(s.time),
                s.age_drop.eq(s.kept),
                s.bound.eq(Mux(s.young, s.bound, at_most(bound, len(s.bound)))),
                s.gone.eq(gone),
                s.known.eq(s.known & ~gone),
            ]
            m.next = "MEAN"
        with m.State("MEAN"):
            m.d.sync += [
                s.left.eq(fitted(s.v + (s.turn >> 1), len(s.left))),
                s.ahead.eq(Mux(s.correct, s.v + s.turn, s.v)),
            ]
            m.next = "PLACE PRODUCT"
        with m.State("PLACE PRODUCT"):
            m.next = "ERROR"
        with m.State("ERROR"):
            m.d.sync += s.e.eq(shift_floor(s.product, p.error_shift) - s.moved)
            m.next = "START"

    def _states_of_the_correction(self, m, s):
        """Add the states for root and quotient, for the limited changes that they make, and for the new anchor."""
        d = self._design
        with m.State("START"):
            m.d.comb += s.start.eq(1)
            m.next = "SOLVE"
        with m.State("SOLVE"), m.If(s.solved):
            m.d.sync += s.root_product.eq(self.levant_edge_lambda * s.root)
            m.next = "LIMIT"
        with m.State("LIMIT"):
            m.next = "CHANGE"
        with m.State("CHANGE"):
            limited = s.e_cut == 0
            change = Mux(limited & ~s.lost & (s.limit < s.slope), s.limit, s.slope)
            m.d.sync += [
                s.change.eq(Mux(s.correct, change, 0)),
                s.flags[0].eq(s.correct & (s.beyond | s.far_slope)),
            ]
            m.next = "SIGN"
        with m.State("SIGN"):
            with m.If(s.e < 0):
                m.d.sync += s.change.eq(-s.change)
            m.next = "BEND"
        with m.State("BEND"):
            bend = Mux((s.e_cut == 0) & (s.relay < s.bent), s.relay, s.bent)
            m.d.sync += s.bend.eq(_signed(bend, s.e < 0))
            m.next = "UPDATE"
        with m.State("UPDATE"):
            far_v = s.ahead - s.change
            v = fitted(far_v, d.velocity.width)
            a = fitted(s.a - s.bend, d.a.width)
            m.d.sync += [
                s.v.eq(v),
                s.a.eq(a),
                s.left.eq(a),
                s.right.eq(s.age_time),
                s.drop.eq(s.age_drop),
                s.flags[1].eq(v != far_v),
            ]
            with m.If(s.anchor):
                m.d.sync += [s.number.eq(s.to), s.stamp.eq(s.at), s.kind.eq(s.to_kind)]
            with m.If(s.correct & s.full_run & ~s.lost & (s.to_kind != s.kind)):
                m.d.sync += [s.places[s.to_kind].eq(s.next_here), s.places[s.kind].eq(s.next_there)]
            m.next = "LINE PRODUCT"

    def _states_of_the_line(self, m, s):
        """Add the states that extrapolate the velocity from the anchor and hold it within the bound for no edge."""
        d = self._design
        with m.State("LINE PRODUCT"):
            # A motion that goes on faster than the bound allows shows that the bound was wrong.
            goes_on = s.was_still | ((s.v < 0) == s.was_down)
            m.d.sync += [
                s.onward.eq(Mux(s.room < 0, 0, s.room)),
                s.refuted.eq(s.correct & goes_on & (_size(s.v) > s.fastest)),
                # From the state after the next one on, the product is the acceleration of the output.
                s.right.eq(d.clocks),
            ]
            m.next = "LINE TURN"
        with m.State("LINE TURN"):
            m.d.sync += s.turn.eq(Mux(s.gone, 0, s.turned))
            with m.If(s.refuted):
                m.d.sync += s.doubt.eq(d.doubt)
            m.next = "LINE"
        with m.State("LINE"):
            straight = s.v + s.turn
            line = fitted(straight, d.velocity.width)
            m.d.sync += [s.line.eq(line), s.far_line.eq(line != straight)]
            m.next = "END"
        with m.State("END"):
            # Only the bound on the line's own side of 0 can limit it.
            m.d.sync += [
                s.end.eq(Mux((s.line < 0) == (s.v < 0), _signed(s.onward, s.v < 0), -s.v)),
                s.rest.eq(s.gone | ~s.young & (s.doubt == 0) & (_size(s.line) >= s.bound << 1)),
            ]
            m.next = "OUTPUT"
        with m.State("OUTPUT"):
            past_end = ((s.line - s.end) < 0) == (s.line < 0)
            held = Mux(~s.young & (s.doubt == 0) & past_end, s.end, s.line)
            with m.If(s.rest):
                m.d.sync += [s.v.eq(0), s.a.eq(0)]
            m.d.sync += [
                self.velocity.eq(Mux(s.rest, 0, held)),
                self.acceleration.eq(Mux(s.rest, 0, s.product >> s.params.sample_shift)),
                self.saturated.eq(Cat(s.flags[0], s.flags[1] | s.far_line & ~s.rest, s.bursts)),
                self.valid.eq(1),
            ]
            m.next = "SAMPLE"


def _shifted(value, right: int, left):
    """Return floor(value * 2**(left - right)), where `left` is a signal."""
    return (value << left) >> right if right > 0 else value << -right << left


def _signed(value, negative):
    return Mux(negative, -value, value)


def _size(value):
    """Return the magnitude of a signed value."""
    return Mux(value < 0, -value, value)
