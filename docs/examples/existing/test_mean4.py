"""A module of existing Verilog gives its model's outputs, word for word."""

from pathlib import Path

import cocotb
import numpy as np
from amaranth.hdl import signed
from amaranth.lib.wiring import In, Out

from hardwall.hdl.verilog_module import VerilogModule
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, rng, simulate


class Mean4(VerilogModule):
    """The mean of the last four samples, as `mean4.v` computes it."""

    latency = 1

    def __init__(self):
        ports = {"strobe": In(1), "sample": In(signed(16)), "valid": Out(1), "mean": Out(signed(16))}
        super().__init__("mean4", ports, [Path(__file__).with_name("mean4.v")], WIDTH=16)


def mean4(samples: np.ndarray) -> np.ndarray:
    """Return the outputs for samples after a reset."""
    return np.convolve(samples, np.ones(4, np.int64))[: len(samples)] >> 2


@cocotb.test(**CAMPAIGN)
async def follows_its_model(dut):
    component = Mean4()
    bench = Bench(dut, component)
    await bench.reset()
    samples = [-(2**15)] * 5 + [2**15 - 1] * 5 + rng().integers(-(2**15), 2**15, SAMPLES).tolist()
    taken, given = await bench.campaign("strobe", "valid", ("sample",), ("mean",), [(sample,) for sample in samples])
    check(taken, given, {"mean": mean4(taken.column("sample"))}, component.latency)


def test_mean4():
    simulate(__file__, Mean4)
