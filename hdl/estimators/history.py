"""The past positions of an axis, in block RAM."""

from amaranth.hdl import Module, Mux, Signal, signed, unsigned
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.estimators.history import Design

from ..arithmetic.fixed import saturate
from ..block import Block


class History(Block):
    """The sum of the count's changes, stored every `design.every` samples, and its change since an older stored sum.

    Equation: position <- position + limit(count - last count), modulo 2**width; 0 at the first sample, and with
    `restart`. change = position - (the position stored `age` stored positions before, 0 if that was before the first).

    Latency: `latency` clocks from `strobe` to `valid`. `change` is ready 2 clocks after its `age`, and not before 1
    clock after `valid`; an age may come every clock. The next `strobe` may come 1 clock after `valid`.

    Rounding and overflow: the change of a sample is limited, with `limited`; everything else is exact. The count may
    wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.history.Design
        Formats; its module derives them.

    Members
    -------
    strobe : In(1)
        Pulse: take `count`.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    count : In(signed)
        Position, counts; may wrap.
    valid : Out(1)
        High for one clock.
    stored : Out(1)
        From `valid` until the next strobe: this sample's position was stored.
    limited : Out(1)
        Until the next `valid`: this sample's change was limited.
    age : In
        Stored positions to go back, 1 or more.
    change : Out(signed)
        Change of the position, counts, if the newest position is stored.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "restart": In(1),
            "count": In(signed(design.count_width)),
            "valid": Out(1),
            "stored": Out(1),
            "limited": Out(1),
            "age": In(design.age_bits),
            "change": Out(signed(design.width)),
        }

    def elaborate(self, platform):
        m = Module()
        design = self._design
        running, taken, summed = Signal(), Signal(), Signal()
        last, moved = Signal.like(self.count), Signal.like(self.count)
        step = Signal(signed(design.change.i))
        position = Signal(signed(design.width))
        phase = Signal(range(max(design.every, 2)))
        head, known = Signal(design.age_bits), Signal(design.age_bits)

        m.d.sync += [taken.eq(self.strobe), summed.eq(taken), self.valid.eq(summed)]
        with m.If(self.strobe):
            fresh = self.restart | ~running
            due = fresh | (phase == design.every - 1)
            # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
            m.d.sync += [
                moved.eq(Mux(fresh, 0, (self.count - last)[: len(moved)].as_signed())),
                last.eq(self.count),
                running.eq(1),
                phase.eq(Mux(due, 0, phase + 1)),
                self.stored.eq(due),
            ]
            with m.If(due):
                m.d.sync += head.eq(head + 1)
            with m.If(fresh):
                m.d.sync += [position.eq(0), known.eq(0)]
            with m.Elif(due & ~known.all()):
                m.d.sync += known.eq(known + 1)

        held = saturate(moved, -design.change.max, design.change.max)
        with m.If(taken):
            m.d.sync += [step.eq(held), self.limited.eq(held != moved)]
        with m.If(summed):
            m.d.sync += position.eq(position + step)

        m.submodules.positions = memory = Memory(shape=unsigned(design.width), depth=1 << design.age_bits, init=[])
        write, read = memory.write_port(), memory.read_port()
        before_start = Signal()
        m.d.comb += [
            write.addr.eq(head),
            write.data.eq(position),
            write.en.eq(self.valid & self.stored),
            read.addr.eq(head - self.age),
            read.en.eq(1),
        ]
        older = Mux(before_start, 0, read.data)
        m.d.sync += [before_start.eq(self.age > known), self.change.eq(position - older)]
        return m
