"""What a block's own arithmetic promises: that no value loses a bit where it is narrowed.

Amaranth computes every expression exactly, as wide as it must be. So a value can only wrap where it is put into a
signal that cannot hold its shape, and where the low bits of a sum, a difference, a product or a shift are taken. For
each of these places in a block as it is elaborated, `Widths` adds an assertion that the value is what is left of it.
The assertion is in the same branch of the same statement, and in a choice of values it holds for the chosen one: it
says something only in the states and for the values for which the hardware uses the result.

A place where a wrap is meant, such as the difference of two counts, is named, and is left out.

A multiplier is too hard for the solver. `Widths` puts a free value in the place of each product: any value from the
smallest to the largest of the four products of the operands' extremes. So what is proven holds for every product.
"""

import linecache
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import product

from amaranth.asserts import AnySeq
from amaranth.hdl import Assert, Const, Fragment, Mux, Shape, Signal, Value
from amaranth.hdl._ast import Assign, Concat, Operator, Slice, SwitchValue
from amaranth.hdl._xfrm import FragmentTransformer, StatementTransformer, ValueTransformer

EXACT = {"+", "-", "*", "<<", ">>"}
"""Operators whose results have more bits than a signal may have that takes them."""


def extremes(shape: Shape) -> tuple[int, int]:
    """Return the least and the greatest value of a shape."""
    top = 1 << (shape.width - shape.signed)
    return -top if shape.signed else 0, top - 1


def text_of(statement: Assign) -> str:
    """Return the line of source that makes a statement."""
    file, line = statement.src_loc
    return linecache.getline(file, line).strip()


def driven_on_line(statement: Assign) -> list[str]:
    """Return the names of what the line of a statement drives, from left to right."""
    return [name.rpartition(".")[2] for name in re.findall(r"([\w.]+)\.eq\(", text_of(statement))]


def names_of(statement: Assign, signal: Signal) -> set[str]:
    """Return the name of a signal that a statement drives; of one without a name, all names that its line drives."""
    return set(driven_on_line(statement)) if signal.name.startswith("$") else {signal.name}


class Collector(FragmentTransformer, StatementTransformer):
    """Collects the signals that statements drive, by name: the first of each name.

    A signal without a name of its own has that of its place on the line: the statements of a line come in its order.

    Attributes:
        named: the signals with a name of their own.
        unnamed: the others.
    """

    def __init__(self):
        self.named: dict[str, Signal] = {}
        self.unnamed: dict[str, Signal] = {}
        self._seen: Counter = Counter()

    def on_Assign(self, stmt: Assign) -> Assign:
        on_line, place = driven_on_line(stmt), self._seen[stmt.src_loc]
        self._seen[stmt.src_loc] += 1
        for signal in stmt.lhs._lhs_signals():
            if not signal.name.startswith("$"):
                self.named.setdefault(signal.name, signal)
            elif on_line:
                self.unnamed.setdefault(on_line[place % len(on_line)], signal)
        return stmt


def signals_of(fragment: Fragment, path: str = "") -> dict[str, Signal]:
    """Return the signals that are driven inside a fragment, by name, with the names of submodules before it."""
    collector = Collector()
    for statements in fragment.statements.values():
        for statement in statements:
            collector.on_statement(statement)
    found = {path + name: signal for name, signal in (collector.unnamed | collector.named).items()}
    for part, name, _ in fragment.subfragments:
        found |= signals_of(part, f"{path}{name}.")
    return found


class FreeProducts(FragmentTransformer, StatementTransformer, ValueTransformer):
    """Puts free values in the place of a block's products."""

    on_value = ValueTransformer.on_value

    def on_Operator(self, value: Operator) -> Value:
        operands = [self.on_value(operand) for operand in value.operands]
        if value.operator != "*" or any(isinstance(operand, Const) for operand in operands):
            return Operator(value.operator, operands)
        free = AnySeq(value.shape())
        low, high = (Const(bound, value.shape()) for bound in range_of_product(*(each.shape() for each in operands)))
        return Mux((free < low) | (free > high), low, free)


def range_of_product(one: Shape, other: Shape) -> tuple[int, int]:
    """Return the least and the greatest product of values of two shapes: both are products of extremes."""
    corners = [a * b for a, b in product(extremes(one), extremes(other))]
    return min(corners), max(corners)


class Widths(FreeProducts):
    """Frees a block's products, and adds the assertions of this module.

    Args:
        wraps: names of the signals that are meant to wrap.

    Attributes:
        places: for each assertion, the name of its signal and the line of source.
    """

    def __init__(self, wraps: Iterable[str] = ()):
        self.wraps = set(wraps)
        self.places: list[tuple[str, str]] = []

    def on_Assign(self, stmt: Assign) -> list:
        taken = self.on_value(stmt.rhs)
        made = [Assign(stmt.lhs, taken)]
        names = set().union(*(names_of(stmt, signal) for signal in stmt.lhs._lhs_signals()))
        if not names & self.wraps:
            always = Const(1)
            narrowed = [*_narrowed(taken, stmt.lhs.shape(), always), *_sliced(taken, always)]
            made += [Assert(~used | fits) for used, fits in narrowed]
            self.places += [(", ".join(sorted(names)), text_of(stmt))] * len(narrowed)
        for each in made:
            each.src_loc, each._MustUse__used = stmt.src_loc, True
        return made


def _narrowed(value: Value, shape: Shape, used: Value) -> Iterator[tuple[Value, Value]]:
    """Yield when a value is used in a shape, and whether it fits; nothing if all values of its shape do."""
    (low, high), (least, most) = extremes(value.shape()), extremes(shape)
    if low < least or high > most:
        held = value[: shape.width]
        yield used, (held.as_signed() if shape.signed else held) == value


def _sliced(value: Value, used: Value) -> Iterator[tuple[Value, Value]]:
    """Yield, for every place inside an expression where the low bits of arithmetic are taken, the same."""
    signed = isinstance(value, Operator) and value.operator == "s"
    cut = value.operands[0] if signed else value
    if isinstance(cut, Slice):
        if cut.start == 0 and _is_arithmetic(cut.value):
            yield from _narrowed(cut.value, Shape(cut.stop, signed=signed), used)
        yield from _sliced(cut.value, used)
    elif isinstance(value, Operator | Concat):
        for operand in value.operands if isinstance(value, Operator) else value.parts:
            yield from _sliced(operand, used)
    elif isinstance(value, SwitchValue):
        yield from _sliced(value.test, used)
        earlier = Const(0)
        for patterns, case in value.cases:
            here = Const(1) if patterns is None else value.test.matches(*patterns)
            yield from _sliced(case, used & here & ~earlier)
            earlier = earlier | here


def _is_arithmetic(value: Value) -> bool:
    if isinstance(value, SwitchValue):
        return any(_is_arithmetic(case) for _, case in value.cases)
    if isinstance(value, Operator) and value.operator in ("s", "u"):
        return _is_arithmetic(value.operands[0])
    return isinstance(value, Operator) and value.operator in EXACT
