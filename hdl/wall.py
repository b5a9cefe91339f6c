"""The virtual wall: a unilateral spring and damper."""

from amaranth.hdl import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.wall import Design

from .arithmetic.fixed import shape, shift_floor
from .block import Block


class Wall(Block):
    """The force of a unilateral spring and damper on the handle.

    Equation, with side = +1 if the wall fills greater positions, else -1:

        depth = side (count - wall_position)
        push  = wall_stiffness depth + wall_damping side velocity     for depth > 0, else 0
        force = -side push

    `wall_forbid_pull` holds push at 0 or more.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with `valid`. One multiplier makes
    both products in turn.

    Rounding and overflow: low bits of the velocity beyond `design.coarse` are dropped; the exact sum of the products
    is rounded once, half up, to a force LSB, then saturates at the force format.

    Parameters
    ----------
    design : hardwall.model.wall.Design
        Formats; its module derives them.

    Members
    -------
    strobe : In(1)
        Pulse: take a sample.
    count : In(signed)
        Position, counts; may wrap.
    velocity : In(SQ)
        Velocity, counts a sample.
    wall_stiffness, wall_damping : In(UQ)
        Force LSB a count, and force LSB a count/sample.
    wall_position : In(signed)
        Surface of the wall, counts.
    wall_left : In(1)
        1: side is -1.
    wall_forbid_pull : In(1)
        1: the wall only pushes.
    force : Out(SQ)
        Force on the handle, force LSB; constant from one `valid` to the next.
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
            "strobe": In(1),
            "count": In(signed(design.count_width)),
            "velocity": In(shape(design.velocity)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "force": Out(shape(design.force)),
            "valid": Out(1),
        }

    def elaborate(self, platform):
        m = Module()
        design = self._design

        depth = Signal(signed(design.count_width))
        inward = Signal(signed(design.coarse.width + 1))
        gain = Signal(max(design.stiffness.width, design.damping.width))
        operand = Signal(signed(max(len(depth), len(inward))))
        product = Signal(signed(len(gain) + len(operand)))
        spring_shift = design.push - design.stiffness.f
        damper_shift = design.push - design.damping.f - design.coarse.f
        half = 1 << (design.push - 1) if design.push > 0 else 0
        spring = Signal(signed(max(len(product) + spring_shift, half.bit_length() + 1) + 1))
        total = Signal(signed(max(len(spring), len(product) + damper_shift) + 1))

        m.d.sync += self.valid.eq(0)
        with m.FSM():
            with m.State("DEPTH"), m.If(self.strobe):
                offset = Mux(self.wall_left, self.wall_position - self.count, self.count - self.wall_position)
                coarse = shift_floor(self.velocity, design.velocity.f - design.coarse.f)
                m.d.sync += [
                    depth.eq(offset[: len(depth)].as_signed()),
                    inward.eq(Mux(self.wall_left, -coarse, coarse)),
                ]
                m.next = "SPRING"
            with m.State("SPRING"):
                m.d.sync += [gain.eq(self.wall_stiffness), operand.eq(depth)]
                m.next = "DAMPER"
            with m.State("DAMPER"):
                m.d.sync += [gain.eq(self.wall_damping), operand.eq(inward)]
                m.next = "SUM"
            with m.State("SUM"):
                # Half a force LSB is added, so that rounding the sum down rounds half up.
                m.d.sync += spring.eq((product << spring_shift) + half)
                m.next = "PUSH"
            with m.State("PUSH"):
                m.d.sync += total.eq(spring + (product << damper_shift))
                m.next = "FORCE"
            with m.State("FORCE"):
                # The sign and the limits are computed in parallel: either alone is a carry chain.
                top, left = design.force.max, self.wall_left
                rounded = shift_floor(total, design.push)
                push = rounded[: design.force.width].as_signed()
                above = rounded > top
                below = Mux(self.wall_forbid_pull, rounded < 0, rounded < -top)
                limit = Mux(below & self.wall_forbid_pull, 0, Mux(above == left, top, -top))
                within = Mux(left, push, -push)
                m.d.sync += [
                    self.force.eq(Mux(depth > 0, Mux(above | below, limit, within), 0)),
                    self.valid.eq(1),
                ]
                m.next = "DEPTH"
        # The multiplier has registers on both sides: its result is ready two clocks after its operands are chosen.
        m.d.sync += product.eq(gain * operand)
        return m
