"""Velocity from the time of whole encoder cycles."""

from amaranth.hdl import Array, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.period import Design
from hardwall.model.quadrature import RUN_MAX

from . import EstimatorBlock
from .divide import Divide


class Observer(wiring.Component):
    """What the stamps of a sample say: times of cycles and gaps between edges, and ages; `model.period.observe`.

    Equation: differences of stamps, modulo their width; the model says which and when they are known.

    Latency: `ready` comes `model.period.OBSERVE_STEPS` clocks after `strobe`; the next `strobe` may come with it.

    Rounding and overflow: exact. `cycles` is held to `design.cycles_max`.

    Parameters
    ----------
    design : model.period.Design or of an estimator with the same widths
        `inputs`, `count_width`, `stamp_width` and `cycles_max`.

    Members
    -------
    strobe, restart, count, ... : In
        As an estimator's.
    news, cycles, cycle, gap, age, cycle_age : Out
        Clocks, counts and cycles: `model.period.Times`; valid from `ready` until the next `strobe`.
    ready : Out(1)
        High for one clock.

    Source: as the estimator's.
    """

    def __init__(self, design):
        width = design.stamp_width
        self._design = design
        super().__init__(
            {
                "strobe": In(1),
                "restart": In(1),
                "count": In(signed(design.count_width)),
                **{name: In(width) for name in design.inputs if name[:5] == "stamp"},
                "edge": In(2),
                "down": In(1),
                "run": In(range(RUN_MAX + 1)),
                "news": Out(1),
                "cycles": Out(range(design.cycles_max + 1)),
                "cycle": Out(width),
                "gap": Out(width),
                "age": Out(width),
                "cycle_age": Out(width),
                "ready": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        width = self._design.stamp_width
        stamps = (self.stamp_a_rise, self.stamp_b_rise, self.stamp_a_fall, self.stamp_b_fall)
        now = Array(Signal(width, name=f"now_{kind}") for kind in range(4))
        before = Array(Signal(width, name=f"before_{kind}") for kind in range(4))
        time = Signal(width)
        edge, run, last_run = Signal.like(self.edge), Signal.like(self.run), Signal.like(self.run)
        down, last_down = Signal(), Signal()
        count = Signal.like(self.count)
        moved = Signal.like(self.count)
        running, first = Signal(), Signal()
        fresh = Signal(4)

        # The four kinds one after the other, from that of the last edge on: a clock to subtract, a clock to judge.
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

        m.d.sync += self.ready.eq(0)
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                m.d.sync += [
                    *(old.eq(new) for old, new in zip(before, now, strict=True)),
                    *(new.eq(stamp) for new, stamp in zip(now, stamps, strict=True)),
                    time.eq(self.stamp),
                    edge.eq(self.edge),
                    kind.eq(self.edge),
                    down.eq(self.down),
                    last_down.eq(down),
                    run.eq(self.run),
                    last_run.eq(run),
                    # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                    moved.eq(self.count - count),
                    count.eq(self.count),
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
                # The edge of this kind that the last sample knew stands so many counts before the last that it saw.
                behind = (-forward)[:2]
                most = self._design.cycles_max
                m.d.sync += [
                    right_age.eq(age),
                    right_known.eq(known),
                    self.age.eq(Mux(last_known & (run != 0), last_age, 0)),
                    fresh.bit_select(judged, 1).eq(known),
                    self.cycles.eq(Mux(one_way & was_known & (behind < last_run), Mux(cycles > most, most, cycles), 0)),
                    kind.eq(edge + 2),
                ]
                m.next = "OPPOSITE"
            with m.State("OPPOSITE"):
                # A neighbour of the last edge's kind is the edge before it, or the one three before; ages tell.
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
                    self.ready.eq(1),
                ]
                m.next = "SAMPLE"
        return m


class Estimator(EstimatorBlock):
    """The mean velocity over whole cycles of the encoder, bounded by the time since the last edge.

    Equation, per sample, in counts and clocks, with c clocks a sample:

        speed    = 4 m c / (time of the last m cycles), or c / (time between the last two edges), or 0
        velocity = sign * min(speed, 3 c / (2 age), 4 c / (age of the edge three before))

    Start: 0 at the first sample and with `restart`, and until there are two edges in one direction.

    Latency: `latency` clocks from `strobe` to `valid`, most of them the divisions', which go side by side; the next
    `strobe` may come with `valid`.

    Rounding and overflow: rounds half up in magnitude; saturates at the velocity format, with a flag. Count and stamps
    may wrap.

    Parameters
    ----------
    design : hardwall.model.period.Design
        Formats; its module derives them.

    Source: Brown, Schneider, Mulligan 1992; Ohmae et al. 1982.
    """

    def __init__(self, design: Design):
        super().__init__(design, Design)

    def elaborate(self, platform):
        m = Module()
        design = self._design
        width, clocks = design.stamp_width, design.clocks
        quotient_width, fraction = design.velocity.width, design.velocity.f + 1

        m.submodules.times = times = Observer(design)
        for name in ("strobe", "restart", *design.inputs):
            m.d.comb += getattr(times, name).eq(getattr(self, name))

        # The speed's quotient is held until there is another edge.
        scaled = Signal(range(4 * clocks * design.cycles_max + 1))
        whole = times.cycles != 0
        m.submodules.speed = speed = Divide(len(scaled) + fraction, width, quotient_width)
        m.submodules.limit = limit = Divide((8 * clocks << (fraction - 1)).bit_length(), width, quotient_width)
        tighter = Signal()
        m.d.sync += [
            scaled.eq(times.cycles * (4 * clocks)),
            tighter.eq((times.cycle_age != 0) & (times.age << 3 < times.cycle_age * 3)),
        ]
        m.d.comb += [
            speed.dividend.eq(Mux(whole, scaled, clocks) << fraction),
            speed.divisor.eq(Mux(whole, times.cycle, times.gap)),
            limit.dividend.eq(Mux(tighter, 8 * clocks, 3 * clocks) << (fraction - 1)),
            limit.divisor.eq(Mux(tighter, times.cycle_age, times.age)),
        ]

        moving = Signal()
        least = Signal(quotient_width)
        down = Signal()
        far = (least + 1) >> 1
        saturated = far > design.velocity.max
        magnitude = Mux(saturated, design.velocity.max, far)
        m.d.sync += self.valid.eq(0)
        with m.If(self.strobe):
            m.d.sync += down.eq(self.down)
        with m.FSM():
            with m.State("OBSERVE"), m.If(times.ready):
                m.d.comb += limit.start.eq(1)
                with m.If(times.age == 0):
                    m.d.sync += moving.eq(0)
                with m.Elif(times.news):
                    m.d.comb += speed.start.eq(1)
                    m.d.sync += moving.eq(whole | (times.gap != 0))
                m.next = "TIGHTEN"
            with m.State("TIGHTEN"), m.If(limit.done):
                slower = speed.quotient < limit.quotient
                m.d.sync += least.eq(Mux(moving, Mux(slower, speed.quotient, limit.quotient), 0))
                m.next = "OUTPUT"
            with m.State("OUTPUT"):
                m.d.sync += [
                    self.velocity.eq(Mux(down, -magnitude, magnitude)),
                    self.saturated.eq(saturated),
                    self.valid.eq(1),
                ]
                m.next = "OBSERVE"
        return m
