"""What the decoder promises: no glitch counts, no count is wrong before a flag, and no fault is lost."""

from amaranth.hdl import Cat, Mux, Signal, Value, signed

from hardwall.hdl.encoder.quadrature import Quadrature

from .bench import Bench
from .bugs import Bug
from .property import Property

SYNCHRONISER = 2
STARTING = 3
"""Clocks after a reset in which the levels follow the pins."""


def cell(levels: Value) -> Value:
    """Return the number of a cell in a cycle of four, from the levels of A and B."""
    return Cat(levels[0] ^ levels[1], levels[1])


class IdealFilter:
    """The levels of A, B and Z behind an ideal filter, which knows for how long each pin has had its level.

    Attributes:
        starting: clocks until the levels no longer follow the pins after a reset.
        lasted: for each pin, the successive clocks for which it has had the level that it has now.
        level: the filtered levels.
    """

    def __init__(self, bench: Bench, pins: Value, limit: Value):
        m, seen = bench.m, bench.past(pins, SYNCHRONISER)
        self.seen = seen
        self.starting, self.level, self.lasted = Signal(2, init=STARTING), Signal(3), []
        m.d.sync += self.starting.eq(Mux(self.starting == 0, 0, self.starting - 1))
        for bit in range(3):
            before, now = Signal(5, reset_less=True), Signal(5)
            m.d.sync += before.eq(now)
            m.d.comb += now.eq(Mux(seen[bit] != bench.past(seen[bit]), 1, Mux(before.all(), before, before + 1)))
            with m.If((now > limit) | (self.starting != 0)):
                m.d.sync += self.level[bit].eq(seen[bit])
            self.lasted.append(now)


def a_glitch_never_counts(bench: Bench) -> None:
    pins, limit = bench.free(3), bench.free(4)
    decoder = bench.block(Quadrature(5, 2, 4), a=pins[0], b=pins[1], z=pins[2], glitch_clocks=limit)
    moved = bench.inner["moved"]
    for bit, lasted in enumerate(IdealFilter(bench, pins, limit).lasted):
        bench.promise(bench.inner[f"held_{'abz'[bit]}"] <= bench.past(lasted))
        bench.promise(~moved[bit] | bench.past(lasted > limit))
    still = decoder.seen.count == bench.past(decoder.seen.count)
    asked = bench.past(decoder.preload | decoder.origin_shift)
    bench.promise(still | bench.past(moved[0] ^ moved[1]) | asked | bench.past(bench.reset))


def counts_as_an_ideal_decoder(bench: Bench) -> None:
    pins, limit = bench.free(3), bench.constant(4)
    decoder = bench.block(Quadrature(5, 2, 4, 3), a=pins[0], b=pins[1], z=pins[2], glitch_clocks=limit)
    ideal = IdealFilter(bench, pins, limit)
    for bit, lasted in enumerate(ideal.lasted):
        bench.promise(bench.inner[f"held_{'abz'[bit]}"] <= bench.past(lasted))
        waited = bench.past(bench.inner["waiting"][bit] & ~bench.reset)
        bench.promise(~waited | (bench.inner[f"held_{'abz'[bit]}"] == bench.past(lasted)))
    bench.promise(bench.inner["starting"] == ideal.starting)
    bench.promise(bench.inner["level"] == ideal.level)

    # The level of the last clock, from which a step of more than one cell has no direction.
    before, count, illegal, wrapped = Signal(2), Signal.like(decoder.seen.count), Signal(), Signal()
    step, onward = Signal(2), Signal(signed(len(count) + 2))
    change, moves = Mux(step[0], Mux(step[1] ^ decoder.invert, -1, 1), 0), decoder.preload | decoder.origin_shift
    bench.m.d.comb += [
        step.eq(cell(ideal.level) - cell(before)),
        onward.eq(Mux(decoder.preload, 0, count) + Mux(moves, decoder.preload_count, 0) + change),
    ]
    most = (1 << len(count) - 1) - 1
    bench.m.d.sync += [
        before.eq(Mux(ideal.starting == 0, ideal.level, ideal.seen)[:2]),
        count.eq(onward),
        illegal.eq((step == 2) | illegal & ~decoder.clear),
        wrapped.eq((onward > most) | (onward < -most - 1) | wrapped & ~decoder.clear),
    ]
    bench.promise(decoder.seen.count == count)
    bench.promise(decoder.illegal == illegal)
    bench.promise(decoder.wrapped == wrapped)


