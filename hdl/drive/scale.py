"""From the drive to steps of a stage's output: a constant gain, rounded to the nearest step, and saturated."""

from amaranth.hdl import Const, Module, Mux, Signal
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.drive import scale

from ..arithmetic.fixed import shape, shift_round_half_up
from ..block import Block


class Scale(Block):
    """The drive, in steps of a stage's output.

    Equation: as in `hardwall.model.drive.scale`.

    Latency: `latency` clocks from a drive to its steps; a drive every clock.

    Rounding and overflow: to the nearest step, a half up in magnitude; saturates at `most`.

    Parameters
    ----------
    design : hardwall.model.drive.scale.Design
        Gain and formats.

    Members
    -------
    magnitude : In(UQ)
        The drive's magnitude, force LSB.
    negative : In(1)
        Its sign.
    steps : Out(UQ)
        Steps of the output.
    below : Out(1)
        The sign, with the steps.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = scale.Design

    @staticmethod
    def members(design: scale.Design) -> dict[str, Member]:
        return {
            "magnitude": In(shape(design.magnitude)),
            "negative": In(1),
            "steps": Out(shape(design.steps)),
            "below": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        gain, shift, most = self._design.params
        product, below = Signal(shape(self._design.product)), Signal()
        rounded = Signal(shape(self._design.rounded))
        m.d.comb += rounded.eq(shift_round_half_up(product, shift))
        m.d.sync += [
            product.eq(self.magnitude * Const(gain)),
            below.eq(self.negative),
            self.steps.eq(Mux(rounded > most, most, rounded)),
            self.below.eq(below),
        ]
        return m
