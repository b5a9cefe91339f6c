"""The quotient by multiplications: RTL against model and exact integers, and the derived bound on its reciprocals."""

from fractions import Fraction

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.arithmetic.divisionless import Divisionless
from hardwall.model.arithmetic.divisionless import (
    DIGIT,
    ERROR_MAX,
    FINE,
    digits,
    quotient,
    reciprocal,
    reciprocal_error,
    table,
)
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import some_of

NAMES = ("dividend_width", "divisor_width", "fraction", "quotient_width", "factor_width", "term_width")
SIZES = [(20, 27, 24, 26, 14, 26), (12, 7, 3, 5, 1, 1), (9, 8, 0, 1, 3, 20), (23, 30, 17, 31, 12, 24)]


def exact(dividend: int, divisor: int, fraction: int, width: int) -> int:
    return min((Fraction(dividend << fraction, divisor) + Fraction(1, 2)).__floor__(), 2**width - 1)


def ends(width: int) -> list[int]:
    """Return the words at which a carry occurs, and the ends of the range."""
    top = (1 << width) - 1
    return sorted({v for k in range(width) for v in ((1 << k) - 1, 1 << k, (1 << k) + 1) if v <= top} | {0, top})


def stimulus(sizes: tuple[int, ...], samples: int):
    """Yield (dividend, divisor): all ends, 0 by 0, random magnitudes, and both sides of where rounding goes up."""
    dividend_width, divisor_width, fraction, width = sizes[:4]
    random, largest = rng(), (1 << dividend_width) - 1
    yield 0, 0
    yield from ((dividend, divisor) for divisor in ends(divisor_width)[1:] for dividend in ends(dividend_width))
    for _ in range(samples):
        divisor = int(random.integers(1, 1 << int(random.integers(1, divisor_width, endpoint=True))))
        yield int(random.integers(0, 1 << int(random.integers(1, dividend_width, endpoint=True)))), divisor
        halves = 2 * int(random.integers(0, 1 << int(random.integers(1, width, endpoint=True)))) + 1
        dividend = (divisor * halves >> fraction + 1) + int(random.integers(-1, 2))
        yield min(max(dividend, 0), largest), divisor


def steps(dividend: int, divisor: int, fraction: int, width: int, bits: int) -> tuple[int, list[int]]:
    """Return the quotient by the module's steps, with a divisor of so many bits, and check each of its bounds.

    Beside it are the products from that which makes the reciprocal on; none of a quotient that does not fit at once.
    """
    number, digit = digits(width + 1)
    whole, zeros = number * digit - fraction - 1, bits - divisor.bit_length()
    t, x = divisor << zeros, dividend << zeros
    if x >> bits + whole:
        return 2**width - 1, []
    r, one = reciprocal(t, bits), 1 << bits + FINE
    less = one - r * t
    assert 0 < less < ERROR_MAX * one
    remainder, scale, made, products = r * x, one << whole, 0, [r * t, r * x]
    for left in range(number, 0, -1):
        leading = remainder * 2**digit // scale
        assert leading < 2 << digit
        made, remainder = (made << digit) + leading, remainder * 2**digit - leading * (r * t << whole)
        assert 0 <= remainder < 2 * scale
        products.append((leading + (left == 1)) * (less << whole))
    assert remainder < 2 * (r * t << whole)
    made += remainder >= r * t << whole
    return min((made + 1) >> 1, 2**width - 1), products


def test_no_reciprocal_is_above_or_below_by_more_than_derived():
    assert reciprocal_error() < ERROR_MAX == 2.0 ** -(DIGIT + 1)
    assert (len(table()), max(table()), min(table())) == (32, 126, 65)
    for width in (7, 12):
        errors = [1 - Fraction(t * reciprocal(t, width), 1 << width + FINE) for t in range(1 << width - 1, 1 << width)]
        assert min(errors) > 0
        assert reciprocal_error() / 2 < max(errors) <= reciprocal_error()


@pytest.mark.parametrize("sizes", SIZES, ids=str)
def test_the_steps_end_in_the_exact_quotient(sizes):
    pairs = [pair for pair in stimulus(sizes, 2_000) if pair[1]]
    expected = [exact(*pair, *sizes[2:4]) for pair in pairs]
    assert [quotient(*pair, *sizes[2:4]) for pair in pairs] == expected
    assert [steps(*pair, *sizes[2:4], sizes[1])[0] for pair in pairs] == expected


def test_the_steps_end_in_the_exact_quotient_of_all_small_operands():
    for divisor in range(1, 1 << 7):
        for dividend in range(1 << 7):
            assert steps(dividend, divisor, 3, 6, 7)[0] == exact(dividend, divisor, 3, 6)


