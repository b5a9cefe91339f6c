"""The registers and wires of `edge_kalman`, by the names that the model uses."""

from amaranth.hdl import Cat, Const, Signal, signed, unsigned

from hardwall.model.encoder.scale_map import FRACTION_BITS
from hardwall.model.estimators.edge_kalman_design import Design
from hardwall.model.estimators.edge_kalman_tables import (
    BLEND,
    GAIN_BITS,
    GAIN_FORMATS,
    GAIN_ROWS,
    KV,
    KX,
    LENGTH,
    LIMIT_WIDTHS,
    MEMORY_BITS,
    SHARE_BITS,
    USUAL_SHARE,
)

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
        self.memory = Signal(LENGTH.i + MEMORY_BITS)
        self.place, self.mean = Signal(error), Signal(error)
        self.v, self.a = Signal(motion), Signal(shape(d.a))
        self.forgotten = [state.eq(0) for state in (self.memory, self.place, self.mean, self.v, self.a, self.doubt)]

        # What is learned: how often the error of an edge is halved, by the share of larger innovations than usual.
        self.halvings, self.unlearned = Const(0, 0), []
        if p.halvings_max:
            self.share, self.large = Signal(SHARE_BITS, init=USUAL_SHARE), Signal()
            self.halvings = Signal(range(p.halvings_max + 1))
            self.unlearned = [self.share.eq(USUAL_SHARE), self.halvings.eq(0)]

        # The sample. `correct`: its edge corrects; `anchor`: its edge is the new anchor.
        self.fresh, self.correct, self.anchor = Signal(), Signal(), Signal()
        self.now, self.at, self.to = Signal(time), Signal(time), Signal(count)
        self.interval, self.passed = Signal(time), Signal(count)
        self.distance, self.beyond = Signal(shape(d.distance)), Signal()
        self.age, self.rest, self.gone = Signal(time), Signal(), Signal()
        self.interval_size, self.age_size = Signal(range(d.time_bits + 1)), Signal(range(d.time_bits))
        self.flags = Signal(2)
        self.bursts, self.jolt = Signal(), Signal()

        self._place(d)

        # The multiplier: the low limb's product waits, with half of what is rounded off, for the high limb's.
        wide = max(d.time_bits, GAIN_BITS, LIMIT_WIDTHS[BLEND], GAIN_FORMATS[KX].width)
        self.left = Signal(signed(max(d.motion.width + 1, d.a.width, d.error.width + 1)))
        self.right, self.limb = Signal(wide), Signal(max(LIMB_BITS, wide - LIMB_BITS))
        self.product = Signal(signed(len(self.left) + len(self.limb)))
        self.low = Signal(signed(max(len(self.product), len(self.left) + wide - 1) + 1))
        self.total = Signal(signed(max(len(self.low), len(self.product) + LIMB_BITS) + 1))
        self.summed = self.total.eq(self.low + (self.product << LIMB_BITS))

        self._look_up(d)

        # The innovation, and what it changes.
        self.turn, self.ahead = Signal(signed(d.motion.width + 1)), Signal(signed(d.motion.width + 2))
        self.turned = self.turn.eq(fitted(shift_floor(self.total, p.turn_shift), len(self.turn)))
        self.way = Signal(signed(max(len(self.exact) + d.clocks.bit_length() - self.place_shift, 1)))
        self.behind = Signal(signed(max(len(self.way), d.error.width) + 1))
        self.far = Signal(signed(max(len(self.behind), self._shifted(p.travel_shift)) + 1))
        self.r, self.nearer = Signal(error), Signal(error)
        self.far_faster, self.far_v = Signal(), Signal(signed(d.motion.width + 3))
        self.bent = Signal(signed(max(d.a.width, self._shifted(p.bend_shift)) + 1))

        # The line, and the bound on it without a further edge.
        self.room, self.fastest = Signal(signed(d.motion.width + 1)), Signal(d.motion.width)
        self.was_down, self.was_still, self.refuted = Signal(), Signal(), Signal()
        self.straight, self.line = Signal(signed(d.motion.width + 2)), Signal(motion)
        self.least, self.most = Signal(signed(d.motion.width + 1)), Signal(signed(d.motion.width + 1))
        self.held, self.far_line = Signal(motion), Signal()

    def _look_up(self, d: Design) -> None:
        """Add the rows of the tables and their words, the memory that an edge leaves, and the rate for it."""
        self.limits_row = Signal(range(len(d.limits)))
        self.limit = [Signal(width, name=f"limit_{n}") for n, width in enumerate(LIMIT_WIDTHS)]
        self.gains_row = Signal(range(2 * GAIN_ROWS))
        self.gain = [Signal(fmt.width, name=f"gain_{n}") for n, fmt in enumerate(GAIN_FORMATS)]
        # The row of times for the interval: its length, and the bit after its first.
        next_bit = self.interval.bit_select((self.interval_size - 2)[: len(self.interval_size)], 1)
        self.time = Cat((self.interval_size > 1) & next_bit, self.interval_size)[: d.row_bits]

        self.grown, self.alarm = Signal.like(self.memory), Signal()
        self.length, self.word = Signal(LENGTH.i), Signal(GAIN_FORMATS[KV].width)
        self.rate = Signal(GAIN_BITS)

    @staticmethod
    def nearest(memory):
        """Return a memory to the nearest half octave."""
        return memory[MEMORY_BITS:] + memory[MEMORY_BITS - 1]

    @staticmethod
    def without_sign(value):
        """Return the magnitude of a signed value, less an LSB if it is negative."""
        return (value[:-1] ^ value[-1].replicate(len(value) - 1)).as_unsigned()

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
