"""What is mapped to every family: the cells that need a model of ours, the axis, and the board."""

from collections.abc import Callable
from dataclasses import dataclass

from amaranth.hdl import Module, Mux, Signal, signed, unsigned
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.axis.capture import NO_FIRST_CONTENTS
from hardwall.model.axis.capture import RECORDS
from oracles.board import board_of
from stimuli.axes import busy

WIDTH = 18
SIGNS = tuple((a, b) for a in (unsigned, signed) for b in (unsigned, signed))


class Cells(wiring.Component):
    """Products of every kind of sign, memories that are read while they are written, and a large one of one port.

    What a memory shows before its first clock is left open by RTL and data sheets alike, and is not shown.

    Attributes:
        memories: the width and the number of words of every memory, and its content at power-up; the last is only read.
        large: the same of a memory of one port, without a content.
        behind: clocks from a write of that memory to the read of the same word, and from one such read to the next.
    """

    memories = ((16, 512, range(7, 512 * 127, 127)), (8, 1024, ()), (36, 4, ()), (16, 1024, range(65535, 1023, -63)))
    large, behind = (16, 16384), (64, 2)

    def __init__(self):
        products = {f"product_{k}": Out(2 * WIDTH) for k in range(len(SIGNS))}
        reads = {f"read_{k}": Out(width) for k, (width, _, _) in enumerate(self.memories)}
        super().__init__(
            {
                "a": In(WIDTH),
                "b": In(WIDTH),
                "write": In(1),
                "write_address": In(10),
                "read_address": In(10),
                **products,
                **reads,
                "read_large": Out(self.large[0]),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        for k, (a, b) in enumerate(SIGNS):
            x, y = Signal(a(WIDTH), name=f"a_{k}"), Signal(b(WIDTH), name=f"b_{k}")
            m.d.comb += [x.eq(self.a), y.eq(self.b)]
            m.d.sync += getattr(self, f"product_{k}").eq(x * y)
        clocked = Signal(reset_less=True)
        m.d.sync += clocked.eq(1)
        for k, (width, depth, content) in enumerate(self.memories):
            m.submodules[f"memory_{k}"] = memory = Memory(
                shape=width, depth=depth, init=content, attrs={"ram_style": "block"}
            )
            read = memory.read_port()
            m.d.comb += [
                read.addr.eq(self.read_address),
                getattr(self, f"read_{k}").eq(Mux(clocked, read.data, 0)),
            ]
            if k < len(self.memories) - 1:
                write = memory.write_port()
                data = self.a.replicate(2)
                m.d.comb += [write.en.eq(self.write), write.addr.eq(self.write_address), write.data.eq(data)]
        self._one_port(m)
        return m

    def _one_port(self, m: Module) -> None:
        """Write words all over the memory of one port, and read each in the same order some clocks later.

        What it shows where it is written is left open, and is not shown.
        """
        width, depth = self.large
        m.submodules.large = memory = Memory(shape=width, depth=depth, init=[], attrs={NO_FIRST_CONTENTS: 1})
        write, read = memory.write_port(), memory.read_port()
        turn, shown = Signal(range(2 * depth)), Signal()
        late, place = self.behind[0] // self.behind[1], Signal.like(write.addr)
        number = turn[1:] - Mux(turn[0], late, 0)
        # Within a few turns every bit of the address changes.
        m.d.comb += place.eq(number ^ number << len(place) // 2)
        m.d.comb += [write.addr.eq(place), write.data.eq(self.a), write.en.eq(~turn[0]), read.addr.eq(place)]
        m.d.comb += [read.en.eq(turn[0]), self.read_large.eq(Mux(shown & ~turn[0], read.data, 0))]
        m.d.sync += turn.eq(turn + 1)
        with m.If(turn == self.behind[0] + 1):
            m.d.sync += shown.eq(1)


class Small(wiring.Component):
    """Registers behind logic, with the inputs of `Cells`: enough for a wrong cell to be found."""

    a: In(WIDTH)
    b: In(WIDTH)
    write: In(1)
    write_address: In(10)
    read_address: In(10)
    found: Out(WIDTH)

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.d.sync += self.found.eq(Mux(self.write, self.a ^ self.b, self.a & self.b))
        return m


@dataclass(frozen=True)
class Top:
    """A component that is mapped.

    Attributes:
        name: its name in the table.
        stimulus: the name of its stimulus in `side_by_side`.
        component: makes the component.
        still: outputs that never change.
    """

    name: str
    stimulus: str
    component: Callable[[], wiring.Component]
    still: tuple[str, ...] = ()


# No spec lets a sample begin before the last one's velocity is there.
NEVER = ("strobe_busy",)
TOPS = (
    Top("cells", "cells", Cells),
    Top("axis fdm", "axis", lambda: Axis(busy("fdm")), NEVER),
    # These motions are too short to take Levant's differentiator to its bounds.
    Top("axis levant", "axis", lambda: Axis(busy("levant")), (*NEVER, "saturated")),
    Top("board levant", "board", lambda: board_of("paper", "levant", RECORDS)),
)
SMALL = Top("small", "cells", Small)
"""For tests of the means alone."""
