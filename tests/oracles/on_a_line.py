"""A host on the serial line of a board that has its own clocks, and what watches the board's pins meanwhile."""

import logging
from abc import ABC, abstractmethod

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, First, Timer
from cocotbext.uart import UartSink, UartSource

from hardwall.model.link.line import framed
from hardwall.testing import Bench

from .supervised import SYNCHRONISER

CLOCK_HZ, BAUD = 12_000_000, 3_000_000
"""4 clocks a bit."""
OSCILLATOR_NS = 22
"""Where the clock's period is 10 ns."""
STARTING = 100
"""Clocks in which the oscillator has seen that the clock runs."""


class OnALine(ABC):
    """A host on the line of a board, and a task that looks at every clock edge.

    Attributes:
        bench: the bench of the board.
        source, sink: the two ends of the line.
        patience: clocks after which an answer is overdue.
    """

    def __init__(self, bench: Bench, patience: int):
        self.bench, self.dut, self.patience = bench, bench.dut, patience

    async def _start(self, pins: dict[str, int]) -> None:
        """Reset the board with levels at its pins, and begin to look when the reset is over inside."""
        await self.bench.reset()
        self.bench.drive(uart_rx=1, rst=1, **pins)
        Clock(self.dut.oscillator, OSCILLATOR_NS, "ns", impl="gpi").start()
        await ClockCycles(self.dut.clk, STARTING)
        assert int(self.dut.outputs_enable.value) == 0
        self.bench.drive(rst=0)
        bit_ns = self.bench.period_ns * CLOCK_HZ / BAUD
        self.source, self.sink = UartSource(self.dut.uart_rx, 1e9 / bit_ns), UartSink(self.dut.uart_tx, 1e9 / bit_ns)
        for end in (self.source, self.sink):
            end.log.setLevel(logging.WARNING)
        # The reset is seen inside for as long as this; the first edge without it is the first that is looked at.
        await ClockCycles(self.dut.clk, SYNCHRONISER)
        self._following = cocotb.start_soon(self._follow())

    @abstractmethod
    async def _follow(self) -> None:
        """Look at every clock edge, and fail where it is not as it must be."""

    def leave(self) -> None:
        """Look no more from now on."""
        self._following.cancel()

    async def edges(self, count: int) -> None:
        """Let `count` clock edges pass."""
        await ClockCycles(self.dut.clk, count)
        if self._following.done() and not self._following.cancelled():
            await self._following

    async def _send(self, pdu: bytes) -> bytes:
        """Send a request; return its frame when the last bit has left."""
        frame = framed(b"\1" + pdu)
        await self.source.write(frame)
        await self.source.wait()
        return frame

    async def _answer(self, frame: bytes) -> bytes:
        """Return the bytes that the board sends until it has been silent for two, CRC included."""
        timeout = Timer(self.patience * self.bench.period_ns, "ns")
        first = cocotb.start_soon(self.sink.wait())
        assert await First(first.complete, timeout) is not timeout, f"no answer to {frame.hex(' ')}"
        got = b""
        while not self.sink.empty():
            got += bytes(self.sink.read_nowait())
            await self.edges(20 * CLOCK_HZ // BAUD)
        return got
