"""What the wall promises: its force is the exact equation's, in range, and pushes, wherever wall and handle are."""

import re
from dataclasses import replace
from functools import partial

from amaranth.hdl import Mux, Signal, Value

from hardwall.hdl.axis.wall import PART_BITS, Wall
from hardwall.hdl.wires import port
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import FreeProducts, Widths


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
    block = bench.block(wall(axis), Widths(()))
    bench.within(force=block.design.force.max)


def never_pulls(axis: str, bench: Bench) -> None:
    block = bench.block(wall(axis), Widths(()))
    waits = samples(bench, block)
    left, forbidden = block.wall_left, block.wall_forbid_pull
    for side, allowed in ((0, bench.inner["positive"]), (1, bench.inner["negative"])):
        bench.promise(~waits | ~forbidden | ~allowed | (left != side))
    left, forbidden = (bench.past(word, block.latency) for word in (left, forbidden))
    bench.promise(~block.valid | ~forbidden | Mux(left, block.force >= 0, block.force <= 0))


def signs_are_where_it_acts(axis: str, bench: Bench) -> None:
    """Promise what a virtual mass is told with a force: the signs that it may have at its sample's count."""
    estimator = "kalman"
    design = replace(spec(axis, estimator), virtual_mass_max_kg=0.1, coupling=True).design.wall
    block = bench.block(Wall(design), FreeProducts())
    waits, inner = samples(bench, block), bench.inner
    counted, left, forbidden = Signal.like(block.count), block.wall_left, block.wall_forbid_pull
    with bench.m.If(block.lead):
        bench.m.d.sync += counted.eq(block.count)
    outward = block.wall_position - counted
    exists = (block.wall_stiffness != 0) | (block.wall_damping != 0)
    inside = Mux(left, outward > 0, outward < 0) | block.wall_two_sided
    told = {"positive": inside & (left | ~forbidden), "negative": inside & ~(left & forbidden)}
    for sign, allowed in told.items():
        bench.promise(~block.valid | (port(block, f"may_be_{sign}") == bench.past(allowed & exists, 3)))
        bench.promise(~waits | (inner[sign] == allowed))
    # For the induction.
    bench.promise(inner["counted"] == counted)
    bench.promise(~(waits | inner["placed"]) | (inner["offset"] == outward))
    bench.promise(~waits | (inner["exists"] == exists))


def whole(bench: Bench, name: str) -> Value:
    """Return the product of a name, which the block keeps in parts."""
    parts = [bench.inner[key] for key in bench.inner if re.fullmatch(rf"{name}_\d", key)]
    return sum(part << place * PART_BITS for place, part in enumerate(parts))


def force_is_exact(axis: str, coupling: bool, bench: Bench) -> None:
    """Promise the force of the equation in the block's docstring, in integers of as many bits as they need.

    The depth is exact for every position word and count. What is made of the two products is, for every product.
    """
    block = bench.block(Wall(replace(spec(axis), coupling=coupling).design.wall), Widths(()))
    waits, inner, design = samples(bench, block), bench.inner, block.design
    counted, left, forbidden = Signal.like(block.count), block.wall_left, block.wall_forbid_pull
    with bench.m.If(block.lead):
        bench.m.d.sync += counted.eq(block.count)
    outward = block.wall_position - counted
    inside = Mux(left, outward > 0, outward < 0)
    if coupling:
        inside |= block.wall_two_sided

    # A clock after the strobe the products are there: of the stiffness with the way to a wall that fills smaller
    # positions, and of the damping with the velocity, less what the surface's adds.
    acts, side, pushes = (bench.past(each) for each in (inside, left, forbidden))
    spring_shift, damper_shift = design.push - design.stiffness.f, design.push - design.damping.f - design.coarse.f
    surface_shift = design.push - design.damping.f - design.surface.f
    surface = whole(bench, "surface") << surface_shift if coupling else 0
    outwards = (whole(bench, "spring") << spring_shift) - (whole(bench, "damper") << damper_shift) + surface
    most = design.force.max
    push = (Mux(side, outwards, -outwards) + (1 << design.push - 1)) >> design.push
    least = Mux(pushes, 0, -most)
    limited = Mux(push < least, least, Mux(push > most, most, push))
    force = Mux(acts, Mux(side, limited, -limited), 0)
    bench.promise(~block.valid | (block.force == bench.past(force, 2)))

    # For the induction: what a sample that waits for its strobe has left in the registers.
    bench.promise(inner["counted"] == counted)
    bench.promise(~(waits | inner["placed"]) | (inner["offset"] == outward))
    bench.promise(~waits | (inner["left"] == left))
    bench.promise(~waits | (inner["positive"] == inside & (left | ~forbidden)))
    bench.promise(~waits | (inner["negative"] == inside & ~(left & forbidden)))
    if coupling:
        carried = surface + (1 << design.push - 1) - 1 + left
        bench.promise(~waits | (inner["lean"] == carried))


PROPERTIES = [
    *(
        Property(
            "the force is the exact equation's, for every position word and count",
            f"wall {name}{axis}",
            partial(force_is_exact, axis, coupling),
            depth=5,
            quick=axis == "mhz" and not coupling,
            bugs=(
                Bug(
                    Wall.elaborate,
                    "offset.eq(self.wall_position - counted)",
                    "offset.eq((self.wall_position - counted)[: len(counted)].as_signed())",
                ),
                Bug(Wall.elaborate, "(offset != 0) & (offset[-1]", "(offset[-1]"),
            ),
        )
        for name, coupling in (("", False), ("coupling ", True))
        for axis in ("paper", "mhz", "narrow", "wide")
    ),
    Property(
        "a virtual mass is told the signs that the force may have",
        "wall mhz",
        partial(signs_are_where_it_acts, "mhz"),
        depth=6,
        quick=True,
        bugs=(Bug(Wall._say_where_it_acts, "allowed & exists", "allowed"),),
    ),
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
