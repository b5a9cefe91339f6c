"""A rounded quotient by multiplications alone, all of one multiplier."""

from types import SimpleNamespace

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.arithmetic import divisionless as model
from hardwall.model.checks import check_int


class Divisionless(wiring.Component):
    """The exact quotient of two words, rounded half up, by a tabulated reciprocal, Newton's step and corrections.

    Equation: quotient = min(floor(dividend * 2**fraction / divisor + 1/2), 2**quotient_width - 1); the model's module
    derives how. While it is idle its multiplier is its user's: product is factor * term of the clock before.

    Latency: `latency` clocks from `start` to `done`; the next `start` may come with `done`, and not before.

    Rounding and overflow: rounds half up, exactly; a quotient that does not fit saturates and raises `saturated`.

    Parameters
    ----------
    dividend_width, divisor_width, quotient_width : int
        Bits of each word, 1 or more; the divisor has `DIVISOR_BITS_MIN` or more.
    fraction : int
        Fraction bits of the quotient, 0 to quotient_width.
    factor_width, term_width : int
        Bits of the user's factors, 1 or more.

    Members
    -------
    start : In(1)
        Pulse: take `dividend` and `divisor`.
    dividend : In(dividend_width)
        Unsigned.
    divisor : In(divisor_width)
        Unsigned; not 0, unless the dividend is 0, whose quotient is 0.
    quotient : Out(quotient_width)
        Unsigned; valid from `done` until the next `start`.
    saturated : Out(1)
        The quotient did not fit; valid as `quotient` is.
    done : Out(1)
        High for one clock.
    factor, term : In
        Unsigned; factors of the user's product.
    product : Out
        factor * term of the clock before, if then there was no quotient under way.

    Raises
    ------
    TypeError
        If a parameter is not an int.
    ValueError
        If a parameter is out of range.

    Source: textbook arithmetic, as the model's module says.
    """

    def __init__(
        self,
        dividend_width: int,
        divisor_width: int,
        fraction: int,
        quotient_width: int,
        factor_width: int = 1,
        term_width: int = 1,
    ):
        check_int("dividend_width", dividend_width, 1)
        check_int("divisor_width", divisor_width, model.DIVISOR_BITS_MIN)
        check_int("quotient_width", quotient_width, 1)
        check_int("fraction", fraction, 0, quotient_width)
        check_int("factor_width", factor_width, 1)
        check_int("term_width", term_width, 1)
        self._fraction = fraction
        self._digits, self._digit = model.digits(quotient_width + 1)
        # Bits of the quotient before the point, including unused bits of its digits.
        self._whole = self._digits * self._digit - fraction - 1
        narrow, wide = max(model.FINE + 1, factor_width), max(divisor_width + self._whole + 1, term_width)
        super().__init__(
            {
                "start": In(1),
                "dividend": In(dividend_width),
                "divisor": In(divisor_width),
                "quotient": Out(quotient_width),
                "saturated": Out(1),
                "done": Out(1),
                "factor": In(factor_width),
                "term": In(term_width),
                "product": Out(narrow + max(wide, model.STEP + 1)),
            }
        )

    @property
    def latency(self) -> int:
        """Clocks from `start` to `done`."""
        return model.latency(len(self.divisor), len(self.quotient), len(self.factor))

    def elaborate(self, platform):
        m = Module()
        width, whole = len(self.divisor), self._whole
        shapes = {
            "narrow": max(model.FINE + 1, len(self.factor)),
            # What t r is less than 1 by takes t's place, with as many zeros below as the quotient has whole bits.
            "t": width + whole + 1,
            "x": width + whole,
            "over": 1,
            "reciprocal": model.FINE + 1,
            "remainder": width + model.FINE + whole + 1,
            "made": self._digits * self._digit + 1,
            "left": range(self._digits + 1),
        }
        s = SimpleNamespace(**{name: Signal(of, name=name) for name, of in shapes.items()})
        s.wide = Signal(len(self.product) - len(s.narrow), name="wide")
        rounded = s.made[1:] + (s.made[0] | s.remainder[-1])
        m.d.comb += [
            self.saturated.eq(s.over | (rounded >> len(self.quotient)).any()),
            self.quotient.eq(Mux(self.saturated, (1 << len(self.quotient)) - 1, rounded)),
        ]
        m.d.sync += [self.product.eq(s.narrow * s.wide), self.done.eq(0)]
        with m.FSM():
            self._place(m, s)
            self._invert(m, s)
            self._correct(m, s)
        return m

    def _place(self, m: Module, s: SimpleNamespace) -> None:
        """Add the states that take the operands and shift them until the divisor's top bit is 1."""
        width, places = len(self.divisor), model.places(len(self.divisor), len(self.factor))
        # From the top down, the lowest 1 alone is two to the number of zeros above t; without one in sight, the most.
        above = s.t[width - places : width][::-1]
        shift = (above & -above)[:places] | (~above.any() << places - 1)
        passes = model.passes(width, len(self.factor))
        with m.State("IDLE"):
            m.d.comb += [s.narrow.eq(self.factor), s.wide.eq(self.term)]
            with m.If(self.start):
                m.d.sync += [
                    s.t.eq(self.divisor),
                    s.x.eq(self.dividend),
                    s.over.eq(self.dividend[len(s.x) :].any()),
                    s.made.eq(0),
                    s.left.eq(self._digits),
                ]
                m.next = "SHIFT_0"
        for each in range(passes):
            with m.State(f"SHIFT_{each}"):
                m.d.comb += [s.narrow.eq(shift), s.wide.eq(s.t)]
                if each:
                    self._take_dividend(m, s)
                m.next = f"TOO_{each}"
            with m.State(f"TOO_{each}"):
                m.d.comb += [s.narrow.eq(shift), s.wide.eq(s.x)]
                m.d.sync += s.t.eq(self.product)
                m.next = f"SHIFT_{each + 1}" if each + 1 < passes else "LOOK"

    def _take_dividend(self, m: Module, s: SimpleNamespace) -> None:
        """Take the shifted dividend; bits above its place mean a quotient that does not fit."""
        m.d.sync += [s.x.eq(self.product), s.over.eq(s.over | self.product[len(s.x) :].any())]

    def _invert(self, m: Module, s: SimpleNamespace) -> None:
        """Add the states that make the reciprocal, and scale both operands by it."""
        width = len(self.divisor)
        index = s.t[width - 1 - model.INDEX : width - 1]
        entry = Array(Const(each, model.TABLE + 1) for each in model.table())[index]
        two_less = (~self.product)[width + model.TABLE - model.STEP : width + model.TABLE + 1]
        finer = self.product[model.TABLE + model.STEP - model.FINE :][: model.FINE + 1]
        with m.State("LOOK"):
            m.d.comb += [s.narrow.eq(entry), s.wide.eq(s.t)]
            self._take_dividend(m, s)
            m.next = "STEP"
        with m.State("STEP"):
            m.d.comb += [s.narrow.eq(entry), s.wide.eq(two_less)]
            m.next = "TAKE"
        with m.State("TAKE"):
            m.d.comb += [s.narrow.eq(finer), s.wide.eq(s.t)]
            m.d.sync += s.reciprocal.eq(finer)
            m.next = "SCALE"
        with m.State("SCALE"):
            m.d.comb += [s.narrow.eq(s.reciprocal), s.wide.eq(s.x)]
            m.d.sync += s.t.eq((-self.product)[: width + 1] << self._whole)
            m.next = "LOAD"

    def _correct(self, m: Module, s: SimpleNamespace) -> None:
        """Add the states that make the digits, each from the top of the remainder so far."""
        point, digit = len(s.remainder) - 1, self._digit
        loading, last = Signal(), Signal()
        leading = s.remainder[point - digit :]
        following = Mux(loading, 0, s.remainder[: point - digit] << digit) + self.product
        m.d.comb += last.eq(s.left == 1)
        with m.State("LOAD"):
            m.d.comb += loading.eq(1)
            m.d.sync += s.remainder.eq(following)
            m.next = "DIGIT"
        with m.State("DIGIT"):
            # The last digit counts one more, so that the top bit of the remainder says whether the quotient does.
            m.d.comb += [s.narrow.eq(leading + last), s.wide.eq(s.t)]
            m.d.sync += s.made.eq(Cat(leading[:digit], s.made + leading[digit]))
            m.next = "CORRECT"
        with m.State("CORRECT"):
            m.d.sync += [s.remainder.eq(following), s.left.eq(s.left - 1), self.done.eq(last)]
            m.next = "DIGIT"
            with m.If(last):
                m.next = "IDLE"
