"""No arithmetic of any block wraps, but where that is meant: `widths` says what is asserted, this module the rest.

Induction needs the ranges of the registers, which the formats are derived from: they are promised and proven with it.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from amaranth.hdl import Cat
from amaranth.lib import wiring

from hardwall.hdl.arithmetic.divide import Divide
from hardwall.hdl.arithmetic.signed_divide import SignedDivide
from hardwall.hdl.arithmetic.sqrt import Sqrt
from hardwall.hdl.estimators import (
    butterworth,
    finite_difference,
    foaw,
    kalman,
    least_squares,
    levant,
    levant_semi_implicit,
    mt,
    mt_divisionless,
    tracking_loop,
)
from hardwall.hdl.estimators.cycle_times import CycleTimes
from hardwall.hdl.estimators.estimate import EstimatorBlock
from hardwall.hdl.estimators.history import History
from hardwall.hdl.estimators.registry import block_of
from hardwall.hdl.output import Output
from hardwall.hdl.quadrature import Quadrature
from hardwall.hdl.scale_map import ScaleMap
from hardwall.hdl.wall import Wall
from hardwall.model.arithmetic.divisionless import digits
from hardwall.model.estimators.foaw import TAPS
from hardwall.model.estimators.levant_adaptive import RAISED
from hardwall.model.quadrature import START
from hardwall.model.scale_map import Design as Bins
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .of_arithmetic import root_keeps
from .property import Property
from .widths import Widths

AXES = ("paper", "mhz", "narrow", "wide")
"""The axes of the tests: the paper's rates, a megahertz, and formats at both extremes."""
ALONE = ("",)
QUICK = ("wall",)


def estimator(name: str, axis: str) -> EstimatorBlock:
    return block_of(spec(axis, name).design.estimator)


def phase(bench: Bench, stage: Output) -> None:
    bench.within(phase=(0, stage.design.decimation - 1))


def start(bench: Bench, decoder: Quadrature) -> None:
    bench.within(starting=(0, START.starting))


def levants(bench: Bench, block: wiring.Component) -> None:
    velocity, error = block.design.velocity, block.design.error
    root_keeps(bench, "root.")
    bench.within(u1=velocity.max, next_u1=velocity.max, lead=error.max + velocity.max)


def levant_alone(bench: Bench, block: wiring.Component) -> None:
    """Promise that u1 with the steps of the digits so far leaves room for those of the digits that are left.

    A sum goes up by a digit's place, takes in two bits, and adds three steps at most.
    """
    inner, design, root_path = bench.inner, block.design, "square_root."
    root_keeps(bench, root_path)
    total, left, digits = inner["total"], inner[f"{root_path}left"], len(inner["low"]) // 2
    rooting = bench.state("ROOT")
    bench.promise(rooting == (left != 0))
    bench.promise(bench.state("PREPARE") | (inner["e"] >= -design.error.max) & (inner["e"] <= design.error.max))
    lambda_ = (1 << len(inner["step"]) - 1) - 1
    bench.within(step=lambda_, triple=3 * lambda_, relay=design.alpha.max)
    finer = len(inner["step"]) - 1 - design.lambda_.width + design.product - design.velocity.f
    room = (((-design.velocity.min << finer) + lambda_ + 1) >> 2 * digits + 1) + 1
    for taken in range(digits + 1):
        bench.promise((left != digits - taken) | (total >= -room) & (total <= room))
        room = 4 * room + 3 + 3 * lambda_
    shifted = Cat(inner["low"][-2:], total).as_signed()
    for number, more in enumerate((0, inner["step"], inner["step"] << 1, inner["triple"])):
        bench.promise(~rooting | (inner[f"sum_{number}"] == shifted + more))


def adaptive(bench: Bench, block: wiring.Component) -> None:
    """Promise that the counters of the law stop before their next threshold, too."""
    levants(bench, block)
    levels, inner = block.design.levels, bench.inner
    bench.within(reached=(0, levels), _level=(0, RAISED + levels), calm=(0, block.design.hold_samples(levels - 1) - 1))
    for level in range(levels):
        bench.promise((inner["reached"] != level) | (inner["elapsed"] < block.design.reach_samples(level + 1)))


