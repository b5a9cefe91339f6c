"""A watch over the times of cycles: whether an encoder emits its edges in bursts."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.checks import check_int
from hardwall.model.estimators import bursts as model


class Bursts(wiring.Component):
    """Whether silences between edges are too long for the speed of their cycles, again and again.

    Equation: `hardwall.model.estimators.bursts` defines silences and events.

    Latency: `latency` clocks from `strobe` to `found`; the next `strobe` may come no earlier.

    Rounding and overflow: exact.

    Parameters
    ----------
    stamp_width : int
        Bits of the clock stamps, 3 to 62.
    cycles_max : int
        Largest number of cycles, 1 or more.
    doubt : int
        Samples for which an event is remembered, 2 or more.

    Members
    -------
    strobe : In(1)
        Pulse: take a sample, the outputs of `CycleTimes`.
    news, cycles, cycle, age : In
        Those outputs, constant for `latency` clocks.
    found : Out(1)
        Whether edges come in bursts.

    Raises
    ------
    TypeError
        If a parameter is not an int.
    ValueError
        If a parameter is out of range.

    Source: this project's.
    """

    def __init__(self, stamp_width: int, cycles_max: int, doubt: int):
        check_int("stamp_width", stamp_width, 3, 62)
        check_int("cycles_max", cycles_max, 1)
        check_int("doubt", doubt, 2)
        self._stamp_width, self._cycles_max, self._doubt = stamp_width, cycles_max, doubt
        super().__init__(
            {
                "strobe": In(1),
                "news": In(1),
                "cycles": In(range(cycles_max + 1)),
                "cycle": In(stamp_width),
                "age": In(stamp_width),
                "found": Out(1),
            }
        )

    @property
    def stamp_width(self) -> int:
        return self._stamp_width

    @property
    def cycles_max(self) -> int:
        return self._cycles_max

    @property
    def doubt(self) -> int:
        return self._doubt

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to `found`."""
        return model.LATENCY

    def elaborate(self, platform):
        m = Module()
        quiet, silence = Signal(self._stamp_width), Signal(self._stamp_width)
        product = Signal(len(self.cycles) + self._stamp_width)
        events, left = Signal(range(model.EVENTS + 1)), Signal(range(self._doubt + 1))
        m.d.comb += self.found.eq(events == model.EVENTS)
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                m.d.sync += [quiet.eq(self.age), left.eq(left - (left != 0))]
                with m.If(self.news & (quiet > silence)):
                    m.d.sync += silence.eq(quiet)
                m.next = "WEIGH"
            with m.State("WEIGH"):
                m.d.sync += [product.eq(self.cycles * silence), events.eq(Mux(left != 0, events, 0))]
                m.next = "JUDGE"
            with m.State("JUDGE"):
                with m.If(self.age == 0):
                    m.d.sync += [silence.eq(0), events.eq(0), left.eq(0)]
                with m.Elif(self.news & (self.cycles != 0)):
                    with m.If(silence > self.cycle):
                        m.d.sync += silence.eq(0)
                    with m.Elif(product << 4 > (self.cycle << 3) + self.cycle):
                        m.d.sync += [
                            silence.eq(0),
                            events.eq(Mux(events == model.EVENTS, events, events + 1)),
                            left.eq(self._doubt),
                        ]
                m.next = "SAMPLE"
        return m
