"""A board's clock that stops and comes back, at several phases of the beat by which the oscillator knows it."""

import math

from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.model.board.clock_monitor import SYNCHRONISER, Design

from .on_a_line import CLOCK_HZ, OSCILLATOR_NS, OnALine

STOPS = 8
"""Phases of the beat at which the clock stops."""


async def check_returns(host: OnALine) -> None:
    """Check that a clock that comes back is believed after one level of its beat, and before the third."""
    monitor, dut = Design(CLOCK_HZ), host.dut
    level = monitor.beat_clocks
    # The oscillator sees a change of the beat at its next edge, and takes it through the synchroniser.
    seen = math.ceil((1 + SYNCHRONISER + 1) * OSCILLATOR_NS / host.bench.period_ns)
    host.leave()
    for stop in range(STOPS):
        # The beat is at the same place whenever the clock is found to run.
        await ClockCycles(dut.clk, level + level * stop // STOPS)
        host.bench.clock.stop()
        await ClockCycles(dut.oscillator, 1 + int(monitor.stop_latency_s(1.0)))
        assert not int(dut.outputs_enable.value)
        host.bench.clock.start()
        clocks = 0
        while not int(dut.outputs_enable.value):
            await RisingEdge(dut.clk)
            clocks += 1
            assert clocks <= 2 * level + seen, f"stop {stop}"
        assert clocks > level, f"stop {stop}"
