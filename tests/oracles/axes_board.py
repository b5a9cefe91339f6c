"""A board of several axes, a host on its line, and what its pins must be at every clock, by the model of the stage."""

import logging

import cocotb
from amaranth.hdl import Cat, Module, Shape, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, First, RisingEdge, Timer
from cocotbext.uart import UartSink, UartSource

from hardwall.hdl.axes_board import AxesBoard
from hardwall.hdl.lead_out import lead_out
from hardwall.hdl.supervised import LOOPS
from hardwall.model.axes import AxesSpec
from hardwall.model.axes_registers import BANK
from hardwall.model.drive import pdm
from hardwall.model.link import banked_file
from hardwall.model.link.line import Verdict, framed
from hardwall.testing import Bench
from hardwall.testing.packing import Packing
from stimuli import frames
from stimuli.specs import NARROW

from .banked_server import BankedServer

CLOCK_HZ, BAUD = 12_000_000, 3_000_000
OSCILLATOR_NS = 22
"""Where the clock's period is 10 ns."""
STARTING, PATIENCE = 100, 20_000
"""Clocks in which the oscillator has seen that the clock runs; clocks after which an answer is overdue."""
SHOWN = "magnitude", "negative", "drive_inverted", "alive"
"""What the axes inside give to stages and pins."""
PINS = "drive_pdm", "drive_sign", "alive", "outputs_enable"
"""What comes of it."""


