"""No arithmetic of any block wraps, but where that is meant: `widths` says what is asserted, this module the rest.

Induction needs the ranges of the registers, which the formats are derived from: they are promised and proven with it.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from amaranth.lib import wiring

from hardwall.hdl.arithmetic.divide import Divide
from hardwall.hdl.arithmetic.signed_divide import SignedDivide
from hardwall.hdl.arithmetic.sqrt import Sqrt
from hardwall.hdl.axis.output import Output
from hardwall.hdl.axis.passivity import Passivity
from hardwall.hdl.axis.virtual_mass import VirtualMass
from hardwall.hdl.axis.wall import Wall
from hardwall.hdl.encoder.quadrature import Quadrature
from hardwall.hdl.encoder.scale_map import ScaleMap
from hardwall.hdl.estimators import (
    butterworth,
    edge_kalman,
    finite_difference,
    kalman,
    levant,
    levant_adaptive,
    levant_edge,
    levant_higher,
    levant_semi_implicit,
    mt,
    mt_divisionless,
    tracking_loop,
)
from hardwall.hdl.estimators.bursts import Bursts
from hardwall.hdl.estimators.cycle_times import CycleTimes
from hardwall.hdl.estimators.estimate import EstimatorBlock
from hardwall.hdl.estimators.history import History
from hardwall.hdl.estimators.registry import block_of
from hardwall.model.encoder.scale_map import Design as Bins
from hardwall.model.estimators.bursts import limits
from stimuli.specs import spec

from . import of_passivity, of_virtual_mass, ranges
from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import Widths

AXES = ("paper", "mhz", "narrow", "wide")
"""The axes of the tests: the paper's rates, a megahertz, and formats at both extremes."""
ALONE = ("",)
QUICK = ("wall",)


def estimator(name: str, axis: str) -> EstimatorBlock:
    return block_of(spec(axis, name).design.estimator)


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
    keeps: Callable[[Bench, wiring.Component], None] = ranges.nothing
    axes: tuple[str, ...] = AXES
    promise: str = "no arithmetic wraps but where it is meant to"


# The difference of two counts or stamps, and a memory's address, are modulo their width. The registers of a division
# shift bits out, and their exact result is proven; a counter that its next assignment clears may pass its end.
MOVED = ("moved",)
BURSTS = ("age", "span", "low", "went", "above")
DIGITS = ("digits", "remainder", "quotient")
ROOTED = (*MOVED, "digits")
HISTORY = (*MOVED, "head", "read__addr", "write__data", "data", "position", "change")
CYCLES = (*DIGITS, *MOVED, *BURSTS, "change", "gap", "cycles", "kind", "behind", "samples")
EDGES = (*BURSTS, "number", "between", "passed")
STAMPED = (*DIGITS, *BURSTS, "to", "passed", "waited", "interval", "measure")
# An error of zero has terms of zero, whatever its octave and their shifts; the octave of any other error is promised.
OF_ZERO = ("octave", "down_0", "down_1", "down_2", "down_3")
# What a state that uses a time or a length finds is promised; else they may be cut too short.
TIMES = ("time", "kept", "more", "few", "halves")
# These are what a weight between 0 and 1 makes of an error, which a free product does not know.
WEIGHTED = ("mean", "place", "nearer")
# What a table's words make of a memory: words are free here, and `test_edge_kalman_design` has all of the tables'.
TABLED = ("grown", "gains_row", "length", "rate")
# A slope over a sample: a free product is larger than any, and `test_acceleration` holds the steepest to its format.
SLOPE = ("acceleration",)
# What the parts of a quotient by multiplications may be follows from its products, one from another.
PRODUCTS = ("dividend", "t", "x", "remainder", "made")
# What the sum of a fit may be follows from its coefficients, one by one.
FIT = ("age", "total")
# In the search for the longest window, what the slopes and the sums may be follows from the history alone.
SEARCH = ("age", "weight", "slope", "before", "below", "above", "total", "sums", "dividend")

