"""Unsigned integer division, rounded down: one quotient bit a clock."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model import divide as model


class Divide(wiring.Component):
    """The exact quotient of two words, rounded down, in as many bits as are wanted.

    Equation: quotient = min(floor(dividend / divisor), 2**quotient_width - 1); a division by 0 gives the latter.

    Latency: `latency` clocks from `start` to `done`: one to load, one a quotient bit, however wide the operands. The
    next `start` may come with `done`.

    Rounding and overflow: rounds down, exactly; a quotient that does not fit, that of 0 by 0 included, saturates and
    raises `saturated`.

    Parameters
    ----------
    dividend_width, divisor_width, quotient_width : int
        Bits, 1 or more each.

    Members
    -------
    start : In(1)
        Takes `dividend` and `divisor`. A start while busy abandons the quotient in hand.
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
        If a width is not an int.
    ValueError
        If a width is less than 1.

    Source: restoring division in base 2, the school's long division.
    """

    def __init__(self, dividend_width: int, divisor_width: int, quotient_width: int):
        widths = {
            "dividend_width": dividend_width,
            "divisor_width": divisor_width,
            "quotient_width": quotient_width,
        }
        for name, width in widths.items():
            if isinstance(width, bool) or not isinstance(width, int):
                raise TypeError(f"{name} must be an int, not {width!r}")
            if width < 1:
                raise ValueError(f"{name} must be 1 or more, not {width!r}")
        self._widths = widths
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
        return self._widths["dividend_width"]

    @property
    def divisor_width(self) -> int:
        return self._widths["divisor_width"]

    @property
    def quotient_width(self) -> int:
        return self._widths["quotient_width"]

    @property
    def latency(self) -> int:
        """Clocks from `start` to `done`."""
        return model.latency(self.quotient_width)

    def elaborate(self, platform):
        m = Module()
        bits = self.quotient_width
        divisor = Signal(self.divisor_width)
        remainder = Signal(self.divisor_width)
        left = Signal(range(bits + 1))

        # The quotient fits only if what stands above its bits of the dividend is less than the divisor; the remainder
        # then is so at every step. The dividend's low bits leave at the top of the register that the quotient enters.
        above = self.dividend[bits:]
        taken = Cat(self.quotient[-1], remainder)
        rest = taken - divisor
        fits = ~rest[-1]

        m.d.sync += self.done.eq(left == 1)
        with m.If(left != 0):
            m.d.sync += [
                remainder.eq(Mux(fits, rest, taken)[: len(remainder)]),
                self.quotient.eq(Cat(fits | self.saturated, self.quotient)[:bits]),
                left.eq(left - 1),
            ]
        with m.If(self.start):
            m.d.sync += [
                divisor.eq(self.divisor),
                remainder.eq(above[: len(remainder)]),
                self.quotient.eq(self.dividend[:bits]),
                self.saturated.eq(above >= self.divisor),
                left.eq(bits),
                self.done.eq(0),
            ]
        return m
