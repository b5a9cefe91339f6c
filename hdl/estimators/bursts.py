"""A watch over the stamps of edges: whether an encoder emits its edges in bursts."""

from amaranth.hdl import Array, Module, Mux, Signal
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.estimators import bursts as model

from ..block import Block
from ..encoder.quadrature import Seen


class Bursts(Block):
    """Whether edges come faster after silences than any axis can, again and again.

    Equation, with the age and the count of the sample before the first edges in `window` samples:

        jolt = three edges in one direction within `span` clocks, and 4 (their clocks + 1) < that age

    `found` is 1 from the third jolt on. The jolts have an age of more than `tolerated`, and each comes within `memory`
    samples of the one before. `found` stays 1 until none comes. The model's module derives the limits.

    Latency: `latency` clocks from `strobe` to both outputs; the next `strobe` may come no earlier.

    Rounding and overflow: exact; ages are cut off at what every jolt has. Count and stamps may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.bursts.Limits
        Widths and limits.

    Members
    -------
    strobe : In(1)
        Pulse: take a sample.
    restart : In(1)
        With `strobe`: forget everything.
    seen : In(Seen)
        The decoder's outputs.
    jolt : Out(1)
        Whether this sample has a jolt.
    found : Out(1)
        Whether edges come in bursts.

    Raises
    ------
    TypeError
        If `design` is of another class.

    Source: this project's.
    """

    design_class = model.Limits

    @staticmethod
    def members(design: model.Limits) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "restart": In(1),
            "seen": In(Seen(design.count_width, design.stamp_width)),
            "jolt": Out(1),
            "found": Out(1),
        }

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to both outputs."""
        return model.LATENCY

    def elaborate(self, platform):
        m = Module()
        limits, seen, longest = self._design, self.seen, model.longest(self._design)
        stamps = Array([seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall])
        stamp, age, span = (Signal(limits.stamp_width, name=name) for name in ("stamp", "age", "span"))
        low, last, base, went, above = (
            Signal(min(model.MOVED_BITS, limits.count_width), name=name)
            for name in ("low", "last", "base", "went", "above")
        )
        quiet, silence = Signal(range(longest + 1)), Signal(range(longest + 1))
        edge, running, fresh, news, together = Signal(2), Signal(), Signal(), Signal(), Signal()
        window, left = Signal(range(limits.window + 1)), Signal(range(limits.memory + 1))
        events = Signal(range(model.EVENTS + 1))
        # Fewer than EDGES counts either way are from 0 to twice as many above the least of them, modulo their width.
        near = above <= 2 * (model.EDGES - 1)
        m.d.comb += [
            self.found.eq(events == model.EVENTS),
            went.eq(low - base),
            above.eq(went + (model.EDGES - 1)),
        ]
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                newest = stamps[seen.edge]
                m.d.sync += [
                    news.eq((newest != stamp) | (seen.edge != edge)),
                    together.eq(seen.run >= model.EDGES),
                    fresh.eq(self.restart | ~running),
                    running.eq(1),
                    edge.eq(seen.edge),
                    stamp.eq(newest),
                    # The edge two before the last one of a run is of the opposite kind.
                    span.eq(stamps[seen.edge ^ 2]),
                    age.eq(seen.stamp),
                    low.eq(seen.count),
                    last.eq(low),
                    window.eq(window - (window != 0)),
                    left.eq(left - (left != 0)),
                ]
                m.next = "SILENCE"
            with m.State("SILENCE"):
                m.d.sync += [span.eq(stamp - span), age.eq(age - stamp)]
                with m.If(left == 0):
                    m.d.sync += events.eq(0)
                with m.If(news & ((window == 0) | (quiet > silence))):
                    m.d.sync += [silence.eq(quiet), base.eq(last), window.eq(limits.window)]
                m.next = "JUDGE"
            with m.State("JUDGE"):
                close = (span <= limits.span) & (((span + 1) << 2) < silence)
                jolt = ~fresh & news & (window != 0) & together & ~near & close
                m.d.sync += [quiet.eq(Mux(age > longest, longest, age)), self.jolt.eq(jolt)]
                with m.If(fresh | jolt):
                    m.d.sync += [silence.eq(0), window.eq(0)]
                with m.If(fresh):
                    m.d.sync += [events.eq(0), left.eq(0)]
                with m.Elif(jolt & (silence > limits.tolerated)):
                    m.d.sync += [events.eq(events + (events != model.EVENTS)), left.eq(limits.memory)]
                m.next = "SAMPLE"
        return m
