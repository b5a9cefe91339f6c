"""Quadrature decoder: from the pins of an incremental encoder to a count, with clock stamps, index and faults.

`Seen` is the bus from the decoder to the estimators.
"""

from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from hardwall.model.checks import check_int
from hardwall.model.encoder import quadrature as model


class Seen(wiring.Signature):
    """The decoder's outputs that an estimator may use, valid at every clock.

    Twin of `hardwall.model.encoder.quadrature.Seen`.

    Parameters
    ----------
    count_width, stamp_width : int
        Bits of the count and of the clock stamps.

    Members
    -------
    count : Out(signed(count_width))
        Position, counts.
    stamp : Out(stamp_width)
        Clocks since reset.
    stamp_a_rise, stamp_b_rise, stamp_a_fall, stamp_b_fall : Out(stamp_width) `stamp` in the clock that decoded the last
        edge of that kind: one clock before the edge's count is out.
    edge : Out(2)
        Kind of the last counted edge: 0 A rose, 1 B rose, 2 A fell, 3 B fell. Its stamp is the stamp of this kind.
    down : Out(1)
        Whether that edge counted -1.
    run : Out(3) Successive edges counted in that direction, at most 4: as many stamps belong to this run. It is 0
        before the first edge, and after an illegal change.
    """

    def __init__(self, count_width: int, stamp_width: int):
        super().__init__(
            {
                "count": Out(signed(count_width)),
                "stamp": Out(stamp_width),
                "stamp_a_rise": Out(stamp_width),
                "stamp_b_rise": Out(stamp_width),
                "stamp_a_fall": Out(stamp_width),
                "stamp_b_fall": Out(stamp_width),
                "edge": Out(2),
                "down": Out(1),
                "run": Out(range(model.RUN_MAX + 1)),
            }
        )


