"""The registers and wires of `levant_edge`, by the names that the model uses."""

from amaranth.hdl import Array, Signal, signed, unsigned

from hardwall.model.estimators.levant_edge import Design

from ..arithmetic.fixed import shape


class Signals:
    """The registers and wires for a design."""

    def __init__(self, d: Design):
        self.params = d.params({word.name: word.reset for word in d.words})
        count, clocks, velocity = signed(d.count_width), unsigned(d.stamp_width), shape(d.velocity)

        # The state from sample to sample: the anchor, the motion there, and the places of the four kinds of edges.
        self.running, self.known = Signal(), Signal()
        self.number, self.stamp, self.kind = Signal(count), Signal(clocks), Signal(2)
        self.length = Signal(range(d.stamp_width + 1))
        self.v, self.a = Signal(velocity), Signal(shape(d.a))
        self.places = Array(Signal(shape(d.place), name=f"place_{n}") for n in range(4))

        # The sample. `anchor`: its edge is the new anchor; `loose`: its edge is too close to the anchor, and the
        # sample, too, if it is `young`.
        self.fresh, self.full_run, self.gone, self.rest, self.beyond = (Signal() for _ in range(5))
        self.correct, self.anchor, self.loose, self.young = Signal(), Signal(), Signal(), Signal()
        self.now, self.at, self.waited = Signal(clocks), Signal(clocks), Signal()
        self.to, self.to_kind, self.passed = Signal(count), Signal(2), Signal(count)
        self.flags = Signal(2)
        self.bursts = Signal()

        # A time and its length, its bits for the multiplier, and the change of velocity by an acceleration in it.
        self.measure, self.size = Signal(clocks), Signal(range(d.stamp_width + 1))
        self.cut, self.kept = Signal(range(d.turn_span + 2)), Signal(range(d.turn_span + 1))
        self.time, self.age_time = Signal(d.mantissa), Signal(d.mantissa)
        self.drop, self.age_drop = Signal.like(self.kept), Signal.like(self.kept)
        self.left, self.right = Signal(velocity), Signal(d.mantissa)
        self.product = Signal(signed(d.velocity.width + d.mantissa))
        self.turned, self.turn = (Signal(signed(d.velocity.width + 1)) for _ in range(2))
        self.ahead = Signal(signed(d.velocity.width + 2))

        # The error of the place, and the changes that it makes.
        self.distance, self.apart = Signal(shape(d.distance)), Signal(signed(d.place.width + 1))
        bits = max(d.distance.width + d.clocks.bit_length() + d.place.f, d.place.width + 1) + 1
        self.way, self.moved = Signal(signed(bits)), Signal(shape(d.error))
        self.e, self.e_cut = Signal(shape(d.error)), Signal.like(self.cut)
        self.lost = Signal()
        self.start, self.solved, self.root = Signal(), Signal(), Signal(d.root.width)
        self.root_product = Signal(d.lambda_.width + d.root.width)
        self.slope, self.far_slope, self.limit = Signal(d.velocity.width - 1), Signal(), Signal(d.velocity.width - 1)
        self.bent, self.relay = Signal(d.a.width - 1), Signal(d.a.width - 1)
        self.change, self.bend = Signal(velocity), Signal(shape(d.a))
        self.here, self.there = Signal(shape(d.place)), Signal(shape(d.place))
        self.next_here, self.next_there = Signal(shape(d.place)), Signal(shape(d.place))

        # The bound of the line without a further edge.
        self.bound, self.doubt = Signal(d.velocity.width), Signal(range(d.doubt + 1))
        self.room = Signal(signed(d.velocity.width + 1))
        self.onward, self.fastest = Signal(d.velocity.width), Signal(d.velocity.width)
        self.was_down, self.was_still, self.refuted = Signal(), Signal(), Signal()
        self.far_line = Signal()
        self.line, self.end = Signal(velocity), Signal(signed(d.velocity.width + 1))
