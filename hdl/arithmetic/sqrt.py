"""Integer square root, rounded down: one result bit a clock."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.arithmetic import sqrt as model
from hardwall.model.checks import check_int


class Sqrt(wiring.Component):
    """The exact integer square root of a word.

    Equation: root = floor(sqrt(radicand)).

    Latency: `latency` clocks from `start` to `done`: one to load, and one for every bit of the result. The next `start`
    may come with `done`.

    Rounding and overflow: rounds down, exactly; every radicand has a root that fits.

    Parameters
    ----------
    width : int
        Bits of the radicand, 1 or more.

    Members
    -------
    start : In(1)
        Pulse: take `radicand`. A start while busy abandons the root under way.
    radicand : In(width)
        Unsigned.
    root : Out((width + 1) // 2)
        Unsigned; valid from `done` until the next `start`.
    done : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If `width` is not an int.
    ValueError
        If `width` is less than 1.

    Source: the digit-by-digit method in base 2, as done on paper since antiquity.
    """

    def __init__(self, width: int):
        check_int("width", width, 1)
        self._width = width
        super().__init__(
            {
                "start": In(1),
                "radicand": In(width),
                "root": Out((width + 1) // 2),
                "done": Out(1),
            }
        )

    @property
    def width(self) -> int:
        return self._width

    @property
    def latency(self) -> int:
        """Clocks from `start` to `done`."""
        return model.latency(self._width)

    def elaborate(self, platform):
        m = Module()
        bits = len(self.root)
        # The radicand moves, two bits a clock, from its top into a remainder that never exceeds twice the root so far.
        digits = Signal(2 * bits)
        remainder = Signal(bits + 2)
        left = Signal(range(bits + 1))

        taken = Cat(digits[-2:], remainder)
        trial = Cat(1, 0, self.root) if bits > 1 else Cat(1, 0)
        fits = taken >= trial

        m.d.sync += self.done.eq(left == 1)
        with m.If(left != 0):
            m.d.sync += [
                digits.eq(digits << 2),
                remainder.eq((taken - (trial & fits.replicate(len(trial))))[: bits + 2]),
                self.root.eq(Cat(fits, self.root)[:bits]),
                left.eq(left - 1),
            ]
        with m.If(self.start):
            m.d.sync += [
                digits.eq(self.radicand),
                remainder.eq(0),
                self.root.eq(0),
                left.eq(bits),
                self.done.eq(0),
            ]
        return m