class Quadrature(wiring.Component):
    """The position of an encoder, in counts, from its pins A, B and Z; no count is wrong before a flag is up.

    Equation: with (A, B) in the order 00, 10, 11, 01, 00 every edge of the filtered pins counts +1, in the other order
    -1; `invert` swaps the signs. So in a cycle of 4 counts A rises at 0, B rises at 1, A falls at 2, B falls at 3.

    Latency: `latency(glitch_clocks)` = glitch_clocks + 4 clock edges, from the first that sees a changed pin to the
    setting of the new count, both included. Two are for the synchroniser, glitch_clocks + 1 for the filter and one to
    decode and add. Throughput: one edge a clock. All three pins have the same delay.

    Filter: a channel takes a new level once that level was seen at glitch_clocks + 1 successive clocks. A pulse
    shorter than glitch_clocks clocks never passes, and a pulse longer than glitch_clocks + 1 clocks always passes,
    whatever its phase. `glitch_clocks` may change at any time: edges keep their order. If it is lowered while edges of
    both A and B wait, both pass at once, which is `illegal` like any other such pair.

    Speed: the count is exact up to 1 / max(1, (glitch_clocks + 1) / 2) edges a clock. The model derives all of this,
    also for edges out of place (`max_edge_rate`). Beyond that rate `fault` is up no later than the first
    wrong count, whatever the motion. This holds as long as every level of A and of B lasts a clock or more (below 2
    edges a clock). At a steady rate of ideal quadrature above 2 edges a clock it is up within `clocks_to_fault` of the
    model. An exception is the exact range around a multiple of 4: there the samples equal a slow motion's. Two flags
    are for that. `illegal`: A and B changed in one clock; nothing is counted or stamped. `overspeed`: the filter
    rejected a pulse on A or B during which, its first and last clocks included, the other channel had an edge. A lone
    glitch raises neither flag; a glitch that meets an edge of the other channel cannot be distinguished from speed, and
    raises `overspeed`.

    Start: counting starts from the pins as sampled by the first clock after a reset, whatever their levels.

    Index: one edge of Z's pulse, the same from both sides: there Z rises as the count goes up, and falls as it goes
    down. Every edge of A and B looks at Z on its lower side: upwards just before its clock, downwards at it. Take two
    successive edges in one direction, with no slip since the first one. The second one finds an index if Z was 0 at the
    lower and 1 at the upper of them. Its place is the count between the two. So a turn of the handle does not matter,
    nor does a hysteresis of A, B and Z below a count: the pulse's other edge is never taken. The count is beside the
    place by one (below it if the edge counted -1) when the index is found. A pulse between two edges is no index: Z has
    to last a count. An edge of Z that lies on an edge of A or B may come a clock before or after it. It may also lie
    elsewhere upwards than downwards. It is then a count off.

    Slip: after `illegal`, `overspeed`, `wrapped`, another `invert` or `slip` the count belongs no more to the scale. In
    that clock `index_latched` and `referenced` fall. `preload` makes them fall too, because nobody knows by how much it
    moves the count.

    Rounding and overflow: nothing is rounded. `count`, `index_count` and the stamps wrap, `illegal_count` saturates. An
    edge or a shift of the origin that takes the count beyond an end of its range raises `wrapped` with the wrong count.

    Coincidences: no motion is lost. An edge decoded in the clock of `preload` is added to `preload_count`. In the clock
    of `origin_shift` it is added to the moved count. An index latched in the clock of either has the new count.
    `preload` has priority over `origin_shift`. `arm` has priority over an index, which is then not latched; a fault in
    the clock of `clear` stays.

    Parameters
    ----------
    count_width : int
        Bits of the count, 2 to 62.
    stamp_width : int
        Bits of the clock stamps, 1 to 62.
    glitch_width : int
        Bits of `glitch_clocks`, 1 to 16.
    fault_width : int
        Bits of `illegal_count`, 1 to 32.

    Members
    -------
    a, b, z : In(1)
        Pins, asynchronous.
    glitch_clocks : In(glitch_width)
        Largest number of clocks at which a pulse may be seen and still be rejected; 0 filters nothing.
    invert : In(1)
        Reverses the direction of the edges decoded from now on; neither the count nor the stamps change.
    preload : In(1)
        Strobe: sets the count.
    origin_shift : In(1)
        Strobe: moves the origin: adds `preload_count` to the count and to `index_count`.
    preload_count : In(signed(count_width))
        The new count, or what is added to it, counts.
    slip : In(1)
        The count has lost its scale, as somebody else has found.
    arm : In(1)
        Strobe: arms the index latch.
    clear : In(1)
        Strobe: clears `illegal`, `overspeed`, `wrapped` and `illegal_count`.
    seen : Out(Seen)
        Count, stamps and the last edges.
    index_count : Out(signed(count_width))
        Position of the first index after `arm`, counts.
    index_armed, index_latched : Out(1)
        The latch is waiting for an index; `index_count` is its position.
    referenced : Out(1)
        The origin was moved since the index was latched, and nothing has made either void since.
    stepped : Out(1)
        High for one clock with the count of a new edge.
    indexed : Out(1)
        High for one clock with `stepped`, if the edge found an index.
    illegal, overspeed, wrapped : Out(1)
        Sticky flags, see above.
    fault : Out(1)
        Any of them.
    illegal_count : Out(fault_width)
        Illegal changes since `clear`.

    Raises
    ------
    TypeError
        If a width is not an int.
    ValueError
        If a width is out of its range.

    Source: decoding by 4 and the filter of consecutive equal samples are as in decoder chips (HCTL-2022 data sheet,
    Avago, "Digital Noise Filter"; 3 samples there); the flag for edges that such a filter hides is derived in the
    model.
    """

    def __init__(self, count_width: int, stamp_width: int, glitch_width: int = 4, fault_width: int = 8):
        check_int("count_width", count_width, 2, 62)
        check_int("stamp_width", stamp_width, 1, 62)
        check_int("glitch_width", glitch_width, 1, 16)
        check_int("fault_width", fault_width, 1, 32)
        self._count_width = count_width
        self._stamp_width = stamp_width
        self._glitch_width = glitch_width
        self._fault_width = fault_width
        super().__init__(
            {
                "a": In(1),
                "b": In(1),
                "z": In(1),
                "glitch_clocks": In(glitch_width),
                "invert": In(1),
                "preload": In(1),
                "origin_shift": In(1),
                "preload_count": In(signed(count_width)),
                "slip": In(1),
                "arm": In(1),
                "clear": In(1),
                "seen": Out(Seen(count_width, stamp_width)),
                "index_count": Out(signed(count_width)),
                "index_armed": Out(1),
                "index_latched": Out(1),
                "referenced": Out(1),
                "stepped": Out(1),
                "indexed": Out(1),
                "illegal": Out(1),
                "overspeed": Out(1),
                "wrapped": Out(1),
                "fault": Out(1),
                "illegal_count": Out(fault_width),
            }
        )

    @property
    def count_width(self) -> int:
        return self._count_width

    @property
    def stamp_width(self) -> int:
        return self._stamp_width

    @property
    def glitch_width(self) -> int:
        return self._glitch_width

    @property
    def fault_width(self) -> int:
        return self._fault_width

    @property
    def params(self) -> model.Params:
        """Parameters of the twin in `hardwall.model.encoder.quadrature`."""
        return model.Params(self._count_width, self._stamp_width, self._fault_width)

    def latency(self, glitch_clocks: int) -> int:
        """Return the clock edges from the first that sees a pin changed to the new `seen.count`, both included."""
        return model.latency(glitch_clocks)

    def elaborate(self, platform):
        m = Module()
        seen = self.seen
        pins = Signal(3)
        # Three independent bits may share a synchroniser. A reset does not clear it, but `starting` lasts long enough.
        m.submodules.synchroniser = FFSynchronizer(Cat(self.a, self.b, self.z), pins)
        starting = Signal(range(model.START.starting + 1), init=model.START.starting)
        running = starting == 0

        # Filter. The counters run upwards and are compared by >=, which keeps edges in order when the limit changes:
        # of two pending channels the first to leave its level has waited longer, whatever the limit.
        level = Signal(3)
        differs = Signal(3)
        accepted = Signal(3)
        waiting = Signal(3)
        m.d.comb += [differs.eq((pins ^ level) & running.replicate(3)), waiting.eq(differs & ~accepted)]
        for bit, channel in enumerate("abz"):
            held = Signal(self._glitch_width, name=f"held_{channel}")
            m.d.comb += accepted[bit].eq(differs[bit] & (held >= self.glitch_clocks))
            # A waiting channel has held < glitch_clocks, so the sum fits.
            m.d.sync += held.eq(Mux(waiting[bit], (held + 1)[: self._glitch_width], 0))
        pending, moved, up = Signal(3), Signal(3), Signal()
        m.d.sync += [
            pending.eq(waiting),
            level.eq(Mux(running, level ^ accepted, pins)),
            moved.eq(accepted),
            up.eq(level[0] ^ accepted[0] ^ level[1]),
        ]

        # A pulse is rejected when its channel returns to its level while pending.
        previous = Signal(2)
        crossed = Signal(2)
        edges = pins[:2] ^ previous
        crossing = crossed | Cat(edges[1], edges[0])
        outrun = (pending & ~differs & crossing).any()
        m.d.sync += [
            previous.eq(pins[:2]),
            crossed.eq(waiting[:2] & crossing),
            self.overspeed.eq(outrun | (self.overspeed & ~self.clear)),
            starting.eq(Mux(running, 0, (starting - 1)[: len(starting)])),
        ]

        # Decode, a clock after the filter: the filter's comparison and this addition have a clock each.
        one = moved[0] ^ moved[1]
        both = moved[0] & moved[1]
        down = Signal()
        change = Signal(signed(2))
        base, count = Signal.like(seen.count), Signal.like(seen.count)
        held, added = Mux(self.preload, 0, seen.count), Mux(self.preload | self.origin_shift, self.preload_count, 0)
        total, beyond = Signal(signed(self._count_width + 2)), Signal()
        m.d.comb += [
            down.eq(~(up ^ self.invert)),
            change.eq(Mux(one, Mux(down, -1, 1), 0)),
            base.eq((held + added)[: self._count_width]),
            total.eq(held + added + change),
            count.eq(total[: self._count_width]),
            # A count that fits has copies of its sign above it.
            beyond.eq(total[self._count_width - 1 :].any() & ~total[self._count_width - 1 :].all()),
        ]
        index, lost = self._index(m, moved, level, down, outrun)
        m.d.sync += [
            seen.count.eq(count),
            self.stepped.eq(one),
            self.indexed.eq(index),
            self.wrapped.eq(beyond | (self.wrapped & ~self.clear)),
            seen.stamp.eq((seen.stamp + 1)[: self._stamp_width]),
        ]
        for bit, rise, fall in ((0, seen.stamp_a_rise, seen.stamp_a_fall), (1, seen.stamp_b_rise, seen.stamp_b_fall)):
            with m.If(one & moved[bit]):
                with m.If(level[bit]):
                    m.d.sync += rise.eq(seen.stamp)
                with m.Else():
                    m.d.sync += fall.eq(seen.stamp)

        with m.If(one):
            m.d.sync += [
                seen.edge.eq(Cat(moved[1], ~(moved[:2] & level[:2]).any())),
                seen.down.eq(down),
                # The top bit stops the count: RUN_MAX is a power of two.
                seen.run.eq(Mux(seen.down == down, seen.run + ~seen.run[-1], 1)),
            ]
        with m.Elif(both):
            m.d.sync += seen.run.eq(0)

        self._latch(m, index, base, lost, beyond)
        kept = Signal(self._fault_width)
        m.d.comb += [
            kept.eq(Mux(self.clear, 0, self.illegal_count)),
            self.fault.eq(self.illegal | self.overspeed | self.wrapped),
        ]
        m.d.sync += self.illegal.eq(both | (self.illegal & ~self.clear))
        with m.If(both & ~kept.all()):
            m.d.sync += self.illegal_count.eq((kept + 1)[: self._fault_width])
        with m.Else():
            m.d.sync += self.illegal_count.eq(kept)
        return m

    def _index(self, m: Module, moved: Value, level: Value, down: Value, outrun: Value) -> tuple[Value, Value]:
        """Return whether there is an index in this clock, and whether the count loses its scale."""
        one, both = moved[0] ^ moved[1], moved[0] & moved[1]
        inverted, known, below = Signal(), Signal(), Signal()
        lost, index, z = Signal(), Signal(), Signal()
        onward = known & (self.seen.down == down)
        m.d.comb += [
            lost.eq(both | outrun | self.slip | (self.invert ^ inverted)),
            # Z on the lower side of this edge; `below` is the last edge's, if it is known.
            z.eq(level[2] ^ (moved[2] & ~down)),
            index.eq(one & onward & (below == down) & (z != down) & ~lost),
        ]
        m.d.sync += [inverted.eq(self.invert), known.eq((one | known) & ~lost), below.eq(Mux(one, z, below))]
        return index, lost

    def _latch(self, m: Module, index: Value, place: Value, lost: Value, beyond: Value) -> None:
        """Latch the place of an index, move it with the origin, and forget it when the count loses its scale.

        Args:
            m: the module.
            index, place: whether there is an index, and its place.
            lost, beyond: whether the count loses its scale within its range, and whether it does so beyond it. `beyond`
                comes late in a clock.
        """
        latches = self.index_armed & index & ~self.arm
        with m.If(self.arm):
            m.d.sync += [self.index_armed.eq(1), self.index_latched.eq(0)]
        with m.Elif(latches):
            m.d.sync += [self.index_armed.eq(0), self.index_latched.eq(~beyond)]
        with m.Elif(lost | beyond | self.preload):
            m.d.sync += self.index_latched.eq(0)
        with m.If(latches):
            m.d.sync += self.index_count.eq(place)
        with m.Elif(self.origin_shift):
            m.d.sync += self.index_count.eq((self.index_count + self.preload_count)[: self._count_width])
        with m.If(self.arm | self.preload | lost | beyond):
            m.d.sync += self.referenced.eq(0)
        with m.Elif(self.origin_shift & self.index_latched):
            m.d.sync += self.referenced.eq(1)
