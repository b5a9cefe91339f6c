"""The capture memory: a ring of records of an axis, one a sample, that freezes behind a trigger."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis import capture
from hardwall.model.axis.capture import (
    DONE,
    FILLING,
    RECORD_REGISTERS,
    REGISTER_BITS,
    SOURCES,
    STATES,
    TRIGGERED,
    WAITING,
)
from hardwall.model.axis.supervisor import TRIPPED
from hardwall.model.register import VALUE_BITS

from ..arithmetic.fixed import shape
from ..block import Block
from ..wires import port

NO_FIRST_CONTENTS = "no_first_contents"
"""The attribute of a memory that is never read before it is written. Its Verilog then has no initial content. Only so
do tools use a part's large memory, which has none."""


class Capture(Block):
    """A ring of records in a memory of one port, which the axis's samples write, and the host reads once it is frozen.

    Equation: the model's, word for word; the model describes states, triggers and records.

    Latency: `data` is the register at `address` one clock later. A record takes 8 clocks from `sampled` on, a register
    each; the capture is done 2 clocks behind its last one.

    Rounding and overflow: of the stamp the low bits are kept; the ring wraps. Nothing else is rounded.

    Reset: no capture; the memory keeps what it holds, and cannot be read.

    Parameters
    ----------
    design : hardwall.model.axis.capture.Design
        Formats and the number of records; its module derives them.

    Members
    -------
    sampled : In(1)
        High for one clock with the changed drive of a sample.
    count, velocity, wall_force : In(SQ) The count of the last sample, and the words made of it: count and force a clock
        before `sampled`.
    acceleration : In(SQ)
        With `velocity`, of an estimator that has one.
    driven : In(SQ)
        The drive that is let out, a clock behind `sampled`.
    state, live : In
        The supervisor's state, and whether the host's heartbeat is not overdue.
    flags : In
        The axis's sticky flags.
    stamp : In
        The number of this clock.
    capture_start, capture_trigger : In(1)
        Pulses: begin a capture, and trigger it by hand.
    one input for each word of `design.words` : In
        Run-time parameters, which act at the next clock.
    address : In A register of the window, which begins with the oldest record.
    data : Out(16)
        The register that `address` had a clock before, if the capture was done then.
    done : Out(1)
        The capture is done, and the memory frozen.
    capture_state : Out(3)
        One of `model.capture.STATES`.
    capture_place, capture_stamp : Out
        The records before the trigger, and the number of the trigger's clock.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = capture.Design

    @staticmethod
    def members(design: capture.Design) -> dict[str, Member]:
        return {
            "sampled": In(1),
            "count": In(shape(design.count)),
            "velocity": In(shape(design.velocity)),
            **({"acceleration": In(shape(design.acceleration))} if design.acceleration else {}),
            "wall_force": In(shape(design.force)),
            "driven": In(shape(design.force)),
            "state": In(2),
            "live": In(1),
            "flags": In(len(design.spec.design.flags)),
            "stamp": In(design.spec.stamp_width),
            "capture_start": In(1),
            "capture_trigger": In(1),
            **{word.name: In(shape(word.format)) for word in design.words},
            "address": In(range(RECORD_REGISTERS * design.records)),
            "data": Out(REGISTER_BITS),
            "done": Out(1),
            "capture_state": Out(range(len(STATES))),
            "capture_place": Out(shape(design.place)),
            "capture_stamp": Out(design.spec.stamp_width),
        }

    def elaborate(self, platform):
        m = Module()
        state, records = self.capture_state, self._design.records
        waiting = (state == FILLING) | (state == WAITING)
        kept, ring = Signal(range(records + 1)), Signal(range(records), reset_less=True)
        seen, trigger = Signal(), Signal()
        m.d.comb += [self.done.eq(state == DONE), trigger.eq(self._trigger(m, seen))]

        # A record is due at 1, and at 0, which is the first behind the start.
        left, due = Signal.like(self.capture_decimation), Signal()
        m.d.comb += due.eq(~left[1:].any())
        with m.If(self.sampled):
            m.d.sync += [left.eq(Mux(due, self.capture_decimation, left - 1)), seen.eq(1)]
        step, writing, ended = Signal(range(RECORD_REGISTERS)), Signal(), Signal()
        begins = self.sampled & due & (waiting | (state == TRIGGERED)) & ~self.capture_start
        m.d.comb += [writing.eq(begins | step.any()), ended.eq(step.all())]
        m.d.sync += step.eq(step + writing)
        with m.If(ended):
            m.d.sync += ring.eq(ring + 1)
            with m.If((state != WAITING) | trigger):
                m.d.sync += kept.eq(kept + 1)
        self._memory(m, ring, step, writing)

        with m.If(trigger & (waiting | self.capture_start)):
            m.d.sync += [state.eq(TRIGGERED), self.capture_place.eq(kept), self.capture_stamp.eq(self.stamp)]
        with m.Elif(self.capture_start):
            m.d.sync += state.eq(FILLING)
        with m.Elif((state == FILLING) & (kept >= self.capture_before)):
            m.d.sync += state.eq(WAITING)
        with m.Elif((state == TRIGGERED) & kept[-1]):
            m.d.sync += state.eq(DONE)
        with m.If(self.capture_start):
            m.d.sync += [kept.eq(0), left.eq(0), step.eq(0), self.capture_place.eq(0), seen.eq(0)]
        return m

    def _trigger(self, m: Module, seen: Signal) -> Value:
        """Return whether a trigger comes at this clock."""
        # The force and the count are there a clock before `sampled`, and have a clock of their own to be looked at.
        contact, under, tripped = Signal(), Signal(), self.state == TRIPPED
        was_in_contact, was_under, was_tripped = Signal(), Signal(), Signal()
        m.d.sync += [
            contact.eq(self.wall_force.any()),
            under.eq(self.count < self.capture_level),
            was_tripped.eq(tripped),
        ]
        with m.If(self.sampled):
            m.d.sync += [was_in_contact.eq(contact), was_under.eq(under)]
        chosen = dict(zip(SOURCES, self.capture_sources, strict=True))
        passed = chosen["contact"] & contact & ~was_in_contact
        passed |= chosen["rise"] & ~under & was_under | chosen["fall"] & under & ~was_under
        trips = chosen["trip"] & tripped & ~was_tripped
        return self.capture_trigger | trips | passed & self.sampled & seen & ~self.capture_start

    def _memory(self, m: Module, ring: Signal, step: Signal, writing: Signal) -> None:
        """Write a record's register at a step, or read what is asked for from the oldest record on."""
        values = [Signal(VALUE_BITS, name=name) for name in ("position", "speed", "force", "marks")]
        flags = Cat(self.state, self.wall_force.any(), self.live, self.flags)
        last = Cat(Cat(self.stamp, Const(0, REGISTER_BITS))[:REGISTER_BITS], flags)
        motion = self.velocity
        if self._design.acceleration:
            motion = Mux(port(self, "capture_acceleration"), port(self, "acceleration"), motion)
        m.d.comb += [to.eq(word) for to, word in zip(values, (self.count, motion, self.driven, last), strict=True)]
        lower, upper, waits = Signal(REGISTER_BITS), Signal(REGISTER_BITS), Signal(REGISTER_BITS)
        with m.Switch(step[1:]):
            for pair, value in enumerate(values):
                with m.Case(pair):
                    m.d.comb += [lower.eq(value), upper.eq(value[REGISTER_BITS:])]
        with m.If(writing & ~step[0]):
            m.d.sync += waits.eq(upper)

        m.submodules.memory = memory = Memory(
            shape=REGISTER_BITS, depth=RECORD_REGISTERS * self._design.records, init=[], attrs={NO_FIRST_CONTENTS: 1}
        )
        write, read = memory.write_port(), memory.read_port()
        place, writes = Signal.like(read.addr), Signal()
        within = Cat(step[0] ^ 1, step[1:])
        low = self.address[: len(step)]
        record = ring + Mux(self.done, self.address[len(step) :], 0)
        m.d.comb += [
            place.eq(Cat(Mux(self.done, low, within), record[: len(ring)])),
            write.addr.eq(place),
            write.data.eq(Mux(step[0], waits, lower)),
            # Tools take one port for both only where both never happen at once.
            writes.eq(writing & ~self.done),
            write.en.eq(writes),
            read.addr.eq(place),
            read.en.eq(self.done),
            self.data.eq(read.data),
        ]
