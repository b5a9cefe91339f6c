"""Integer square root, rounded down: two result bits a clock."""

from amaranth.hdl import Cat, Const, Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.arithmetic import sqrt as model
from hardwall.model.checks import check_int

from .fixed import choice


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
    reached : Out(3)
        What the next two bits of the root are: bit d - 1 is high if they are at least d. Behind the last clock that
        makes the root, they are those behind its point.
    last : Out(1)
        High in the last of these clocks.

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
                "reached": Out(3),
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
        # The root is kept as its complement, which a subtraction adds, and as three times the complement plus one.
        digits = Signal(4 * clocks)
        remainder = Signal(2 * clocks + 1)
        complement = Signal(signed(len(self.root) + 1), init=-1)
        triple = Signal(signed(len(complement) + 2), init=-2)
        left = Signal(range(clocks + 1))
        m.d.comb += self.root.eq(~complement)

        # The digits 1 to 3 are tried side by side: (4 root + d)^2 = 16 root^2 + d (8 root + d), and the complement is
        # -root - 1.
        taken = Cat(digits[-4:], remainder)
        trials = (complement << 3) | 7, (complement << 4) | 12, (triple << 3) | 7
        rests = [taken, *(taken + trial for trial in trials)]
        m.d.comb += [self.reached.eq(Cat(rest >= 0 for rest in rests[1:])), self.last.eq(left == 1)]
        # The complement of a digit d is 3 - d; four times the triple is to have 3 (3 - d) - 3 more.
        complements = [Cat(Const(3 - digit, 2), complement).as_signed() for digit in range(4)]
        triples = [Cat(Const(6 - 3 * digit & 3, 2), triple + (6 - 3 * digit >> 2)).as_signed() for digit in range(4)]

        m.d.sync += self.done.eq(self.last)
        with m.If(left != 0):
            m.d.sync += [
                digits.eq(digits << 4),
                remainder.eq(choice(self.reached, rests)),
                complement.eq(choice(self.reached, complements)),
                triple.eq(choice(self.reached, triples)),
                left.eq(left - 1),
            ]
        with m.If(self.start):
            m.d.sync += [
                digits.eq(self.radicand),
                remainder.eq(0),
                complement.eq(-1),
                triple.eq(-2),
                left.eq(clocks),
                self.done.eq(0),
            ]
        return m
