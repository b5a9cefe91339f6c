"""Unsigned integer division, rounded down: one or a few quotient bits a clock."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.arithmetic import divide as model
from hardwall.model.checks import check_int


class Divide(wiring.Component):
    """The exact quotient of two words, rounded down, in a chosen number of bits.

    Equation: quotient = min(floor(dividend / divisor), 2**quotient_width - 1); division by 0 gives
    2**quotient_width - 1.

    Latency: `latency` clocks from `start` to `done`: one to load, and one for every `bits_per_clock` bits of the
    quotient, however wide the operands. The next `start` may come with `done`.

    Rounding and overflow: rounds down, exactly; a quotient that does not fit saturates and raises `saturated`, as does
    0 divided by 0.

    Parameters
    ----------
    dividend_width, divisor_width, quotient_width : int
        Bits of each word, 1 or more.
    bits_per_clock : int
        Quotient bits a clock, 1 or more: each adds a subtraction between two registers.

    Members
    -------
    start : In(1)
        Pulse: take `dividend` and `divisor`. A start while busy abandons the division under way.
    dividend : In(dividend_width)
        Unsigned.
    divisor : In(divisor_width)
        Unsigned.
    quotient : Out(quotient_width)
        Unsigned; valid from `done` until the next `start`.
    saturated : Out(1)
        The quotient did not fit; valid as `quotient` is.
    done : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If a parameter is not an int.
    ValueError
        If a parameter is less than 1.

    Source: restoring division in base 2, as in long division on paper.
    """

    def __init__(self, dividend_width: int, divisor_width: int, quotient_width: int, bits_per_clock: int = 1):
        sizes = {
            "dividend_width": dividend_width,
            "divisor_width": divisor_width,
            "quotient_width": quotient_width,
            "bits_per_clock": bits_per_clock,
        }
        for name, size in sizes.items():
            check_int(name, size, 1)
        self._sizes = sizes
        super().__init__(
            {
                "start": In(1),
                "dividend": In(dividend_width),
                "divisor": In(divisor_width),
                "quotient": Out(quotient_width),
                "saturated": Out(1),
                "done": Out(1),
            }
        )

    @property
    def dividend_width(self) -> int:
        return self._sizes["dividend_width"]

    @property
    def divisor_width(self) -> int:
        return self._sizes["divisor_width"]

    @property
    def quotient_width(self) -> int:
        return self._sizes["quotient_width"]

    @property
    def bits_per_clock(self) -> int:
        return self._sizes["bits_per_clock"]

    @property
    def latency(self) -> int:
        """Clocks from `start` to `done`."""
        return model.latency(self.quotient_width, self.bits_per_clock)

    def elaborate(self, platform):
        m = Module()
        bits, steps = self.quotient_width, self.latency - 1
        divisor = Signal(self.divisor_width)
        remainder = Signal(self.divisor_width)
        digits = Signal(steps * self.bits_per_clock)
        left = Signal(range(steps + 1))

        # The dividend's low bits leave at the top of the register that the quotient enters; the bits above them are
        # the first remainder. The quotient fits if the dividend's bits above the quotient's are less than the divisor.
        rest, shifted = remainder, digits
        for _ in range(self.bits_per_clock):
            taken = Cat(shifted[-1], rest)
            less = taken - divisor
            fits = ~less[-1]
            rest = Mux(fits, less, taken)[: len(remainder)]
            shifted = Cat(fits | self.saturated, shifted[:-1])

        m.d.comb += self.quotient.eq(digits)
        m.d.sync += self.done.eq(left == 1)
        with m.If(left != 0):
            m.d.sync += [remainder.eq(rest), digits.eq(shifted), left.eq(left - 1)]
        with m.If(self.start):
            m.d.sync += [
                divisor.eq(self.divisor),
                remainder.eq(self.dividend[len(digits) :]),
                digits.eq(self.dividend),
                self.saturated.eq(self.dividend[bits:] >= self.divisor),
                left.eq(steps),
                self.done.eq(0),
            ]
        return m
