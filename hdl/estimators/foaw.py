"""First-order adaptive windowing."""

from amaranth.hdl import Array, Module, Mux, Shape, Signal, Value, signed

from hardwall.model.estimators.foaw import BAND, TAPS, UNIT, WEIGHTS, Design
from hardwall.model.estimators.history import LATENCY as HISTORY_LATENCY

from ..arithmetic.signed_divide import SignedDivide
from .estimate import EstimatorBlock
from .history import History

FIRST = HISTORY_LATENCY + 1
"""Clock at which the change of the first tap is ready."""


class Estimator(EstimatorBlock):
    """The slope over the longest window in which the counts are a line.

    Equation, with D_i the change over i taps of T samples, and d the band. n is the largest number of taps, at most
    `foaw_window`, up to which every tap passes

        (D_i - d) / i <= D_n / n <= (D_i + d) / i                        for i < n

        velocity = D_n / (n T), or the slope of the least-squares line over the same taps

    Before the first sample the axis counts as having stood at its position, so velocity is 0 at the first sample.

    Latency: `latency` clocks from `strobe` to `valid`: one a tap, and the clocks of the division; the next `strobe` may
    come with `valid`.

    Rounding and overflow: the search is exact; the velocity rounds toward zero. The change of a sample is limited to
    the velocity format, with a flag; the velocity then always fits. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.foaw.Design
        Formats; its module derives them.

    Source: Janabi-Sharifi, Hayward, Chen, IEEE Transactions on Control Systems Technology 2000.
    """

    design_class = Design

    def elaborate(self, platform):
        m = Module()
        design, spacing = self._design, self._design.spacing
        m.submodules.history = history = History(design.history)
        clock = Signal(range(FIRST + TAPS + 4))
        last, total, sums, taps = self._search(m, clock, history.change)

        # Least squares by sums of sums: taps total - 2 sums, over taps (taps + 1) (taps + 2) / 6.
        product = Signal(signed(taps.shape().width + len(total)))
        ends = range(TAPS + 1)
        squares = [n * (n + 1) * (n + 2) // 6 for n in ends]
        of_ends, of_squares = (Array(n * spacing for n in numbers) for numbers in (ends, squares))
        m.submodules.division = division = SignedDivide(
            len(product), (squares[-1] * spacing).bit_length(), design.fraction, design.velocity.width - 1
        )
        dividend, divisor = Signal.like(division.dividend), Signal.like(division.divisor)
        age = Signal.like(history.age, init=spacing)
        m.d.comb += [
            history.strobe.eq(self.strobe),
            history.restart.eq(self.restart),
            history.count.eq(self.seen.count),
            history.age.eq(age),
            division.dividend.eq(dividend),
            division.divisor.eq(divisor),
        ]

        m.d.sync += [division.start.eq(0), self.valid.eq(division.done)]
        with m.If(clock != 0):
            m.d.sync += clock.eq(clock + 1)
        # Every clock reads the next tap, from the clock at which the newest position is ready for the first change.
        with m.If(clock >= FIRST - 2):
            m.d.sync += age.eq(age + spacing)
        with m.Switch(clock):
            with m.Case(0), m.If(self.strobe):
                m.d.sync += clock.eq(1)
            with m.Case(FIRST + TAPS + 2):
                m.d.sync += product.eq(taps * total)
            with m.Case(FIRST + TAPS + 3):
                m.d.sync += [
                    dividend.eq(Mux(self.foaw_output, product - (sums << 1), last)),
                    divisor.eq(Mux(self.foaw_output, of_squares[taps], of_ends[taps])),
                    division.start.eq(1),
                    clock.eq(0),
                    age.eq(spacing),
                ]
        with m.If(division.done):
            m.d.sync += self.saturated.eq(history.limited)
            with m.If(history.stored):
                m.d.sync += self.velocity.eq(division.quotient)
        return m

    def _search(self, m: Module, clock: Signal, change: Value) -> tuple[Signal, Signal, Signal, Signal]:
        """Add the search: the change over i taps is ready at clock FIRST + i - 1, and is judged two clocks later.

        Return, for the longest fitting window: its change, the sum of its taps' changes, the sum of the earlier sums,
        and its number of taps.
        """
        # The change over one tap is at most this, and over i taps at most i times this; all widths follow.
        tap = self._design.history.change.max * self._design.spacing * self._design.history.every
        triangle = TAPS * (TAPS + 1) // 2
        slopes = _holding((tap << BAND.f) * UNIT + BAND.max * UNIT)

        weights = Array(WEIGHTS.tolist())
        weight = Signal(UNIT.bit_length())
        slope, margin = Signal(slopes), Signal(range(BAND.max * UNIT + 1))
        centre, below, above = Signal(slopes), Signal(slopes), Signal(slopes)
        before, newest = Signal(_holding(TAPS * tap)), Signal(_holding(TAPS * tap))
        index = (clock - (FIRST - 2))[: len(clock)]
        m.d.sync += [
            weight.eq(weights[index]),
            slope.eq((change[: len(before)].as_signed() * weight) << BAND.f),
            margin.eq(self.foaw_band * weight),
            before.eq(change),
            centre.eq(slope),
            below.eq(slope - margin),
            above.eq(slope + margin),
            newest.eq(before),
        ]

        searching, first = Signal(), Signal()
        tried, taps = Signal(range(TAPS + 2)), Signal(range(TAPS + 1))
        low, high = Signal(slopes), Signal(slopes)
        last, total = Signal(_holding(TAPS * tap)), Signal(_holding(triangle * tap))
        sums = Signal(_holding(triangle * (TAPS + 2) // 3 * tap))
        fits = first | (tried <= self.foaw_window) & (low <= centre) & (centre <= high)
        with m.If(searching):
            m.d.sync += [first.eq(0), tried.eq(tried + 1), searching.eq(fits & (tried != TAPS))]
            with m.If(fits):
                m.d.sync += [
                    low.eq(Mux(first | (below > low), below, low)),
                    high.eq(Mux(first | (above < high), above, high)),
                    last.eq(newest),
                    total.eq(Mux(first, 0, total) + newest),
                    sums.eq(Mux(first, 0, sums + total)),
                    taps.eq(tried),
                ]
        with m.Elif(clock == FIRST + 1):
            m.d.sync += [searching.eq(1), first.eq(1), tried.eq(1)]
        return last, total, sums, taps


def _holding(largest: int) -> Shape:
    """Return the signed shape that holds magnitudes up to `largest`."""
    return signed(largest.bit_length() + 1)
