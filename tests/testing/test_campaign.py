"""Campaigns: the pace of their strobes, and their messages on late, lost and extra answers."""

import cocotb
import numpy as np
import pytest
from amaranth.hdl import Array, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.testing import CAMPAIGN, Bench, check, simulate
from hardwall.testing.campaign import BATCH
from hardwall.testing.harness import Harness

LONGEST = 7


class Echo(wiring.Component):
    """A component that returns `value` after `delay` clocks, unless `lost`, with an additional answer for `extra`.

    It counts the clocks.
    """

    strobe: In(1)
    value: In(8)
    lost: In(1)
    extra: In(1)
    delay: In(range(LONGEST + 1))
    valid: Out(1)
    echo: Out(8)
    clock: Out(32)

    def elaborate(self, platform):
        m = Module()
        m.d.sync += self.clock.eq(self.clock + 1)
        stages = [(self.strobe & ~self.lost, self.value)]
        for k in range(LONGEST):
            stage = Signal(name=f"valid_{k}"), Signal(8, name=f"value_{k}")
            m.d.sync += [now.eq(before) for now, before in zip(stage, stages[-1], strict=True)]
            stages.append(stage)
        valid, value = (Array(column)[self.delay] for column in zip(*stages, strict=True))
        m.d.comb += [self.valid.eq(valid | self.extra), self.echo.eq(value)]
        return m


async def echo(dut, delay: int) -> Bench:
    """Return a bench whose component answers after `delay` clocks."""
    bench = Bench(dut, Echo())
    await bench.reset()
    bench.drive(delay=delay)
    return bench


def rows(samples: int, **at: int) -> list[tuple[int, int, int]]:
    """Return rows (value, lost, extra); answers are lost or followed by an extra answer at the given samples."""
    return [(k % 256, int(k == at.get("lost")), int(k == at.get("extra"))) for k in range(samples)]


async def campaign(bench: Bench, some: list[tuple[int, int, int]], **pace: int | None):
    return await bench.campaign("strobe", "valid", ("value", "lost", "extra"), ("echo",), some, **pace)


@cocotb.test(**CAMPAIGN)
async def every_latency_and_pace_is_kept(dut):
    for latency in range(LONGEST + 1):
        bench = await echo(dut, latency)
        for every in sorted({1, 2, max(latency, 1), latency + 3}):
            taken, given = await campaign(bench, rows(100), latency=latency, every=every)
            assert taken.column("value").tolist() == list(range(100))
            check(taken, given, {"echo": np.arange(100)}, latency)
            # The next strobe comes as early as allowed or a clock later.
            assert set(np.diff(taken.clocks).tolist()) == {every, every + 1}


@cocotb.test(**CAMPAIGN)
async def a_campaign_of_batches_and_what_is_done_by_hand_are_one_sequence_of_clocks(dut):
    bench, samples = await echo(dut, 3), 2 * BATCH + 100
    monitor = bench.monitor("valid", "echo", "clock")
    await bench.transact("strobe", "valid", value=7)
    taken, given = await campaign(bench, rows(samples), latency=3)
    check(taken, given, {"echo": np.arange(samples) % 256}, 3)
    apart = np.diff(taken.clocks).tolist()
    # At the end of a batch an overdue answer is waited for.
    assert [apart.pop(2 * BATCH - 1), apart.pop(BATCH - 1)] == [6, 6]
    assert set(apart) == {3, 4}
    await bench.transact("strobe", "valid", value=5)
    assert monitor.column("echo").tolist() == [7, *given.column("echo"), 5]
    assert monitor.clocks[1:-1] == given.clocks
    # The component has counted its clocks itself.
    assert len(set(monitor.column("clock") - monitor.clocks)) == 1


@cocotb.test(**CAMPAIGN)
async def a_momentary_input_is_itself_with_the_strobe_alone(dut):
    bench = await echo(dut, 2)
    # With complements, this is high at all clocks but those of strobes.
    at_other_clocks = bench.monitor("lost", "strobe", "value")
    taken, given = await campaign(bench, rows(100), latency=2, every=4, momentary=("value", "lost"))
    assert taken.column("value").tolist() == given.column("echo").tolist() == list(range(100))
    seen = at_other_clocks.rows[1:]
    assert {value for _, value in seen} == set(range(255, 155, -1))
    assert not any(strobe for strobe, _ in seen)
    assert len(seen) >= 3 * 100


@cocotb.test(**CAMPAIGN)
async def what_is_wrong_is_named_with_its_sample(dut):
    late = r"^sample 0 waits: no valid within 2 clocks of its strobe, the latency promised; inputs {'value': 0,"
    with pytest.raises(AssertionError, match=late):
        await campaign(await echo(dut, 3), rows(40), latency=2)
    for every in (1, 4):
        with pytest.raises(AssertionError, match=r"^sample 21 waits: .*; inputs {'value': 21, 'lost': 1, 'extra': 0}$"):
            await campaign(await echo(dut, 4), rows(40, lost=21), latency=4, every=every)
    with pytest.raises(AssertionError, match=r"^valid without strobe before sample 22$"):
        await campaign(await echo(dut, 0), rows(40, extra=21), latency=0, every=2)
    bench = await echo(dut, 2)
    taken, given = await campaign(bench, rows(40), latency=3)
    with pytest.raises(AssertionError, match=r"^latency \[2\] clocks, promised 3$"):
        check(taken, given, {"echo": np.arange(40)}, 3)


@cocotb.test(**CAMPAIGN)
async def a_transaction_does_not_wait_for_ever(dut):
    bench = await echo(dut, 3)
    await bench.transact("strobe", "valid", value=5)
    assert bench.reader("echo")() == 5
    with pytest.raises(AssertionError, match=r"^no valid within 10000 clocks of strobe; inputs {'lost': 1}$"):
        await bench.transact("strobe", "valid", lost=1)


@cocotb.test()
async def a_pace_that_is_none_is_refused(dut):
    bench = await echo(dut, 1)
    for pace, error, message in [
        ({}, TypeError, "latency must be an int, the clocks from strobe, not None"),
        ({"latency": 1.0}, TypeError, "latency must be an int, the clocks from strobe, not 1.0"),
        ({"latency": -1}, ValueError, "latency must be 0 to 65534 clocks, not -1"),
        ({"latency": 1, "every": 0}, ValueError, "every must be 1 to 65534 clocks, not 0"),
    ]:
        with pytest.raises(error, match=f"^{message}$"):
            await campaign(bench, rows(1), **pace)


def test_rtl():
    simulate(__file__, Echo)


def test_a_port_of_the_harness_own_name_is_refused():
    with pytest.raises(ValueError, match=r"^a port under test must not begin with bench_, not 'bench_go'$"):
        Harness(wiring.Component({"bench_go": In(1)}))
