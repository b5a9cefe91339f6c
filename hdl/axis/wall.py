"""The virtual wall: a unilateral spring and damper, or a virtual coupling."""

from amaranth.hdl import Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis.wall import Design

from ..arithmetic.fixed import shape, shift_floor
from ..block import Block
from ..wires import given

PART_BITS = 16
"""Bits of an operand that a multiplier of every part takes beside a gain word; a wider one is split."""


def split(value: Value) -> list[Value]:
    """Return the parts of a signed value, `PART_BITS` apart, the lowest first: the last is signed, the others not."""
    low = [value[start : start + PART_BITS] for start in range(0, len(value) - PART_BITS, PART_BITS)]
    return [*low, value[len(low) * PART_BITS :].as_signed()]


def products(name: str, gain: Value, operand: Value) -> tuple[list, Value]:
    """Return the assignments that take the products of a gain and the parts of an operand, and the registers' sum.

    Nothing but a register is behind a multiplier: what adds the parts has a clock of its own. It has no reset,
    because the register inside a multiplier of the iCE40, which may take its place, has only an asynchronous one.
    """
    made = [gain * part for part in split(operand)]
    taken = [Signal(each.shape(), name=f"{name}_{place}", reset_less=True) for place, each in enumerate(made)]
    whole = sum(each << place * PART_BITS for place, each in enumerate(taken))
    return [register.eq(each) for register, each in zip(taken, made, strict=True)], whole


