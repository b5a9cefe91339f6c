"""The server: whole frames through line, server and register file, RTL and twin alike, whatever arrives."""

import cocotb
import pytest
from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out, connect
from cocotb.triggers import ClockCycles, First, RisingEdge, Timer

from hardwall.hdl.lead_out import lead_out
from hardwall.hdl.link import line as hdl_line
from hardwall.hdl.link.register_file import RegisterFile
from hardwall.hdl.link.server import Server
from hardwall.model.link import register_file, server
from hardwall.model.link.line import Line, Verdict, framed
from hardwall.model.registers import COUNTERS, MAP, WRITTEN
from hardwall.testing import Bench, parameters, rng, simulate
from stimuli import frames
from stimuli.status import show
from stimuli.supervised import captured, supervised

GAP = 30
"""Clocks of the line's gap: a few bytes."""
PATIENCE = 20_000
EXCEPTIONS = [
    (b"\5\0\0\xff\0", 1),
    (bytes([43, 13, 1, 0]), 1),
    (bytes([8, 0, 1, 0, 0]), 1),
    (frames.read(0, 0), 3),
    (frames.read(0, 126), 3),
    (frames.read(1, 2), 2),
    (frames.read(0, 1), 2),
    (frames.read(0x100, 2), 2),
    (frames.read(0xFFFF, 2), 2),
    (frames.read(0xF000, 4), 2),
    (frames.write_one(0x80, 0), 2),
    (frames.write(0x20, [0, 0]), 2),
    (frames.write_one(0x7F, 2), 3),
    (frames.write(0x84, [0, 2]), 3),
    (b"\x10" + frames.words(0x84, 2) + b"\2" + frames.words(0), 3),
    (frames.write(0x84, [0, 2, 0]), 2),
    (bytes([8, 0, 11, 0, 1]), 3),
    (bytes([43, 14, 0, 0]), 3),
    (bytes([43, 14, 5, 0]), 3),
    (bytes([43, 14, 4, 3]), 2),
    (frames.write_and_read(0x80, [0, 0], 0, 0), 3),
    (frames.write_and_read(0x20, [0, 0], 0, 2), 2),
]
"""A request for every reason of an exception of the server's own, and its code."""


