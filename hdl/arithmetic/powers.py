"""Fractional powers of a magnitude, times constants, from its leading bits."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.arithmetic.powers import STEP_BITS, Design

from ..block import Block
from ..wires import port
from .fixed import shape


class Powers(Block):
    """The terms c_n a^(n/g) 2^(k (g - n) / g) of a magnitude a.

    Equation: D is log2 of the leading bit, less k; Q and R are its quotient and rest by g. A table has an entry for R
    and the three bits below the leading one. A term is this entry, shifted by n Q + k. See
    `hardwall.model.arithmetic.powers`.

    Latency: `latency` clocks from `start` to `done`: the shift that brings the leading one to the top takes two, the
    tables one, the shift of their entries one. A `start` may come at every clock.

    Rounding and overflow: an entry stands for an eighth of an octave; shifts round down; nothing overflows.

    Parameters
    ----------
    design : hardwall.model.arithmetic.powers.Design
        Tables, shifts and widths.

    Members
    -------
    start : In(1)
        Pulse: take `size`.
    size : In
        The magnitude, unsigned.
    octaves : In
        k, signed, within the design's; taken a clock after `start`.
    term_0, term_1, ... : Out
        The terms in the order of the design's, unsigned.
    done : Out(1)
        High in the clock in which the terms of a start are ready.

    Source: the model's module names it.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        terms = {f"term_{number}": Out(width) for number, width in enumerate(design.widths)}
        ports = {"start": In(1), "size": In(design.width), "octaves": In(shape(design.octave_format))}
        return {**ports, **terms, "done": Out(1)}

    def elaborate(self, platform):
        m = Module()
        run = Signal(self.design.latency)
        m.d.sync += run.eq(Cat(self.start, run[:-1]))
        m.d.comb += self.done.eq(run[-1])
        self._read(m)
        return m

    def _read(self, m: Module) -> None:
        """Describe the way from the magnitude to the terms."""
        design = self.design
        octave, step, empty = leading(m, design, self.size, self.octaves)
        quotient, rest = self._divided(m, octave)
        # The octaves that this octave was found with.
        octaves = Signal.like(self.octaves)
        m.d.sync += octaves.eq(self.octaves)
        entry = Cat(step, rest)
        for number, (term, table) in enumerate(zip(design.terms, design.params.tables.tolist(), strict=True)):
            value, most = Signal(design.entry_bits[number], name=f"entry_{number}"), design.most[number]
            down = Signal(
                range(most + 1 - int(design.params.shifts[number]) - design.octaves[0]), name=f"down_{number}"
            )
            amount = times(quotient, term.power) + octaves + int(design.params.shifts[number])
            m.d.sync += [
                value.eq(Mux(empty, 0, entry_of(m, entry, table, f"table_{number}"))),
                down.eq(most - amount),
            ]
            m.d.sync += port(self, f"term_{number}").eq((value << most if most > 0 else value >> -most) >> down)

    def _divided(self, m: Module, octave: Signal) -> tuple[Value, Value]:
        """Return quotient and rest of an octave by the degree."""
        degree, depth = self.design.degree, self.design.depth
        bits = (degree - 1).bit_length()
        if 1 << bits == degree:
            return octave[bits:], octave[:bits]
        both = entry_of(m, octave, [each // degree << bits | each % degree for each in range(depth)], "divided")
        return both[bits:], both[:bits]


def leading(m: Module, design: Design, size: Value, octaves: Value, lowest: int = 0) -> tuple[Signal, Signal, Signal]:
    """Return, two clocks after a magnitude, the number of its octave, the bits below its leading one, and if it is 0.

    The number of the least octave is `lowest`.
    """
    # The shift, by large steps and then by the last three. `up` counts it; zeros come in from below.
    steps = [1 << stage for stage in reversed(range((design.width - 1).bit_length()))]
    early, late = steps[:-STEP_BITS], steps[-STEP_BITS:]
    top, up = _raised(size, early, sum(late))
    partly, above = Signal(len(top)), Signal(max(len(up), 1))
    m.d.sync += [partly.eq(top), above.eq(up)]
    top, up = _raised(partly, late, 0)
    # The number is that of the place at the top, less the shift.
    place = design.width - 1 + design.params.offset
    octave, step, empty = Signal(range(lowest, design.depth)), Signal(STEP_BITS), Signal()
    m.d.sync += [
        octave.eq(place - octaves - Cat(up, above)),
        step.eq(top[-STEP_BITS - 1 : -1]),
        empty.eq(~top[-1]),
    ]
    return octave, step, empty


def times(value: Value, factor: int) -> Value:
    """Return a value times a small constant, by shifts and sums: a product would take a multiplier of the part."""
    return sum((value << place for place in range(factor.bit_length()) if factor >> place & 1), Const(0))


def _raised(value: Value, steps: list[int], later: int) -> tuple[Value, Value]:
    """Return a word shifted to the left by every step that loses no one, and which steps these were, the last first.

    Only the bits are kept that are seen: the first, those behind it, and those that shifts by `later` may bring there.
    """
    shifted = []
    for number, step in enumerate(steps):
        room = value[-step:].any() if step < len(value) else value.any()
        kept = 1 + STEP_BITS + later + sum(steps[number + 1 :])
        both = Mux(room, value, (value << step)[: len(value)])
        value = both[max(len(value) - kept, 0) :]
        shifted.insert(0, ~room)
    return value, Cat(*shifted)


def entry_of(m: Module, address: Value, table: list[int], name: str) -> Signal:
    """Return the entry of a table at an address; beyond its end, what costs least."""
    value = Signal(max(max(table).bit_length(), 1), name=name)
    with m.Switch(address):
        for number, word in enumerate(table):
            with m.Case(number):
                m.d.comb += value.eq(word)
        with m.Default():
            m.d.comb += value.eq(table[-1])
    return value
