"""The inputs and the outputs of an estimator's pipeline."""

from collections.abc import Callable
from typing import NamedTuple

from amaranth.hdl import Mux, Value

from hardwall.model.arithmetic.fixed import SQ


class Entered(NamedTuple):
    """A sample as it enters an estimator.

    Attributes:
        stage: the stage in which it does.
        count: its count.
        fresh: whether it counts as the first.
        word: returns a run-time word of the axis that is in a stage, by the name of the word and the stage.
    """

    stage: int
    count: Value
    fresh: Value
    word: Callable[[str, int], Value]


class Estimate(NamedTuple):
    """The velocity, and the flags that the sample raised, both as many stages later as the estimator's latency."""

    velocity: Value
    saturated: Value


def moved_since(pipe, design, entered: Entered) -> Value:
    """Return the counts since the axis's last sample, 0 at a fresh one, one stage later."""
    last = pipe.kept("last_count", entered.count.shape())
    last.leave(entered.stage, entered.count)
    # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
    difference = (entered.count - last.read(entered.stage))[: design.count_width].as_signed()
    return pipe.taken(Mux(entered.fresh, 0, difference)[: design.count_width].as_signed(), "moved")


def held(value: Value, fmt: SQ) -> tuple[Value, Value]:
    """Return a signed value held within +-`fmt.max`, and whether it was beyond: its bits decide, nothing is compared.

    The value is at least as wide as the format.
    """
    top, low = value[fmt.width - 1 :], value[: fmt.width - 1]
    beyond = Mux(value[-1], ~(top.all() & low.any()), top.any())
    return Mux(beyond, Mux(value[-1], -fmt.max, fmt.max), value[: fmt.width].as_signed()), beyond
