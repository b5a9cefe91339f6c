"""First-order adaptive windowing."""

from amaranth.hdl import Array, Module, Mux, Signal, signed

from hardwall.model.foaw import BAND, TAPS, UNIT, WEIGHTS, Design

from . import EstimatorBlock
from .divide import Divide
from .history import History


class Estimator(EstimatorBlock):
    """The slope over the longest window in which the counts are a line.

    Equation, with D_i the change over i taps of T samples, d the band, and n the largest number of taps, at most
    `foaw_window`, up to which every one passes

        (D_i - d) / i <= D_n / n <= (D_i + d) / i                        for i < n

        velocity = D_n / (n T), or the slope of the least-squares line over the same taps

    In the first samples the axis counts as having stood at the first one before, so velocity is 0 at the first.

    Latency: `latency` clocks from `strobe` to `valid`: one a tap, and the division's; the next `strobe` may come with
    `valid`.

    Rounding and overflow: the search is exact; the velocity rounds toward zero. The change of a sample is limited to
    the velocity format, with a flag; the velocity then always fits. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.foaw.Design
        Formats; its module derives them.

    Source: Janabi-Sharifi, Hayward, Chen, IEEE Transactions on Control Systems Technology 2000.
    """

    def __init__(self, design: Design):
        super().__init__(design, Design)

    def elaborate(self, platform):
        m = Module()
        design, spacing = self._design, self._design.spacing
        m.submodules.history = history = History(design.history)

        # Largest change of one tap; of i taps, i times that. All widths of the search follow.
        tap = design.history.change.max * spacing * design.history.every

        def holding(largest: int):
            return signed(largest.bit_length() + 1)

        change = holding(TAPS * tap)
        slope_shape = holding((tap << BAND.f) * UNIT + BAND.max * UNIT)
        weights = Array(WEIGHTS.tolist())
        triangle = TAPS * (TAPS + 1) // 2
        pyramid = triangle * (TAPS + 2) // 3

        # Clock n of the search multiplies tap n - 1, bounds tap n - 2 and decides on tap n - 3.
        clock = Signal(range(TAPS + 6))
        weight = Signal(UNIT.bit_length())
        slope, margin = Signal(slope_shape), Signal(range(BAND.max * UNIT + 1))
        centre, below, above = Signal(slope_shape), Signal(slope_shape), Signal(slope_shape)
        changes = [Signal(change, name=f"change_{stage}") for stage in range(2)]
        low, high = Signal(slope_shape), Signal(slope_shape)
        searching = Signal()
        tried, taps = Signal(range(TAPS + 2)), Signal(range(TAPS + 1))
        last, total, sums = Signal(change), Signal(holding(triangle * tap)), Signal(holding(pyramid * tap))
        product = Signal(holding(TAPS * triangle * tap))

        ends = [0, *range(1, TAPS + 1)]
        squares = [n * (n + 1) * (n + 2) // 6 for n in ends]
        divisors = [Array(n * spacing for n in numbers) for numbers in (ends, squares)]
        m.submodules.division = division = Divide(
            len(product), (pyramid * spacing).bit_length(), design.fraction, design.velocity.width - 1
        )
        dividend, divisor = Signal.like(division.dividend), Signal.like(division.divisor)
        age = Signal.like(history.age, init=spacing)
        m.d.comb += [
            history.strobe.eq(self.strobe),
            history.restart.eq(self.restart),
            history.count.eq(self.count),
            history.age.eq(age),
            division.dividend.eq(dividend),
            division.divisor.eq(divisor),
        ]

        # The pipeline runs on always; what it decides counts while `searching`.
        m.d.sync += [
            weight.eq(weights[clock]),
            slope.eq((history.change[: change.width].as_signed() * weight) << BAND.f),
            margin.eq(self.foaw_band * weight),
            changes[0].eq(history.change),
            centre.eq(slope),
            below.eq(slope - margin),
            above.eq(slope + margin),
            changes[1].eq(changes[0]),
        ]
        first = Signal()
        fits = first | (tried <= self.foaw_window) & (low <= centre) & (centre <= high)
        with m.If(searching):
            with m.If(fits):
                m.d.sync += [
                    low.eq(Mux(first | (below > low), below, low)),
                    high.eq(Mux(first | (above < high), above, high)),
                    last.eq(changes[1]),
                    total.eq(Mux(first, 0, total) + changes[1]),
                    sums.eq(Mux(first, 0, sums + total)),
                    taps.eq(tried),
                ]
            with m.Else():
                m.d.sync += searching.eq(0)
            m.d.sync += [first.eq(0), tried.eq(tried + 1)]

        m.d.sync += [division.start.eq(0), self.valid.eq(division.done)]
        with m.If(clock != 0):
            m.d.sync += [clock.eq(clock + 1), age.eq(age + spacing)]
        with m.Switch(clock):
            with m.Case(0), m.If(history.valid):
                m.d.sync += [clock.eq(1), age.eq(age + spacing)]
            with m.Case(3):
                m.d.sync += [searching.eq(1), first.eq(1), tried.eq(1)]
            with m.Case(TAPS + 3):
                m.d.sync += searching.eq(0)
            with m.Case(TAPS + 4):
                m.d.sync += product.eq(taps * total)
            with m.Case(TAPS + 5):
                m.d.sync += [
                    dividend.eq(Mux(self.foaw_output, product - (sums << 1), last)),
                    divisor.eq(Mux(self.foaw_output, divisors[1][taps], divisors[0][taps])),
                    division.start.eq(1),
                    clock.eq(0),
                    age.eq(spacing),
                ]
        with m.If(division.done):
            m.d.sync += self.saturated.eq(history.limited)
            with m.If(history.stored):
                m.d.sync += self.velocity.eq(division.quotient)
        return m
