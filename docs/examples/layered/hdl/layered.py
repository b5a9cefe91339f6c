"""A layered wall: a stiff core under a soft skin."""

from amaranth.hdl import Module, Mux
from amaranth.lib.wiring import Member

from hardwall.model.layered import Design

from .arithmetic.fixed import saturate
from .axis.wall import Wall
from .block import Block


class Layered(Block):
    """The force of two unilateral springs, one beginning below the other, and a damper on the handle.

    Equation: the sum of two `Wall`s; the core has no damper, and its surface lies `core_depth` below the wall's.

    Latency: `latency` clocks from `strobe` to `valid`; a sample's `lead` and `strobe` come as to a `Wall`.

    Rounding and overflow: every layer rounds and saturates as `Wall`; the exact sum saturates at the force format.

    Parameters
    ----------
    design : hardwall.model.layered.Design
        Formats; its module derives them.

    Members
    -------
    lead, count, strobe, velocity, force, valid
        The same as in `Wall`.
    one input for each of `design.words` : In
        Run-time parameters.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        return Wall.members(design)

    def elaborate(self, platform):
        m = Module()
        design = self._design
        m.submodules.skin = skin = Wall(design.layer)
        m.submodules.core = core = Wall(design.layer)
        for layer in (skin, core):
            m.d.comb += [
                layer.lead.eq(self.lead),
                layer.count.eq(self.count),
                layer.strobe.eq(self.strobe),
                layer.velocity.eq(self.velocity),
                layer.wall_left.eq(self.wall_left),
                layer.wall_forbid_pull.eq(self.wall_forbid_pull),
            ]
        inwards = Mux(self.wall_left, -self.core_depth, self.core_depth)
        m.d.comb += [
            skin.wall_stiffness.eq(self.wall_stiffness),
            skin.wall_damping.eq(self.wall_damping),
            skin.wall_position.eq(self.wall_position),
            core.wall_stiffness.eq(self.core_stiffness),
            core.wall_position.eq((self.wall_position + inwards)[: design.count_width]),
        ]
        m.d.sync += self.valid.eq(skin.valid)
        with m.If(skin.valid):
            m.d.sync += self.force.eq(saturate(skin.force + core.force, -design.force.max, design.force.max))
        return m
