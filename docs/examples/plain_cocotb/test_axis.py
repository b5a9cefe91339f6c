"""The written Verilog in a cocotb project of one's own: every sample has the drive and the velocity of the model.

hardwall verilog mhz -o rtl
pytest test_axis.py
"""

import os
from pathlib import Path

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, ReadOnly, RisingEdge
from cocotb_tools.runner import get_runner

from hardwall.model import stamped
from hardwall.model.axis import Axis
from hardwall.sim.scene import spec

AXIS = Axis(spec("mhz"), wall_stiffness=20e3, wall_damping=10.0)
SAMPLES, CLOCKS_AN_EDGE = 400, 130
LEVELS = [0b00, 0b01, 0b11, 0b10]
"""A + 2 B as the position rises."""


ENCODER = ["encoder_a", "encoder_b", "encoder_z"]
PULSES = ["clear_flags", "preload", "preload_count", "origin_shift", "slip", "index_arm"]
"""The inputs that are 0 at first; most others are the words of the axis, by the same names."""


def handle() -> list[int]:
    """Return the position after each edge: 80 counts into the wall, and back out of it."""
    return [*range(1, 81), *range(79, -40, -1)]


async def turned(dut):
    """Turn the encoder, beginning with the first clock without a reset."""
    for position in handle():
        for _ in range(CLOCKS_AN_EDGE):
            await FallingEdge(dut.clk)
        level = LEVELS[position % 4]
        dut.encoder_a.value, dut.encoder_b.value = level & 1, level >> 1


@cocotb.test()
async def the_drive_is_that_of_the_model(dut):
    for name, word in {**dict.fromkeys(ENCODER + PULSES, 0), **AXIS.words}.items():
        getattr(dut, name).value = word
    dut.drive_enable.value, dut.rst.value = 1, 1
    Clock(dut.clk, 20, "ns").start()
    for _ in range(4):
        await FallingEdge(dut.clk)
    dut.rst.value, dut.commit.value = 0, 1
    cocotb.start_soon(turned(dut))
    await FallingEdge(dut.clk)
    dut.commit.value = 0

    found = []
    while len(found) < SAMPLES:
        await RisingEdge(dut.clk)
        await ReadOnly()
        if dut.sampled.value:
            found.append((dut.drive.value.to_signed(), dut.velocity.value.to_signed()))
    clocks = CLOCKS_AN_EDGE * np.arange(1, len(handle()) + 1)
    record = stamped.run(AXIS, clocks, np.array(LEVELS)[np.array(handle()) % 4], SAMPLES)
    assert found == list(zip(record.drive.tolist(), record.velocity.tolist(), strict=True))
    assert min(record.drive) < 0
    assert 0 in record.drive


def test_axis():
    here = Path(__file__).parent
    simulator = os.environ.get("SIM", "verilator")
    # Verilator warns of how the Verilog is written; `lint.vlt` says why each of these warnings is harmless.
    files = ["lint.vlt", "axis.v"] if simulator == "verilator" else ["axis.v"]
    # The Verilog has no timescale of its own.
    timescale = "1ns", "1ps"
    runner = get_runner(simulator)
    runner.build(sources=[here / "rtl" / file for file in files], hdl_toplevel="axis", timescale=timescale)
    runner.test(hdl_toplevel="axis", test_module="test_axis", test_dir=here, timescale=timescale)
