"""What the passivity controller promises: it takes a force to zero at most, and only in debt; and a debt stays."""

from functools import partial

from amaranth.hdl import Mux, Signal

from hardwall.hdl.axis.passivity import Passivity, held
from hardwall.model.axis.passivity import BEHIND, Design
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


def the_energy_is_the_balance(axis: str, bench: Bench) -> None:
    """Promise the equations of what the energy becomes, in as many bits as they need, for every product of a drive."""
    block = bench.block(passivity(axis), FreeProducts())
    keeps(bench, block)
    inner, design = bench.inner, block.design
    energy, most = inner["energy"], design.energy.max
    before, summed = bench.past(energy), bench.past(inner["summed"] & ~bench.reset)
    balance = before - bench.past(inner["work"])
    bounded = Mux(balance > most, most, Mux(balance < -most, -most, balance))
    bench.promise(~summed | (energy == Mux(bench.past(inner["begins"]), 0, bounded)))
    # Of a credit all but 2**-memory is left, rounded down; without a force nothing.
    forgot, force = bench.past(inner["forgets"] & ~bench.reset), bench.past(block.force.any(), 2)
    share = (before << design.memory) - before
    left = (energy << design.memory <= share) & (share < (energy + 1) << design.memory)
    bench.promise(~forgot | Mux(before < 0, energy == before, Mux(force, left, energy == 0)))
    bench.promise(~bench.past(~bench.reset) | summed | forgot | (energy == before))


def a_way_is_between_two_places(axis: str, bench: Bench) -> None:
    """Promise that a sample's half counts are those from the last place of the handle to the next, as edges show it."""
    block = bench.block(passivity(axis), FreeProducts())
    samples(bench, block)
    inner = bench.inner
    count, restarted, known = inner["last"], inner["restarted"], inner["known"]
    place, before, now = Signal(len(count) + 1, init=1), Signal.like(count), Signal(len(count) + 1)
    goes, fastest = (block.count - count)[: len(count)].as_signed(), block.design.displacement.max // 2 - 1
    bench.assume(~block.lead | block.restart | (goes <= fastest) & (goes >= -fastest))
    up, down = ((before + way)[: len(count)] == count[:] for way in (1, -1))
    within = Mux(up & ~restarted, 0, Mux(down & ~restarted, 2, 1))
    bench.m.d.comb += now.eq(Mux((count == before) & ~restarted, place, 2 * count + within))
    with bench.m.If(known):
        bench.m.d.sync += [place.eq(now), before.eq(count)]
    way = bench.past((now - place)[: len(now)].as_signed())
    bench.promise(~bench.past(known & ~restarted & ~bench.reset) | (inner["half_counts"] == way))
    # For the induction: where the handle is in its count, and what has gone by since the last sample.
    bench.promise(place == (2 * before + inner["within"])[: len(place)])
    bench.promise(~known | (inner["moved"] == (count - before)[: len(count)].as_signed()) | restarted)
    bench.promise(known | (count == before))


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
    Property(
        "the energy is the exact balance of work and credit",
        "passivity mhz",
        partial(the_energy_is_the_balance, "mhz"),
        depth=8,
        bugs=(
            Bug(Passivity._observe, "total.eq(energy - work)", "total.eq(energy + work)"),
            Bug(Passivity._observe, " + energy[: design.memory].any()", ""),
            Bug(Passivity._observe, "Mux(begins, 0, held", "Mux(0, 0, held"),
        ),
    ),
    Property(
        "the way in a sample is that between two places, as edges show them",
        "passivity mhz",
        partial(a_way_is_between_two_places, "mhz"),
        depth=8,
        bugs=(
            Bug(Passivity._observe, "2 * moved + now - within", "2 * moved + now - MIDDLE"),
            Bug(Passivity._observe, "Mux(moved == -1, UPPER, MIDDLE)", "MIDDLE"),
        ),
    ),
]
