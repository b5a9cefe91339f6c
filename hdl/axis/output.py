"""The output stage, from the wall's force to the drive."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis.output import Design

from ..arithmetic.fixed import shape
from ..block import Block


def past(value: Value, bound: Value, negative: Value) -> Value:
    """Return whether a signed value is farther from zero than a bound of its sign, with that sign; one sum decides."""
    spare = Cat(~negative, bound).as_signed() + Cat(~negative, ~value).as_signed()
    return spare[-1] ^ negative


class Output(Block):
    """The output stage: decimation, then the slew limit and, last, the force limit.

    Equation, every `design.decimation` strobes, beginning with the first:

        drive <- force, whose magnitude grows by at most output_slew_limit, then held within +-output_force_limit

    No force limit at run time exceeds `design.force_limit`. Between actuations the drive holds. A strobe with `fault`
    makes the drive zero at `valid`. `enable` low makes the drive zero at the next clock, and it stays zero until an
    actuation whose strobe finds `enable` high. Slewing starts again from zero, and from zero too when the force has
    changed its sign: the way to zero is never limited.

    Latency: `latency` clocks from `strobe` to the changed `drive`, with `valid`; `design.interval` clocks or more from
    a `strobe`, or from a reset, to the next.

    Rounding and overflow: all values are exact; the limits above raise `limited` when they act.

    Parameters
    ----------
    design : hardwall.model.axis.output.Design
        Formats; its module derives them.

    Members
    -------
    strobe : In(1)
        Pulse: take a force.
    force : In(SQ)
        The wall's force on the handle, force LSB.
    fault : In(1)
        With `strobe`: this sample's drive is zero.
    enable : In(1)
        Low forces the drive to zero at the next clock.
    output_force_limit : In(UQ)
        Largest drive in either direction, force LSB; a larger word acts as `design.force_limit`.
    output_slew_limit : In(UQ)
        Largest growth of the drive's magnitude in an actuation, force LSB. Both limits are taken `design.ahead` clocks
        before a `strobe`; at any other clock they mean nothing.
    drive : Out(SQ)
        The drive that leaves the FPGA, force LSB.
    limited : Out(2)
        With `valid`: bit 0, the slew limit acted; bit 1, the force limit acted.
    actuated : Out(1)
        High for one clock, with the `valid` of an actuation.
    valid : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "force": In(shape(design.force)),
            "fault": In(1),
            "enable": In(1),
            **{word.name: In(shape(word.format)) for word in design.words},
            "drive": Out(shape(design.force)),
            "limited": Out(len(design.flags)),
            "actuated": Out(1),
            "valid": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        design = self._design
        phase = Signal(range(max(design.decimation, 2)))
        turn = phase == 0 if design.decimation > 1 else Const(1)

        # At every clock the window for the next drive follows the limits of the clock before, the drive, and a low
        # enable. The window is how far the drive may grow on each side, and how far it may be, whichever is smaller.
        # Which one is smaller is compared beside the sum: whether the drive is within a step of the force limit.
        most = design.force_limit
        limit = Mux(self.output_force_limit > most, most, self.output_force_limit)
        highest, lowest = Signal(range(most + 1), init=most), Signal(range(-most, 1), init=-most)
        room, step = Signal(range(-design.slew.max, most + 1), init=most), Signal(shape(design.slew))
        growth = Signal(range(design.slew.max + design.force.max + 1))
        falls = Signal(range(design.force.min - design.slew.max, 1))
        upper, lower = Signal(shape(design.force)), Signal(shape(design.force))
        capped, floored = Signal(), Signal()
        positive, negative = (Mux(self.enable & (self.drive[-1] == sign), self.drive, 0) for sign in (0, 1))
        rise, fall = (positive + step)[: len(growth)], negative - step
        too_high, too_low = positive > room, negative + room < 0
        m.d.sync += [
            highest.eq(limit),
            lowest.eq(-limit),
            step.eq(self.output_slew_limit),
            room.eq(limit - self.output_slew_limit),
            growth.eq(rise),
            falls.eq(fall),
            capped.eq(too_high),
            floored.eq(too_low),
            upper.eq(Mux(too_high, highest, rise)),
            lower.eq(Mux(too_low, lowest, fall)),
        ]

        # The force's sign says on which side it may leave the window.
        side = self.force[-1]
        bound, grown = Mux(side, lower, upper), Mux(side, falls, growth)
        beyond = past(self.force, bound, side)
        flags = Cat(past(self.force, grown, side), beyond & Mux(side, floored, capped))
        actuating = self.strobe & turn & self.enable & ~self.fault
        with m.If(actuating):
            m.d.sync += self.drive.eq(Mux(beyond, bound, self.force))
        with m.If(~self.enable | self.strobe & self.fault):
            m.d.sync += self.drive.eq(0)

        m.d.sync += [self.valid.eq(self.strobe), self.actuated.eq(self.strobe & turn)]
        with m.If(self.strobe):
            m.d.sync += [
                phase.eq(Mux(phase == design.decimation - 1, 0, phase + 1)),
                self.limited.eq(Mux(actuating, flags, 0)),
            ]
        return m