def no_wrong_count_before_a_flag(bench: Bench) -> None:
    """Whenever both pins have rested for the decoder's latency, the count is the number of edges, or a fault is up.

    The encoder moves as it likes: at every clock each of A and B may change once. If both do, they do in either order.
    """
    limit, phase, moves, forth = bench.constant(2), bench.constant(2), bench.free(2), bench.free()
    place, level, pins, rested = Signal(signed(4), init=0), Signal(2), Signal(2), Signal(4)
    decoder = bench.block(
        Quadrature(4, 2, 2, 1), a=pins[0], b=pins[1], glitch_clocks=limit, invert=0, preload=0, origin_shift=0, clear=0
    )
    bench.assume(~bench.reset)
    bench.assume((bench.inner["starting"] != STARTING) | (moves == 0))
    now, one = Signal(signed(4)), moves[0] ^ moves[1]
    # From an even cell A is the edge ahead, from an odd cell B.
    ahead = Mux((place + phase)[0], moves[1], moves[0])
    bench.m.d.comb += [
        now.eq(place + Mux(moves.all(), Mux(forth, 2, -2), Mux(one, Mux(ahead, 1, -1), 0))),
        level.eq(now + phase),
        pins.eq(Cat(level[0] ^ level[1], level[1])),
    ]
    bench.m.d.sync += [place.eq(now), rested.eq(Mux(moves.any(), 0, Mux(rested.all(), rested, rested + 1)))]
    bench.promise(decoder.fault | (rested < limit + 3) | (decoder.seen.count == place))
    _on_the_way(bench, decoder, now, phase)


def _on_the_way(bench: Bench, decoder: Quadrature, now: Value, phase: Value) -> None:
    """Promise how far the count may be behind the pins, for the induction: by the edges that the filter still holds."""
    inner = bench.inner
    pins, level, differs, starting = (inner[name] for name in ("synchroniser.pins", "level", "differs", "starting"))
    edges = pins[:2] ^ inner["previous"]
    crossing = inner["crossed"] | Cat(edges[1], edges[0])
    bench.promise(inner["previous"] == bench.past(pins[:2]))
    bench.promise(inner["pending"] == bench.past(inner["waiting"]))
    for clocks in range(1, STARTING):
        bench.promise((starting != STARTING - clocks) | (bench.past(now, clocks) == 0))
    seen = bench.past(now, SYNCHRONISER)
    bench.promise((starting > 1) | (cell(pins) == (seen + phase)[:2]))
    lost = decoder.fault | inner["moved"][:2].all() | (inner["pending"] & ~differs & crossing).any() | (starting != 0)
    behind = Signal(signed(4))
    bench.m.d.comb += behind.eq(seen - inner["count"])
    bench.promise(lost | (cell(level) == (inner["count"] + phase)[:2]))
    # From an even cell a change of A is forward.
    forward = Mux(cell(level)[0], -1, 1)
    first_a, first_b = inner["held_a"] >= inner["held_b"], inner["held_b"] >= inner["held_a"]
    with bench.m.Switch(differs[:2]):
        for pattern, fits in {
            0b00: behind == 0,
            0b01: behind == forward,
            0b10: behind == -forward,
            0b11: first_a & crossing[0] & (behind == 2 * forward) | first_b & crossing[1] & (behind == -2 * forward),
        }.items():
            with bench.m.Case(pattern):
                bench.promise(lost | fits)
    bench.promise((starting == 0) | (inner["count"] == 0) & ~decoder.fault & (inner["moved"] == 0))


