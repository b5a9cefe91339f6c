"""A custom block and its model."""

import numpy as np
from amaranth.hdl import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class MovingAverage(wiring.Component):
    """The mean of the last four samples, rounded down, one clock after `strobe`; a sample may come at every clock."""

    latency = 1

    strobe: In(1)
    sample: In(signed(16))
    valid: Out(1)
    mean: Out(signed(16))

    def elaborate(self, platform):
        m = Module()
        before = [Signal(signed(16), name=f"before_{k}") for k in range(3)]
        m.d.sync += self.valid.eq(self.strobe)
        with m.If(self.strobe):
            m.d.sync += self.mean.eq((self.sample + sum(before)) >> 2)
            m.d.sync += [later.eq(sooner) for later, sooner in zip(before, [self.sample, *before], strict=False)]
        return m


def moving_average(samples: np.ndarray) -> np.ndarray:
    """Return the block's outputs for samples after a reset."""
    return np.convolve(samples, np.ones(4, np.int64))[: len(samples)] >> 2
