"""Integer square root, rounded down: two result bits a clock."""

from amaranth.hdl import Cat, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.arithmetic import sqrt as model
from hardwall.model.checks import check_int


class Sqrt(wiring.Component):
    """The exact integer square root of a word.

    Equation: root = floor(sqrt(radicand)).

    Latency: `latency` clocks from `start` to `done`: one to load, and one for every two bits of the result, high ones
    first. The next `start` may come with `done`.

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
    digit : Out(2)
        The next two bits of the root, in the clocks that make them; `last` is high in the last of these.
    last : Out(1)
        `done` follows at the next clock, unless a `start` is in its way.

    Raises
    ------
    TypeError
        If `width` is not an int.
    ValueError
        If `width` is less than 1.

    Source: the digit-by-digit method, as done on paper since antiquity, in base 4.
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
                "digit": Out(2),
                "last": Out(1),
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
        clocks = model.digits(self._width)
        # The radicand moves, four bits a clock, from its top into a remainder that is at most twice the root so far.
        digits = Signal(4 * clocks)
        remainder = Signal(2 * clocks + 1)
        left = Signal(range(clocks + 1))

        # The digits 1 to 3 are tried side by side: (4 root + d)^2 = 16 root^2 + d (8 root + d).
        taken = Cat(digits[-4:], remainder)
        rests = [taken]
        for trial in ((self.root << 3) + 1, (self.root << 4) + 4, (self.root << 4) + (self.root << 3) + 9):
            rests.append(Signal(signed(len(taken) + 1), name=f"rest_{len(rests)}"))
            m.d.comb += rests[-1].eq(taken - trial)
        fits = [rest >= 0 for rest in rests[1:]]
        rest = Mux(fits[1], Mux(fits[2], rests[3], rests[2]), Mux(fits[0], rests[1], rests[0]))
        m.d.comb += [self.digit.eq(Cat(Mux(fits[1], fits[2], fits[0]), fits[1])), self.last.eq(left == 1)]

        m.d.sync += self.done.eq(self.last)
        with m.If(left != 0):
            m.d.sync += [
                digits.eq(digits << 4),
                remainder.eq(rest[: len(remainder)]),
                self.root.eq(Cat(self.digit, self.root)[: len(self.root)]),
                left.eq(left - 1),
            ]
        with m.If(self.start):
            m.d.sync += [
                digits.eq(self.radicand),
                remainder.eq(0),
                self.root.eq(0),
                left.eq(clocks),
                self.done.eq(0),
            ]
        return m
