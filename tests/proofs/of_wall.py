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


def samples(bench: Bench, block: Wall) -> Value:
    """Assume that samples come as the wall promises to take them; return whether one waits for its strobe.

    A sample's strobe comes `lead` clocks or more behind its lead, the next lead with it or later, and the words are
    constant from the clock after the lead to the strobe.
    """
    age = Signal(range(block.design.lead + 1))
    ready = age == block.design.lead
    with bench.m.If(block.lead):
        bench.m.d.sync += age.eq(1)
    with bench.m.Elif(block.strobe):
        bench.m.d.sync += age.eq(0)
    with bench.m.Elif((age != 0) & ~ready):
        bench.m.d.sync += age.eq(age + 1)
    bench.assume(~block.strobe | ready)
    bench.assume(~block.lead | (age == 0) | block.strobe)
    for word in block.design.words:
        now = getattr(block, word.name)
        bench.assume((age < 2) | (now == bench.past(now)))
    bench.promise(bench.inner["known"] == (age == 1))
    bench.promise(~bench.inner["placed"] | ready)
    return ready & ~bench.inner["placed"]


def force_is_in_range(axis: str, bench: Bench) -> None:
    block = bench.block(wall(axis), Widths(("offset",)))
    bench.within(force=block.design.force.max)


def never_pulls(axis: str, bench: Bench) -> None:
    block = bench.block(wall(axis), Widths(("offset",)))
    waits = samples(bench, block)
    left, forbidden = block.wall_left, block.wall_forbid_pull
    for side, allowed in ((0, bench.inner["positive"]), (1, bench.inner["negative"])):
        bench.promise(~waits | ~forbidden | ~allowed | (left != side))
    left, forbidden = (bench.past(word, block.latency) for word in (left, forbidden))
    bench.promise(~block.valid | ~forbidden | Mux(left, block.force >= 0, block.force <= 0))


PROPERTIES = [
    Property(
        "the force is in range",
        "wall mhz",
        partial(force_is_in_range, "mhz"),
        depth=8,
        bugs=(Bug(Wall.elaborate, "sign & ~total[design.push : top].any()", "0"),),
    ),
    Property(
        "a wall that may not pull never pulls",
        "wall mhz",
        partial(never_pulls, "mhz"),
        depth=10,
        quick=True,
        bugs=(Bug(Wall.elaborate, "inside & ~(self.wall_left & self.wall_forbid_pull)", "inside"),),
    ),
]
