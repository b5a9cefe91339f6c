"""What the wall promises: its force is in range and pushes, and no bit of the exact sum is lost on the way."""

from functools import partial

from amaranth.hdl import Mux, Signal, Value

from hardwall.hdl.wall import Wall
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import Widths


def wall(axis: str) -> Wall:
    return Wall(spec(axis).design.wall)


def latched(bench: Bench, block: Wall) -> dict[str, Value]:
    """Return the inputs as the last strobe took them; they are assumed to be constant from there to `valid`."""
    idle = bench.inner["fsm_state"] == 0
    taken = {}
    for name in ("count", "velocity", *(word.name for word in block.design.words)):
        now = getattr(block, name)
        taken[name] = Signal.like(now)
        with bench.m.If(idle & block.strobe):
            bench.m.d.sync += taken[name].eq(now)
        bench.assume(idle | (now == taken[name]))
    return taken


def force_is_in_range(axis: str, bench: Bench) -> None:
    block = bench.block(wall(axis), Widths(("depth",)))
    bench.within(force=block.design.force.max)


def never_pulls(axis: str, bench: Bench) -> None:
    block = bench.block(wall(axis), Widths(("depth",)))
    taken = latched(bench, block)
    pushes = Mux(taken["wall_left"], block.force >= 0, block.force <= 0)
    bench.promise(~block.valid | ~taken["wall_forbid_pull"] | pushes)


PROPERTIES = [
    Property(
        "the force is in range",
        "wall mhz",
        partial(force_is_in_range, "mhz"),
        depth=8,
        bugs=(Bug(Wall.elaborate, "rounded < -top", "0"),),
    ),
    Property(
        "a wall that may not pull never pulls",
        "wall mhz",
        partial(never_pulls, "mhz"),
        depth=10,
        quick=True,
        bugs=(Bug(Wall.elaborate, "below & self.wall_forbid_pull, 0", "below & self.wall_left, 0"),),
    ),
]
