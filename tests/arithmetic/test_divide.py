"""The integer division: RTL against model, and both against Python's exact integers."""

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.arithmetic.divide import Divide
from hardwall.model.arithmetic.divide import divide
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import some_of

WIDTHS = [(1, 1, 1), (3, 5, 2), (24, 10, 14), (20, 26, 20)]


def exact(dividend: int, divisor: int, quotient_width: int) -> int:
    largest = 2**quotient_width - 1
    return largest if divisor == 0 else min(dividend // divisor, largest)


def ends(width: int) -> list[int]:
    """Return the words at which a carry occurs, and the ends of the range."""
    top = (1 << width) - 1
    return sorted({v for k in range(width) for v in ((1 << k) - 1, 1 << k, (1 << k) + 1) if v <= top} | {0, top})


def stimulus(dividend_width: int, divisor_width: int, quotient_width: int, samples: int):
    """Yield (dividend, divisor): all ends, both sides of whole and largest quotients, random magnitudes."""
    random = rng()
    largest = (1 << dividend_width) - 1
    for divisor in ends(divisor_width):
        for dividend in ends(dividend_width):
            yield dividend, divisor
        for quotient in ends(quotient_width):
            for dividend in (divisor * quotient - 1, divisor * quotient, divisor * (quotient + 1) - 1):
                if 0 <= dividend <= largest:
                    yield dividend, divisor
    if 1 << (dividend_width + divisor_width) <= samples:
        yield from ((a, b) for a in range(largest + 1) for b in range(1 << divisor_width))
        return
    for _ in range(samples):
        bits = random.integers(1, [dividend_width, divisor_width], endpoint=True)
        yield tuple(int(random.integers(0, 1 << int(each))) for each in bits)


@pytest.mark.parametrize("widths", [*WIDTHS, (62, 40, 30), (62, 62, 62)])
def test_model_is_the_exact_quotient(widths):
    pairs = list(stimulus(*widths, 20_000))
    assert [divide(a, b, widths[2]) for a, b in pairs] == [exact(a, b, widths[2]) for a, b in pairs]


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = Divide(**parameters())
    widths = component.dividend_width, component.divisor_width, component.quotient_width
    bench = Bench(dut, component)
    await bench.reset()
    operands, results = ("dividend", "divisor"), ("quotient", "saturated")
    at_next_start = bench.monitor("start", *results)
    starts, quotients = await bench.campaign(
        "start", "done", operands, results, stimulus(*widths, SAMPLES // 10), momentary=operands
    )
    pairs = starts.rows
    expected = {
        "quotient": np.array([divide(a, b, widths[2]) for a, b in pairs]),
        "saturated": np.array([b == 0 or a // b >= 1 << widths[2] for a, b in pairs]),
    }
    assert set(expected["saturated"]) == {False, True}
    check(starts, quotients, expected, component.latency)
    assert at_next_start.rows[1:] == quotients.rows[:-1], "a quotient must stay until the next start"


@cocotb.test()
async def a_new_start_abandons_the_old_one(dut):
    component = Divide(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    quotients = bench.monitor("done", "quotient", "saturated")
    for clocks in range(1, component.latency):
        bench.drive(start=1, dividend=1, divisor=0)
        await RisingEdge(dut.clk)
        bench.drive(start=0)
        await ClockCycles(dut.clk, clocks - 1) if clocks > 1 else None
        await bench.transact("start", "done", dividend=1, divisor=1)
    assert quotients.rows == [(1, 0)] * (component.latency - 1)


SIZES = [*((*widths, 1) for widths in WIDTHS), (24, 10, 14, 2), (5, 3, 9, 3)]


@pytest.mark.parametrize("widths", some_of(SIZES, 5), ids=str)
def test_rtl(widths):
    names = ("dividend_width", "divisor_width", "quotient_width", "bits_per_clock")
    simulate(__file__, Divide, **dict(zip(names, widths, strict=True)))


@pytest.mark.parametrize("name", ["dividend_width", "divisor_width", "quotient_width", "bits_per_clock"])
@pytest.mark.parametrize(("width", "error"), [(0, ValueError), (-3, ValueError), (8.0, TypeError), ("8", TypeError)])
def test_bad_width_is_refused(name, width, error):
    widths = {"dividend_width": 8, "divisor_width": 8, "quotient_width": 8, name: width}
    with pytest.raises(error, match=f"^{name} must be .*not {width!r}$"):
        Divide(**widths)