def no_fault_is_lost(bench: Bench) -> None:
    decoder = bench.block(Quadrature(5, 2, 2, 3))
    moved, most = bench.inner["moved"], decoder.illegal_count.shape().width
    kept = ~bench.past(decoder.clear) & ~bench.past(bench.reset)
    for flag in (decoder.illegal, decoder.overspeed, decoder.wrapped):
        bench.promise(~(bench.past(flag) & kept) | flag)
    both = bench.past(moved[:2].all()) & ~bench.past(bench.reset)
    before = Mux(bench.past(decoder.clear), 0, bench.past(decoder.illegal_count))
    bench.promise(~both | decoder.illegal)
    bench.promise(
        ~(both | kept) | (decoder.illegal_count == Mux(both & (before != (1 << most) - 1), before + 1, before))
    )
    bench.promise(decoder.fault == (decoder.illegal | decoder.overspeed | decoder.wrapped))


def no_reference_outlasts_a_slip(bench: Bench) -> None:
    decoder = bench.block(Quadrature(4, 2, 2, 1))
    moved, latched, referenced = bench.inner["moved"], decoder.index_latched, decoder.referenced
    fresh = bench.past(bench.reset) | bench.past(bench.reset, 2)
    turned = (bench.past(decoder.invert) ^ bench.past(decoder.invert, 2)) & ~fresh
    rises = (flag & ~bench.past(flag) for flag in (decoder.overspeed, decoder.wrapped))
    flagged = Cat(*rises, bench.past(moved[:2].all())).any()
    slipped = turned | flagged | bench.past(decoder.slip)
    bench.promise(fresh | (bench.inner["inverted"] == bench.past(decoder.invert)))
    bench.promise(~slipped | ~latched & ~referenced)
    bench.promise(~bench.past(decoder.preload | decoder.arm) | ~referenced)
    bench.promise(~referenced | latched)
    shifted = bench.past(decoder.origin_shift & latched) & ~bench.past(bench.reset)
    bench.promise(~referenced | bench.past(referenced) | shifted)
    bench.promise(~latched | bench.past(latched) | bench.past(decoder.index_armed & (moved[0] ^ moved[1])))


def an_index_is_one_edge_of_z(bench: Bench) -> None:
    """Each index is at the cell in which Z rises upwards, and two edges in one direction around it find it.

    Places are quarters of a count. The handle moves by one a clock at most, and Z is high from one place to another.
    """
    rises, falls = bench.constant(signed(6)), bench.constant(signed(6))
    offset, phase, moves = bench.constant(2), bench.constant(2), bench.free(2)
    place, now, level = Signal(signed(6)), Signal(signed(6)), Signal(2)
    there = Signal(signed(7))
    decoder = bench.block(
        Quadrature(4, 2, 1, 1),
        a=level[0] ^ level[1],
        b=level[1],
        z=(rises <= there) & (there < falls),
        **dict.fromkeys(("glitch_clocks", "invert", "preload", "origin_shift", "clear", "slip"), 0),
    )
    inner = bench.inner
    bench.assume(~bench.reset)
    bench.assume((inner["starting"] != STARTING) | (moves == 0))
    bench.m.d.comb += [
        now.eq(place + Mux(moves == 1, 1, Mux(moves == 2, -1, 0))),
        there.eq(now + offset),
        level.eq((there >> 2) + phase),
    ]
    bench.assume((now < 24) & (now >= -24))
    bench.m.d.sync += place.eq(now)

    def high(at: Value) -> Value:
        return (rises <= at) & (at < falls)

    # Behind the synchroniser the levels come, and a clock later the count.
    at_level, at_count = (bench.past(now, SYNCHRONISER + clocks) + offset for clocks in (1, 2))
    running = inner["starting"] == 0
    count, down, level = decoder.seen.count, decoder.seen.down, inner["level"]
    bench.promise(~running | (cell(level) == ((at_level >> 2) + phase)[:2]))
    bench.promise(~running | (level[2] == high(at_level)))
    bench.promise(~bench.past(running) | (inner["moved"] == level ^ bench.past(level)))
    bench.promise(~decoder.fault & (count == at_count >> 2))
    below = Mux(down, count + 1, count) * 4 - 1
    bench.promise(~inner["known"] | (inner["below"] == high(below)))
    mark = Signal(signed(8))
    bench.m.d.comb += mark.eq(Mux(down, count + 1, count - 1))
    onward = decoder.stepped & bench.past(inner["known"]) & (down == bench.past(down))
    bench.promise(decoder.indexed == onward & (mark == rises >> 2) & high(mark * 4 + 3))
    bench.promise(~decoder.index_latched | (decoder.index_count == rises >> 2))


