"""A serial DAC with a clear pin: a frame at every actuation, while ARMED."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.drive import dac

from ..arithmetic.fixed import shape
from ..block import Block
from .scale import Scale


class Dac(Block):
    """The drive as frames for a serial DAC, which takes a frame at the rise of its chip select.

    Equation: as in `hardwall.model.drive.dac`.

    Safe is `dac_clear_n` low: at once, through a gate alone, where `permitted` is low, and one clock after the axis is
    not ARMED. The same ends a frame that is under way. The chip select rises before its last bit, so a DAC that counts
    bits does not take the frame. No other frame begins until the axis is ARMED.

    Latency: `latency` clocks from the strobe of a drive to the rise of the chip select. A strobe while a frame is under
    way is not heard; `design.frame_clocks` after the last one it is.

    Rounding and overflow: as of `Scale`; the code saturates at its upper end, a step below the full scale.

    Parameters
    ----------
    design : hardwall.model.drive.dac.Design
        Frame, serial clock and scaling.

    Members
    -------
    strobe : In(1)
        Pulse: the drive belongs to a new actuation.
    magnitude : In(UQ)
        The drive's magnitude, force LSB.
    negative : In(1)
        The sign for the DAC.
    armed : In(1)
        The axis is ARMED.
    permitted : In(1)
        A level that no clock is needed for: low makes the pins safe.
    dac_cs_n : Out(1)
        Chip select, low during a frame.
    dac_sclk, dac_mosi : Out(1)
        Serial clock and data, the uppermost bit first.
    dac_clear_n : Out(1)
        Clear: its level holds the DAC at its middle code while it is low.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = dac.Design

    @staticmethod
    def members(design: dac.Design) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "magnitude": In(shape(design.magnitude)),
            "negative": In(1),
            "armed": In(1),
            "permitted": In(1),
            **dict.fromkeys(design.pins, Out(1)),
        }

    def elaborate(self, platform):
        m = Module()
        params = self._design.params
        m.submodules.scale = scale = Scale(self._design.scale)
        m.d.comb += [scale.magnitude.eq(self.magnitude), scale.negative.eq(self.negative)]
        ready, waiting = Signal(), Signal(scale.latency)
        m.d.sync += [ready.eq(self.armed), waiting.eq(Cat(self.strobe, waiting[:-1]))]

        # A place is a half of the serial clock's period; the last one is the pause after the frame.
        bits, last = params.frame_bits, 2 * params.frame_bits + 1
        place, left, word = Signal(range(last + 2)), Signal(range(max(params.half, 2))), Signal(bits)
        next_place, goes_on = Signal.like(place), place.any() & (left == 0)
        begins = Signal()
        m.d.comb += next_place.eq(Mux(goes_on, Mux(place == last + 1, 0, place + 1), place))
        m.d.comb += begins.eq((next_place == 0) & waiting[-1] & ready)
        m.d.sync += left.eq(Mux(begins | goes_on, params.half - 1, Mux(place.any(), left - 1, 0)))

        now = Signal.like(place)
        m.d.comb += now.eq(Mux(self.armed, Mux(begins, 1, next_place), 0))
        m.d.sync += place.eq(now)
        # The first bit is there from the beginning; the others follow at every second place.
        first, frame = 3 + params.late, self._frame(m, scale, begins)
        with m.If(begins):
            m.d.sync += word.eq(frame)
        with m.Elif(goes_on & (next_place >= first) & (next_place[0] == first % 2) & (next_place <= last)):
            m.d.sync += word.eq(word << 1)

        select, clock = Signal(init=1), Signal(init=params.rest)
        busy = (now != 0) & (now <= last)
        m.d.sync += [select.eq(~busy), clock.eq(params.rest ^ (busy & ~now[0]))]
        m.d.comb += [
            self.dac_cs_n.eq(select | ~self.permitted),
            self.dac_sclk.eq(clock),
            self.dac_mosi.eq(word[-1]),
            self.dac_clear_n.eq(ready & self.permitted),
        ]
        return m

    def _frame(self, m: Module, scale: Scale, begins: Value) -> Value:
        """Return the frame that is to go out: of the drive, or behind an arming one of the setup."""
        params = self._design.params
        half = 1 << params.bits - 1
        code, wanted = Signal(signed(params.bits)), Signal(signed(params.bits + 1))
        m.d.comb += [
            wanted.eq(params.offset + Mux(scale.below, -scale.steps, scale.steps)),
            code.eq(Mux(wanted > half - 1, half - 1, wanted)),
        ]
        frame = params.header | (code.as_unsigned() << params.trailing_bits) ^ params.flip
        if not params.frames:
            return frame
        told = Signal(range(params.frames + 1))
        to_tell = told != params.frames
        with m.If(~self.armed):
            m.d.sync += told.eq(0)
        with m.Elif(begins & to_tell):
            m.d.sync += told.eq(told + 1)
        frames = Array(Const(frame, params.frame_bits) for frame in params.setup)
        return Mux(to_tell, frames[told], frame)
