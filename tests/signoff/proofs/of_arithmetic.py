"""What root and division promise: the exact result, rounded down, at the clock that they name.

A ghost beside each carries the square of the root so far, or the product of the quotient so far and the divisor: by
(4 r + d)^2 = 16 r^2 + (8 r + d) d for a digit d, and (2 q + b) d = 2 q d + b d, so that every step is a sum. In small
widths the ghosts are also held against the solver's own products.
"""

from functools import partial
from typing import NamedTuple

from amaranth.hdl import Const, Mux, Signal, Value

from hardwall.hdl.arithmetic.divide import Divide
from hardwall.hdl.arithmetic.signed_divide import SignedDivide
from hardwall.hdl.arithmetic.sqrt import Sqrt
from hardwall.model.arithmetic.signed_divide import BITS_PER_CLOCK

from .bench import Bench
from .bugs import Bug
from .property import Property

SMALL = 12
"""The largest width for which the solver multiplies."""


def root_keeps(bench: Bench, path: str = "") -> None:
    """Promise what a root under way keeps: the remainder is at most twice the root, which has as many bits as made.

    A root with an odd number of bits has one bit after its first step, for the first digit is at most 1: nothing stands
    above the radicand then.
    """
    inner = bench.inner
    complement, left, digits = inner[f"{path}complement"], inner[f"{path}left"], inner[f"{path}digits"]
    clocks, above = len(digits) // 4, len(digits) // 2 - len(inner[f"{path}root"])
    root = Signal(2 * clocks)
    bench.m.d.comb += root.eq(~complement)
    bench.promise(complement < 0)
    bench.promise(inner[f"{path}triple"] == 3 * complement + 1)
    bench.promise(left <= clocks)
    bench.promise(inner[f"{path}remainder"] <= root << 1)
    bench.promise((root << above) >> ((clocks - left) << 1)[: len(root).bit_length()] == 0)
    bench.promise((left != clocks) | (digits[len(digits) - 2 * above :] == 0))


