"""The M/T method: counts between two edges that are a window apart, over the time between them."""

from types import SimpleNamespace

from amaranth.hdl import Array, Module, Mux, Signal

from hardwall.model.estimators.mt import Design

from ..arithmetic.divide import Divide
from .estimate import EstimatorBlock


class Estimator(EstimatorBlock):
    """The mean velocity from an edge of half a window to a whole one ago to the last edge, bounded by the time since.

    Equation, per sample, in counts and clocks, with c clocks a sample:

        speed    = c |number of the last edge - number of the older| / (stamp of the last edge - stamp of the older)
        velocity = sign * min(speed, 3 c / (2 age))

    Every half window the newer of two kept edges becomes the older one, and the last edge the newer. While the older
    is the last edge, the speed is held. Start: 0 at the first sample and with `restart`, and until there are two edges.

    Latency: `latency` clocks from `strobe` to `valid`, most of them for the two divisions, which run in parallel; the
    next `strobe` may come with `valid`.

    Rounding and overflow: rounds half up in magnitude; saturates at the velocity format, with a flag. Count and stamps
    may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.mt.Design
        Formats; its module derives them.

    Source: Ohmae, Matsuda, Kamiyama, Tachikawa 1982.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design = self._design
        shapes = {
            "number": self.seen.count.shape(),
            "moved": self.seen.count.shape(),
            "stamp": design.stamp_width,
            "age": design.stamp_width,
            "span": design.stamp_width,
            "known": 1,
            "moving": 1,
            "down": 1,
            "scaled": range(design.clocks * design.edges_max + 1),
        }
        s = SimpleNamespace(**{name: Signal(of, name=name) for name, of in shapes.items()})
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            self._observe(m, s)
            self._scale(m, s)
            self._divide(m, s)
        return m

    def _observe(self, m: Module, s: SimpleNamespace) -> None:
        """Add the states that take the last edge and keep the two before it, up to what passed since the older."""
        design, seen = self._design, self.seen
        last_number, newer_number, older_number = Signal.like(s.number), Signal.like(s.number), Signal.like(s.number)
        last_stamp, newer_stamp, older_stamp = Signal.like(s.stamp), Signal.like(s.stamp), Signal.like(s.stamp)
        time = Signal(design.stamp_width)
        running, fresh, was_known = Signal(), Signal(), Signal()
        phase = Signal(range(design.half + 1))
        stamps = Array([seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall])
        news = (s.stamp != last_stamp) | (s.number != last_number)
        known = ~fresh & (s.age != 0) & ~s.age[-2:].all() & (was_known | news)
        with m.State("SAMPLE"), m.If(self.strobe):
            m.d.sync += [
                # The last edge has the number of the cell that it led to, or the next one.
                s.number.eq(seen.count + seen.down),
                s.stamp.eq(stamps[seen.edge]),
                time.eq(seen.stamp),
                last_number.eq(s.number),
                last_stamp.eq(s.stamp),
                fresh.eq(self.restart | ~running),
                running.eq(1),
                was_known.eq(s.known),
            ]
            m.next = "AGE"
        with m.State("AGE"):
            m.d.sync += s.age.eq(time - s.stamp)
            m.next = "KEEP"
        with m.State("KEEP"):
            m.d.sync += [s.known.eq(known), phase.eq(phase + 1)]
            with m.If(~(known & was_known)):
                m.d.sync += [older_number.eq(s.number), older_stamp.eq(s.stamp)]
            with m.Elif(phase == design.half - 1):
                m.d.sync += [older_number.eq(newer_number), older_stamp.eq(newer_stamp)]
            with m.If(~(known & was_known) | (phase == design.half - 1)):
                m.d.sync += [newer_number.eq(s.number), newer_stamp.eq(s.stamp), phase.eq(0)]
            m.next = "SPAN"
        with m.State("SPAN"):
            # Differences of two numbers and of two stamps are taken modulo their width.
            m.d.sync += [s.moved.eq(s.number - older_number), s.span.eq(s.stamp - older_stamp)]
            m.next = "SIZE"

    def _scale(self, m: Module, s: SimpleNamespace) -> None:
        """Add the states that take the magnitude of the counts, and multiply it by the clocks of a sample."""
        most = self._design.edges_max
        size, counts = Signal(len(s.moved)), Signal(range(most + 1))
        with m.State("SIZE"):
            m.d.sync += size.eq(Mux(s.moved < 0, -s.moved, s.moved))
            m.next = "LIMIT"
        with m.State("LIMIT"):
            m.d.sync += counts.eq(Mux(size > most, most, size))
            m.next = "SCALE"
        with m.State("SCALE"):
            m.d.sync += s.scaled.eq(counts * self._design.clocks)
            m.next = "DIVIDE"

    def _divide(self, m: Module, s: SimpleNamespace) -> None:
        """Add the two divisions, and the states that take the lesser quotient."""
        design = self._design
        width, fraction, bound = design.velocity.width, design.velocity.f + 1, 3 * design.clocks << design.velocity.f
        m.submodules.speed = speed = Divide(len(s.scaled) + fraction, len(s.span), width)
        m.submodules.limit = limit = Divide(bound.bit_length(), len(s.age), width)
        m.d.comb += [
            speed.dividend.eq(s.scaled << fraction),
            speed.divisor.eq(s.span),
            limit.dividend.eq(bound),
            limit.divisor.eq(s.age),
        ]
        least = Signal(width)
        far = (least + 1) >> 1
        saturated = far > design.velocity.max
        magnitude = Mux(saturated, design.velocity.max, far)
        with m.State("DIVIDE"):
            m.d.comb += limit.start.eq(1)
            with m.If(~s.known):
                m.d.sync += s.moving.eq(0)
            with m.Elif(s.span != 0):
                m.d.comb += speed.start.eq(1)
                m.d.sync += [s.moving.eq(1), s.down.eq(s.moved < 0)]
            m.next = "LEAST"
        with m.State("LEAST"), m.If(limit.done):
            slower = speed.quotient < limit.quotient
            m.d.sync += least.eq(Mux(s.moving, Mux(slower, speed.quotient, limit.quotient), 0))
            m.next = "OUTPUT"
        with m.State("OUTPUT"):
            m.d.sync += [
                self.velocity.eq(Mux(s.down, -magnitude, magnitude)),
                self.saturated.eq(saturated),
                self.valid.eq(1),
            ]
            m.next = "SAMPLE"
