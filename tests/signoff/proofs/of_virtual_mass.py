"""What the virtual mass promises: the exact equation's force, bounded masses, and no pull in a wall."""

from dataclasses import replace
from functools import partial

from amaranth.hdl import Mux, Signal, Value

from hardwall.hdl.axis.virtual_mass import VirtualMass
from hardwall.model.axis.virtual_mass import BEHIND
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .of_wall import whole
from .property import Property
from .widths import FreeProducts, Widths

AXES = {"mhz": ("kalman", 0.25), "paper": ("levant-2", 0.06), "narrow": ("levant-3", 10.0), "wide": ("kalman", 1e7)}
"""Estimator and largest mass (kg) of every axis; the last one has a product in units larger than a force LSB."""


def virtual_mass(axis: str) -> VirtualMass:
    estimator, most_kg = AXES[axis]
    return VirtualMass(replace(spec(axis, estimator), virtual_mass_max_kg=most_kg).design.mass)


def samples(bench: Bench, block: VirtualMass) -> Value:
    """Assume that samples come as the block promises to take them; return whether one waits for its force.

    The force comes `BEHIND` clocks or more behind the strobe, and once; the next strobe with it or later.
    """
    age = Signal(range(BEHIND + 1))
    with bench.m.If(block.strobe):
        bench.m.d.sync += age.eq(1)
    with bench.m.Elif(block.forced):
        bench.m.d.sync += age.eq(0)
    with bench.m.Elif((age != 0) & (age != BEHIND)):
        bench.m.d.sync += age.eq(age + 1)
    bench.assume(~block.forced | (age == BEHIND))
    bench.assume(~block.strobe | (age == 0) | block.forced)
    for name in ("wall", "free"):
        bench.promise(bench.inner[f"{name}_multiplied"] == (age == 1))
    return age == BEHIND


def rounded(block: VirtualMass, product: Value) -> Value:
    """Return a product, rounded half up to a force LSB and held within the range of an inertia."""
    shift, most = block.design.shift, block.design.inertia.max
    value = (product + (1 << shift - 1)) >> shift if shift > 0 else product << -shift
    return Mux(value > most, most, Mux(value < -most, -most, value))


def force_is_exact(axis: str, bench: Bench) -> None:
    """Promise the sum of the block's docstring for every product of a mass, in as many bits as it needs."""
    block = bench.block(virtual_mass(axis), Widths(()))
    waits, inner, most = samples(bench, block), bench.inner, block.design.force.max
    wall, free = (rounded(block, whole(bench, f"{name}_product")) for name in ("wall", "free"))
    positive, negative = block.may_be_positive, block.may_be_negative
    acts = positive | negative
    sum_ = block.force - Mux(acts, wall, free)
    limited = Mux(sum_ > most, most, Mux(sum_ < -most, -most, sum_))
    given = Mux(acts & Mux(limited < 0, ~negative, ~positive), 0, limited)
    bench.promise(~bench.past(block.forced & ~bench.reset) | (block.given == bench.past(given)))
    bench.promise(block.valid == bench.past(block.forced & ~bench.reset))
    # For the induction: what a sample that waits for its force has left.
    for name, value in (("wall", wall), ("free", free)):
        bench.promise(~waits | (inner[f"{name}_inertia"] == value))


def sign_is_allowed(axis: str, bench: Bench) -> None:
    """Promise that where a wall acts, the sum has a sign that its force may have, whatever the force is."""
    block = bench.block(virtual_mass(axis), FreeProducts())
    samples(bench, block)
    positive, negative = (bench.past(each) for each in (block.may_be_positive, block.may_be_negative))
    acts = positive | negative
    bench.promise(~block.valid | ~acts | (block.given <= 0) | positive)
    bench.promise(~block.valid | ~acts | (block.given >= 0) | negative)


def mass_is_bounded(axis: str, bench: Bench) -> None:
    """Promise that what is multiplied is a mass within its bound, for every word of a host; and the last one."""
    block = bench.block(virtual_mass(axis), FreeProducts())
    most = block.design.most
    bench.within(wall_mass_within=most, free_mass_within=most)
    for name, word in (("wall", block.wall_mass), ("free", block.free_mass)):
        bounded = Mux(word > most, most, Mux(word < -most, -most, word))
        taken = bench.inner[f"{name}_mass_within"] == bench.past(bounded)
        bench.promise(~bench.past(~bench.reset) | taken)


PROPERTIES = [
    *(
        Property(
            "the force with a virtual mass is the exact equation's, for every product",
            f"virtual_mass {axis}",
            partial(force_is_exact, axis),
            depth=5,
            quick=axis == "mhz",
            bugs=(
                Bug(VirtualMass.elaborate, "Mux(acts, in_wall, in_free_space)", "in_wall"),
                Bug(VirtualMass.elaborate, "~acts | Mux(", "Mux("),
            ),
        )
        for axis in AXES
    ),
    Property(
        "where a wall acts, a mass does not turn its force to a sign that it may not have",
        "virtual_mass mhz",
        partial(sign_is_allowed, "mhz"),
        depth=6,
        quick=True,
        bugs=(Bug(VirtualMass.elaborate, "Mux(total[-1], self.may_be_negative, self.may_be_positive)", "acts"),),
    ),
    Property(
        "a mass is within its bound, whatever the host writes",
        "virtual_mass mhz",
        partial(mass_is_bounded, "mhz"),
        depth=4,
        quick=True,
        bugs=(Bug(VirtualMass._inertia, "saturate(word, -design.most, design.most)", "word"),),
    ),
]
