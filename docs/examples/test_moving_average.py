"""The block gives its model's outputs, word for word."""

import cocotb
from moving_average import MovingAverage, moving_average

from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, rng, simulate

ENDS = [-(2**15)] * 5 + [2**15 - 1] * 5 + [0, -1, 1]


@cocotb.test(**CAMPAIGN)
async def follows_its_model(dut):
    component = MovingAverage()
    bench = Bench(dut, component)
    await bench.reset()
    samples = ENDS + rng().integers(-(2**15), 2**15, SAMPLES).tolist()
    rows = [(sample,) for sample in samples]
    taken, given = await bench.campaign("strobe", "valid", ("sample",), ("mean",), rows)
    check(taken, given, {"mean": moving_average(taken.column("sample"))}, component.latency)


def test_moving_average():
    simulate(__file__, MovingAverage)
