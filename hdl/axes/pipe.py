"""The common parts of a pipeline's stages: registers, delays, and a word kept for every axis from pass to pass.

A pass is one sample of one axis on its way through the pipeline. It is in stage s during the s-th clock after its
strobe, which is stage 0; a register loaded in stage s is seen in stage s + 1.
"""

from amaranth.hdl import Cat, Module, Mux, Shape, Signal, Value, unsigned
from amaranth.lib.memory import Memory

from ..axis.capture import NO_FIRST_CONTENTS

RING_LEAST = 5
"""The shortest delay, in clocks, that is a memory instead of registers."""
RING_BITS = 48
"""The fewest bits of registers that a memory replaces: it has rows of 4 bits, and logic of its own to write them."""


class Pipe:
    """The stages of a pipeline that takes one axis a clock.

    Nothing of it needs a reset but `valid`: a pass that a reset ends writes nothing.

    Args:
        m: the module that the pipeline is part of.
        axes: the number of axes.
        axis: the axis in stage 0.
        valid: whether an axis is in stage 0.
    """

    def __init__(self, m: Module, axes: int, axis: Value, valid: Value):
        self.m, self.axes = m, axes
        self._axis, self._valid = [axis], [valid]
        self._places: dict[int, Signal] = {}
        self._rings = 0

    def taken(self, value: Value, name: str | None = None) -> Signal:
        """Return a register that takes `value` at every clock."""
        register = Signal(Value.cast(value).shape(), name=name or "stage", reset_less=True)
        self.m.d.sync += register.eq(value)
        return register

    def axis(self, stage: int) -> Value:
        """Return the number of the axis that is in a stage."""
        while len(self._axis) <= stage:
            self._axis.append(self.taken(self._axis[-1], f"axis_{len(self._axis)}"))
        return self._axis[stage]

    def valid(self, stage: int) -> Value:
        """Return whether an axis is in a stage."""
        while len(self._valid) <= stage:
            register = Signal(name=f"valid_{len(self._valid)}")
            self.m.d.sync += register.eq(self._valid[-1])
            self._valid.append(register)
        return self._valid[stage]

    def turns(self, stage: int) -> list[Value]:
        """Return for every axis whether it is in a stage."""
        return [self.valid(stage) & (self.axis(stage) == number) for number in range(self.axes)]

    def waits(self, name: str, pulses: Value, stage: int) -> Signal:
        """Return for every axis whether a pulse of it came since it was in a stage; one in that very clock waits on.

        Args:
            name: what waits.
            pulses: a bit for every axis.
            stage: the stage that looks at the waiting events.
        """
        waiting = Signal(self.axes, name=f"waiting_{name}")
        self.m.d.sync += waiting.eq(pulses | (waiting & ~Cat(self.turns(stage))))
        return waiting

    def of(self, rows: list[Value], stage: int) -> Value:
        """Return the row of the axis that is in a stage, from one row of each axis."""
        return chosen(self.m, rows, self.axis(stage))

    def later(self, value: Value, stages: int) -> Value:
        """Return `value`, that many stages later."""
        value = Value.cast(value)
        if stages < RING_LEAST or len(value) * stages < RING_BITS:
            for _ in range(stages):
                value = self.taken(value)
            return value
        return self.taken(self._ring(value, stages - 1))

    def _ring(self, value: Value, clocks: int) -> Value:
        """Return a value as it was `clocks` clocks ago: each word of a memory is read in the clock that replaces it."""
        self._rings += 1
        memory = Memory(shape=value.shape(), depth=clocks, init=[], attrs={NO_FIRST_CONTENTS: 1})
        self.m.submodules[f"ring_{self._rings}"] = memory
        write, read = memory.write_port(), memory.read_port(domain="comb")
        place = self._place(clocks)
        self.m.d.comb += [write.addr.eq(place), write.data.eq(value), write.en.eq(1), read.addr.eq(place)]
        return read.data

    def _place(self, clocks: int) -> Signal:
        """Return a counter that goes round in that many clocks."""
        if clocks not in self._places:
            place = Signal(range(clocks), name=f"place_of_{clocks}")
            self.m.d.sync += place.eq(Mux(place == clocks - 1, 0, place + 1))
            self._places[clocks] = place
        return self._places[clocks]

    def kept(self, name: str, shape: Shape | int) -> "Kept":
        """Return a word for every axis, of that shape."""
        return Kept(self, name, shape)


class Kept:
    """A word for every axis: one stage writes it, another reads it. The memory is read within the clock."""

    def __init__(self, pipe: Pipe, name: str, shape: Shape | int):
        self._pipe = pipe
        shape = unsigned(shape) if isinstance(shape, int) else shape
        # A memory of one word would have no address.
        self._memory = Memory(shape=shape, depth=max(pipe.axes, 2), init=[], attrs={NO_FIRST_CONTENTS: 1})
        pipe.m.submodules[name] = self._memory

    def read(self, stage: int) -> Value:
        """Return the word of the axis that is in a stage."""
        port = self._memory.read_port(domain="comb")
        self._pipe.m.d.comb += port.addr.eq(self._pipe.axis(stage))
        return port.data

    def write(self, value: Value, axis: Value, enable: Value) -> None:
        """Keep a value for an axis."""
        port = self._memory.write_port()
        self._pipe.m.d.comb += [port.addr.eq(axis), port.data.eq(value), port.en.eq(enable)]

    def leave(self, stage: int, value: Value) -> None:
        """Keep a value for the axis that is in a stage."""
        self.write(value, self._pipe.axis(stage), self._pipe.valid(stage))


def chosen(m: Module, rows: list[Value], number: Value) -> Value:
    """Return the row of that number; a greater one has the last."""
    row = Signal(Value.cast(rows[0]).shape(), name="chosen")
    with m.Switch(number):
        for case, each in enumerate(rows[:-1]):
            with m.Case(case):
                m.d.comb += row.eq(each)
        with m.Default():
            m.d.comb += row.eq(rows[-1])
    return row