def test_bit_12_of_what_the_only_digit_leaves_decides_nothing():
    """What `tests/signoff/mutation/reasons.toml` says of a mutant: with that bit set the quotient is the same."""
    dividends, bits, fraction, width = SIZES[1][:4]
    (number, digit), tried = digits(width + 1), 0
    assert number == 1
    whole = digit - fraction - 1
    point = bits + FINE + whole
    for divisor in range(1, 1 << bits):
        zeros = bits - divisor.bit_length()
        r, dividend = reciprocal(divisor << zeros, bits), np.arange(1 << dividends)
        dividend = dividend[dividend << zeros >> bits + whole == 0]
        remainder = r * dividend << zeros
        leading, left = remainder >> point - digit, remainder % (1 << point - digit) << digit
        last = (leading + 1) * ((1 << bits + FINE) - (r * divisor << zeros) << whole)
        for bit in (0, 1 << 12):
            made = (leading >> 1) + (leading & 1 | (left | bit) + last >> point & 1)
            assert (made == ((dividend << fraction + 1) // divisor + 1) >> 1).all()
        tried += len(dividend)
    assert tried == 43_688


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component, sizes = Divisionless(**parameters()), tuple(parameters()[name] for name in NAMES)
    bench = Bench(dut, component)
    await bench.reset()
    operands, results = ("dividend", "divisor"), ("quotient", "saturated")
    at_next_start = bench.monitor("start", *results)
    starts, quotients = await bench.campaign(
        "start", "done", operands, results, stimulus(sizes, SAMPLES // 20), momentary=operands
    )
    most, fraction, width = 2 ** sizes[3] - 1, *sizes[2:4]
    expected = {
        "quotient": np.array([exact(a, b, fraction, width) if b else 0 for a, b in starts.rows]),
        "saturated": np.array([b > 0 and exact(a, b, fraction, width + 64) > most for a, b in starts.rows]),
    }
    assert set(expected["saturated"]) == {False, True}
    check(starts, quotients, expected, component.latency)
    assert at_next_start.rows[1:] == quotients.rows[:-1], "a quotient must stay until the next start"


@cocotb.test()
async def an_idle_multiplier_is_the_users(dut):
    component, random = Divisionless(**parameters()), rng()
    bench = Bench(dut, component)
    await bench.reset()
    for _ in range(20):
        factor, term = (int(random.integers(0, 1 << len(port))) for port in (component.factor, component.term))
        await bench.transact("start", "done", dividend=1, divisor=1, factor=factor, term=term)
        await ClockCycles(dut.clk, 2)
        assert bench.reader("product")() == factor * term


@cocotb.test()
async def every_product_is_that_of_the_steps(dut):
    """A reciprocal that is a little less makes the same quotients; it is not what the module says, all the same."""
    component, sizes = Divisionless(**parameters()), tuple(parameters()[name] for name in NAMES)
    bench, clock, last = Bench(dut, component), RisingEdge(dut.clk), digits(sizes[3] + 1)[0] - 1
    await bench.reset()
    product, seen = bench.reader("product"), 0
    for dividend, divisor in list(stimulus(sizes, 300))[-600:]:
        _, expected = steps(dividend, divisor, *sizes[2:4], sizes[1])
        bench.drive(start=1, dividend=dividend, divisor=divisor)
        await clock
        bench.drive(start=0)
        products = []
        for _ in range(component.latency):
            await clock
            products.append(product())
        if expected:
            # The products by the reciprocal follow one another; those of the digits come every other clock.
            first = len(products) - 2 * last - 5
            assert [*products[first : first + 2], *products[first + 3 :: 2]] == expected
            seen += 1
    assert seen > 100


@pytest.mark.parametrize("sizes", some_of(SIZES, 0), ids=str)
def test_rtl(sizes):
    simulate(__file__, Divisionless, **dict(zip(NAMES, sizes, strict=True)))


@pytest.mark.parametrize(
    ("changes", "error", "told"),
    [
        ({"divisor_width": 6}, ValueError, "divisor_width must be 7 or more, not 6"),
        ({"fraction": 27}, ValueError, "fraction must be 0 to 26, not 27"),
        ({"fraction": -1}, ValueError, "fraction must be 0 to 26, not -1"),
        ({"dividend_width": 0}, ValueError, "dividend_width must be 1 or more, not 0"),
        ({"factor_width": 0}, ValueError, "factor_width must be 1 or more, not 0"),
        ({"term_width": "8"}, TypeError, "term_width must be an int, not '8'"),
    ],
)
def test_impossible_sizes_are_refused(changes, error, told):
    with pytest.raises(error, match=f"^{told}$"):
        Divisionless(**dict(zip(NAMES, SIZES[0], strict=True)) | changes)
