"""The output stage, from the wall's force to the drive."""

from amaranth.hdl import Const, Module, Mux, Signal
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.output import Design

from .arithmetic.fixed import negated, not_above, shape
from .block import Block


class Output(Block):
    """The output stage: decimation, then the slew limit and, last, the force limit.

    Equation, every `design.decimation` strobes, beginning with the first:

        drive <- force, whose magnitude grows by at most output_slew_limit, then held within +-output_force_limit

    No force limit at run time exceeds `design.force_limit`. Between actuations the drive holds. A strobe with `fault`
    makes the drive zero at `valid`. `enable` low makes the drive zero at the next clock, and it stays zero until
    `enable` is high from strobe to `valid` of an actuation. Slewing starts again from zero, and from zero too when the
    force has changed its sign: the way to zero is never limited.

    Latency: `latency` clocks from `strobe` to the changed `drive`, with `valid`; the next `strobe` may come with
    `valid`.

    Rounding and overflow: all values are exact; the limits above raise `limited` when they act.

    Parameters
    ----------
    design : hardwall.model.output.Design
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
        Largest growth of the drive's magnitude in an actuation, force LSB.
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
        phase = Signal(range(max(self._design.decimation, 2)))
        turn = phase == 0 if self._design.decimation > 1 else Const(1)
        allowed = Signal()
        # The stage works with magnitudes, and keeps that of the force as its complement, which a comparison adds. The
        # growth is measured from the drive, or from zero if the force has the other sign.
        most = self._design.force_limit
        limit = Signal(range(most + 1), init=most)
        less, slewed, limited = Signal(len(self.force)), Signal(len(self.force)), Signal.like(limit)
        held, reach = Signal.like(limit, init=0), Signal(len(self.output_slew_limit) + 1)
        negative, held_negative = Signal(), Signal()
        m.d.sync += limit.eq(Mux(self.output_force_limit > most, most, self.output_force_limit))
        before = Mux(self.force[-1] == held_negative, held, 0)
        farther, over = ~not_above(less, reach), slewed > limit
        m.d.comb += limited.eq(Mux(over, limit, slewed))

        m.d.sync += [self.valid.eq(0), self.actuated.eq(0)]
        with m.FSM():
            with m.State("CHANGE"), m.If(self.strobe):
                m.d.sync += [
                    less.eq(~negated(self.force, self.force[-1])),
                    negative.eq(self.force[-1]),
                    reach.eq(before + self.output_slew_limit),
                    allowed.eq(self.enable & ~self.fault),
                ]
                m.next = "SLEW"
            with m.State("SLEW"):
                m.d.sync += [slewed.eq(Mux(farther, reach, ~less)), self.limited[0].eq(farther)]
                m.next = "LIMIT"
            with m.State("LIMIT"):
                actuated = turn & allowed
                with m.If(actuated):
                    m.d.sync += [
                        self.drive.eq(negated(limited, negative)),
                        held.eq(limited),
                        held_negative.eq(negative),
                    ]
                with m.If(~allowed):
                    m.d.sync += [self.drive.eq(0), held.eq(0)]
                m.d.sync += [
                    phase.eq(Mux(phase == self._design.decimation - 1, 0, phase + 1)),
                    self.limited.eq(Mux(actuated, self.limited[0] | over << 1, 0)),
                    self.actuated.eq(turn),
                    self.valid.eq(1),
                ]
                m.next = "CHANGE"
        with m.If(~self.enable):
            m.d.sync += [self.drive.eq(0), held.eq(0), allowed.eq(0)]
        return m
