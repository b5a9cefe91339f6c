"""The finite difference over a chosen window, an axis a clock: its quotient is a stage for every few bits."""

from amaranth.hdl import C, Cat, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory

from hardwall.model.arithmetic.signed_divide import BITS_PER_CLOCK
from hardwall.model.estimators import history
from hardwall.model.estimators.window import Design

from ..arithmetic.fixed import negated, saturate
from ..axis.capture import NO_FIRST_CONTENTS
from .estimator import Entered, Estimate, moved_since
from .pipe import Pipe


def estimate(pipe: Pipe, design: Design, entered: Entered) -> Estimate:
    """Return the estimate of `hardwall.hdl.estimators.window`, as many stages later as the model's `PIPELINES` says."""
    at, past = entered.stage, design.history
    length = entered.word("window_length", at + 1)
    # A window has at least one sample.
    length = pipe.taken(Mux(length == 0, 1, length)[: len(length)], "length")
    change, stored, limited = _change(pipe, past, entered, length)

    size = pipe.taken(negated(change, change[-1])[: past.width], "size")
    quotient, steps = _quotient(pipe, size << design.fraction, pipe.later(length, 4), design.velocity.width - 1)
    negative, end = pipe.later(change[-1], 1 + steps), at + 6 + steps
    # The quotient always fits, so a velocity of this magnitude and sign does too.
    velocity = Mux(negative, -quotient, quotient)[: design.velocity.width].as_signed()
    if past.every > 1:
        before = pipe.kept("last_velocity", velocity.shape())
        velocity = Mux(pipe.later(stored, end - at - 1), velocity, before.read(end))[: len(velocity)].as_signed()
        before.leave(end, velocity)
    return Estimate(pipe.taken(velocity, "velocity"), pipe.later(limited, end - at - 1))


def _change(pipe: Pipe, past: history.Design, entered: Entered, length: Value) -> tuple[Value, Value, Value]:
    """Return the change of the position over the window, 5 stages later, and from 2 on: whether the position is stored,
    and whether the change of the sample was limited."""
    at, fresh = entered.stage, entered.fresh
    stored = C(1, 1)
    if past.every > 1:
        phase = pipe.kept("phase", (past.every - 1).bit_length())
        sample = phase.read(at)
        stored = fresh | sample.all()
        phase.leave(at, Mux(stored, 0, sample + 1))
    head, known = pipe.kept("head", past.age_bits), pipe.kept("known", past.age_bits)
    next_head = (Mux(fresh, 0, head.read(at)) + stored)[: past.age_bits]
    count_of_known = known.read(at)
    next_known = Mux(fresh, 0, count_of_known + (stored & ~count_of_known.all()))[: past.age_bits]
    head.leave(at, next_head)
    known.leave(at, next_known)
    head_now, known_now = pipe.later(next_head, 2), pipe.later(next_known, 2)
    stored = pipe.taken(stored, "stored")

    moved = moved_since(pipe, past, entered)
    held = saturate(moved, -past.change.max, past.change.max)
    limited = pipe.taken(held != moved, "limited")
    step = pipe.taken(held[: past.change.width].as_signed(), "step")
    last = pipe.kept("position", past.width)
    position = (Mux(pipe.later(fresh, 2), 0, last.read(at + 2).as_signed()) + step)[: past.width]
    last.leave(at + 2, position)
    position = pipe.taken(position, "position")

    older = _older(pipe, past, at + 3, position, head_now, pipe.later(stored, 2), length)
    older = Mux(pipe.later(length > known_now, 2), 0, older)
    change = (pipe.taken(position) - older)[: past.width].as_signed()
    return pipe.taken(change, "change"), stored, limited


def _older(
    pipe: Pipe, past: history.Design, stage: int, position: Value, head: Value, stored: Value, back: Value
) -> Value:
    """Store the position in that stage; a stage later, return the position stored `back` positions before it.

    Args:
        head: its place among its axis's positions.
        stored: whether it is to be stored.
        back: as above, a stage earlier.
    """
    m = pipe.m
    memory = Memory(shape=past.width, depth=pipe.axes << past.age_bits, init=[], attrs={NO_FIRST_CONTENTS: 1})
    m.submodules.positions = memory
    write, read = memory.write_port(), memory.read_port()
    place = pipe.taken((head - back)[: past.age_bits], "place")
    m.d.comb += [
        write.addr.eq(Cat(pipe.later(head, 1), pipe.axis(stage))),
        write.data.eq(position),
        write.en.eq(pipe.valid(stage) & stored),
        read.addr.eq(Cat(place, pipe.axis(stage))),
        read.en.eq(1),
    ]
    return read.data


def _quotient(pipe: Pipe, dividend: Value, divisor: Value, bits: int) -> tuple[Value, int]:
    """Return floor(dividend / divisor), which has no more than so many bits, and in how many stages it is ready."""
    steps = -(-bits // BITS_PER_CLOCK)
    first = steps * BITS_PER_CLOCK
    remainder, digits = dividend[first:], Cat(dividend[:first], C(0, max(first - len(dividend), 0)))
    for _ in range(steps):
        for _ in range(BITS_PER_CLOCK):
            taken = Cat(digits[-1], remainder)[: len(divisor) + 1]
            less = Signal(signed(len(divisor) + 2), name="less")
            pipe.m.d.comb += less.eq(taken - divisor)
            remainder, digits = Mux(less[-1], taken, less)[: len(divisor)], Cat(~less[-1], digits[:-1])
        remainder, digits = pipe.taken(remainder, "remainder"), pipe.taken(digits, "digits")
        divisor = pipe.taken(divisor, "divisor")
    return digits[:bits], steps
