"""Formats and narrowing: the model against exact arithmetic, and the hardware's shapes against the model's formats."""

import math
from fractions import Fraction

import pytest
from amaranth.hdl import Cat, Const, Module, Signal, Value, signed, unsigned
from amaranth.sim import Simulator
from hypothesis import given
from hypothesis import strategies as st

from hardwall.hdl.arithmetic import fixed as hdl
from hardwall.model.arithmetic import fixed
from hardwall.model.arithmetic.fixed import SQ, UQ, bits_for

WORDS = st.integers(-(2**40), 2**40)


def test_a_format_says_what_its_words_mean():
    q = SQ(3, 5)
    assert (q.width, q.min, q.max, q.lsb) == (8, -128, 127, 1 / 32)
    assert (UQ(3, 5).min, UQ(3, 5).max) == (0, 255)
    assert str(UQ(-2, 9)) == "UQ(-2, 9)"
    assert q.to_real(-128) == -4.0
    assert UQ(20, -4).to_real(3) == 48.0


@given(st.floats(-4, 3.95))
def test_from_real_is_the_nearest_word_ties_upward(value):
    word = SQ(3, 5).from_real(value)
    assert word == math.floor(Fraction(value) * 32 + Fraction(1, 2))


@pytest.mark.parametrize("value", [4.0, -4.1, math.nan, math.inf, -math.inf])
def test_from_real_refuses_what_does_not_fit(value):
    with pytest.raises(ValueError, match=r"^value for SQ\(3, 5\) must be"):
        SQ(3, 5).from_real(value)


@pytest.mark.parametrize(("i", "f", "error"), [(0, 0, ValueError), (60, 4, ValueError), (1.0, 2, TypeError)])
def test_impossible_formats_are_refused(i, f, error):
    with pytest.raises(error, match="not "):
        SQ(i, f)


@given(st.integers(-60, 60), st.floats(1e-9, 1))
def test_bits_for_is_the_smallest_power_of_two_that_holds(exponent, mantissa):
    value = math.ldexp(mantissa, exponent)
    assert 2.0 ** (bits_for(value) - 1) < value <= 2.0 ** bits_for(value)


@given(WORDS, st.integers(1, 40))
def test_wrap_is_the_residue_of_least_size(value, width):
    wrapped = fixed.wrap(value, width)
    assert (value - wrapped) % 2**width == 0
    assert -(2 ** (width - 1)) <= wrapped < 2 ** (width - 1)


@given(WORDS, st.integers(-15, 39))
def test_shifts_round_as_they_are_named(value, shift):
    exact = Fraction(value) / Fraction(2) ** shift
    assert fixed.shift_floor(value, shift) == math.floor(exact)
    assert fixed.shift_round_half_up(value, shift) == math.floor(exact + Fraction(1, 2))


@given(WORDS, WORDS, WORDS)
def test_saturate_holds_within(value, one, other):
    low, high = min(one, other), max(one, other)
    assert fixed.saturate(value, low, high) == sorted((low, value, high))[1]


def evaluate(expression: Value) -> int:
    """Return the value of a constant Amaranth expression."""
    m, result = Module(), Signal(expression.shape())
    m.d.comb += result.eq(expression)
    seen = []

    async def bench(ctx):
        await ctx.delay(1e-9)
        seen.append(ctx.get(result))

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()
    return seen[0]


@pytest.mark.parametrize("value", [-128, -65, -64, -63, -5, -1, 0, 1, 5, 63, 64, 127])
def test_hardware_narrows_as_the_model_does(value):
    word = Const(value, signed(8))
    for shift in (-3, 0, 1, 3, 7):
        assert evaluate(hdl.shift_floor(word, shift)) == fixed.shift_floor(value, shift)
        assert evaluate(hdl.shift_round_half_up(word, shift)) == fixed.shift_round_half_up(value, shift)
    for low, high in ((-64, 63), (0, 5), (-128, 127)):
        assert evaluate(hdl.saturate(word, low, high)) == fixed.saturate(value, low, high)


@pytest.mark.parametrize("bound", [0, 1, 5, 8, 15, 16, 17])
def test_less_compares_with_a_constant(bound):
    values = range(16)
    assert evaluate(Cat(hdl.less(Const(value, 4), bound) for value in values)) == (1 << min(bound, 16)) - 1


def test_shapes_follow_formats():
    assert hdl.shape(SQ(3, 5)) == signed(8)
    assert hdl.shape(UQ(-2, 9)) == unsigned(7)


def test_a_number_is_negated_or_not():
    for value in (-128, -1, 0, 1, 127):
        word = Const(value, signed(8))
        assert [evaluate(hdl.negated(word, Const(negative, 1))) for negative in (0, 1)] == [value, -value]
    assert evaluate(hdl.negated(Const(255, 8), Const(1, 1))) == -255


@pytest.mark.parametrize(("width", "limit_width"), [(3, 3), (2, 4), (4, 2)])
def test_a_number_is_compared_by_its_complement(width, limit_width):
    for number in range(1 << width):
        for limit in range(1 << limit_width):
            compared = Const(~number, width), Const(limit, limit_width)
            assert evaluate(hdl.not_above(*compared)) == (number <= limit)
            assert evaluate(hdl.below(*compared)) == (number < limit)