class Wall(Block):
    """The force of a unilateral spring and damper on the handle; of a virtual coupling if the design is one.

    Equation, with side = +1 if the wall fills greater positions, else -1:

        depth = side (count - wall_position)
        push  = wall_stiffness depth + wall_damping side velocity     for depth > 0, else 0
        force = -side push

    `wall_forbid_pull` holds push at 0 or more. In a coupling the velocity is taken relative to `wall_velocity`. With
    `wall_two_sided` the wall pushes at every depth; both sides hold if `wall_forbid_pull` is 0.

    Latency: `latency` clocks from `strobe` to `valid`. A sample's `lead` comes `design.lead` clocks or more before its
    `strobe`, and not before the last sample's `strobe`; it may come with that one.

    Rounding and overflow: the depth is exact. Low bits of the velocity beyond `design.coarse` are dropped; the exact
    sum of the products is rounded once, half of a push up, to a force LSB, then saturates at the force format.

    Parameters
    ----------
    design : hardwall.model.axis.wall.Design
        Formats; its module derives them.

    Members
    -------
    lead : In(1)
        Pulse: take a sample's count.
    count : In(signed)
        With `lead`: position, counts.
    strobe : In(1)
        Pulse: take the same sample's velocity.
    velocity : In(SQ)
        With `strobe`: velocity, counts a sample.
    wall_stiffness, wall_damping : In(UQ)
        Force LSB a count, and force LSB a count/sample.
    wall_position : In(signed)
        Surface of the wall, counts.
    wall_left : In(1)
        1: side is -1.
    wall_forbid_pull : In(1)
        1: the wall only pushes.
    wall_velocity : In(SQ)
        Of a coupling: the surface's velocity, counts a sample, with the bits of `design.surface`.
    wall_two_sided : In(1)
        Of a coupling. 1: the wall holds on both sides, if it may pull.
        All these words are constant from the clock after a sample's `lead` to its `strobe`.
    force : Out(SQ)
        Force on the handle, force LSB; constant from one `valid` to the next.
    may_be_positive, may_be_negative : Out(1)
        If a virtual mass follows, with `force`: the signs that a force at this count may have; neither in free space,
        or if the wall has neither a spring nor a damper.
    valid : Out(1)
        High for one clock.

    Raises
    ------
    TypeError
        If `design` is of another class.

    Source: Chawda, Celik, O'Malley, World Haptics 2011, the virtual wall.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        return {
            "lead": In(1),
            "count": In(signed(design.count_width)),
            "strobe": In(1),
            "velocity": In(shape(design.velocity)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "force": Out(shape(design.force)),
            **(dict.fromkeys(("may_be_positive", "may_be_negative"), Out(1)) if design.borne else {}),
            "valid": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        design = self._design
        counted = Signal(signed(design.count_width))
        offset = Signal(shape(design.depth))
        left, positive, negative = Signal(), Signal(), Signal()
        known, placed, damped, summed = Signal(), Signal(), Signal(), Signal()

        m.d.sync += [known.eq(self.lead), placed.eq(known)]
        with m.If(self.lead):
            m.d.sync += counted.eq(self.count)
        # The force is a spring to the surface and a damper, whatever the side: -side push = stiffness offset - damping
        # velocity. The side says where it acts.
        with m.If(known):
            m.d.sync += offset.eq(self.wall_position - counted)
        pulled, spring = products("spring", self.wall_stiffness, offset)
        inside = (offset != 0) & (offset[-1] != self.wall_left)
        if design.coupling:
            inside |= self.wall_two_sided
        with m.If(placed):
            m.d.sync += [
                *pulled,
                left.eq(self.wall_left),
                positive.eq(inside & (self.wall_left | ~self.wall_forbid_pull)),
                negative.eq(inside & ~(self.wall_left & self.wall_forbid_pull)),
            ]

        coarse = shift_floor(self.velocity, design.velocity.f - design.coarse.f)[: design.coarse.width].as_signed()
        braked, damper = products("damper", self.wall_damping, coarse)
        m.d.sync += [damped.eq(self.strobe), summed.eq(damped), self.valid.eq(summed)]
        with m.If(self.strobe):
            m.d.sync += braked

        # A push of half a force LSB is rounded up. The sum rounded down is -side push where the side is -1; where it is
        # +1, half an LSB is rounded the other way if it is added but for a unit.
        spring_shift, damper_shift = design.push - design.stiffness.f, design.push - design.damping.f - design.coarse.f
        total = Signal(signed(design.total_bits))
        half = (1 << (design.push - 1)) - 1 if design.push > 0 else 0
        lean = half + left if design.push > 0 else 0
        if design.coupling:
            surface_shift = design.push - design.damping.f - design.surface.f
            # What the surface's velocity adds is known before the strobe: the sum has no more terms than without.
            carried, surface = products("surface", self.wall_damping, self.wall_velocity)
            lean = Signal(signed(design.lean_bits))
            with m.If(known):
                m.d.sync += carried
            with m.If(placed):
                m.d.sync += lean.eq((surface << surface_shift) + half + (self.wall_left if design.push > 0 else 0))
        with m.If(damped):
            m.d.sync += total.eq((spring << spring_shift) - (damper << damper_shift) + lean)

        # A sum is in range if its bits above the force are all as its sign; the force's least word is out of range.
        sign, top = total[-1], design.push + design.force.width - 1
        limited = total[top:].any() & ~total[top:].all() | sign & ~total[design.push : top].any()
        limit = Mux(sign, -design.force.max, design.force.max)
        within = (total >> design.push)[: design.force.width].as_signed()
        with m.If(summed):
            m.d.sync += self.force.eq(Mux(Mux(sign, negative, positive), Mux(limited, limit, within), 0))
        if design.borne:
            self._say_where_it_acts(m, placed, summed, {"may_be_positive": positive, "may_be_negative": negative})
        return m

    def _say_where_it_acts(self, m: Module, placed: Signal, summed: Signal, may_be: dict[str, Signal]) -> None:
        """Give the signs that the force may have, with the force; a wall without a spring and a damper has none."""
        exists = Signal()
        with m.If(placed):
            m.d.sync += exists.eq(self.wall_stiffness.any() | self.wall_damping.any())
        with m.If(summed):
            m.d.sync += given(self, {name: allowed & exists for name, allowed in may_be.items()})
