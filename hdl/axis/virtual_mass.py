"""Virtual mass: a force against the acceleration of the handle."""

from amaranth.hdl import Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis.virtual_mass import Design

from ..arithmetic.fixed import held, saturate, shape, shift_floor
from ..block import Block
from .wall import products


class VirtualMass(Block):
    """The wall's force, less a virtual mass times the acceleration of the handle.

    Equation:

        mass  = wall_mass where the wall acts, else free_mass, within -design.most to design.most
        given = force - mass acceleration

    Where the wall acts, a sum with a sign that its force may not have is 0.

    Latency: `latency` clocks from `forced` to `valid`. A sample's `forced` comes `design.behind` clocks or more after
    its `strobe`, and not after the next one's.

    Rounding and overflow: low bits of the acceleration beyond `design.coarse` are dropped. The product is rounded once,
    half up, to a force LSB. It saturates at `design.inertia`, twice the range of the force, and the sum at the force's.

    Parameters
    ----------
    design : hardwall.model.axis.virtual_mass.Design
        Formats; its module derives them.

    Members
    -------
    strobe : In(1)
        Pulse: take a sample's acceleration.
    acceleration : In(SQ)
        With `strobe`: acceleration, counts a sample^2.
    wall_mass, free_mass : In(SQ)
        Force LSB a count/sample^2; constant from the clock before `strobe` to `strobe`.
    forced : In(1)
        Pulse: the same sample's force is there.
    force : In(SQ)
        With `forced`: the wall's force on the handle, force LSB.
    may_be_positive, may_be_negative : In(1)
        With `forced`: the signs that the wall's force may have there; neither in free space.
    given : Out(SQ)
        The force that is given on, force LSB; constant from one `valid` to the next.
    valid : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If `design` is of another class.

    Source: see `hardwall.model.axis.virtual_mass`.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "acceleration": In(shape(design.acceleration)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "forced": In(1),
            "force": In(shape(design.force)),
            **dict.fromkeys(("may_be_positive", "may_be_negative"), In(1)),
            "given": Out(shape(design.force)),
            "valid": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        design = self.design
        in_wall, in_free_space = self._inertia(m, "wall", self.wall_mass), self._inertia(m, "free", self.free_mass)
        acts = self.may_be_positive | self.may_be_negative
        total = Signal(signed(design.inertia.width + 1))
        m.d.comb += total.eq(self.force - Mux(acts, in_wall, in_free_space))
        allowed = ~acts | Mux(total[-1], self.may_be_negative, self.may_be_positive)
        m.d.sync += self.valid.eq(self.forced)
        with m.If(self.forced):
            m.d.sync += self.given.eq(Mux(allowed, held(total, 0, len(self.force)), 0))
        return m

    def _inertia(self, m: Module, name: str, word: Value) -> Signal:
        """Return the force that a mass takes from the wall's: it is there 2 clocks behind the strobe."""
        design = self._design
        mass = Signal(shape(design.mass), name=f"{name}_mass_within")
        m.d.sync += mass.eq(saturate(word, -design.most, design.most))
        down = design.acceleration.f - design.coarse.f
        coarse = shift_floor(self.acceleration, down)[: design.coarse.width].as_signed()
        taken, product = products(f"{name}_product", mass, coarse)
        multiplied = Signal(name=f"{name}_multiplied")
        m.d.sync += multiplied.eq(self.strobe)
        with m.If(self.strobe):
            m.d.sync += taken
        inertia = Signal(shape(design.inertia), name=f"{name}_inertia")
        up, down = max(-design.shift, 0), max(design.shift, 0)
        rounded = Signal(signed(max(len(product) + up + 1, down + design.inertia.width)), name=f"{name}_rounded")
        m.d.comb += rounded.eq((product << up) + (1 << down - 1 if down else 0))
        with m.If(multiplied):
            m.d.sync += inertia.eq(held(rounded, down, design.inertia.width))
        return inertia
