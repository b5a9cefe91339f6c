"""The registers and wires of `edge_kalman`, by the names that the model uses."""

from amaranth.hdl import Cat, Signal, signed, unsigned

from hardwall.model.encoder.scale_map import FRACTION_BITS
from hardwall.model.estimators.edge_kalman import TOP
from hardwall.model.estimators.edge_kalman_design import Design

from ..arithmetic.fixed import fitted, shape, shift_floor

LIMB_BITS = 13
"""Bits of the right operand that the multiplier takes first; the rest, 14 at most, comes a clock later."""


class Signals:
    """The registers and wires for a design."""

    def __init__(self, d: Design):
        self.params = p = d.params({})
        count, time, error, motion = signed(d.count_width), unsigned(d.time_bits), shape(d.error), shape(d.motion)

        # The state from sample to sample: the anchor, the motion there, and how long it is remembered.
        self.running, self.known = Signal(), Signal()
        self.number, self.stamp = Signal(count), Signal(time)
        self.bound, self.doubt = Signal(d.motion.width), Signal(range(d.doubt + 1))
        self.level = Signal(range(TOP + 1))
        self.place, self.mean = Signal(error), Signal(error)
        self.v, self.a = Signal(motion), Signal(shape(d.a))
        states = self.place, self.mean, self.v, self.a, self.doubt
        self.forgotten = [self.level.eq(TOP), *(state.eq(0) for state in states)]

        # The sample. `correct`: its edge corrects; `anchor`: its edge is the new anchor.
        self.fresh, self.correct, self.anchor = Signal(), Signal(), Signal()
        self.now, self.at, self.to = Signal(time), Signal(time), Signal(count)
        self.interval, self.passed = Signal(time), Signal(count)
        self.distance, self.beyond = Signal(shape(d.distance)), Signal()
        self.age, self.rest, self.gone = Signal(time), Signal(), Signal()
        self.size, self.age_size = Signal(range(d.time_bits + 1)), Signal(range(d.time_bits))
        self.flags = Signal(2)
        self.bursts, self.jolt = Signal(), Signal()

        self._place(d)

        # The multiplier: the low limb's product waits, with half of what is rounded off, for the high limb's.
        wide = max(d.time_bits, *(fmt.width for fmt in d.columns))
        self.left = Signal(signed(max(d.motion.width + 1, d.a.width, d.error.width + 1)))
        self.right, self.limb = Signal(wide), Signal(max(LIMB_BITS, wide - LIMB_BITS))
        self.product = Signal(signed(len(self.left) + len(self.limb)))
        self.low = Signal(signed(max(len(self.product), len(self.left) + wide - 1) + 1))
        self.total = Signal(signed(max(len(self.low), len(self.product) + LIMB_BITS) + 1))
        self.summed = self.total.eq(self.low + (self.product << LIMB_BITS))

        # The row of the table, and its words; `of_time` is the part of a row's number that the interval gives.
        widths = [fmt.width for fmt in d.columns]
        self.starts = [sum(widths[:n]) for n in range(len(widths) + 1)]
        self.row = Signal(range(len(d.table)))
        self.entry = [Signal(width, name=f"entry_{n}") for n, width in enumerate(widths)]
        next_bit = self.interval.bit_select((self.size - 2)[: len(self.size)], 1)
        self.of_time = Cat((self.size > 1) & next_bit, self.size)[: d.row_bits]

        # The innovation, and what it changes.
        self.turn, self.ahead = Signal(signed(d.motion.width + 1)), Signal(signed(d.motion.width + 2))
        self.turned = self.turn.eq(fitted(shift_floor(self.total, p.turn_shift), len(self.turn)))
        self.way = Signal(signed(max(len(self.exact) + d.clocks.bit_length() - self.place_shift, 1)))
        self.behind = Signal(signed(max(len(self.way), d.error.width) + 1))
        self.far = Signal(signed(max(len(self.behind), self._shifted(p.travel_shift)) + 1))
        self.r = Signal(error)
        self.lower, self.alarm = Signal.like(self.level), Signal()
        self.far_v = Signal(signed(max(len(self.ahead), self._shifted(p.velocity_shift)) + 1))
        self.bent = Signal(signed(max(d.a.width, self._shifted(p.bend_shift)) + 1))

        # The line, and the bound on it without a further edge.
        self.room, self.fastest = Signal(signed(d.motion.width + 1)), Signal(d.motion.width)
        self.was_down, self.was_still, self.refuted = Signal(), Signal(), Signal()
        self.straight, self.line = Signal(signed(d.motion.width + 2)), Signal(motion)
        self.least, self.most = Signal(signed(d.motion.width + 1)), Signal(signed(d.motion.width + 1))
        self.held, self.far_line = Signal(motion), Signal()

    def _place(self, d: Design) -> None:
        """Add what passed, with the errors of both edges' places where a map has them: `before` is the anchor's."""
        self.exact, self.place_shift, self.displaced = self.distance, self.params.place_shift - FRACTION_BITS, []
        if d.scale is not None:
            self.error, self.before = Signal(shape(d.scale.place)), Signal(shape(d.scale.place))
            edges = self.distance << FRACTION_BITS
            self.exact = Signal(signed(max(len(edges), d.scale.place.width + 1) + 1))
            self.place_shift = self.params.place_shift
            self.displaced = [self.exact.eq(edges + (self.error - self.before))]

    def _shifted(self, shift: int) -> int:
        """Return the bits of the sum of a product after a shift to the right."""
        return max(len(self.total) - shift, 1)

    def waits(self, shift: int):
        """Return the statement that keeps the low limb's product, with half of the LSB that a shift will round off."""
        return self.low.eq(self.product + (1 << (shift - 1) if shift > 0 else 0))
