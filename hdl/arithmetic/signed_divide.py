"""Division of a signed by an unsigned integer: a division of the magnitudes, and the sign."""

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.arithmetic import signed_divide as model
from hardwall.model.checks import check_int

from .divide import Divide


class SignedDivide(wiring.Component):
    """The quotient of two integers, with fraction bits.

    Equation: quotient = dividend 2**fraction / divisor.

    Latency: `latency` clocks from `start` to `done`. The next `start` may come with `done`.

    Rounding and overflow: rounds toward zero. A magnitude of 2**quotient_bits or more saturates, as does division by
    zero.

    Parameters
    ----------
    dividend_width : int
        Bits of the dividend with its sign, 2 or more.
    divisor_width : int
        Bits of the divisor, 1 or more.
    fraction : int
        Fraction bits of the quotient, 0 or more.
    quotient_bits : int
        Bits of the quotient's magnitude: no fewer than `fraction`, and 1 or more.

    Members
    -------
    start : In(1)
        Pulse: take the operands. A start while busy abandons the division under way.
    dividend : In(signed)
    divisor : In(unsigned)
    quotient : Out(signed)
        Valid from one `done` to the next.
    done : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If a parameter is not an int.
    ValueError
        If a parameter is out of range.

    Source: as of `Divide`.
    """

    def __init__(self, dividend_width: int, divisor_width: int, fraction: int, quotient_bits: int):
        check_int("dividend_width", dividend_width, 2)
        check_int("divisor_width", divisor_width, 1)
        check_int("fraction", fraction, 0)
        check_int("quotient_bits", quotient_bits, max(fraction, 1))
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
    def dividend_width(self) -> int:
        return len(self.dividend)

    @property
    def divisor_width(self) -> int:
        return len(self.divisor)

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
        width = len(self.dividend)
        m.submodules.magnitudes = magnitudes = Divide(
            width + self._fraction, len(self.divisor), self._quotient_bits, model.BITS_PER_CLOCK
        )
        negative = Signal()
        size = Mux(self.dividend < 0, -self.dividend, self.dividend)[:width]
        m.d.comb += [
            magnitudes.start.eq(self.start),
            magnitudes.dividend.eq(size << self._fraction),
            magnitudes.divisor.eq(self.divisor),
        ]
        m.d.sync += self.done.eq(magnitudes.done & ~self.start)
        with m.If(magnitudes.done):
            m.d.sync += self.quotient.eq(Mux(negative, -magnitudes.quotient, magnitudes.quotient))
        with m.If(self.start):
            m.d.sync += negative.eq(self.dividend < 0)
        return m