def past(bench: Bench, block: wiring.Component) -> None:
    design = block.design.history
    bench.within(**{"history.phase": (0, design.every - 1), "history.step": design.change.max})


def edges(bench: Bench, block: wiring.Component) -> None:
    design = block.design
    bench.within(**{"edges.phase": (0, design.half - 1), "edges.moved": (0, design.edges_max)})


def scaled_edges(bench: Bench, block: wiring.Component) -> None:
    edges(bench, block)
    bench.within(scaled=(0, block.design.edges_max * block.design.clocks))


def digits_left(bench: Bench, block: wiring.Component) -> None:
    edges(bench, block)
    bench.promise(bench.inner["speed.left"] <= digits(block.design.velocity.width)[0])


def fit(bench: Bench, block: wiring.Component) -> None:
    past(bench, block)
    bench.within(clock=(0, least_squares.FIRST + block.design.taps))


def nothing(bench: Bench, block: wiring.Component) -> None:
    """Promise nothing more."""


def search(bench: Bench, block: wiring.Component) -> None:
    past(bench, block)
    bench.within(clock=(0, foaw.FIRST + TAPS + 3))


class Case(NamedTuple):
    """A block, and what its proof needs.

    Attributes:
        make: makes the block for an axis.
        wraps: names of the signals that are meant to wrap.
        bug: a change by which a value wraps.
        keeps: promises the ranges of registers.
        axes: names of the axes for which it is proven; no name for a block that no axis changes.
        promise: what is proven.
    """

    make: Callable[[str], wiring.Component]
    wraps: tuple[str, ...]
    bug: Bug
    keeps: Callable[[Bench, wiring.Component], None] = nothing
    axes: tuple[str, ...] = AXES
    promise: str = "no arithmetic wraps but where it is meant to"


# The difference of two counts or stamps, and a memory's address, are modulo their width. The registers of a division
# shift bits out, and their exact result is proven; a counter that its next assignment clears may pass its end.
MOVED = ("moved",)
DIGITS = ("digits", "remainder", "quotient")
HISTORY = (*MOVED, "head", "read__addr", "write__data", "data", "position", "change")
CYCLES = (*DIGITS, *MOVED, "age", "change", "gap", "cycles", "kind", "behind", "samples")
EDGES = ("number", "age", "between", "passed")
# What the parts of a quotient by multiplications may be follows from its products, one from another.
PRODUCTS = ("dividend", "t", "x", "remainder", "made", "left")
# What the sum of a fit may be follows from its coefficients, one by one.
FIT = ("age", "total")
# In the search for the longest window, what the slopes and the sums may be follows from the history alone.
SEARCH = ("age", "weight", "slope", "before", "below", "above", "total", "sums", "dividend")