PROPERTIES = [
    Property(
        "an index is at one edge of Z, however the handle moves",
        "quadrature",
        an_index_is_one_edge_of_z,
        depth=6,
        quick=True,
        bugs=(
            Bug(Quadrature._index, "below.eq(Mux(one, z, below))", "below.eq(z)"),
            Bug(Quadrature._index, "(z != down) & ~lost", "(z != down) & ~lost & ~down"),
            Bug(Quadrature._index, "level[2] ^ (moved[2] & ~down)", "level[2]"),
            Bug(Quadrature._index, "(below == down) & ", ""),
        ),
    ),
    Property(
        "a reference is by a latched index, and falls at the clock of a slip",
        "quadrature",
        no_reference_outlasts_a_slip,
        depth=3,
        bugs=(
            Bug(Quadrature._index, "both | outrun | self.slip |", "outrun | self.slip |"),
            Bug(Quadrature._index, "both | outrun | self.slip |", "both | self.slip |"),
            Bug(Quadrature._index, "| (self.invert ^ inverted)", ""),
            Bug(Quadrature._latch, "self.index_latched.eq(~beyond)", "self.index_latched.eq(1)"),
            Bug(Quadrature._latch, "m.If(self.arm | self.preload | lost | beyond)", "m.If(self.arm | lost | beyond)"),
            Bug(Quadrature._latch, "m.Elif(lost | beyond | self.preload)", "m.Elif(beyond | self.preload)"),
        ),
    ),
    Property(
        "a pulse that the filter must reject never counts",
        "quadrature",
        a_glitch_never_counts,
        depth=4,
        quick=True,
        bugs=(
            Bug(Quadrature.elaborate, "held >= self.glitch_clocks", "held + 1 >= self.glitch_clocks"),
            Bug(
                Quadrature.elaborate,
                "Mux(waiting[bit], (held + 1)[: self._glitch_width], 0)",
                "Mux(waiting[bit], (held + 1)[: self._glitch_width], held)",
            ),
        ),
    ),
    Property(
        "the count follows an ideal decoder of the filtered pins",
        "quadrature",
        counts_as_an_ideal_decoder,
        depth=4,
        bugs=(
            Bug(Quadrature.elaborate, "Mux(down, -1, 1)", "Mux(down, 1, 1)"),
            Bug(Quadrature.elaborate, "total[self._count_width - 1 :].any()", "total[self._count_width :].any()"),
            Bug(Quadrature.elaborate, "level ^ accepted, pins", "level ^ accepted, 0"),
        ),
    ),
    Property(
        "no fault is lost between a read and a clear",
        "quadrature",
        no_fault_is_lost,
        depth=4,
        bugs=(
            Bug(Quadrature.elaborate, "both | (self.illegal & ~self.clear)", "(both | self.illegal) & ~self.clear"),
            Bug(Quadrature.elaborate, "both & ~kept.all()", "both"),
        ),
    ),
    Property(
        "the count is right or a fault is up, however the encoder moves",
        "quadrature",
        no_wrong_count_before_a_flag,
        depth=10,
        quick=True,
        bugs=(
            Bug(
                Quadrature.elaborate,
                "self.overspeed.eq(outrun | (self.overspeed & ~self.clear))",
                "self.overspeed.eq(0)",
            ),
        ),
    ),
]
