"""What the passivity controller promises: it takes a force to zero at most, and only in debt; and a debt stays."""

from functools import partial

from amaranth.hdl import Mux, Signal

from hardwall.hdl.passivity import Passivity, held
from hardwall.model.passivity import BEHIND, Design
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import FreeProducts


def passivity(axis: str) -> Passivity:
    return Passivity(Design(spec(axis), spec(axis).design.estimator.velocity))


def samples(bench: Bench, block: Passivity) -> None:
    """Assume that samples come as the controller promises to take them, and a force that is constant while it is used.

    The force comes `BEHIND` clocks or more behind the strobe, and once; the next strobe with it or later. A clock
    counts one edge at most.
    """
    age, inner = Signal(range(BEHIND + 1)), bench.inner
    with bench.m.If(block.strobe):
        bench.m.d.sync += age.eq(1)
    with bench.m.Elif(block.forced):
        bench.m.d.sync += age.eq(0)
    with bench.m.Elif((age != 0) & (age != BEHIND)):
        bench.m.d.sync += age.eq(age + 1)
    bench.assume(~block.forced | (age == BEHIND))
    bench.assume(~block.strobe | (age == 0) | block.forced)
    used = Signal(block.latency - 1)
    bench.m.d.sync += used.eq(used << 1 | block.forced)
    bench.assume(~used.any() | (block.force == bench.past(block.force)))
    bench.assume(~used.any() | ~block.forced)
    fastest = block.design.displacement.max // 2 - 1
    bench.assume(inner["restarted"] | (inner["moved"] <= fastest) & (inner["moved"] >= -fastest))


def keeps(bench: Bench, block: Passivity) -> None:
    """Assume how samples come; promise what the energy holds, and that no more of a credit is lost than it has."""
    samples(bench, block)
    inner, design = bench.inner, block.design
    bench.within(energy=design.energy.max, damper=design.force.max)
    credit = Mux(inner["energy"] > 0, inner["energy"], 0)
    bench.promise(~inner["forgets"] | (inner["loss"] >= 0) & (inner["loss"] <= credit))
    bench.promise(~inner["summed"] | ~inner["forgets"])


def never_turns_a_force(axis: str, bench: Bench) -> None:
    block = bench.block(passivity(axis), FreeProducts())
    samples(bench, block)
    force, top = bench.past(block.force), block.design.force.max
    bench.assume(block.force >= -top)
    held = Mux(force < 0, (block.given <= 0) & (block.given >= -top), (block.given >= 0) & (block.given <= top))
    bench.promise(~block.valid | held & ((force != 0) | (block.given == 0)))


def acts_in_debt_alone(axis: str, bench: Bench) -> None:
    block = bench.block(passivity(axis), FreeProducts())
    samples(bench, block)
    bench.assume(block.force >= -block.design.force.max)
    owed = bench.past(bench.inner["energy"] < 0, block.latency)
    force = bench.past(block.force)
    bench.promise(~block.valid | owed | ~block.active & (block.given == force))
    bench.promise(~block.valid | block.active | (block.given == force))


def a_debt_stays(axis: str, bench: Bench) -> None:
    block = bench.block(passivity(axis), FreeProducts())
    keeps(bench, block)
    energy = bench.inner["energy"]
    owed = bench.past((energy < 0) & ~bench.inner["summed"] & ~bench.reset)
    bench.promise(~owed | (energy == bench.past(energy)))


PROPERTIES = [
    Property(
        "what is given is of the force's sign, or zero, and in range",
        "passivity mhz",
        partial(never_turns_a_force, "mhz"),
        depth=8,
        quick=True,
        bugs=(
            Bug(Passivity.elaborate, "Mux(total[-1] == self.force[-1], within, 0)", "within"),
            Bug(held, " & ~least", ""),
        ),
    ),
    Property(
        "without a debt, or where it does not act, the force is given on as it is",
        "passivity mhz",
        partial(acts_in_debt_alone, "mhz"),
        depth=8,
        bugs=(
            Bug(Passivity._damp, "Mux(energy[-1] & self.force.any(), abs(damper), 0)", "abs(damper)"),
            Bug(Passivity.elaborate, "self.active.eq(part.any())", "self.active.eq(0)"),
        ),
    ),
    Property(
        "a debt stays until the drive has worked",
        "passivity mhz",
        partial(a_debt_stays, "mhz"),
        depth=8,
        bugs=(Bug(Passivity._observe, "Mux(energy[-1], 0, ", "Mux(0, 0, "),),
    ),
]
