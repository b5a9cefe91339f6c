"""A sliding-mode differentiator driven by the clock-stamped edges of the encoder."""

from amaranth.hdl import Array, Cat, Const, Elaboratable, Module, Mux, Signal, signed

from hardwall.model.levant_edge import DIGITS, REST_BITS, Design
from hardwall.model.quadrature import RUN_MAX
from hardwall.model.sqrt import latency as sqrt_latency

from . import EstimatorBlock
from .fixed import shape, shift_floor, shift_round_half_up
from .sqrt import Sqrt


class Estimator(EstimatorBlock):
    """Levant's idea on edges: the error is that of the place predicted for an edge at the moment it came.

    Equation, at an edge T clocks and n edges after the last one used, 2**(L-1) <= T < 2**L, in counts, samples, clocks:

        E = (v + a T/2) T - (n + the difference of the two edges' places) D
        v <- v + a T - min(|E| / T, lambda sqrt(|E| 2**L)) sign(E)
        a <- a - min(|E| / T / 2**L, alpha 2**L) sign(E)

    and at every sample, s clocks after it, velocity = v + a s, held to what no further edge allows; 0 at rest. The
    places of the four edges of a cycle are learnt from E. `hardwall.model.levant_edge` says all of it.

    Start: at the first sample, and with `restart`, v = a = 0 and no edge is known; the first to come is an anchor, the
    second gives a velocity.

    Latency: `latency` clocks from `strobe` to `valid`, most of them the root's; the next `strobe` may come with
    `valid`.

    Rounding and overflow: as the model says; times of more than `mantissa` bits are cut to that many. Velocity and
    error saturate, with flags; acceleration and places saturate without: that is part of the algorithm. The count may
    wrap.

    Parameters
    ----------
    design : hardwall.model.levant_edge.Design
        Formats; its module derives them.

    Source: Levant 1998 for the law; its use on edges is this project's.
    """

    def __init__(self, design: Design):
        super().__init__(design, Design)

    def elaborate(self, platform):
        m = Module()
        d = self._design
        p = d.params({word.name: word.reset for word in d.words})
        velocity, acceleration, error, place = d.velocity, d.acceleration, d.error, d.place
        far = d.stamp_width - 1

        # Held from sample to sample: the anchor, the motion there, the places of the four edges.
        running, known = Signal(), Signal()
        number, stamp, kind = Signal.like(self.count), Signal(d.stamp_width), Signal(2)
        length = Signal(range(d.stamp_width + 1))
        v, a = Signal(shape(velocity)), Signal(shape(acceleration))
        places = Array(Signal(shape(place), name=f"place_{n}") for n in range(4))

        # The sample, and what is to be done with it.
        stamps = Array([self.stamp_a_rise, self.stamp_b_rise, self.stamp_a_fall, self.stamp_b_fall])
        fresh, full_run, new, correct, carry, taken, rest = (Signal() for _ in range(7))
        now, at, age = (Signal(d.stamp_width) for _ in range(3))
        to, to_kind, passed = Signal.like(number), Signal(2), Signal.like(number)

        # A time, its length in bits, and as it multiplies: the top bits, `cut` having been dropped.
        measure, size = Signal(d.stamp_width), Signal(range(d.stamp_width + 1))
        cut = Signal(range(d.turn_span + 2))
        m.d.sync += size.eq(_length(measure))
        m.d.comb += cut.eq(Mux(size > d.mantissa, size - d.mantissa, 0))
        time = (measure >> cut)[: d.mantissa]

        # One multiplier, signed by unsigned, and what it says of a change of velocity.
        left, right = Signal(signed(velocity.width)), Signal(d.mantissa)
        product = Signal(signed(velocity.width + d.mantissa))
        drop, age_drop = Signal(range(d.turn_span + 1)), Signal(range(d.turn_span + 1))
        # A time with its top bit set is cut by one bit more; but then the acceleration is 0.
        kept = (d.turn_span - cut)[: len(drop)]
        turn, ahead = Signal(signed(velocity.width + 1)), Signal(signed(velocity.width + 2))
        coarse = shift_floor(product, p.turn_shift) >> drop
        m.d.sync += product.eq(left * right)

        # The error of the predicted place, and what it changes.
        distance = Signal(shape(d.distance))
        apart = Signal(signed(place.width + 1))
        way = Signal(signed(max(d.distance.width + d.clocks.bit_length() + place.f, place.width + 1) + 1))
        moved = Signal(signed(error.width))
        e = Signal(signed(error.width))
        e_cut = Signal.like(cut)
        beyond = Signal()
        slope = Signal(velocity.width - 1)
        limit, bent, relay = Signal.like(slope), Signal.like(slope), Signal(acceleration.width - 1)
        change, bend = Signal(signed(velocity.width)), Signal(signed(acceleration.width))

        m.submodules.root = root = Sqrt(d.radicand.width + 1)
        m.submodules.quotient = quotient = _Quotient(error.width - 1 + p.error_shift, d.mantissa, len(slope))
        magnitude = Mux(e < 0, -e, e)[: error.width - 1]
        radicand = shift_floor(magnitude, p.radicand_shift)
        m.d.comb += [
            root.radicand.eq(Mux(length[0], radicand << 1, radicand)),
            quotient.dividend.eq(magnitude << p.error_shift),
            quotient.divisor.eq(right),
        ]
        solved = root.done if _root_is_last(d) else quotient.done
        root_product = Signal(d.lambda_.width + d.root.width)

        # Bits of an interval in use beyond the fewest.
        first = d.shortest + 1
        more = Signal(range(max(far - d.shortest, 2)))
        few = Signal(range(max(d.mantissa - first, 0) + 1))
        few_halves = Signal(range(max((d.mantissa >> 1) - (first >> 1), 0) + 1))
        m.d.sync += [
            more.eq(length - first),
            few.eq(length - first),
            few_halves.eq((length >> 1) - (first >> 1)),
            relay.eq(_least(_shifted(self.levant_edge_alpha, p.alpha_shift - first, few), len(relay))),
            slope.eq(_least(quotient.quotient, len(slope))),
            bent.eq(_least(shift_floor(slope, p.slope_shift + first) >> more, len(bent))),
        ]

        # The places learn while the root is drawn.
        here, there = Signal(shape(place)), Signal(shape(place))
        m.d.comb += [here.eq(places[to_kind]), there.eq(places[kind])]
        residual = Signal(signed(p.learn_max.bit_length() + 1))
        learnt = Signal(signed(max(len(residual) - p.learn_shift, 1) + 1))
        place_to, place_since = Signal(shape(place)), Signal(shape(place))
        m.d.sync += [
            residual.eq(_fitted(_fitted(e, len(residual)) << e_cut, len(residual))),
            learnt.eq(shift_round_half_up(residual, p.learn_shift)),
            place_to.eq(_fitted(here + learnt, place.width)),
            place_since.eq(_fitted(there - learnt, place.width)),
        ]

        # What no further edge allows.
        age_time = Signal(d.mantissa)
        bound = Signal(velocity.width - 1)
        line, onward, end = Signal(shape(velocity)), Signal(velocity.width - 1), Signal(signed(velocity.width + 1))
        flags = Signal(2)

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                m.d.sync += [
                    fresh.eq(self.restart | ~running),
                    running.eq(1),
                    now.eq(self.stamp),
                    at.eq(stamps[self.edge]),
                    to.eq(self.count + self.down),
                    to_kind.eq(self.edge ^ Cat(0, self.down)),
                    full_run.eq(self.run == RUN_MAX),
                ]
                m.next = "DIFFERENCE"
            with m.State("DIFFERENCE"):
                m.d.sync += [
                    measure.eq(Mux(fresh, 0, at - stamp)),
                    age.eq(now - Mux(fresh, at, stamp)),
                    # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                    passed.eq(Mux(fresh, 0, (to - number)[: len(passed)].as_signed())),
                ]
                with m.If(fresh):
                    m.d.sync += [known.eq(0), v.eq(0), a.eq(0), length.eq(0)]
                    m.d.sync += [number.eq(to), stamp.eq(at), kind.eq(to_kind)]
                    m.d.sync += [places[n].eq(0) for n in range(4)]
                m.next = "DECISION"
            with m.State("DECISION"):
                came = (measure != 0) | (passed != 0)
                unknown = ~known | measure[far]
                timed = (measure >> d.shortest) != 0
                waited = (age >> first) != 0
                held = _fitted(passed, d.distance.width)
                m.d.sync += [
                    new.eq(came),
                    correct.eq(came & ~unknown & timed),
                    carry.eq(came & ~unknown & ~timed & waited),
                    taken.eq(~came | unknown | timed | waited),
                    distance.eq(held),
                    beyond.eq(held != passed),
                    apart.eq(here - there),
                ]
                with m.If(came & unknown):
                    m.d.sync += [known.eq(1), v.eq(0), a.eq(0)]
                m.next = "TIME"
            with m.State("TIME"):
                m.d.sync += [
                    left.eq(a),
                    right.eq(time),
                    e_cut.eq(cut),
                    drop.eq(kept),
                    way.eq(((distance * d.clocks) << place.f) + apart),
                    measure.eq(now - Mux(new & taken, at, stamp)),
                ]
                with m.If(correct):
                    m.d.sync += length.eq(size)
                m.next = "TURN PRODUCT"
            with m.State("TURN PRODUCT"):
                m.d.sync += moved.eq(shift_floor(way, -p.place_shift) >> e_cut)
                m.next = "TURN"
            with m.State("TURN"):
                m.d.sync += [
                    turn.eq(_fitted(coarse, len(turn))),
                    age_time.eq(time),
                    age_drop.eq(kept),
                    bound.eq(_least(Const(p.bound) >> Mux(size == 0, 0, size - 1)[: len(size)], len(bound))),
                    rest.eq(taken & (measure[far] | (size > length + REST_BITS))),
                ]
                with m.If(taken & measure[far]):
                    m.d.sync += known.eq(0)
                m.next = "MEAN"
            with m.State("MEAN"):
                m.d.sync += [
                    left.eq(_fitted(v + (turn >> 1), velocity.width)),
                    ahead.eq(Mux(correct | carry, v + turn, v)),
                ]
                m.next = "PLACE PRODUCT"
            with m.State("PLACE PRODUCT"):
                m.next = "ERROR"
            with m.State("ERROR"):
                m.d.sync += e.eq(shift_floor(product, p.error_shift) - moved)
                m.next = "SOLVE"
            with m.State("SOLVE"):
                m.d.comb += [root.start.eq(1), quotient.start.eq(1)]
                m.next = "LIMIT PRODUCT"
            with m.State("LIMIT PRODUCT"), m.If(solved):
                m.d.sync += root_product.eq(self.levant_edge_lambda * root.root)
                m.next = "LIMIT"
            with m.State("LIMIT"):
                steep = _least(_shifted(root_product, p.limit_shift - (first >> 1), few_halves), len(limit))
                m.d.sync += limit.eq(Mux(e_cut == 0, steep, velocity.max))
                with m.If(e_cut != 0):
                    m.d.sync += relay.eq(acceleration.max)
                m.next = "CHANGE"
            with m.State("CHANGE"):
                m.d.sync += [
                    change.eq(Mux(correct, _signed(Mux(limit < slope, limit, slope), e < 0), 0)),
                    bend.eq(Mux(correct, _signed(Mux(relay < bent, relay, bent), e < 0), 0)),
                    flags[0].eq(correct & (beyond | quotient.quotient[len(slope) :].any())),
                ]
                m.next = "UPDATE"
            with m.State("UPDATE"):
                far_v = ahead - change
                held_v = _fitted(far_v, velocity.width)
                held_a = _fitted(a - bend, acceleration.width)
                m.d.sync += [
                    v.eq(Mux(rest, 0, held_v)),
                    a.eq(Mux(rest, 0, held_a)),
                    left.eq(Mux(rest, 0, held_a)),
                    right.eq(age_time),
                    drop.eq(age_drop),
                    flags[1].eq(held_v != far_v),
                ]
                with m.If(new & taken):
                    m.d.sync += [number.eq(to), stamp.eq(at), kind.eq(to_kind)]
                with m.If(correct & full_run & (to_kind != kind)):
                    m.d.sync += [places[to_kind].eq(place_to), places[kind].eq(place_since)]
                m.next = "LINE PRODUCT"
            with m.State("LINE PRODUCT"):
                room = Mux(v < 0, bound + v, bound - v)
                m.d.sync += onward.eq(Mux(room < 0, 0, room))
                m.next = "LINE TURN"
            with m.State("LINE TURN"):
                m.d.sync += turn.eq(_fitted(coarse, len(turn)))
                m.next = "LINE"
            with m.State("LINE"):
                straight = v + turn
                held_line = _fitted(straight, velocity.width)
                m.d.sync += [line.eq(held_line), flags[1].eq(flags[1] | (held_line != straight))]
                m.next = "END"
            with m.State("END"):
                # Only the end on the line's own side of 0 can hold it.
                m.d.sync += end.eq(Mux((line < 0) == (v < 0), _signed(onward, v < 0), -v))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                beyond_end = ((line - end) < 0) == (line < 0)
                m.d.sync += [
                    self.velocity.eq(Mux(taken & beyond_end, end, line)),
                    self.saturated.eq(flags),
                    self.valid.eq(1),
                ]
                m.next = "SAMPLE"
        return m


