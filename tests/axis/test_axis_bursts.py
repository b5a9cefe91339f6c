"""An axis whose encoder emits its edges in bursts: pins to the output that the monitor `estimator_saturated` counts."""

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge, Timer

from hardwall.hdl.axis.axis import Axis
from hardwall.testing import Bench, parameters, simulate
from stimuli.emissions import Emission
from stimuli.lengths import some_of
from stimuli.specs import spec

BURSTS, IN_A_BURST, PERIOD, APART = 6, 5, 2500, 20
LEVELS = (1, 0), (1, 1), (0, 1), (0, 0)
"""Pins A and B from edge to edge."""


def make(estimator: str) -> Axis:
    return Axis(spec("mhz", estimator))


@cocotb.test()
async def an_estimate_is_none_from_the_third_burst_on(dut):
    axis = make(**parameters()).spec
    bench, seen, settled = Bench(dut, make(**parameters())), [], 4 * axis.clocks_per_sample
    await bench.reset()
    begin = bench.clock_number()

    async def watch():
        while True:
            await RisingEdge(dut.clk)
            if int(dut.estimated.value):
                seen.append((bench.clock_number() - begin, int(dut.saturated.value)))
            else:
                assert not int(dut.saturated.value)

    watching = cocotb.start_soon(watch())
    passed = np.repeat(np.arange(1, BURSTS + 1) * PERIOD, IN_A_BURST)
    for number, clock in enumerate(Emission(PERIOD, APART).clocks(passed).tolist()):
        await Timer((clock - (bench.clock_number() - begin)) * bench.period_ns, "ns")
        bench.drive(**dict(zip(("encoder_a", "encoder_b"), LEVELS[number % 4], strict=True)))
    await Timer(PERIOD * bench.period_ns, "ns")
    watching.cancel()
    third = 3 * PERIOD
    assert {flag for clock, flag in seen if clock < third} == {0}
    late = [flag for clock, flag in seen if clock > third + IN_A_BURST * APART + settled]
    assert len(late) > 100
    assert set(late) == {1}
    assert axis.design.flag_names(int(dut.flags.value)) == ["edges_in_bursts"]


@pytest.mark.parametrize("estimator", some_of(["edge-kalman", "period"], 1))
def test_rtl(estimator):
    simulate(__file__, make, estimator=estimator)
