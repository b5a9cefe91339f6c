"""The board of several axes under test: each axis with its encoder's wires, its amplifier and what it shows."""

from amaranth.hdl import Cat, ClockDomain, Module, Mux, Shape, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.hdl.axes.board import ENCODER
from hardwall.hdl.axis.supervised import COMPLEMENTS
from hardwall.hdl.board.lead_out import lead_out
from hardwall.model.axis.supervisor import COUNT

from .amplified import CLOCK_BITS, COUNTERS, FORCES, Amplified
from .damaged import Upset
from .staged import OF_AXES, StagedAxes

TURNED = {"state": Out(2), "latched": Out(COUNT), "first": Out(COUNT)}
"""What a turn of an axis shows."""
WIRES = dict.fromkeys((*ENCODER, *COMPLEMENTS), In(1))


class DamagedAxes(wiring.Component):
    """A board of several axes, an amplifier for each, and a mask `upset_*` for each of `OF_AXES`.

    What belongs to axis k has its number behind its name, as in `state_1`, and is otherwise as of `Damaged`. The board
    has no pins for the complements of the channels: here their wires reach the axes inside.

    Attributes:
        own: the names of what belongs to an axis, without its number.

    Args:
        stage: the axes and their drive stage.
    """

    def __init__(self, stage: StagedAxes):
        self.stage, self.board = stage, stage.board()
        axes = self.board.axes
        self._pins = (*stage.spec.drive.pins, "alive")
        own = {
            **WIRES,
            **TURNED,
            **dict.fromkeys(self._pins, Out(1)),
            "driven": Out(signed(len(axes.magnitude[0]) + 1)),
            "count": Out(signed(stage.spec.count_width)),
            **COUNTERS,
            **FORCES,
        }
        self.own = tuple(own)
        of_board = {name: port for name, port in self.board.signature.members.items() if name not in own}
        self._of_board = tuple(of_board)
        masks = {f"upset_{name}": In(Shape.cast(getattr(axes, name).shape()).width) for name in OF_AXES}
        of_axes = {f"{name}_{axis}": port for axis in range(stage.spec.axes) for name, port in own.items()}
        super().__init__({**of_board, "tick": In(1), "now": Out(CLOCK_BITS), **masks, **of_axes})
        wrong = {name: getattr(self, f"upset_{name}") for name in OF_AXES}
        # The board says that a complement is unlike its channel: wrong are those whose wires are not.
        wrong |= {name: self._all(name) ^ ~self._all(name[:-2]) for name in COMPLEMENTS}
        self.board.axes = Upset(axes, wrong)

    def _all(self, name: str) -> Value:
        """Return what every axis has by a name."""
        return Cat(getattr(self, f"{name}_{axis}") for axis in range(self.stage.spec.axes))

    def elaborate(self, platform):
        m = Module()
        m.submodules.board = board = self.board
        m.d.comb += lead_out(board, self, self._of_board)
        m.d.comb += [getattr(board, name).eq(self._all(name)) for name in ENCODER]
        m.d.comb += [self._all(name).eq(getattr(board, name)) for name in self._pins]
        m.domains.watch = watch = ClockDomain("watch", reset_less=True)
        m.d.comb += watch.clk.eq(self.clk)
        m.d.watch += self.now.eq(self.now + 1)
        for axis in range(self.stage.spec.axes):
            self._show(m, axis)
        return m

    def _show(self, m: Module, axis: int) -> None:
        """Show an axis, and what its amplifier makes of its pins."""
        axes, mine = self.board.axes, {name: getattr(self, f"{name}_{axis}") for name in self.own}
        magnitude = axes.magnitude[axis]
        m.d.comb += [
            mine["driven"].eq(Mux(axes.negative[axis], -magnitude, magnitude)),
            mine["count"].eq(axes.count[axis]),
        ]
        with m.If(axes.turn_valid & (axes.turn_axis == axis)):
            m.d.watch += [mine[name].eq(getattr(axes, f"turn_{name}")) for name in TURNED]
        m.submodules[f"amplified_{axis}"] = amplified = Amplified(self.stage)
        m.d.comb += amplified.tick.eq(self.tick)
        m.d.comb += [getattr(amplified, name).eq(mine[name]) for name in self._pins]
        m.d.comb += [mine[name].eq(getattr(amplified, name)) for name in (*COUNTERS, *FORCES)]


class OfAxis:
    """The device, with what belongs to one of its axes by the names that an axis alone has."""

    def __init__(self, dut, axis: int, own: tuple[str, ...]):
        self._dut, self._axis, self._own = dut, axis, own

    def __getattr__(self, name: str):
        return getattr(self._dut, f"{name}_{self._axis}" if name in self._own else name)
