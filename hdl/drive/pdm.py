"""Pulses whose density is the magnitude of the drive, and its sign."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.drive import pdm

from ..arithmetic.fixed import shape
from ..block import Block
from .scale import Scale


class Pdm(Block):
    """First-order sigma-delta modulation of the drive, as sign and magnitude.

    Equation: as in `hardwall.model.drive.pdm`: 2**N clocks of a steady amount have exactly `amount` pulses.

    Safe is `drive_pdm` low: at once, through a gate alone, where `permitted` is low, and one clock after the axis is
    not ARMED, because its drive is zero then. With an amplifier in the stage the drive passes a scaling. `armed` is
    looked at after the scaling, so it takes one clock, too.

    Latency: `latency` clocks from a drive to the first pulse that it makes.

    Rounding and overflow: the remainder that no pulse has carried yet, less than one pulse, stays in the sum, also when
    the sign changes. With an amplifier, as of `Scale`.

    Parameters
    ----------
    design : hardwall.model.drive.pdm.Design
        Formats and scaling.

    Members
    -------
    magnitude : In(UQ)
        The drive's magnitude, force LSB; zero unless the axis is ARMED.
    negative : In(1)
        The sign for the pin.
    armed : In(1), with an amplifier
        The axis is ARMED.
    permitted : In(1)
        A level that no clock is needed for: low makes the pin safe.
    drive_pdm : Out(1)
        The pulses.
    drive_sign : Out(1)
        The sign, with the pulse.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = pdm.Design

    @staticmethod
    def members(design: pdm.Design) -> dict[str, Member]:
        return {
            "magnitude": In(shape(design.magnitude)),
            "negative": In(1),
            **({"armed": In(1)} if design.scale else {}),
            "permitted": In(1),
            **dict.fromkeys(design.pins, Out(1)),
        }

    def elaborate(self, platform):
        m = Module()
        amount, sign = self.magnitude, self.negative
        if self._design.scale:
            m.submodules.scale = scale = Scale(self._design.scale)
            m.d.comb += [scale.magnitude.eq(amount), scale.negative.eq(sign)]
            amount, sign = Mux(self.armed, scale.steps, 0), scale.below
        total = Signal(self._design.params.bits + 1)
        m.d.sync += [total.eq(total[:-1] + amount), self.drive_sign.eq(sign)]
        m.d.comb += self.drive_pdm.eq(total[-1] & self.permitted)
        return m