class Stack(wiring.Component):
    """Line, server and register file, with bytes at the ports, a capture memory, and the pulses side by side."""

    def __init__(self, name: str):
        self.design = register_file.Design(supervised(name))
        self.file = RegisterFile(self.design)
        own = dict(self.file.signature.members)
        for gone in ("host", "capture_address", "capture_data"):
            del own[gone]
        for pulse in self.design.registers.pulses:
            del own[pulse.name]
        super().__init__(
            {
                "byte": In(8),
                "arrived": In(1),
                "spoilt": In(1),
                "sent": Out(8),
                "sending": Out(1),
                "idle": Out(1),
                "pulses": Out(len(self.design.registers.pulses)),
                "pulsed": Out(1),
                **own,
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.line = line = hdl_line.Line(GAP)
        m.submodules.server = under_test = Server(self.design)
        m.submodules.file = file = self.file
        connect(m, line.frames, under_test.frames)
        connect(m, under_test.file, file.host)
        place = Signal.like(file.capture_address)
        pulses = Cat(getattr(file, pulse.name) for pulse in self.design.registers.pulses)
        m.d.sync += place.eq(file.capture_address)
        m.d.comb += [
            line.byte.eq(self.byte),
            line.arrived.eq(self.arrived),
            line.spoilt.eq(self.spoilt),
            line.sent.ready.eq(1),
            self.sent.eq(line.sent.payload),
            self.sending.eq(line.sent.valid),
            self.idle.eq(~line.frames.ended & ~line.sent.valid),
            self.pulses.eq(pulses),
            self.pulsed.eq(pulses.any()),
            file.capture_data.eq(captured(place)),
        ]
        m.d.comb += lead_out(file, self, [name for name in self.signature.members if hasattr(file, name)])
        return m


def make(name: str) -> Stack:
    return Stack(name)


class World:
    """A host and an axis around the stack, with the twin beside it."""

    def __init__(self, dut):
        component = make(**parameters())
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
        self.server.file.capture = [captured(k) for k in range(self.registers.capture_registers)]

    async def live(self) -> None:
        """Give every status, and the refused pulses, a random value."""
        self.server.file.status = {
            each.name: int(self.random.integers(each.format.min, each.format.max + 1)) for each in self.registers.status
        }
        refused = [int(self.random.random() < 0.1) for _ in self.registers.pulses]
        pairs = zip(self.registers.pulses, refused, strict=True)
        self.server.file.refusing = frozenset(pulse.name for pulse, bit in pairs if bit)
        self.bench.drive(refuse=sum(bit << k for k, bit in enumerate(refused)))
        await show(self.dut, self.bench, self.registers, self.server.file.status)

    async def send(self, data: bytes, pace: int = 1, spoilt: int = -1) -> bytes | None:
        """Send bytes, wait for what they cause, and compare it with the twin's; return the last answer."""
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
                answer = await self.agree(verdict) or answer
        return answer

    async def gap(self) -> bytes | None:
        """Be silent for a gap, and compare what it causes."""
        verdict = self.line.gap()
        await ClockCycles(self.dut.clk, GAP + 1)
        return None if verdict is None else await self.agree(verdict)

    async def agree(self, verdict: Verdict) -> bytes | None:
        """Wait until the line listens again; compare answer, pulses and words with the twin's."""
        await ClockCycles(self.dut.clk, 3)
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

    def random_write(self) -> tuple[int, list[int]]:
        """Return the first address and the values of a write that is mostly right."""
        random, words, values = self.random, (*self.registers.words, *self.registers.live), []
        first = int(random.integers(0, len(words)))
        for word in words[first : first + int(random.integers(1, 6))]:
            value = int(random.integers(word.low, word.high + 1))
            edge = random.random()
            if edge < 0.3:
                value = int(random.choice((word.low, word.high, 0)))
            elif edge < 0.36:
                beyond = word.low - 1, word.high + 1, word.high + (1 << 16), -(1 << 31), (1 << 31) - 1
                value = int(random.choice(beyond))
            values += [value >> 16 & 0xFFFF, value & 0xFFFF]
        address = words[first].address
        if first == 0 and random.random() < 0.7:
            # Pulses before the words, in the same frame.
            pulses = random.integers(0, 2, random.integers(1, len(self.registers.pulses) + 1)).tolist()
            address, values = address - len(pulses), [*pulses, *values]
        if random.random() < 0.05:
            address += int(random.integers(-3, 4))
        if random.random() < 0.05:
            values.pop()
        return address, values or [0]

    def random_read(self) -> tuple[int, int]:
        """Return the first address and the number of registers of a read that is mostly right."""
        random, end = self.random, MAP + len(self.design.map_cells)
        address, count = int(random.choice((0, 0x20, 0x60, 0x80, 0xC0))), int(random.integers(1, 60)) * 2
        case = random.random()
        if case < 0.2:
            address, count = int(random.integers(MAP, end + 2)), int(random.integers(1, 20))
        elif case < 0.3:
            address, count = 0x8000 + int(random.integers(0, 310)), int(random.integers(1, 20))
        elif case < 0.4:
            address, count = int(random.integers(0, 1 << 16)), int(random.integers(0, 130))
        elif case < 0.45:
            count = int(random.choice((0, 125, 126, 65535)))
        return address, count

    def random_pdu(self) -> bytes:
        """Return a function and its data."""
        random = self.random
        (address, values), (source, count) = self.random_write(), self.random_read()
        mangled = bytearray(frames.write(address, values))
        mangled[int(random.integers(3, 6))] ^= 1 << random.integers(0, 8)
        cases = [
            frames.read(source, count),
            frames.read(source, count, 4),
            frames.write(address, values),
            frames.write(address, values),
            frames.write_one(int(random.integers(0x70, 0x82)), int(random.choice((0, 1, 1, 1, 2)))),
            frames.write_and_read(address, values, source, count),
            bytes([8]) + frames.words(random.integers(0, 21), random.choice((0, 0, 0, 5))),
            bytes([43, random.choice((14, 14, 14, 13)), random.integers(0, 6), random.integers(0, 5)]),
            bytes(mangled),
        ]
        return cases[random.integers(0, len(cases))]


@cocotb.test()
async def requests_are_answered_as_the_twin_does(dut):
    world = World(dut)
    await world.reset()
    seen = set()
    for _ in range(200):
        if world.random.random() < 0.3:
            await world.live()
        answer = await world.send(framed(b"\1" + world.random_pdu()))
        if answer is None:
            await world.gap()
        else:
            seen.add(tuple(answer[1:3]) if answer[1] & 0x80 else answer[1])
    assert {3, 4, 6, 8, 16, 23, 43} <= seen
    assert {(16 | 0x80, 2), (16 | 0x80, 3)} <= seen


@cocotb.test()
async def every_exception(dut):
    world = World(dut)
    await world.reset()
    for pdu, code in EXCEPTIONS:
        answer = await world.send(framed(b"\1" + pdu)) or await world.gap()
        assert answer == bytes([1, pdu[0] | 0x80, code])
    world.bench.drive(refuse=-1)
    world.server.file.refusing = frozenset(pulse.name for pulse in world.registers.pulses)
    assert await world.request(frames.write(world.registers["commit"].address, [1, 0, 7])) == b"\x90\4"
    assert (await world.request(frames.read(WRITTEN, 2)))[2:] == frames.words(0, 0)


@cocotb.test()
async def whatever_arrives_is_judged_as_the_twin_does(dut):
    world = World(dut)
    await world.reset()
    for frame in frames.requests(world.random, 120):
        data, case = bytearray(frame), world.random.random()
        if case < 0.2:
            data[world.random.integers(0, len(data))] ^= 1 << world.random.integers(0, 8)
        elif case < 0.3:
            del data[world.random.integers(0, len(data)) :]
        elif case < 0.4:
            data[:0] = world.random.bytes(world.random.integers(1, 5))
        elif case < 0.45:
            data = bytearray(b"\1\x66" + world.random.bytes(270))
        await world.send(bytes(data), spoilt=3 if case > 0.97 else -1)
        if case < 0.5:
            await world.gap()
    counters = [world.server.file.live[COUNTERS + k] for k in range(8)]
    assert min(counters[server.MESSAGES :]) > 0
    answer = await world.request(frames.read(COUNTERS, 8))
    assert answer[2:] == frames.words(*counters[:3], counters[3] + 1, *counters[4:6], counters[6] + 1, counters[7])


@cocotb.test()
async def no_flipped_bit_is_accepted(dut):
    world = World(dut)
    await world.reset()
    frame = framed(b"\1" + frames.write(world.registers["wall_stiffness"].address - 1, [0, 0, 77]))
    whole = framed(b"\1" + frames.write(world.registers["commit"].address, [1, 0, 5]))
    for data in (frame, whole):
        for flipped in frames.flips(data):
            assert await world.send(flipped) is None
            assert await world.gap() is None
    assert world.answers == 0
    assert world.pulsed.rows == []


@cocotb.test()
async def a_reset_in_the_middle_of_a_frame_forgets_it(dut):
    world = World(dut)
    await world.reset()
    stiffness = world.registers["wall_stiffness"].address
    for cut in (1, 4, 11, 13):
        await world.request(frames.write(stiffness, [0, 9]))
        await world.request(frames.write_one(world.registers["commit"].address, 1))
        frame = framed(b"\1" + frames.write(stiffness, [0, 7]))
        for byte in frame[:cut]:
            world.bench.drive(byte=byte, arrived=1)
            await RisingEdge(dut.clk)
        world.bench.drive(arrived=0)
        await ClockCycles(dut.clk, cut)
        dut.rst.value = 1
        await ClockCycles(dut.clk, 1)
        dut.rst.value = 0
        world.line, world.server.file = Line(), register_file.RegisterFile(world.design)
        answer = await world.request(frames.read(stiffness, 2))
        assert answer == b"\3\4" + frames.words(0, 0)
        active = world.registers["active_wall_stiffness"].address
        assert await world.request(frames.read(active, 2)) == b"\3\4" + frames.words(0, 0)


@cocotb.test()
async def written_words_wait_for_their_commit(dut):
    world = World(dut)
    await world.reset()
    registers = world.registers
    word, active, commit = (registers[name].address for name in ("wall_position", "active_wall_position", "commit"))
    assert (await world.request(frames.write(word, [0xFFFF, 0xFFFE])))[0] == 16
    assert (await world.request(frames.read(word, 2)))[2:] == frames.words(0xFFFF, 0xFFFE)
    assert (await world.request(frames.read(active, 2)))[2:] == frames.words(0, 0)
    assert (await world.request(frames.write_one(commit, 1)))[0] == 6
    assert (await world.request(frames.read(active, 2)))[2:] == frames.words(0xFFFF, 0xFFFE)
    ((_, *words),) = world.pulsed.rows
    assert dict(zip(world.server.file.active, words, strict=True))["wall_position"] == -2


@cocotb.test()
async def the_largest_request_is_answered_in_time(dut):
    world = World(dut)
    await world.reset()
    await world.request(frames.read(0, 2))
    pulses, values = world.registers.pulses, []
    for word in world.registers.words:
        values += word.to_registers(word.reset)
    pdu = frames.write_and_read(pulses[-1].address, [0] * (len(pulses) - 1) + [1, *values], 0, 124)
    begun, asked = len(world.sent.rows), world.bench.clock_number()
    await world.request(pdu)
    written, component = len(pulses) + len(values), RegisterFile(world.design)
    most = 30 + 20 * written + 3 * 124 + component.snapshot_clocks + component.shift_clocks
    # The commit waits 50 clocks for its sample.
    assert world.sent.clocks[begun] - asked - len(pdu) <= most + 50 < 6000


@pytest.mark.parametrize("name", ["mhz"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def answers(*pdus: bytes) -> list[bytes]:
    """Return the twin's answers, without unit and CRC."""
    under_test = server.Server(register_file.Design(supervised("mhz")))
    return [under_test.take(Verdict.REQUEST, framed(b"\1" + pdu))[1:] for pdu in pdus]


@pytest.mark.parametrize(("pdu", "code"), EXCEPTIONS)
def test_every_exception(pdu, code):
    assert answers(pdu) == [bytes([pdu[0] | 0x80, code])]


def test_the_device_may_refuse_a_pulse():
    under_test = server.Server(register_file.Design(supervised("mhz")))
    under_test.file.refusing = frozenset({"arm"})
    arm = supervised("mhz")["arm"].address
    assert under_test.take(Verdict.REQUEST, framed(b"\1" + frames.write_one(arm, 1))) == b"\1\x86\4"
    assert under_test.take(Verdict.REQUEST, framed(b"\1" + frames.write_one(arm, 0)))[1] == 6
    assert under_test.file.pulses == ()


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Server(3)