OF_A_FILTER = (
    "no arithmetic wraps but where it is meant to; "
    "weighted sums, what tables make of a memory and the acceleration are not looked at"
)
PRODUCT = Bug(
    levant_semi_implicit.Estimator.elaborate, "len(self._word(0)) + len(factor)", "len(self._word(0)) + len(factor) - 1"
)
FAST = Bug(History.elaborate, "held = saturate(moved, -design.change.max, design.change.max)", "held = moved")
FORWARD = Bug(CycleTimes.elaborate, "forward = Signal(signed(len(count) + 1))", "forward = Signal(signed(len(count)))")
CASES = {
    "quadrature": Case(
        lambda axis: Quadrature(20, 16),
        ("base", "count", "index_count", "seen__stamp"),
        Bug(Quadrature.elaborate, "held >= self.glitch_clocks", "held > self.glitch_clocks"),
        ranges.start,
        ALONE,
    ),
    "sqrt": Case(
        lambda axis: Sqrt(31),
        ("digits",),
        Bug(Sqrt.elaborate, "Signal(2 * clocks + 1)", "Signal(2 * clocks)"),
        lambda bench, _: ranges.root_keeps(bench),
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
        (),
        Bug(
            Wall.elaborate, "total = Signal(signed(design.total_bits))", "total = Signal(signed(design.total_bits - 3))"
        ),
    ),
    "wall coupling": Case(
        lambda axis: Wall(replace(spec(axis), coupling=True).design.wall),
        (),
        Bug(Wall.elaborate, "lean = Signal(signed(design.lean_bits))", "lean = Signal(signed(design.push + 2))"),
    ),
    # A count that goes by more than one a clock, which a restart alone does, is not used.
    "passivity": Case(
        of_passivity.passivity,
        MOVED,
        Bug(Passivity._observe, "init=MIDDLE), Signal(shape(design.displacement))", "init=MIDDLE), Signal(len(moved))"),
        of_passivity.keeps,
    ),
    "virtual_mass": Case(
        of_virtual_mass.virtual_mass,
        (),
        Bug(VirtualMass.elaborate, "signed(design.inertia.width + 1)", "signed(design.inertia.width - 1)"),
    ),
    "output": Case(
        lambda axis: Output(spec(axis).design.output),
        (),
        Bug(Output.elaborate, "design.slew.max + design.force.max + 1", "design.slew.max + 1"),
        ranges.phase,
    ),
    "fdm": Case(
        partial(estimator, "fdm"),
        MOVED,
        Bug(finite_difference.Estimator.elaborate, "saturate(moved, fmt.min, fmt.max)", "moved"),
    ),
    # What the sums are while there is no root is not used; else it is promised.
    "levant": Case(
        partial(estimator, "levant"),
        (*ROOTED, "low", *(f"sum_{number}" for number in range(4))),
        Bug(levant.Estimator._corrected, "design.lambda_.width + coarser + 1", "design.lambda_.width + coarser"),
        ranges.levant_alone,
    ),
    "levant-semi-implicit": Case(partial(estimator, "levant-semi-implicit"), ROOTED, PRODUCT, ranges.levants),
    "levant-implicit": Case(partial(estimator, "levant-implicit"), ROOTED, PRODUCT, ranges.levants),
    "levant-adaptive": Case(
        partial(estimator, "levant-adaptive"),
        (*MOVED, *OF_ZERO),
        Bug(levant_adaptive.Estimator._octaves, "Mux(level < FALL, 0, level - FALL)", "level - FALL"),
        ranges.adaptive,
    ),
    **{
        name: Case(
            partial(estimator, name),
            (*MOVED, *OF_ZERO),
            Bug(levant_higher.Estimator.elaborate, "fitted(led, design.gap.width)", "led[: design.gap.width]"),
            ranges.levant_higher,
        )
        for name in (f"levant-{order}{kind}" for kind in ("", "-filtering", "-implicit") for order in (2, 3))
    },
    "butterworth": Case(
        partial(estimator, "butterworth"),
        MOVED,
        Bug(butterworth.Estimator.elaborate, "held = saturate(total, -state_max, state_max)", "held = total"),
    ),
    "kalman": Case(
        partial(estimator, "kalman"),
        MOVED,
        Bug(kalman.Estimator.elaborate, "signed(len(operand) + len(gain))", "signed(len(operand) + len(gain) - 1)"),
        ranges.kalman,
        axes=("mhz", "narrow"),
    ),
    "tracking-loop": Case(
        partial(estimator, "tracking-loop"),
        MOVED,
        Bug(tracking_loop.Estimator.elaborate, "_bandwidth)))", "_bandwidth) - 1))"),
    ),
    "window": Case(partial(estimator, "window"), (*HISTORY, *DIGITS), FAST, ranges.past),
    "foaw": Case(
        partial(estimator, "foaw"),
        (*HISTORY, *DIGITS, *SEARCH),
        FAST,
        ranges.search,
        promise="no counter wraps; slopes and sums are not looked at",
    ),
    "least-squares": Case(
        partial(estimator, "least-squares"),
        (*HISTORY, *DIGITS, *FIT),
        FAST,
        ranges.fit,
        promise="no arithmetic wraps but where it is meant to; the sum of the fit is not looked at",
    ),
    "bursts": Case(
        lambda axis: Bursts(limits(spec(axis, "mt"))),
        BURSTS,
        Bug(Bursts.elaborate, "Mux(age > longest, longest, age)", "age"),
    ),
    "period": Case(partial(estimator, "period"), CYCLES, FORWARD),
    "period-count": Case(partial(estimator, "period-count"), CYCLES, FORWARD),
    "mt": Case(
        partial(estimator, "mt"),
        (*DIGITS, *EDGES),
        Bug(mt.Estimator.elaborate, "Divide(bound.bit_length(), ", "Divide(bound.bit_length() - 1, "),
        ranges.edges,
    ),
    "mt-divisionless": Case(
        partial(estimator, "mt-divisionless"),
        (*EDGES, *PRODUCTS),
        Bug(mt_divisionless.Estimator.elaborate, "stamp + 1, velocity.f", "stamp, velocity.f"),
        ranges.digits_left,
        promise="no arithmetic wraps but where it is meant to; what a product is put into is not looked at",
    ),
    "levant-edge": Case(
        partial(estimator, "levant-edge"),
        (*STAMPED, *TIMES, *SLOPE),
        Bug(levant_edge.Estimator._measure, "s.size - d.mantissa, 0", "s.size, 0"),
        ranges.levant_edge,
        promise="no arithmetic wraps but where it is meant to; the acceleration is not looked at",
    ),
    "edge-kalman": Case(
        partial(estimator, "edge-kalman"),
        (*STAMPED, *WEIGHTED, *TABLED, *SLOPE),
        Bug(edge_kalman.Estimator._sample, "length_of(s.age[:-1])", "length_of(s.age[:-1]) + 32"),
        ranges.edge_kalman,
        promise=OF_A_FILTER,
    ),
    "count-kalman": Case(
        partial(estimator, "count-kalman"),
        (*MOVED, "cell", "now", "at", *STAMPED, *WEIGHTED, *TABLED, *SLOPE),
        Bug(edge_kalman.Estimator._sample, "length_of(s.age[:-1])", "length_of(s.age[:-1]) + 32"),
        ranges.count_kalman,
        promise=OF_A_FILTER,
    ),
    "scale_map": Case(
        lambda axis: ScaleMap(Bins(12, -300, 3, 64, 16.0)),
        ("origin", "unshifted"),
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
