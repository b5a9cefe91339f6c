"""Line, server and register file as one component, and a host and an axis around it, with the twin beside them."""

import cocotb
from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out, connect
from cocotb.triggers import ClockCycles, First, RisingEdge, Timer

from hardwall.hdl.axis.register_file import RegisterFile
from hardwall.hdl.board.lead_out import lead_out
from hardwall.hdl.link.line import Line as HdlLine
from hardwall.hdl.link.server import Server
from hardwall.model.axis import register_file
from hardwall.model.link import server
from hardwall.model.link.line import Line, Verdict, framed
from hardwall.testing import Bench, parameters, rng
from stimuli.status import show
from stimuli.supervised import CAPTURE_MEMORY, captured, supervised

GAP = 30
"""Clocks of the line's gap: a few bytes."""
PATIENCE = 20_000


class Stack(wiring.Component):
    """Line, server and register file, with bytes at the ports, a capture memory, and the pulses side by side.

    What sends the answers is as slow as a transmitter: for `pause` clocks behind a byte it takes no other.
    """

    def __init__(self, name: str):
        self.design = register_file.Design(supervised(name))
        self.file = RegisterFile(self.design)
        own = dict(self.file.signature.members)
        for gone in ("host", "capture_address", "capture_data", "capture_done"):
            del own[gone]
        for pulse in self.design.registers.pulses:
            del own[pulse.name]
        super().__init__(
            {
                "byte": In(8),
                "arrived": In(1),
                "spoilt": In(1),
                "pause": In(3),
                "sent": Out(8),
                "sending": Out(1),
                "idle": Out(1),
                "pulses": Out(len(self.design.registers.pulses)),
                "pulsed": Out(1),
                "busy": In(1),
                **own,
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.line = line = HdlLine(GAP)
        m.submodules.server = under_test = Server(self.design)
        m.submodules.file = file = self.file
        connect(m, line.frames, under_test.frames)
        connect(m, under_test.file, file.host)
        place, waiting = Signal.like(file.capture_address), Signal.like(self.pause)
        pulses = Cat(getattr(file, pulse.name) for pulse in self.design.registers.pulses)
        m.d.sync += place.eq(file.capture_address)
        with m.If(self.sending):
            m.d.sync += waiting.eq(self.pause)
        with m.Elif(waiting != 0):
            m.d.sync += waiting.eq(waiting - 1)
        m.d.comb += [
            line.byte.eq(self.byte),
            line.arrived.eq(self.arrived),
            line.spoilt.eq(self.spoilt),
            line.sent.ready.eq(waiting == 0),
            self.sent.eq(line.sent.payload),
            self.sending.eq(line.sent.valid & line.sent.ready),
            self.idle.eq(~line.frames.ended & ~line.sent.valid),
            self.pulses.eq(pulses),
            self.pulsed.eq(pulses.any()),
            file.capture_data.eq(captured(place)),
            file.capture_done.eq(~self.busy),
        ]
        m.d.comb += lead_out(file, self, [name for name in self.signature.members if hasattr(file, name)])
        return m


class World:
    """A host and an axis around the stack, with the twin beside it."""

    def __init__(self, dut):
        component = Stack(**parameters())
        self.dut, self.bench, self.random = dut, Bench(dut, component), rng()
        self.registers = component.design.registers
        self.design = component.design
        self.line, self.server = Line(), server.Server(self.design)
        self.sent = self.bench.monitor("sending", "sent")
        self.pulsed = self.bench.monitor("pulsed", "pulses", *self.server.file.active)
        self.idle = self.bench.reader("idle")
        self.answers = 0
        cocotb.start_soon(self._axis())

    async def _axis(self) -> None:
        """Keep a commit waiting for some clocks, as the axis does until its sample."""
        commit = self.dut.pulses
        while True:
            await RisingEdge(self.dut.pulsed)
            await RisingEdge(self.dut.clk)
            if int(commit.value) & 1:
                self.bench.drive(commit_pending=1)
                await ClockCycles(self.dut.clk, 50)
                self.bench.drive(commit_pending=0)

    async def reset(self) -> None:
        await self.bench.reset()
        self.line, self.server.file = Line(), register_file.RegisterFile(self.design)
        self.server.file.capture = CAPTURE_MEMORY

    async def live(self) -> None:
        """Give every status, and the refused pulses, a random value."""
        self.server.file.status = {
            each.name: int(self.random.integers(each.format.min, each.format.max + 1)) for each in self.registers.status
        }
        refused = [int(self.random.random() < 0.1) for _ in self.registers.pulses]
        pairs = zip(self.registers.pulses, refused, strict=True)
        self.server.file.refusing = frozenset(pulse.name for pulse, bit in pairs if bit)
        # The capture memory cannot be read at times.
        busy = int(self.random.random() < 0.3)
        self.server.file.capture = None if busy else CAPTURE_MEMORY
        self.bench.drive(busy=busy, refuse=sum(bit << k for k, bit in enumerate(refused)))
        await show(self.dut, self.bench, self.registers, self.server.file.status)

    async def send(self, data: bytes, pace: int = 1, spoilt: int = -1, more: int = 0) -> bytes | None:
        """Send bytes, wait for what they cause, and compare it with the twin's; return the last answer.

        Args:
            data: the bytes.
            pace: clocks from a byte to the next.
            spoilt: the place of a byte that is not good.
            more: whether another byte follows a frame at once, which is an overrun.
        """
        answer = None
        for k, byte in enumerate(data):
            self.bench.drive(byte=byte, arrived=1, spoilt=k == spoilt)
            await RisingEdge(self.dut.clk)
            self.bench.drive(arrived=0)
            verdict = self.line.receive(byte, k == spoilt)
            if verdict is None:
                if pace > 1:
                    await ClockCycles(self.dut.clk, pace - 1)
            else:
                self.bench.drive(arrived=more)
                await RisingEdge(self.dut.clk)
                self.bench.drive(arrived=0)
                answer = await self.agree(verdict) or answer
                if more:
                    await self.agree(self.line.overrun())
        return answer

    async def gap(self) -> bytes | None:
        """Be silent for a gap, and compare what it causes."""
        verdict = self.line.gap()
        await ClockCycles(self.dut.clk, GAP + 1)
        return None if verdict is None else await self.agree(verdict)

    async def agree(self, verdict: Verdict) -> bytes | None:
        """Wait until the line listens again; compare answer, pulses and words with the twin's."""
        self.bench.drive(pause=2 * (self.answers % 4))
        await ClockCycles(self.dut.clk, 2)
        begun, pulsed = len(self.sent.rows), len(self.pulsed.rows)
        self.server.file.pulses = ()
        answer = self.server.take(verdict, bytes(self.line.frame))
        if not self.idle():
            came = RisingEdge(self.dut.idle)
            assert await First(came, Timer(PATIENCE * self.bench.period_ns, "ns")) is came, "the server hangs"
        await ClockCycles(self.dut.clk, 4)
        got = bytes(row[0] for row in self.sent.rows[begun:])
        assert got == (b"" if answer is None else framed(answer)), self.line.frame.hex(" ")
        pulses = sum(1 << k for k, p in enumerate(self.registers.pulses) if p.name in self.server.file.pulses)
        rows, file = self.pulsed.rows[pulsed:], self.server.file
        assert [row[0] for row in rows] == [pulses] * bool(pulses)
        for row in rows:
            assert dict(zip(file.active, row[1:], strict=True)).items() >= file.ports.items()
        self.answers += answer is not None
        return answer

    async def request(self, pdu: bytes) -> bytes:
        """Return the answer's function and data to a request to the unit."""
        answer = await self.send(framed(b"\1" + pdu))
        assert answer is not None
        return answer[1:]
