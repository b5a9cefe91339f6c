"""The output stage, an axis a clock: what the drive of an axis becomes with a sample."""

from collections.abc import Callable
from typing import NamedTuple

from amaranth.hdl import C, Cat, Mux, Signal, Value

from hardwall.model.axis.output import Design

from ..arithmetic.fixed import negated, not_above
from .pipe import Pipe


class Driven(NamedTuple):
    """The drive that follows from a sample, 3 stages after its force.

    Attributes:
        drive: the drive, if the axis was enabled since its force came.
        limited: the limits that acted, if it was.
        turn: whether the drive follows the force.
        dropped: for every axis, whether it was not enabled since its last force came: then its drive is zero.
    """

    drive: Value
    limited: Value
    turn: Value
    dropped: list[Signal]


class Forced(NamedTuple):
    """A sample's force as it enters the output stage: its stage, whether the sample is of an actuation, its fault."""

    stage: int
    force: Value
    turn: Value
    fault: Value


def drive(pipe: Pipe, design: Design, forced: Forced, enable: Value, word: Callable[[str, int], Value]) -> Driven:
    """Return the drive of `hardwall.hdl.axis.output`.

    Args:
        enable: a bit for every axis.
        word: returns a run-time word of the axis that is in a stage, by the name of the word and the stage.
    """
    stage, most = forced.stage, design.force_limit
    dropped = [Signal(init=1, name=f"dropped_{number}") for number in range(pipe.axes)]
    for number, (mine, turn) in enumerate(zip(dropped, pipe.turns(stage), strict=True)):
        pipe.m.d.sync += mine.eq(~enable[number] | (mine & ~turn))

    # The stage works with magnitudes. It keeps the force's magnitude as its complement, which a comparison adds. The
    # growth is measured from the drive, or from zero if the force has the other sign.
    negative = forced.force[-1]
    magnitude = Signal(range(most + 1))
    kept = pipe.kept("driven", len(magnitude) + 1)
    # The choice among many axes has a clock of its own: whether the axis will be dropped is known before.
    off = pipe.of([mine | ~enable[number] for number, mine in enumerate(dropped)], stage - 1)
    before = Mux(pipe.taken(off), 0, kept.read(stage))
    held = Mux(negative == before[-1], before[:-1], 0)
    reach = pipe.taken(held + word("output_slew_limit", stage), "reach")
    less = pipe.taken((~negated(forced.force, negative))[: len(forced.force)], "less")

    farther = ~not_above(less, reach)
    slewed = pipe.taken(Mux(farther, reach, ~less)[: len(forced.force)], "slewed")
    limit = word("output_force_limit", stage + 1)
    limit = pipe.taken(Mux(limit > most, most, limit)[: len(magnitude)], "limit")

    over = slewed > limit
    pipe.m.d.comb += magnitude.eq(Mux(over, limit, slewed))
    limited = pipe.taken(magnitude, "limited")
    fault, turn = pipe.later(forced.fault, 3), C(1, 1)
    now = Cat(limited, pipe.later(negative, 3))
    if design.decimation > 1:
        turn = pipe.later(forced.turn, 3)
        now = Mux(turn, now, pipe.later(before, 3))
    now &= (~fault).replicate(len(now))
    kept.leave(stage + 3, now)
    acted = turn & ~fault
    value = negated(Cat(now[:-1], 0).as_signed(), now[-1])
    return Driven(
        value[: design.force.width].as_signed(),
        Cat(pipe.later(farther, 2), pipe.taken(over)) & acted.replicate(2),
        turn,
        dropped,
    )
