"""Two kept edges and the last one, and what passed between them."""

from amaranth.hdl import Array, Module, Mux, Signal
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.estimators import kept_edges as model

from ..block import Block
from ..encoder.quadrature import Seen


class KeptEdges(Block):
    """The counts and the clocks from an edge of half a window to a whole one ago to the last edge, and its age.

    Equation, in counts and clocks, modulo their widths:

        moved = min(|number of the last edge - number of the older|, edges_max),  down = its sign
        time  = stamp of the last edge - stamp of the older
        age   = stamp of the sample - stamp of the last edge

    Every half window the newer of two kept edges becomes the older one, and the last edge the newer. While the older
    is the last edge, `moved`, `down` and `time` are held. Start: `moved` is 0 at the first sample and with `restart`,
    until there are two edges, and once the last edge is forgotten.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with it.

    Rounding and overflow: exact; `moved` is held to `edges_max`. Count and stamps may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.kept_edges.KeptDesign
        Formats; its module derives them.

    Members
    -------
    strobe : In(1)
        Pulse: take the decoder's outputs.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    seen : In(Seen)
        The decoder's outputs.
    moved : Out
        Counts between the two edges, 0 to `edges_max`.
    down : Out(1)
        Whether they go downwards.
    time : Out(stamp_width)
        Clocks between the two edges, 1 or more.
    age : Out(stamp_width)
        Clocks since the last edge, 1 or more if `moved` is not 0.
    news : Out(1)
        Whether there is a new edge, and not the first one.
    quiet : Out(stamp_width)
        The age at the last sample; 0 if there was no edge.
    refuted : In(1)
        Pulse, after `valid` and before the next `strobe`: silence is no evidence for the next `doubt` samples.
    doubted : Out(1)
        Whether it is none now.
    valid : Out(1)
        High for one clock; the others are valid from then until the next `strobe`.

    Raises
    ------
    TypeError
        If `design` is of another class.

    Source: the classical M/T method's edges, kept as the model's module says.
    """

    design_class = model.KeptDesign

    @staticmethod
    def members(design: model.KeptDesign) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "restart": In(1),
            "seen": In(Seen(design.count_width, design.stamp_width)),
            "moved": Out(range(design.edges_max + 1)),
            "down": Out(1),
            "time": Out(design.stamp_width, init=model.NOTHING.time),
            "age": Out(design.stamp_width),
            "news": Out(1),
            "quiet": Out(design.stamp_width),
            "refuted": In(1),
            "doubted": Out(1),
            "valid": Out(1),
        }

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to `valid`."""
        return model.LATENCY

    def elaborate(self, platform):
        m = Module()
        design, seen, most = self._design, self.seen, self._design.edges_max
        number, last_number, newer_number, older_number, moved = (
            Signal(seen.count.shape(), name=name) for name in ("number", "last", "newer", "older", "between")
        )
        stamp, last_stamp, newer_stamp, older_stamp, now, passed = (
            Signal(design.stamp_width, name=name)
            for name in ("stamp", "last_stamp", "newer_stamp", "older_stamp", "now", "passed")
        )
        size = Signal(len(moved))
        running, fresh, known, was_known = Signal(), Signal(), Signal(), Signal()
        phase = Signal(range(design.half + 1))
        stamps = Array([seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall])
        news = (stamp != last_stamp) | (number != last_number)
        young = (self.age != 0) & ~self.age[-2:].all()
        knows = Signal()
        doubt = Signal(range(design.doubt + 1))
        m.d.comb += [
            knows.eq(~fresh & young & (was_known | news)),
            self.news.eq(known & news),
            self.doubted.eq(doubt != 0),
        ]
        begins, due = ~(knows & was_known), phase == design.half - 1
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                m.d.sync += [
                    # The last edge has the number of the cell that it led to, or the next one.
                    number.eq(seen.count + seen.down),
                    stamp.eq(stamps[seen.edge]),
                    now.eq(seen.stamp),
                    last_number.eq(number),
                    last_stamp.eq(stamp),
                    fresh.eq(self.restart | ~running),
                    running.eq(1),
                    was_known.eq(known),
                    self.quiet.eq(Mux(known, self.age, 0)),
                ]
                m.next = "AGE"
            with m.State("AGE"):
                m.d.sync += self.age.eq(now - stamp)
                m.next = "KEEP"
            with m.State("KEEP"):
                m.d.sync += [known.eq(knows), phase.eq(phase + 1)]
                with m.If(begins):
                    m.d.sync += [older_number.eq(number), older_stamp.eq(stamp)]
                with m.Elif(due):
                    m.d.sync += [older_number.eq(newer_number), older_stamp.eq(newer_stamp)]
                with m.If(begins | due):
                    m.d.sync += [newer_number.eq(number), newer_stamp.eq(stamp), phase.eq(0)]
                m.next = "SPAN"
            with m.State("SPAN"):
                # Differences of two numbers and of two stamps are taken modulo their width.
                m.d.sync += [moved.eq(number - older_number), passed.eq(stamp - older_stamp)]
                m.next = "SIZE"
            with m.State("SIZE"):
                m.d.sync += size.eq(Mux(moved < 0, -moved, moved))
                m.next = "HOLD"
            with m.State("HOLD"):
                m.d.sync += doubt.eq(doubt - (doubt != 0))
                with m.If(~known):
                    m.d.sync += [self.moved.eq(0), doubt.eq(0)]
                with m.Elif(passed != 0):
                    m.d.sync += [
                        self.moved.eq(Mux(size > most, most, size)),
                        self.down.eq(moved < 0),
                        self.time.eq(passed),
                    ]
                m.d.sync += self.valid.eq(1)
                m.next = "SAMPLE"
        with m.If(self.refuted):
            m.d.sync += doubt.eq(design.doubt)
        return m
