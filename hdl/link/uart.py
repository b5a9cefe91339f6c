"""A UART: 8 data bits, no parity, one stop bit, at a rate that a fractional divider makes from the clock."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from hardwall.model.link.uart import DATA_BITS, FRACTION_BITS, FRAME_BITS, Design


def _checked(design: Design) -> Design:
    if not isinstance(design, Design):
        raise TypeError(f"design must be a uart.Design, not {design!r}")
    return design


def _bit_ends(m: Module, design: Design, idle: Value, first: tuple[int, int]) -> Value:
    """Count the clocks of bits, and return whether one ends; the first after `idle` has `first` clocks and parts."""
    whole, fraction = design.bit
    left, parts, total = Signal(range(whole + 1)), Signal(FRACTION_BITS), Signal(FRACTION_BITS + 1)
    ends = left == 0
    m.d.comb += total.eq(parts + fraction)
    with m.If(idle):
        m.d.sync += [left.eq(first[0]), parts.eq(first[1])]
    with m.Elif(ends):
        m.d.sync += [left.eq(Mux(total[-1], whole, whole - 1)), parts.eq(total[:-1])]
    with m.Else():
        m.d.sync += left.eq(left - 1)
    return ~idle & ends


class Receiver(wiring.Component):
    """The bytes on a line that idles high.

    Equation: a fall of the line begins a byte; bit k of it, the least significant first, is the line's level k + 3/2
    bits later; the stop bit's level is taken 9 1/2 bits later. A line that is high again after half a bit was no start.

    Latency: 2 clocks of the synchroniser, then the bits; `arrived` comes at the middle of the stop bit, so the next
    start bit may be early. Throughput: bytes without a pause.

    Rounding and overflow: each sample is within 1 clock of the middle of its bit; the model derives the mismatch of
    rates that this leaves. A byte with a low stop bit arrives `spoilt`. A break arrives as one such byte, and nothing
    more arrives until the line has been high.

    Parameters
    ----------
    design : hardwall.model.link.uart.Design
        Clock and rate.

    Members
    -------
    pin : In(1)
        The line; asynchronous.
    byte : Out(8)
        With `arrived`: the byte.
    arrived : Out(1)
        High for one clock.
    spoilt : Out(1)
        With `arrived`: the stop bit was low.

    Raises
    ------
    TypeError
        If `design` is not a Design.

    Source: the RTU transmission mode of "Modbus over Serial Line, Specification and Implementation Guide", section
    2.5.1; with one stop bit and no parity, as USB adapters and hosts have by default.
    """

    def __init__(self, design: Design):
        self._design = _checked(design)
        super().__init__({"pin": In(1), "byte": Out(DATA_BITS), "arrived": Out(1), "spoilt": Out(1)})

    @property
    def design(self) -> Design:
        return self._design

    def elaborate(self, platform):
        m = Module()
        pin, before = Signal(init=1), Signal(init=1)
        m.submodules.synchroniser = FFSynchronizer(self.pin, pin, init=1)
        busy = Signal()
        bits = Signal(range(FRAME_BITS + 1))
        m.d.sync += [before.eq(pin), self.arrived.eq(0)]
        # Half a bit to the middle of the start bit, less the clock at which this is seen.
        with m.If(_bit_ends(m, self._design, ~busy, self._design.to_first_sample)):
            m.d.sync += bits.eq(bits + 1)
            with m.If(bits == 0):
                m.d.sync += busy.eq(~pin)
            with m.Elif(bits == FRAME_BITS - 1):
                m.d.sync += [busy.eq(0), self.arrived.eq(1), self.spoilt.eq(~pin)]
            with m.Else():
                m.d.sync += self.byte.eq(Cat(self.byte[1:], pin))
        with m.If(~busy):
            m.d.sync += [busy.eq(before & ~pin), bits.eq(0)]
        return m


class Transmitter(wiring.Component):
    """Bytes to a line, one after the other.

    Equation: a start bit, the 8 bits of the byte with the least significant first, and a stop bit, each a bit's time.

    Latency: the line falls with the clock after the one that takes a byte. Throughput: a byte every 10 bits and a
    clock.

    Rounding and overflow: no edge is more than a clock late, and lateness does not add up.

    Parameters
    ----------
    design : hardwall.model.link.uart.Design
        Clock and rate.

    Members
    -------
    bytes : In(stream.Signature(8))
        The bytes to send.
    pin : Out(1)
        The line.

    Raises
    ------
    TypeError
        If `design` is not a Design.

    Source: as of `Receiver`.
    """

    def __init__(self, design: Design):
        self._design = _checked(design)
        super().__init__({"bytes": In(stream.Signature(DATA_BITS)), "pin": Out(1, init=1)})

    @property
    def design(self) -> Design:
        return self._design

    def elaborate(self, platform):
        m = Module()
        shift = Signal(FRAME_BITS, init=1)
        bits = Signal(range(FRAME_BITS + 1))
        m.d.comb += [
            self.bytes.ready.eq(bits == 0),
            self.pin.eq(shift[0]),
        ]
        with m.If(_bit_ends(m, self._design, self.bytes.ready, self._design.to_first_edge)):
            m.d.sync += [shift.eq(Cat(shift[1:], Const(1, 1))), bits.eq(bits - 1)]
        with m.If(self.bytes.ready & self.bytes.valid):
            m.d.sync += [shift.eq(Cat(Const(0, 1), self.bytes.payload, Const(1, 1))), bits.eq(FRAME_BITS)]
        return m
