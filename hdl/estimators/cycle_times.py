"""Times of whole encoder cycles, from the clock stamps of edges."""

from amaranth.hdl import Array, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.checks import check_int
from hardwall.model.encoder.quadrature import RUN_MAX
from hardwall.model.estimators import cycle_times as model

from ..encoder.quadrature import Seen


class CycleTimes(wiring.Component):
    """Times of cycles and of gaps between edges, and ages of edges, from the stamps of a sample.

    Equation: differences of stamps, modulo their width; `hardwall.model.estimators.cycle_times` defines them.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with it.

    Rounding and overflow: exact. `cycles` is held to `cycles_max`; count and stamps may wrap.

    Parameters
    ----------
    count_width : int
        Bits of the count, 2 to 62.
    stamp_width : int
        Bits of the clock stamps, 3 to 62.
    cycles_max : int
        Largest number of cycles that `cycles` can show, 1 or more.

    Members
    -------
    strobe : In(1)
        Pulse: take the decoder's outputs.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    seen : In(Seen)
        The decoder's outputs.
    news : Out(1)
        Whether there is a new edge.
    cycles : Out
        Number of whole cycles in one direction, in the time `cycle`, that ended with the last edge; 0: none.
    cycle, gap : Out(stamp_width)
        Clocks of those cycles, and clocks between the last two edges (0: not known).
    age, cycle_age : Out(stamp_width)
        Clocks since the last edge and since the edge three before it; 0: not known, or too long.
    valid : Out(1)
        High for one clock; the others are valid from then until the next `strobe`.

    Raises
    ------
    TypeError
        If a parameter is not an int.
    ValueError
        If a parameter is out of range.

    Source: Brown, Schneider, Mulligan 1992: fixed position, by full cycles.
    """

    def __init__(self, count_width: int, stamp_width: int, cycles_max: int):
        check_int("count_width", count_width, 2, 62)
        check_int("stamp_width", stamp_width, 3, 62)
        check_int("cycles_max", cycles_max, 1)
        self._cycles_max = cycles_max
        super().__init__(
            {
                "strobe": In(1),
                "restart": In(1),
                "seen": In(Seen(count_width, stamp_width)),
                "news": Out(1),
                "cycles": Out(range(cycles_max + 1)),
                "cycle": Out(stamp_width),
                "gap": Out(stamp_width),
                "age": Out(stamp_width),
                "cycle_age": Out(stamp_width),
                "valid": Out(1),
            }
        )

    @property
    def count_width(self) -> int:
        return len(self.seen.count)

    @property
    def stamp_width(self) -> int:
        return len(self.seen.stamp)

    @property
    def cycles_max(self) -> int:
        return self._cycles_max

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to `valid`."""
        return model.LATENCY

    def elaborate(self, platform):
        m = Module()
        seen = self.seen
        width = len(seen.stamp)
        stamps = (seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall)
        now = Array(Signal(width, name=f"now_{kind}") for kind in range(4))
        before = Array(Signal(width, name=f"before_{kind}") for kind in range(4))
        time = Signal(width)
        edge, run, last_run = Signal.like(seen.edge), Signal.like(seen.run), Signal.like(seen.run)
        down, last_down = Signal(), Signal()
        count = Signal.like(seen.count)
        moved = Signal.like(seen.count)
        running, first = Signal(), Signal()
        fresh = Signal(4)

        # The four kinds follow each other, beginning with the last edge's: one clock to subtract, one clock to judge.
        kind, judged = Signal(2), Signal(2)
        age, change = Signal(width), Signal(width)
        known = Signal()
        m.d.comb += known.eq(~first & ((change != 0) | (fresh.bit_select(judged, 1) & ~age[-2:].all())))
        m.d.sync += [age.eq(time - now[kind]), change.eq(now[kind] - before[kind]), judged.eq(kind)]

        last_age, right_age, newer = Signal(width), Signal(width), Signal(width)
        last_known, was_known, right_known = Signal(), Signal(), Signal()
        forward = Signal(signed(len(count) + 1))
        one_way = Signal()
        cycles = Signal(len(count) + 1)
        left_first = Signal()
        m.d.comb += [
            left_first.eq(known & ~(right_known & (right_age < age))),
            cycles.eq((forward + 3) >> 2),
        ]

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                m.d.sync += [
                    *(old.eq(new) for old, new in zip(before, now, strict=True)),
                    *(new.eq(stamp) for new, stamp in zip(now, stamps, strict=True)),
                    time.eq(seen.stamp),
                    edge.eq(seen.edge),
                    kind.eq(seen.edge),
                    down.eq(seen.down),
                    last_down.eq(down),
                    run.eq(seen.run),
                    last_run.eq(run),
                    # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                    moved.eq(seen.count - count),
                    count.eq(seen.count),
                    first.eq(self.restart | ~running),
                    running.eq(1),
                ]
                m.next = "LAST"
            with m.State("LAST"):
                m.d.sync += [forward.eq(Mux(down, -moved, moved)), kind.eq(edge + 1)]
                m.next = "RIGHT"
            with m.State("RIGHT"):
                m.d.sync += [
                    self.cycle.eq(change),
                    self.news.eq(change != 0),
                    last_age.eq(age),
                    last_known.eq(known),
                    was_known.eq(fresh.bit_select(edge, 1)),
                    fresh.bit_select(judged, 1).eq(known),
                    one_way.eq((down == last_down) & (forward > 0) & ((run == RUN_MAX) | (run == last_run + forward))),
                    kind.eq(edge - 1),
                ]
                m.next = "LEFT"
            with m.State("LEFT"):
                # The last sample's edge of this kind is so many counts before its last edge.
                behind = (-forward)[:2]
                held = Mux(cycles > self._cycles_max, self._cycles_max, cycles)
                m.d.sync += [
                    right_age.eq(age),
                    right_known.eq(known),
                    self.age.eq(Mux(last_known & (run != 0), last_age, 0)),
                    fresh.bit_select(judged, 1).eq(known),
                    self.cycles.eq(Mux(one_way & was_known & last_known & (behind < last_run), held, 0)),
                    kind.eq(edge + 2),
                ]
                m.next = "OPPOSITE"
            with m.State("OPPOSITE"):
                # The two neighbouring kinds belong to the edge before and to the edge three before; ages tell which.
                both = known & right_known & last_known & (run == RUN_MAX)
                either = (known | right_known) & last_known & (run >= 2)
                m.d.sync += [
                    newer.eq(Mux(either, Mux(left_first, age, right_age), last_age)),
                    self.cycle_age.eq(Mux(both, Mux(right_age < age, age, right_age), 0)),
                    fresh.bit_select(judged, 1).eq(known),
                ]
                m.next = "GAP"
            with m.State("GAP"):
                m.d.sync += [
                    self.gap.eq(newer - last_age),
                    fresh.bit_select(judged, 1).eq(known),
                    self.valid.eq(1),
                ]
                m.next = "SAMPLE"
        return m
