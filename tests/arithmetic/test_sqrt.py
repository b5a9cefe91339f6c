"""The integer square root: RTL against model, and both against exact integers."""

import math

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.arithmetic.sqrt import Sqrt
from hardwall.model.arithmetic.sqrt import digits, isqrt
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from stimuli.lengths import some_of


def around_squares(width: int) -> list[int]:
    """Return radicands around those at which the root changes, over all magnitudes, and the extremes."""
    top = (1 << width) - 1
    roots = {r for k in range((width + 1) // 2 + 1) for r in (1 << k, (1 << k) - 1, math.isqrt(top >> k))}
    return sorted({0, 1, top} | {v for r in roots for v in (r * r - 1, r * r, r * r + 1) if 0 <= v <= top})


@pytest.mark.parametrize("width", [8, 16, 17, 36, 53, 62])
def test_model_is_the_exact_root(width):
    radicands = around_squares(width) + rng().integers(0, 1 << width, 20_000).tolist()
    assert [isqrt(r) for r in radicands] == [math.isqrt(r) for r in radicands]


def test_model_is_exhaustively_exact_below_two_to_the_18():
    assert all(isqrt(r) == math.isqrt(r) for r in range(1 << 18))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    width = parameters()["width"]
    component = Sqrt(width)
    bench = Bench(dut, component)
    await bench.reset()
    # The campaign is exhaustive where that takes fewer samples than the random one.
    radicands = range(1 << width) if 1 << width <= SAMPLES else rng().integers(0, 1 << width, SAMPLES).tolist()
    rows = [(radicand,) for radicand in [*around_squares(width), *radicands]]
    at_next_start = bench.monitor("start", "root")
    starts, roots = await bench.campaign("start", "done", ("radicand",), ("root",), rows, momentary=("radicand",))
    expected = np.array([isqrt(r) for r in starts.column("radicand").tolist()])
    check(starts, roots, {"root": expected}, component.latency)
    assert at_next_start.rows[1:] == roots.rows[:-1], "a root must stay until the next start"


@cocotb.test()
async def a_new_start_abandons_the_old_one(dut):
    component = Sqrt(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    roots = bench.monitor("done", "root")
    top = (1 << component.width) - 1
    for clocks in range(1, component.latency):
        bench.drive(start=1, radicand=0)
        await RisingEdge(dut.clk)
        bench.drive(start=0)
        await ClockCycles(dut.clk, clocks - 1) if clocks > 1 else None
        await bench.transact("start", "done", radicand=top)
    assert roots.rows == [(math.isqrt(top),)] * (component.latency - 1)


@cocotb.test()
async def every_digit_is_told_as_it_is_made(dut):
    component = Sqrt(**parameters())
    bench, clocks = Bench(dut, component), digits(component.width)
    await bench.reset()
    shown = [bench.reader(name) for name in ("reached", "last", "done", "root")]
    told = []
    for radicand in [*around_squares(component.width), *rng().integers(0, 1 << component.width, 200).tolist()]:
        bench.drive(start=1, radicand=radicand)
        await RisingEdge(dut.clk)
        bench.drive(start=0, radicand=0)
        # A root that is done goes on with the digits of a radicand that ends in zeros, and stays as it is.
        for made in (*range(clocks), clocks, clocks):
            await RisingEdge(dut.clk)
            after = math.isqrt(radicand << 4 >> 4 * (clocks - made))
            told.append(tuple(read() for read in shown))
            done = made == clocks and told[-2][1]
            assert told[-1] == ((1 << after % 4) - 1, made == clocks - 1, done, after >> 2), (radicand, made)
    assert {reached for reached, *_ in told} == {0, 1, 3, 7} or component.width <= 3


@pytest.mark.parametrize("width", some_of([1, 2, 3, 16, 35], 4))
def test_rtl(width):
    simulate(__file__, Sqrt, width=width)


@pytest.mark.parametrize(("width", "error"), [(0, ValueError), (-3, ValueError), (8.0, TypeError), ("8", TypeError)])
def test_bad_width_is_refused(width, error):
    with pytest.raises(error, match=f"not {width!r}$"):
        Sqrt(width)
