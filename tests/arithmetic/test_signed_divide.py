"""The division: RTL against model, and the model against exact rationals."""

from fractions import Fraction

import cocotb
import pytest

from hardwall.hdl.arithmetic.signed_divide import SignedDivide
from hardwall.model.arithmetic.signed_divide import divide
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import some_of


def make(**sizes: int) -> SignedDivide:
    return SignedDivide(**sizes)


def pairs(component: SignedDivide, samples: int):
    """Yield dividends and divisors whose quotient fits: the ends of its range, then random pairs."""
    random, members = rng(), component.signature.members
    top = (1 << (members["dividend"].shape.width - 1)) - 1
    most = (1 << members["divisor"].shape) - 1
    for number in range(samples):
        divisor = (1, 2, 3, most, most - 1)[number // 8] if number < 40 else int(random.integers(1, most + 1))
        divisor = max(divisor, 1)
        # The largest dividend whose quotient is less than 2**quotient_bits.
        largest = min(top, ((divisor << component.quotient_bits) - 1) >> component.fraction)
        ends = (0, 1, largest, largest - 1, -1, -largest, largest // 2, 1 - largest)
        dividend = ends[number % 8] if number < 40 else int(random.integers(-largest, largest + 1))
        yield max(-largest, min(dividend, largest)), divisor


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    operands, rows = ("dividend", "divisor"), pairs(component, SAMPLES // 50)
    at_next_start = bench.monitor("start", "quotient")
    inputs, outputs = await bench.campaign("start", "done", operands, ("quotient",), rows, momentary=operands)
    quotients = [divide(dividend, divisor, component.fraction) for dividend, divisor in inputs.rows]
    check(inputs, outputs, {"quotient": quotients}, component.latency)
    assert at_next_start.rows[1:] == outputs.rows[:-1], "a quotient must stay until the next start"


@cocotb.test()
async def a_start_while_busy_abandons_the_quotient_in_hand(dut):
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    outputs = bench.monitor("done", "quotient")
    for clocks in range(1, component.latency):
        bench.drive(start=1, dividend=-1, divisor=1)
        await cocotb.triggers.RisingEdge(dut.clk)
        bench.drive(start=0)
        if clocks > 1:
            await cocotb.triggers.ClockCycles(dut.clk, clocks - 1)
        await bench.transact("start", "done", dividend=1, divisor=1)
    await bench.rest()
    assert outputs.rows == [(1 << component.fraction,)] * (component.latency - 1)


SIZES = {
    "wide": {"dividend_width": 20, "divisor_width": 11, "fraction": 18, "quotient_bits": 21},
    # The counter of steps needs one more bit when the additional steps are counted too.
    "small dividend": {"dividend_width": 5, "divisor_width": 9, "fraction": 11, "quotient_bits": 14},
}


@pytest.mark.parametrize("sizes", some_of(SIZES.values(), 1), ids=some_of(SIZES, 1))
def test_rtl(sizes):
    simulate(__file__, make, **sizes)


def test_model_is_the_exact_quotient_rounded_toward_zero():
    random = rng()
    for _ in range(5000):
        divisor, fraction = int(random.integers(1, 1 << 30)), int(random.integers(0, 30))
        dividend = int(random.integers(-(1 << 55), 1 << 55)) >> fraction
        exact = Fraction(dividend << fraction, divisor)
        assert divide(dividend, divisor, fraction) == int(exact)


@pytest.mark.parametrize(
    ("sizes", "error", "message"),
    [
        ((2.0, 1, 0, 1), TypeError, r"^dividend_width must be an int, not 2.0$"),
        ((1, 1, 0, 1), ValueError, r"^dividend_width must be 2 or more, not 1$"),
        ((2, 0, 0, 1), ValueError, r"^divisor_width must be 1 or more, not 0$"),
        ((2, 1, -1, 1), ValueError, r"^fraction must be 0 or more, not -1$"),
        ((2, 1, 3, 2), ValueError, r"^quotient_bits must be 3 or more, not 2$"),
    ],
)
def test_impossible_sizes_are_refused(sizes, error, message):
    with pytest.raises(error, match=message):
        SignedDivide(*sizes)
