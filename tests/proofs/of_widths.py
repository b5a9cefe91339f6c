"""No arithmetic of any block wraps, but where that is meant: `widths` says what is asserted, this module the rest.

Induction needs the ranges of the registers, which the formats are derived from: they are promised and proven with it.
"""

from collections.abc import Callable
from functools import partial

from amaranth.lib import wiring

from hardwall.hdl.arithmetic.divide import Divide
from hardwall.hdl.arithmetic.signed_divide import SignedDivide
from hardwall.hdl.arithmetic.sqrt import Sqrt
from hardwall.hdl.estimators import butterworth, finite_difference, foaw, history, kalman, levant
from hardwall.hdl.estimators import levant_adaptive, levant_implicit, levant_semi_implicit, window
from hardwall.hdl.estimators.registry import block_of
from hardwall.hdl.output import Output
from hardwall.hdl.quadrature import Quadrature
from hardwall.hdl.wall import Wall
from hardwall.model.quadrature import START
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import Widths

AXES = ("mhz",)


def estimator(name: str, axis: str):
    return block_of(spec(axis, name).design.estimator)


def root(bench: Bench, path: str = "") -> None:
    """Promise what a root under way keeps: the remainder is at most twice the root, which has as many bits as made."""
    inner = bench.inner
    so_far, left, bits = inner[f"{path}root"], inner[f"{path}left"], len(inner[f"{path}root"])
    bench.promise(left <= bits)
    bench.promise(inner[f"{path}remainder"] <= 2 * so_far)
    bench.promise((so_far >> (bits - left)[: len(left)]) == 0)


def phase(bench: Bench, stage: Output) -> None:
    bench.within(phase=(0, stage.design.decimation - 1))


def start(bench: Bench, decoder: Quadrature) -> None:
    bench.within(starting=(0, START.starting))


def levants(bench: Bench, block: wiring.Component) -> None:
    velocity, error = block.design.velocity, block.design.error
    root(bench, "root.")
    bench.within(e=error.max, u1=velocity.max, next_u1=velocity.max, lead=error.max + velocity.max)


def adaptive(bench: Bench, block: wiring.Component) -> None:
    """Promise that the counters of the law stop before their next threshold, too."""
    levants(bench, block)
    levels, inner = block.design.levels, bench.inner
    bench.within(reached=(0, levels), _level=(0, levels), calm=(0, block.design.hold_samples(levels - 1) - 1))
    for level in range(levels):
        bench.promise((inner["reached"] != level) | (inner["elapsed"] < block.design.reach_samples(level + 1)))


def past(bench: Bench, design, path: str = "") -> None:
    bench.within(**{f"{path}phase": (0, design.every - 1), f"{path}step": design.change.max})


def nothing(bench: Bench, block: wiring.Component) -> None:
    """Promise nothing more."""


DIGITS = ("digits", "remainder", "quotient")
HISTORY = ("moved", "head", "read__addr", "write__data", "data", "position", "change")
CASES: dict[str, tuple[Callable, tuple[str, ...], Callable, int]] = {
    "quadrature": (lambda axis: Quadrature(20, 16), ("count", "stamp", "seen__stamp"), start, 4),
    "output": (lambda axis: Output(spec(axis).design.output), (), phase, 6),
    "wall": (lambda axis: Wall(spec(axis).design.wall), ("depth",), nothing, 6),
    "sqrt": (lambda axis: Sqrt(31), ("digits",), lambda bench, block: root(bench), 3),
    "divide": (lambda axis: Divide(24, 12, 14, 2), DIGITS, nothing, 6),
    "signed_divide": (lambda axis: SignedDivide(20, 10, 4, 14), DIGITS, nothing, 6),
    "fdm": (partial(estimator, "fdm"), ("moved",), nothing, 6),
    "levant": (partial(estimator, "levant"), ("moved", "digits"), levants, 6),
    "levant-semi-implicit": (partial(estimator, "levant-semi-implicit"), ("moved", "digits"), levants, 6),
    "levant-implicit": (partial(estimator, "levant-implicit"), ("moved", "digits"), levants, 6),
    "levant-adaptive": (partial(estimator, "levant-adaptive"), ("moved", "digits"), adaptive, 6),
    "butterworth": (partial(estimator, "butterworth"), ("moved",), nothing, 6),
    "kalman": (partial(estimator, "kalman"), ("moved",), nothing, 6),
    "window": (partial(estimator, "window"), (*HISTORY, *DIGITS), lambda b, c: past(b, c.design.history, "history."), 6),
    "foaw": (partial(estimator, "foaw"), (*HISTORY, *DIGITS, "age"), lambda b, c: past(b, c.design.history, "history."), 6),
    "period": (partial(estimator, "period"), (*DIGITS, "moved", "age", "change", "gap", "cycles", "kind", "behind"), nothing, 6),
    "period-count": (partial(estimator, "period-count"), (*DIGITS, "moved", "age", "change", "gap", "cycles", "kind", "behind"), nothing, 6),
}


def describe(make, wraps, more, bench: Bench) -> None:
    block = bench.block(make(), Widths(wraps))
    more(bench, block)


PROPERTIES = [
    Property("no arithmetic wraps", f"{name} {axis}", partial(describe, partial(make, axis), wraps, more), depth, bugs=())
    for name, (make, wraps, more, depth) in CASES.items()
    for axis in AXES
]
