"""The passivity observer and controller: what the drive has taken and given, and a damper while it has given more."""

from amaranth.hdl import Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis.passivity import LOWER, MIDDLE, UPPER, Design

from ..arithmetic.fixed import held, length_of, shape, shift_floor
from ..block import Block
from .wall import products


def significant_bits(value: Value) -> Value:
    """Return the number of bits of a signed value without its leading copies of the sign."""
    rest = len(value) - 1
    return length_of(value[:-1] ^ value[-1].replicate(rest)) if rest else Const(0)


class Passivity(Block):
    """The observer of the energy that the drive takes from the handle, and a damper while it has given more than taken.

    Equation, at every sample, with `drive` as the answer to the last one:

        energy <- energy - drive (position - last position)    position: the count, and where in it the handle is
        given  =  force - part velocity                        for energy < 0 and a force, not beyond zero, else force

    The part is passivity_damping 2**-n. Unless n is 0, it dissipates an eighth of the debt to twice the debt until the
    next actuation, except for its rounding to zero. A debt stays. A credit loses a share of 2**-`design.memory` a
    sample, and all of it where there is no force. After a preload there is neither.

    Latency: `latency` clocks from `forced` to `valid`. A sample's `lead` comes 2 clocks or more before its `strobe`,
    and not before the last one's; `forced` comes `behind` clocks or more behind the `strobe`, and the next `strobe`
    comes behind `valid`.

    Rounding and overflow: the energy is exact and saturates; the damper's force is rounded once, half up, and
    saturates; its part is rounded to zero; what is given saturates.

    Parameters
    ----------
    design : hardwall.model.axis.passivity.Design
        Formats; its module derives them.

    Members
    -------
    lead : In(1)
        Pulse: take a sample's count.
    count : In(signed)
        With `lead`: position, counts; may wrap. It changes by one a clock at most, but for a preload.
    restart : In(1)
        With `lead`: the count was preloaded since the last sample.
    strobe : In(1)
        Pulse: take the same sample's velocity.
    velocity : In(SQ)
        With `strobe`: velocity, counts a sample.
    drive : In(SQ)
        With `strobe`: the drive that answers the last sample, force LSB.
    passivity_damping : In(UQ)
        With `strobe`: force LSB a count/sample.
    forced : In(1)
        Pulse: the same sample's force is there.
    force : In(SQ)
        From `forced` to `valid`: the wall's force on the handle, force LSB.
    given : Out(SQ)
        The force that is given on, force LSB; constant from one `valid` to the next.
    active : Out(1)
        With `given`: whether the damper's part is not zero.
    valid : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If `design` is of another class.

    Source: Hannaford and Ryu, IEEE Transactions on Robotics and Automation 18(1), 2002; see
    `hardwall.model.axis.passivity`.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        return {
            "lead": In(1),
            "count": In(signed(design.count_width)),
            "restart": In(1),
            "strobe": In(1),
            "velocity": In(shape(design.velocity)),
            "drive": In(shape(design.force)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "forced": In(1),
            "force": In(shape(design.force)),
            "given": Out(shape(design.force)),
            "active": Out(1),
            "valid": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        energy = Signal(shape(self._design.energy))
        self._observe(m, energy)
        part, back = self._damp(m, energy)

        # A sum that is past zero is zero.
        total = Signal(signed(len(self.force) + 1))
        m.d.comb += total.eq(Mux(back, self.force + part, self.force - part))
        halved, given = Signal(), Signal()
        m.d.sync += [halved.eq(self.forced), given.eq(halved), self.valid.eq(given)]
        with m.If(given):
            within = held(total, 0, len(self.force))
            m.d.sync += [self.given.eq(Mux(total[-1] == self.force[-1], within, 0)), self.active.eq(part.any())]
        return m

    def _observe(self, m: Module, energy: Signal) -> None:
        """Let the energy follow the samples: it is a sample's 3 clocks behind the strobe, up to `forced`."""
        design = self._design
        last, moved = Signal(signed(design.count_width)), Signal(shape(design.displacement))
        within, half_counts = Signal(range(UPPER + 1), init=MIDDLE), Signal(shape(design.displacement))
        restarted, begins, known = Signal(), Signal(), Signal()
        m.d.sync += known.eq(self.lead)
        turned = (self.count - last)[: design.count_width].as_signed()
        with m.If(self.lead):
            m.d.sync += [last.eq(self.count), moved.eq(turned), restarted.eq(self.restart)]
        with m.If(known):
            now = Mux(moved == 0, within, Mux(moved == 1, LOWER, Mux(moved == -1, UPPER, MIDDLE)))
            m.d.sync += within.eq(Mux(restarted, MIDDLE, now))
            # How far a preload is from the last count is no displacement, and may be more than one has bits for.
            with m.If(~restarted):
                m.d.sync += half_counts.eq(2 * moved + now - within)

        worked, taken = products("worked", self.drive, half_counts)
        multiplied, summed = Signal(), Signal()
        work = Signal.like(taken)
        m.d.sync += [multiplied.eq(self.strobe), summed.eq(multiplied), work.eq(taken)]
        with m.If(self.strobe):
            m.d.sync += [*worked, begins.eq(restarted)]

        # What a sample leaves of a credit comes behind its force, and before the next sample's work.
        loss, forgets = Signal.like(energy), Signal()
        share = (energy >> design.memory) + energy[: design.memory].any()
        m.d.sync += [forgets.eq(self.forced), loss.eq(Mux(energy[-1], 0, Mux(self.force.any(), share, energy)))]
        total = Signal((energy - work).shape())
        m.d.comb += total.eq(energy - work)
        with m.If(summed):
            m.d.sync += energy.eq(Mux(begins, 0, held(total, 0, len(energy))))
        with m.If(forgets):
            m.d.sync += energy.eq(energy - loss)

    def _damp(self, m: Module, energy: Signal) -> tuple[Signal, Signal]:
        """Return the magnitude of the damper's force, halved as often as the debt says, and its sign; 2 clocks late."""
        design = self._design
        coarse = shift_floor(self.velocity, design.velocity.f - design.coarse.f)[: design.coarse.width].as_signed()
        braked, product = products("damper", self.passivity_damping, coarse)
        multiplied, summed = Signal(), Signal()
        speed_bits = Signal(range(design.coarse.width))
        m.d.sync += [multiplied.eq(self.strobe), summed.eq(multiplied)]
        with m.If(self.strobe):
            m.d.sync += [*braked, speed_bits.eq(significant_bits(coarse))]

        up, down = max(-design.shift, 0), max(design.shift, 0)
        half = 1 << down - 1 if down else 0
        total = Signal(signed(max(len(product) + up + 1, down + design.force.width)))
        damper = Signal(shape(design.force))
        with m.If(multiplied):
            m.d.sync += total.eq((product << up) + half)
        with m.If(summed):
            m.d.sync += damper.eq(held(total, down, design.force.width))

        # Without a debt, or a force, there is no part.
        taken = significant_bits(damper) + speed_bits + design.spare_bits
        own_bits, debt_bits = Signal(taken.shape()), Signal(range(design.energy.width))
        magnitude, back, halved = Signal(design.force.width - 1), Signal(), Signal()
        m.d.sync += halved.eq(self.forced)
        with m.If(self.forced):
            m.d.sync += [
                own_bits.eq(taken),
                debt_bits.eq(significant_bits(energy)),
                magnitude.eq(Mux(energy[-1] & self.force.any(), abs(damper), 0)),
                back.eq(damper[-1]),
            ]
        excess, part = own_bits - debt_bits, Signal.like(magnitude)
        with m.If(halved):
            m.d.sync += part.eq(magnitude >> Mux(excess < 0, 0, excess)[: len(excess) - 1])
        return part, back
