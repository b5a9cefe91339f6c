"""Division of a signed by an unsigned integer: a few bits of the quotient a clock."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model import divide as model


class Divide(wiring.Component):
    """The quotient of two integers with fraction bits.

    Equation: quotient = dividend 2**fraction / divisor.

    Latency: `latency` clocks from `start` to `done`. The next `start` may come with `done`.

    Rounding and overflow: rounds toward zero. The quotient must be less than 2**quotient_bits in magnitude, else it
    has no meaning; so has one by zero.

    Parameters
    ----------
    dividend_width : int
        Bits of the dividend with its sign, 2 or more.
    divisor_width : int
        Bits of the divisor, 1 or more.
    fraction : int
        0 or more.
    quotient_bits : int
        Bits of the quotient's magnitude: no fewer than `fraction`, and 1 or more.

    Members
    -------
    start : In(1)
        Takes `dividend` and `divisor`. A start while busy abandons the quotient in hand.
    dividend : In(signed)
    divisor : In(unsigned)
        Constant from `start` to `done`.
    quotient : Out(signed)
        Valid from `done` until the next.
    done : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If a parameter is not an int.
    ValueError
        If it is out of range.

    Source: restoring long division in base 2, as done on paper.
    """

    def __init__(self, dividend_width: int, divisor_width: int, fraction: int, quotient_bits: int):
        given = {
            "dividend_width": (dividend_width, 2),
            "divisor_width": (divisor_width, 1),
            "fraction": (fraction, 0),
            "quotient_bits": (quotient_bits, max(fraction, 1) if isinstance(fraction, int) else 1),
        }
        for name, (value, least) in given.items():
            if not isinstance(value, int):
                raise TypeError(f"{name} must be an int, not {value!r}")
            if value < least:
                raise ValueError(f"{name} must be {least} or more, not {value!r}")
        self._fraction, self._quotient_bits = fraction, quotient_bits
        super().__init__(
            {
                "start": In(1),
                "dividend": In(signed(dividend_width)),
                "divisor": In(divisor_width),
                "quotient": Out(signed(quotient_bits + 1)),
                "done": Out(1),
            }
        )

    @property
    def fraction(self) -> int:
        return self._fraction

    @property
    def quotient_bits(self) -> int:
        return self._quotient_bits

    @property
    def latency(self) -> int:
        """Clocks from `start` to `done`."""
        return model.latency(self._quotient_bits)

    def elaborate(self, platform):
        m = Module()
        steps = self.latency - 2
        bits = steps * model.BITS_PER_CLOCK
        low = bits - self._fraction

        # The dividend's upper bits are less than the divisor and start as the remainder; the lower ones leave at the
        # top of `digits`, and the quotient's enter below.
        negative = Signal()
        remainder = Signal.like(self.divisor)
        digits = Signal(bits)
        left = Signal(range(steps + 2))
        size = Mux(self.dividend < 0, -self.dividend, self.dividend)[: len(self.dividend)]

        rest, shifted = remainder, digits
        for _ in range(model.BITS_PER_CLOCK):
            taken = Cat(shifted[-1], rest)
            over = taken - self.divisor
            fits = ~over[-1]
            rest = Mux(fits, over, taken)[: len(remainder)]
            shifted = Cat(fits, shifted[:-1])

        m.d.sync += self.done.eq(left == 1)
        with m.If(left > 1):
            m.d.sync += [remainder.eq(rest), digits.eq(shifted)]
        with m.If(left != 0):
            m.d.sync += left.eq(left - 1)
        with m.If(left == 1):
            m.d.sync += self.quotient.eq(Mux(negative, -digits, digits))
        with m.If(self.start):
            m.d.sync += [
                negative.eq(self.dividend < 0),
                remainder.eq(size[low:]),
                digits.eq(Cat(Const(0, self._fraction), size[:low])),
                left.eq(steps + 1),
                self.done.eq(0),
            ]
        return m
