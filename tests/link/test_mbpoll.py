"""The link and a Modbus client that knows nothing of it: `mbpoll`, on a pseudo-terminal that carries its bytes.

It is a program of the system, not of the project: the test is skipped where it is not installed.
"""

import logging
import os
import re
import shutil
import subprocess
import tty

import cocotb
import pytest
from cocotb.triggers import ClockCycles, Timer
from cocotbext.uart import UartSink, UartSource

from hardwall.hdl.link.link import Link
from hardwall.testing import Bench, parameters, simulate
from stimuli.supervised import supervised

BAUD = 921_600
"""The fastest that it knows."""
PAUSE_NS = 10_000
"""The simulator's time between two looks at the terminal."""


def make(name: str) -> Link:
    return Link(supervised(name), BAUD)


class Terminal:
    """A serial port for a program, whose other end is the UART in the simulator."""

    def __init__(self, dut, bit_ns: float):
        self.source, self.sink = UartSource(dut.uart_rx, baud=1e9 / bit_ns), UartSink(dut.uart_tx, baud=1e9 / bit_ns)
        for end in (self.source, self.sink):
            end.log.setLevel(logging.WARNING)
        self.ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(self.ours, False)
        self.name = os.ttyname(theirs)

    async def carry(self) -> None:
        """Carry bytes both ways for ever."""
        while True:
            try:
                await self.source.write(os.read(self.ours, 256))
            except BlockingIOError:
                await Timer(PAUSE_NS, "ns")
            if not self.sink.empty():
                os.write(self.ours, bytes(self.sink.read_nowait()))


@cocotb.test()
async def it_reads_and_writes(dut):
    link = make(**parameters())
    registers, bench = link.registers, Bench(dut, link)
    await bench.reset()
    commits = bench.monitor("commit", "wall_stiffness")
    bench.drive(uart_rx=1, count=-5, driven=3)
    await ClockCycles(dut.clk, 4)
    terminal = Terminal(dut, bench.period_ns * registers.spec.clock_hz / BAUD)
    await Timer(bench.period_ns * (link.gap_clocks + 100), "ns")
    carrying = cocotb.start_soon(terminal.carry())

    async def mbpoll(*arguments: str) -> tuple[int, str]:
        """Return how a call ends, and what it prints; the value to write comes last, or an empty text."""
        line = ("-m", "rtu", "-b", str(BAUD), "-P", "none", "-a", "1", "-0", "-B", "-1", "-o", "10")
        command = ("mbpoll", *line, *arguments[:-1], terminal.name, arguments[-1])
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        with subprocess.Popen([*filter(None, command)], text=True, **pipes) as process:
            while process.poll() is None:
                await Timer(PAUSE_NS, "ns")
            return process.returncode, process.stdout.read()

    async def read(name: str, count: int = 1) -> list[int]:
        code, printed = await mbpoll("-t", "4:int", "-r", str(registers[name].address), "-c", str(count), "")
        assert code == 0, printed
        return [int(value) for value in re.findall(r"^\[\d+\]:\s+(-?\d+)$", printed, re.MULTILINE)]

    async def write(name: str, value: int, kind: str = "4:int") -> tuple[int, str]:
        return await mbpoll("-t", kind, "-r", str(registers[name].address), str(value))

    high, low = await read("identity_high", 2)
    assert f"{high & 0xFFFFFFFF:08x}{low & 0xFFFFFFFF:08x}" == registers.identity
    assert await read("count") == [-5]
    assert await read("driven") == [3]
    stiffness = registers["wall_stiffness"].high // 3
    code, printed = await write("wall_stiffness", stiffness)
    assert code == 0, printed
    assert await read("wall_stiffness") == [stiffness]
    assert await read("active_wall_stiffness") == [0]
    code, printed = await write("commit", 1, "4")
    assert code == 0, printed
    assert await read("active_wall_stiffness") == [stiffness]
    code, printed = await write("encoder_invert", 2)
    assert code
    assert "Illegal data value" in printed
    carrying.cancel()
    assert commits.rows == [(stiffness,)]


@pytest.mark.skipif(not shutil.which("mbpoll"), reason="mbpoll is not installed")
def test_rtl():
    simulate(__file__, make, name="paper")