PRODUCT = Bug(
    levant_semi_implicit.Estimator.elaborate, "len(self._word(0)) + len(factor)", "len(self._word(0)) + len(factor) - 1"
)
FAST = Bug(History.elaborate, "held = saturate(moved, -design.change.max, design.change.max)", "held = moved")
FORWARD = Bug(CycleTimes.elaborate, "forward = Signal(signed(len(count) + 1))", "forward = Signal(signed(len(count)))")
CASES = {
    "quadrature": Case(
        lambda axis: Quadrature(20, 16),
        ("count", "seen__stamp"),
        Bug(Quadrature.elaborate, "held >= self.glitch_clocks", "held > self.glitch_clocks"),
        start,
        ALONE,
    ),
    "sqrt": Case(
        lambda axis: Sqrt(31),
        ("digits",),
        Bug(Sqrt.elaborate, "Signal(2 * clocks + 1)", "Signal(2 * clocks)"),
        lambda bench, _: root_keeps(bench),
        ALONE,
    ),
    "divide": Case(
        lambda axis: Divide(24, 12, 14, 2),
        DIGITS,
        Bug(Divide.elaborate, "left.eq(left - 1)", "left.eq(left - 2)"),
        axes=ALONE,
    ),
    "signed_divide": Case(
        lambda axis: SignedDivide(20, 10, 4, 14),
        DIGITS,
        Bug(SignedDivide.elaborate, "[:width]", "[: width - 1]"),
        axes=ALONE,
    ),
    "wall": Case(
        lambda axis: Wall(spec(axis).design.wall),
        ("offset",),
        Bug(Wall.elaborate, "signed(design.total_bits)", "signed(design.total_bits - 3)"),
    ),
    "output": Case(
        lambda axis: Output(spec(axis).design.output),
        (),
        Bug(Output.elaborate, "design.slew.max + design.force.max + 1", "design.slew.max + 1"),
        phase,
    ),
    "fdm": Case(
        partial(estimator, "fdm"),
        MOVED,
        Bug(finite_difference.Estimator.elaborate, "saturate(moved, fmt.min, fmt.max)", "moved"),
    ),
    # What the sums are while there is no root is not used; else it is promised.
    "levant": Case(
        partial(estimator, "levant"),
        (*MOVED, "digits", "low", *(f"sum_{number}" for number in range(4))),
        Bug(levant.Estimator._corrected, "design.lambda_.width + coarser + 1", "design.lambda_.width + coarser"),
        levant_alone,
    ),
    "levant-semi-implicit": Case(partial(estimator, "levant-semi-implicit"), (*MOVED, "digits"), PRODUCT, levants),
    "levant-implicit": Case(partial(estimator, "levant-implicit"), (*MOVED, "digits"), PRODUCT, levants),
    "levant-adaptive": Case(partial(estimator, "levant-adaptive"), (*MOVED, "digits"), PRODUCT, adaptive),
    "butterworth": Case(
        partial(estimator, "butterworth"),
        MOVED,
        Bug(butterworth.Estimator.elaborate, "held = saturate(total, -state_max, state_max)", "held = total"),
    ),
    "kalman": Case(
        partial(estimator, "kalman"),
        MOVED,
        Bug(kalman.Estimator.elaborate, "signed(len(operand) + len(gain))", "signed(len(operand) + len(gain) - 1)"),
        axes=("mhz", "narrow"),
    ),
    "tracking-loop": Case(
        partial(estimator, "tracking-loop"),
        MOVED,
        Bug(tracking_loop.Estimator.elaborate, "_bandwidth)))", "_bandwidth) - 1))"),
    ),
    "window": Case(partial(estimator, "window"), (*HISTORY, *DIGITS), FAST, past),
    "foaw": Case(
        partial(estimator, "foaw"),
        (*HISTORY, *DIGITS, *SEARCH),
        FAST,
        search,
        promise="no counter wraps; slopes and sums are not looked at",
    ),
    "least-squares": Case(
        partial(estimator, "least-squares"),
        (*HISTORY, *DIGITS, *FIT),
        FAST,
        fit,
        promise="no arithmetic wraps but where it is meant to; the sum of the fit is not looked at",
    ),
    "period": Case(partial(estimator, "period"), CYCLES, FORWARD),
    "period-count": Case(partial(estimator, "period-count"), CYCLES, FORWARD),
    "mt": Case(
        partial(estimator, "mt"),
        (*DIGITS, *EDGES),
        Bug(mt.Estimator.elaborate, "Divide(bound.bit_length(), ", "Divide(bound.bit_length() - 1, "),
        scaled_edges,
    ),
    "mt-divisionless": Case(
        partial(estimator, "mt-divisionless"),
        (*EDGES, *PRODUCTS),
        Bug(mt_divisionless.Estimator.elaborate, "stamp + 1, velocity.f", "stamp, velocity.f"),
        digits_left,
        promise="no arithmetic wraps but where it is meant to; what a product is put into is not looked at",
    ),
    "scale_map": Case(
        lambda axis: ScaleMap(Bins(12, -300, 3, 64, 16.0)),
        (),
        Bug(ScaleMap.elaborate, "wanted > d.bins - 1", "wanted > d.bins"),
        axes=ALONE,
    ),
}


def describe(case: Case, axis: str, bench: Bench) -> None:
    block = bench.block(case.make(axis), Widths(case.wraps))
    case.keeps(bench, block)


PROPERTIES = [
    Property(
        case.promise,
        f"{name} {axis}".strip(),
        partial(describe, case, axis),
        depth=6,
        bugs=(case.bug,),
        quick=axis == "mhz" and name in QUICK,
    )
    for name, case in CASES.items()
    for axis in case.axes
]