def root_is_exact(width: int, bench: Bench) -> None:
    """The radicand is what has moved out so far, square + remainder, and the digits that are left."""
    block = bench.block(Sqrt(width))
    inner, m = bench.inner, bench.m
    left, remainder, bits = inner["left"], inner["remainder"], len(inner["digits"])
    radicand, square = Signal(bits), Signal(bits)
    # At a step the root goes up by a digit's place and takes its next digit, which is its last digit after the step.
    before, digit = bench.past(block.root), block.root[:2]
    eightfold = before << 3
    after = Signal(bits + 2)
    now = Signal(bits)
    stepped, started = bench.past((left != 0) & ~block.start), bench.past(block.start)
    m.d.sync += square.eq(now)
    m.d.comb += [
        after.eq(
            (square << 4)
            + Mux(digit[0], eightfold + 1, 0)
            + Mux(digit[1], (eightfold << 1) + 4, 0)
            + Mux(digit.all(), 4, 0)
        ),
        now.eq(Mux(started, 0, Mux(stepped, after, square))),
    ]
    with m.If(block.start):
        m.d.sync += radicand.eq(block.radicand)
    taken = radicand >> (left << 2)
    resetting = bench.past(bench.reset)
    root_keeps(bench)
    bench.promise(resetting | (left == 0) | (taken == now + remainder))
    gone = ((bits // 4 - left) << 2)[: bits.bit_length() + 1]
    bench.promise(resetting | (inner["digits"] == (radicand << gone)[:bits]))
    if width <= SMALL:
        bench.promise(resetting | (now == block.root * block.root))
    bench.promise(~block.done | (now <= radicand) & (radicand - now <= block.root << 1))


class Taken(NamedTuple):
    """What a division takes, and when."""

    start: Value
    dividend: Value
    divisor: Value


class Division:
    """A division beside the one in a block, and what the two keep.

    Attributes:
        dividend, divisor: the operands of the division under way.
        product: the quotient so far, times the divisor.
        remainder: what the quotient leaves of the dividend so far.
    """

    def __init__(self, bench: Bench, taken: Taken, quotient_width: int, each: int, path: str = ""):
        inner, m = bench.inner, bench.m
        digits, left, saturated = (inner[path + name] for name in ("digits", "left", "saturated"))
        steps, self.remainder = len(digits) // each, inner[path + "remainder"]
        self.dividend, self.divisor = Signal(len(taken.dividend)), Signal(len(taken.divisor))
        begun = Signal()
        before, self.product = (Signal(len(taken.divisor) + len(digits) + each) for _ in range(2))
        sums = (Mux(digits[bit], self.divisor << bit, 0) for bit in range(each))
        stepped = bench.past((left != 0) & ~taken.start)
        m.d.sync += before.eq(self.product)
        m.d.comb += self.product.eq(Mux(bench.past(taken.start), 0, Mux(stepped, (before << each) + sum(sums), before)))
        with m.If(taken.start):
            m.d.sync += [self.dividend.eq(taken.dividend), self.divisor.eq(taken.divisor), begun.eq(1)]
        moved = (Const(steps) - left)[: len(left)] * each
        ones = (Const(1) << moved) - 1
        bench.promise(left <= steps)
        for kept in (
            inner[path + "divisor"] == self.divisor,
            saturated == ((self.dividend >> quotient_width) >= self.divisor),
            saturated | (self.remainder < self.divisor),
            saturated | ((self.dividend >> (left * each)) == self.product + self.remainder),
            (digits >> moved) == (self.dividend << moved)[: len(digits)] >> moved,
            ~saturated | ((digits & ones) == ones),
        ):
            bench.promise(~begun | kept)
        bench.promise(begun | (left == 0) & ~inner[path + "done"])
        if len(digits) + len(self.divisor) <= SMALL:
            bench.promise(~begun | saturated | (self.product == (digits & ones) * self.divisor))


def quotient_is_exact(sizes: tuple[int, int, int, int], bench: Bench) -> None:
    block = bench.block(Divide(*sizes))
    taken = Taken(block.start, block.dividend, block.divisor)
    run = Division(bench, taken, block.quotient_width, block.bits_per_clock)
    largest = (1 << block.quotient_width) - 1
    fits = run.divisor << block.quotient_width > run.dividend
    bench.promise(~block.done | (block.saturated == ~fits))
    bench.promise(~block.done | fits | (block.quotient == largest))
    left_over = run.dividend - run.product
    bench.promise(~block.done | ~fits | (left_over >= 0) & (left_over < run.divisor))


def signed_quotient_is_exact(sizes: tuple[int, int, int, int], bench: Bench) -> None:
    """With `done`, the quotient has the sign of the dividend and the magnitude of the division of the magnitudes."""
    block = bench.block(SignedDivide(*sizes))
    bits = block.quotient_bits
    dividend, divisor = Signal.like(block.dividend), Signal.like(block.divisor)
    with bench.m.If(block.start):
        bench.m.d.sync += [dividend.eq(block.dividend), divisor.eq(block.divisor)]
    now, whole = (Mux(value < 0, -value, value) << block.fraction for value in (block.dividend, dividend))
    taken = Taken(block.start, now[: block.dividend_width + block.fraction], block.divisor)
    run = Division(bench, taken, bits, BITS_PER_CLOCK, "magnitudes.")
    magnitude = Mux(block.quotient < 0, -block.quotient, block.quotient)
    fits = whole < divisor << bits
    rest = whole - magnitude * divisor
    bench.promise((run.dividend == whole) & (run.divisor == divisor))
    bench.promise(bench.inner["negative"] == (dividend < 0))
    bench.promise(~block.done | (block.quotient == 0) | ((block.quotient < 0) == (dividend < 0)))
    bench.promise(~block.done | fits | (magnitude == (1 << bits) - 1))
    bench.promise(~block.done | ~fits | (rest >= 0) & (rest < divisor))


PROPERTIES = (
    [
        Property(
            "the root is exact and rounded down",
            f"sqrt {width}",
            partial(root_is_exact, width),
            depth=3,
            bugs=(Bug(Sqrt.elaborate, "rest >= 0", "rest > 0"),),
            quick=width == SMALL,
        )
        for width in (7, 12, 31)
    ]
    + [
        Property(
            "the quotient is exact, rounded down, or saturates",
            f"divide {'/'.join(map(str, sizes))}",
            partial(quotient_is_exact, sizes),
            depth=3,
            bugs=(Bug(Divide.elaborate, "fits | self.saturated", "fits"),),
            quick=sum(sizes) < 2 * SMALL,
        )
        for sizes in ((8, 4, 5, 1), (24, 12, 14, 2))
    ]
    + [
        Property(
            "the quotient is exact, rounded toward zero, or saturates",
            "signed_divide 5/3/1/4",
            partial(signed_quotient_is_exact, (5, 3, 1, 4)),
            depth=3,
            bugs=(
                Bug(
                    SignedDivide.elaborate,
                    "Mux(negative, -magnitudes.quotient, magnitudes.quotient)",
                    "magnitudes.quotient",
                ),
            ),
        )
    ]
)
