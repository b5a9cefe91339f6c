"""The four gates of an H-bridge: pulses of a fixed frequency, with a dead time in each leg."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.drive import pwm

from ..arithmetic.fixed import shape
from ..block import Block
from .scale import Scale


class Pwm(Block):
    """An H-bridge: the leg of the drive's sign is high for a part of every period, and otherwise low, as the other is.

    Equation: as in `hardwall.model.drive.pwm`. The gates of a leg are never on together.
    `dead` clocks with both off are between them, whatever the inputs and the reset do.

    Safe is all four gates low, so that the motor coasts: at once, through a gate alone, where `permitted` is low, and
    one clock after the axis is not ARMED. A drive of zero while ARMED brakes: both low gates are on.

    Latency: at most `latency` clocks from a drive to the pulse that it makes; the drive is taken at a period's end.

    Rounding and overflow: as of `Scale`; the width saturates three dead times below the period.

    Parameters
    ----------
    design : hardwall.model.drive.pwm.Design
        Period, dead time and scaling.

    Members
    -------
    magnitude : In(UQ)
        The drive's magnitude, force LSB.
    negative : In(1)
        The sign for the pins: leg B pulses.
    armed : In(1)
        The axis is ARMED.
    permitted : In(1)
        A level that no clock is needed for: low makes the pins safe.
    gate_high_a, gate_low_a, gate_high_b, gate_low_b : Out(1)
        The gates, on while high.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = pwm.Design

    @staticmethod
    def members(design: pwm.Design) -> dict[str, Member]:
        return {
            "magnitude": In(shape(design.magnitude)),
            "negative": In(1),
            "armed": In(1),
            "permitted": In(1),
            **dict.fromkeys(design.pins, Out(1)),
        }

    def elaborate(self, platform):
        m = Module()
        m.submodules.scale = scale = Scale(self._design.scale)
        m.d.comb += [scale.magnitude.eq(self.magnitude), scale.negative.eq(self.negative)]
        period, dead = self._design.period, self._design.dead

        phase, width, negative = Signal(range(period)), Signal.like(scale.steps), Signal()
        ends, on = phase == period - 1, Signal()
        m.d.sync += phase.eq(Mux(ends, 0, phase + 1))
        with m.If(ends):
            m.d.sync += [width.eq(scale.steps), negative.eq(scale.below)]
        with m.If(~self.armed):
            m.d.sync += width.eq(0)
        m.d.comb += on.eq(width.any() & (phase < width + dead))
        self._leg(m, "a", on & ~negative, (self.gate_high_a, self.gate_low_a))
        self._leg(m, "b", on & negative, (self.gate_high_b, self.gate_low_b))
        return m

    def _leg(self, m: Module, name: str, wanted: Value, pins: tuple[Signal, Signal]) -> None:
        """Describe a leg, whose high gate is wanted on, or else its low one."""
        dead, (high_pin, low_pin) = self._design.dead, pins
        # A reset, too, is followed by a dead time.
        side, left = Signal(name=f"{name}_side"), Signal(range(dead + 1), init=dead, name=f"{name}_left")
        high, low = Signal(name=f"{name}_high"), Signal(name=f"{name}_low")
        m.d.sync += [high.eq(0), low.eq(0)]
        with m.If(~self.armed):
            m.d.sync += [side.eq(0), left.eq(dead)]
        with m.Elif(wanted != side):
            m.d.sync += [side.eq(wanted), left.eq(dead - 1)]
        with m.Elif(left.any()):
            m.d.sync += left.eq(left - 1)
        with m.Else():
            m.d.sync += [high.eq(side), low.eq(~side)]
        m.d.comb += [high_pin.eq(high & self.permitted), low_pin.eq(low & self.permitted)]