class Watched(wiring.Component):
    """A board with its pins, and in one word what its axes let out and what comes of it.

    Attributes:
        board: the board.
        shown: how `SHOWN`, and `PINS` behind `pin_`, lie in `showing`.
    """

    def __init__(self, axes: int):
        fields = {**NARROW, "clock_hz": CLOCK_HZ}
        self.board = board = AxesBoard(AxesSpec(**fields, axes=axes, estimator="fdm"), BAUD)
        self._ports = {name: Value.cast(getattr(board.axes, name)) for name in SHOWN}
        self._ports |= {f"pin_{name}": getattr(board, name) for name in PINS}
        self.shown = Packing({name: Shape(len(port)) for name, port in self._ports.items()})
        super().__init__({**self.board.signature.members, "showing": Out(self.shown.width)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.board = self.board
        m.d.comb += lead_out(self.board, self, self.board.signature.members)
        m.d.comb += self.showing.eq(Cat(self._ports.values()))
        return m


class Host:
    """A host on the line, encoders that rest, and the pins of every axis, compared at every clock.

    Attributes:
        pulses: for every axis the clocks with a pulse so far.
        compared: the clocks at which pins were compared.
        server: the twin of the link.
    """

    def __init__(self, dut, axes: int):
        self.dut, self.component = dut, Watched(axes)
        self.board, self.bench = self.component.board, Bench(dut, self.component)
        self.registers = self.board.registers
        self.server = BankedServer(banked_file.Design(self.registers))
        self.loops, self.compared, self.pulses = dict.fromkeys(LOOPS, 1), 0, [0] * axes
        self._stage, self._states = pdm.Design(self.board.spec, pdm.USUAL), [pdm.START] * axes

    async def reset(self) -> None:
        await self.bench.reset()
        self.bench.drive(uart_rx=1, rst=1, **self.loops)
        Clock(self.dut.oscillator, OSCILLATOR_NS, "ns", impl="gpi").start()
        await ClockCycles(self.dut.clk, STARTING)
        assert int(self.dut.outputs_enable.value) == 0
        self.bench.drive(rst=0)
        bit_ns = self.bench.period_ns * CLOCK_HZ / BAUD
        self.source, self.sink = UartSource(self.dut.uart_rx, 1e9 / bit_ns), UartSink(self.dut.uart_tx, 1e9 / bit_ns)
        for end in (self.source, self.sink):
            end.log.setLevel(logging.WARNING)
        await ClockCycles(self.dut.clk, 3)
        self._following = cocotb.start_soon(self._follow())

    async def _follow(self) -> None:
        """Compare the pins at every clock edge with what the stages make of what the axes let out."""
        edge, width = RisingEdge(self.dut.clk), self._stage.magnitude.width
        mask, params, last, still = (1 << width) - 1, self._stage.params, -1, 0
        while True:
            await edge
            word = int(self.dut.showing.value)
            # Stages without a drive do nothing more once their last pulse is out.
            still = still + 1 if word == last else 0
            last = word
            if still > 2 and not word & self.component.shown.mask("magnitude"):
                self.compared += 1
                continue
            shown = self.component.shown.unpack(word)
            permitted = self.loops["drive_enable"] & self.loops["emergency_stop"]
            pins = [pdm.pins(self._stage, state, permitted) for state in self._states]
            wanted = {name: sum(pin[name] << axis for axis, pin in enumerate(pins)) for name in self._stage.pins}
            wanted |= {"alive": shown["alive"], "outputs_enable": 1}
            assert {name: shown[f"pin_{name}"] for name in PINS} == wanted, f"clock {self.compared}"
            signs = shown["negative"] ^ shown["drive_inverted"]
            for axis, state in enumerate(self._states):
                inputs = pdm.Inputs(shown["magnitude"] >> width * axis & mask, signs >> axis & 1)
                self._states[axis] = pdm.step(params, state, inputs)
                self.pulses[axis] += shown["pin_drive_pdm"] >> axis & 1
            self.compared += 1

    def leave(self) -> None:
        """Compare nothing from now on."""
        self._following.cancel()

    def change(self, **loops: int) -> None:
        """Open or close loops."""
        self.loops |= loops
        self.bench.drive(**loops)

    async def edges(self, count: int) -> None:
        """Let `count` clock edges pass."""
        await ClockCycles(self.dut.clk, count)
        if self._following.done():
            await self._following

    async def pulsing(self, clocks: int) -> list[bool]:
        """Return for every axis whether there are pulses in the next clocks."""
        before = list(self.pulses)
        await self.edges(clocks)
        return [now > then for now, then in zip(self.pulses, before, strict=True)]

    async def request(self, pdu: bytes, shows: bool = False) -> bytes:
        """Return the answer without unit and CRC; it must be the twin's, unless it `shows` status."""
        frame = framed(b"\1" + pdu)
        await self.source.write(frame)
        await self.source.wait()
        answer = await self._answer(frame)
        expected = framed(self.server.take(Verdict.REQUEST, frame))
        assert len(answer) == len(expected) if shows else answer == expected
        return answer[1:-2]

    async def _answer(self, frame: bytes) -> bytes:
        """Return the bytes that the board sends until it has been silent for two bytes, CRC included."""
        timeout = Timer(PATIENCE * self.bench.period_ns, "ns")
        first = cocotb.start_soon(self.sink.wait())
        assert await First(first.complete, timeout) is not timeout, f"no answer to {frame.hex(' ')}"
        got = b""
        while not self.sink.empty():
            got += bytes(self.sink.read_nowait())
            await self.edges(20 * CLOCK_HZ // BAUD)
        return got

    async def look(self, axis: int, first: str = "drive", last: str = "driven") -> dict[str, int]:
        """Return the status of an axis, from one register to another, and let the twin refuse what the board does."""
        begin, end = self.registers[first].address, self.registers[last].address + 2
        data = (await self.request(frames.read(BANK * axis + begin, end - begin), shows=True))[2:]
        cells = [int.from_bytes(data[k : k + 2], "big") for k in range(0, len(data), 2)]
        read = [r for r in self.registers.status if begin <= r.address < end]
        status = {r.name: r.from_registers(tuple(cells[r.address - begin : r.address - begin + 2])) for r in read}
        refused = {"arm": not status["ready"], "preload": status["state"] == 1}
        self.server.file.refused_of[axis] = frozenset(name for name, is_so in refused.items() if is_so)
        return status

    async def write(self, axis: int, **values: int) -> bytes:
        """Write words of an axis that lie side by side, or `commit` and the first words, in one frame."""
        chosen = sorted((r for r in self.registers.registers if r.name in values), key=lambda r: r.address)
        cells = [half for register in chosen for half in register.to_registers(values[register.name])]
        assert chosen[-1].address + chosen[-1].size - chosen[0].address == len(cells), "not side by side"
        return await self.request(frames.write(BANK * axis + chosen[0].address, cells))