class _Quotient(Elaboratable):
    """floor(dividend / divisor), or the largest word where it does not fit, `DIGITS` quotient bits a clock.

    `done` comes one clock after `start` and one more for each `DIGITS` bits; the quotient stays until the next start.
    """

    def __init__(self, dividend: int, divisor: int, quotient: int):
        self.start, self.done = Signal(), Signal()
        self.dividend, self.divisor = Signal(dividend), Signal(divisor)
        self.quotient = Signal(-(-quotient // DIGITS) * DIGITS)

    def elaborate(self, platform):
        m = Module()
        bits = len(self.quotient)
        divisor, remainder = Signal.like(self.divisor), Signal.like(self.divisor)
        over = Signal()
        left = Signal(range(bits // DIGITS + 1))

        above = self.dividend[bits:]
        rest, digits = remainder, []
        for n in range(DIGITS):
            taken = Cat(self.quotient[bits - 1 - n], rest)
            less = taken - divisor
            digits.insert(0, ~less[-1] | over)
            rest = Mux(less[-1], taken, less)[: len(remainder)]

        m.d.sync += self.done.eq(left == 1)
        with m.If(left != 0):
            m.d.sync += [
                remainder.eq(rest),
                self.quotient.eq(Cat(*digits, self.quotient)[:bits]),
                left.eq(left - 1),
            ]
        with m.If(self.start):
            m.d.sync += [
                divisor.eq(self.divisor),
                remainder.eq(above[: len(remainder)]),
                self.quotient.eq(self.dividend[:bits]),
                over.eq(above >= self.divisor),
                left.eq(bits // DIGITS),
                self.done.eq(0),
            ]
        return m


def _root_is_last(design: Design) -> bool:
    """Return whether the root takes as long as the quotient, or longer."""
    return sqrt_latency(design.radicand.width + 1) >= design.quotient_latency


def _length(value):
    """Return the bits of a word: the least n with value < 2**n."""
    if len(value) == 1:
        return value
    half = len(value) // 2
    return Mux(value[half:].any(), half + _length(value[half:]), _length(value[:half]))


def _shifted(value, right: int, left):
    """Return floor(value * 2**(left - right)), `left` a signal."""
    return (value << left) >> right if right > 0 else value << -right << left


def _least(value, bits: int):
    """Return an unsigned `value`, or the largest word of `bits` where it is more."""
    return Mux(value[bits:].any(), (1 << bits) - 1, value[:bits])


def _fitted(value, bits: int):
    """Return a signed `value` held within `bits` of two's complement: its top bits tell, no comparison is needed."""
    if len(value) <= bits:
        return value
    top = value[bits - 1 :]
    held = Mux(value[-1], -1 << (bits - 1), (1 << (bits - 1)) - 1)
    return Mux(top.any() & ~top.all(), held, value[:bits].as_signed())


def _signed(value, negative):
    return Mux(negative, -value, value)
