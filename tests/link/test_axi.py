"""The AXI4-Lite subordinate with its register file: transfers of a bus master that others wrote, RTL and twin alike."""

import logging
from itertools import cycle

import cocotb
import pytest
from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import ClockCycles, RisingEdge
from cocotbext.axi import AxiLiteBus, AxiLiteMaster
from cocotbext.axi.axil_channels import AxiLiteAWTransaction, AxiLiteWTransaction

from hardwall.hdl.board.lead_out import lead_out
from hardwall.hdl.link.axi_link import AxiLink
from hardwall.model.axis import register_file
from hardwall.model.axis.registers import (
    ACTIVE,
    CAPTURE,
    COUNTERS,
    LIVE,
    MAP,
    PULSES,
    SPACE,
    SUPERVISOR,
    TELEMETRY,
    WRITTEN,
)
from hardwall.model.link import axi
from hardwall.model.link.axi import Response
from hardwall.testing import SAMPLES, Bench, parameters, rng, simulate
from stimuli.lengths import WHOLE
from stimuli.restless import Restless
from stimuli.status import show
from stimuli.supervised import CAPTURE_MEMORY, captured, supervised

TRANSFERS = 300 + SAMPLES // 80
PENDING = 50
"""Clocks that a commit waits for its sample."""
IN_A_WHILE = 20
"""Clocks in which the subordinate would have answered."""


class Device(wiring.Component):
    """The link with a capture memory, and its pulses side by side."""

    def __init__(self, name: str):
        self.link = AxiLink(supervised(name))
        ports = dict(self.link.signature.members)
        for gone in (
            "capture_address",
            "capture_data",
            "capture_done",
            *(pulse.name for pulse in self.link.registers.pulses),
        ):
            del ports[gone]
        super().__init__({**ports, "pulses": Out(len(self.link.registers.pulses)), "pulsed": Out(1), "busy": In(1)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.link = link = self.link
        place = Signal.like(link.capture_address)
        m.d.sync += place.eq(link.capture_address)
        m.d.comb += [
            link.capture_data.eq(captured(place)),
            link.capture_done.eq(~self.busy),
            self.pulses.eq(Cat(getattr(link, pulse.name) for pulse in link.registers.pulses)),
            self.pulsed.eq(self.pulses.any()),
        ]
        m.d.comb += lead_out(link, self, [name for name in self.signature.members if hasattr(link, name)])
        return m


def make(name: str) -> Device:
    return Device(name)


class World:
    """A bus master and an axis around the link, with the twin beside it."""

    def __init__(self, dut):
        component = make(**parameters())
        self.dut, self.bench, self.random = dut, Bench(dut, component), rng()
        self.registers = component.link.registers
        self.twin = axi.Subordinate(register_file.Design(self.registers))
        self.twin.file.capture = CAPTURE_MEMORY
        self.pulsed = self.bench.monitor("pulsed", "pulses", *self.twin.file.active)
        self.taken = [self.bench.monitor(f"axi_{way}ready", f"axi_{way}valid") for way in ("aw", "w", "ar")]
        self.seen = set()

    async def reset(self) -> None:
        await self.bench.reset()
        self.master = AxiLiteMaster(AxiLiteBus.from_prefix(self.dut, "axi"), self.dut.clk)
        for part in (self.master.write_if, self.master.read_if):
            part.log.setLevel(logging.WARNING)
        # The master takes no answer at some clocks.
        waits = cycle(self.random.random(997) < 0.3)
        self.master.write_if.b_channel.set_pause_generator(waits)
        self.master.read_if.r_channel.set_pause_generator(waits)
        cocotb.start_soon(self._axis())

    async def _axis(self) -> None:
        """Keep a commit waiting for some clocks, as the axis does until its sample."""
        while True:
            await RisingEdge(self.dut.pulsed)
            await RisingEdge(self.dut.clk)
            if int(self.dut.pulses.value) & 1:
                self.bench.drive(commit_pending=1)
                await ClockCycles(self.dut.clk, PENDING)
                self.bench.drive(commit_pending=0)

    async def live(self) -> None:
        """Give every status, and the refused pulses, a random value."""
        status = {r.name: int(self.random.integers(r.format.min, r.format.max + 1)) for r in self.registers.status}
        refused = [int(self.random.random() < 0.2) for _ in self.registers.pulses]
        self.twin.file.status = status
        pairs = zip(self.registers.pulses, refused, strict=True)
        self.twin.file.refusing = frozenset(pulse.name for pulse, bit in pairs if bit)
        # The capture memory cannot be read at times.
        busy = int(self.random.random() < 0.3)
        self.twin.file.capture = None if busy else CAPTURE_MEMORY
        self.bench.drive(busy=busy, refuse=sum(bit << k for k, bit in enumerate(refused)))
        await show(self.dut, self.bench, self.registers, status)

    async def stamp(self, stamp: int) -> None:
        """Give the stamps another value."""
        self.twin.file.status = self.twin.file.status | {"stamp": stamp, "stamp_a_rise": stamp + 1}
        await show(self.dut, self.bench, self.registers, self.twin.file.status)

    async def restart(self) -> None:
        """Reset the link; the bus has no transfer."""
        self.bench.drive(rst=1)
        await ClockCycles(self.dut.clk, 2)
        self.bench.drive(rst=0)
        status, capture = self.twin.file.status, self.twin.file.capture
        self.twin = axi.Subordinate(register_file.Design(self.registers))
        self.twin.file.status, self.twin.file.capture = status, capture
        await self.live()

    async def write(self, address: int, data: bytes) -> Response:
        """Write bytes within a word at a byte address, and compare what it causes with the twin's."""
        begun, channels, place = len(self.pulsed.rows), self.master.write_if, 8 * (address % 4)
        mask = (1 << 8 * len(data)) - 1 << place
        # What is not written is anything.
        word = int(self.random.integers(0, 1 << 32)) & ~mask | int.from_bytes(data, "little") << place
        strobes = ((1 << len(data)) - 1) << address % 4
        expected = self.twin.write(address, word, strobes)
        await channels.aw_channel.send(AxiLiteAWTransaction(awaddr=address))
        await channels.w_channel.send(AxiLiteWTransaction(wdata=word, wstrb=strobes))
        got = Response(int((await channels.b_channel.recv()).bresp))
        assert got == expected, f"{address:#x} {data.hex()}"
        pulses = sum(1 << k for k, p in enumerate(self.registers.pulses) if p.name in self.twin.pulses)
        await ClockCycles(self.dut.clk, 2)
        rows, file = self.pulsed.rows[begun:], self.twin.file
        assert [row[0] for row in rows] == [pulses] * bool(pulses)
        for row in rows:
            assert dict(zip(file.active, row[1:], strict=True)).items() >= file.ports.items()
        self.seen.add(("write", got))
        return got

    async def write_word(self, address: int, value: int) -> Response:
        return await self.write(2 * address, (value & 0xFFFFFFFF).to_bytes(4, "little"))

    async def read(self, address: int, whole: bool = False) -> int:
        """Read the word with a register, whole or from any byte of it on, and compare it with the twin's."""
        first = 0 if whole else int(self.random.integers(0, 4))
        place = 2 * address & ~3 | first
        response, expected = self.twin.read(place)
        got = await self.master.read(place, 4 - first)
        assert (Response(got.resp), got.data) == (response, expected.to_bytes(4, "little")[first:]), f"{place:#x}"
        self.seen.add(("read", response))
        return expected


@cocotb.test()
async def random_transfers(dut):
    world = World(dut)
    await world.reset()
    random, registers = world.random, world.registers
    words = (*registers.words, *registers.live)
    for _ in range(TRANSFERS):
        await world.live()
        act = random.random()
        if act < 0.35:
            word = words[int(random.integers(0, len(words)))]
            value = int(random.choice((word.low, word.high, word.low - 1, word.high + 1, random.integers(0, 1 << 32))))
            await world.write_word(word.address, value)
        elif act < 0.5:
            # One pulse, or two side by side.
            place = int(random.integers(PULSES + 8, WRITTEN))
            value = int(random.integers(0, 3) if random.random() < 0.1 else 1)
            await world.write(2 * (place ^ 1), value.to_bytes(2, "little"))
            await world.write_word(place & ~1, int(random.choice((0, 1, 1 << 16, 1 << 16 | 1))))
        elif act < 0.6:
            address = 2 * int(random.choice((random.integers(0, 256), random.integers(0, 1 << 16))))
            first = int(random.integers(0, 4))
            await world.write(address & ~3 | first, random.bytes(int(random.integers(1, 5 - first))))
        else:
            blocks = (0, TELEMETRY, SUPERVISOR, COUNTERS, WRITTEN, ACTIVE, LIVE, MAP, CAPTURE, 0x3000, SPACE - 2)
            blocks += tuple(1 << bit for bit in range(1, 16))
            begin = int(random.choice(blocks)) + 2 * int(random.integers(0, 8))
            for word in range(int(random.integers(1, 5))):
                if random.random() < 0.3:
                    await world.live()
                await world.read((begin + 2 * word) % SPACE)
    assert world.seen == {(way, end) for way in ("read", "write") for end in Response}
    # What is taken was there.
    assert [{row for (row,) in taken.rows} for taken in world.taken] == [{1}] * len(world.taken)


@cocotb.test()
async def a_write_of_no_byte_does_nothing(dut):
    world = World(dut)
    await world.reset()
    channels, limit = world.master.write_if, world.registers["supervisor_force_limit"]
    await world.write_word(limit.address, 5)
    for address in (2 * limit.address, 2 * world.registers["commit"].address & ~3, 0):
        await channels.aw_channel.send(AxiLiteAWTransaction(awaddr=address))
        await channels.w_channel.send(AxiLiteWTransaction(wdata=1 << 16 | 1, wstrb=0))
        assert Response(int((await channels.b_channel.recv()).bresp)) == world.twin.write(address, 1 << 16 | 1, 0)
    assert await world.read(limit.address) == 5
    assert world.pulsed.rows == []


@cocotb.test()
async def a_write_waits_for_its_other_half(dut):
    world = World(dut)
    await world.reset()
    channels, place = world.master.write_if, 2 * world.registers["supervisor_force_limit"].address
    for value, first in ((5, "address"), (7, "data")):
        halves = {
            "address": (channels.aw_channel, AxiLiteAWTransaction(awaddr=place)),
            "data": (channels.w_channel, AxiLiteWTransaction(wdata=value, wstrb=0b1111)),
        }
        channel, half = halves.pop(first)
        await channel.send(half)
        await ClockCycles(dut.clk, IN_A_WHILE)
        assert channels.b_channel.empty()
        for channel, half in halves.values():
            await channel.send(half)
        assert Response(int((await channels.b_channel.recv()).bresp)) == world.twin.write(place, value, 0b1111)
        assert await world.read(place // 2) == value


@cocotb.test()
async def a_commit_is_answered_when_the_axis_has_it(dut):
    world = World(dut)
    await world.reset()
    await world.write(2 * (world.registers["commit"].address ^ 1), b"\1\0")
    (pulsed,) = world.pulsed.clocks
    assert world.bench.clock_number() - pulsed > PENDING


@cocotb.test()
async def every_bit_of_every_status_is_read(dut):
    world = World(dut)
    await world.reset()
    restless = {status.name: Restless(status, world.random) for status in world.registers.status}
    for _ in range(6):
        world.twin.file.status = {name: values.next() for name, values in restless.items()}
        await show(dut, world.bench, world.registers, world.twin.file.status)
        for status in world.registers.status:
            await world.read(status.address, whole=True)


@cocotb.test()
async def words_read_in_order_are_of_one_snapshot(dut):
    world = World(dut)
    await world.reset()
    place = world.registers["stamp"].address
    # Two stamps differ in their lowest byte, which not every read gives that is not whole.
    for seen in (5, 7):
        await world.stamp(seen)
        if seen == 5:
            assert await world.read(place, whole=True) == 5
    assert await world.read(place + 2, whole=True) == 6
    assert await world.read(place, whole=True) == 7
    # They are so however long the bus is at rest between them.
    for clocks in range(1, 5):
        seen = 100 * clocks
        await world.stamp(seen)
        assert await world.read(place, whole=True) == seen
        await world.stamp(seen + 50)
        await ClockCycles(dut.clk, clocks)
        assert await world.read(place + 2, whole=True) == seen + 1
    # A word that a single bit tells from the one before it is not the one before it.
    for bit in range(1, SPACE.bit_length() - 1):
        await world.stamp(10 + bit)
        await world.read(place - 2 ^ 1 << bit, whole=True)
        assert await world.read(place, whole=True) == 10 + bit


@cocotb.test()
async def no_word_is_the_next_after_a_reset(dut):
    world = World(dut)
    await world.reset()
    await world.live()
    for place in range(TELEMETRY, COUNTERS, 2 if WHOLE else 12):
        await world.read(place - 2)
        await world.restart()
        await world.read(place)
        await world.read(place)


@pytest.mark.parametrize("name", ["mhz"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_a_word_is_a_value_with_its_upper_half_first():
    twin = axi.Subordinate(register_file.Design(supervised("mhz")))
    limit = supervised("mhz")["supervisor_force_limit"]
    assert twin.write(2 * limit.address, 12345, 0b1111) == Response.OKAY
    assert twin.file.active["supervisor_force_limit"] == 12345
    assert twin.read(2 * limit.address) == (Response.OKAY, 12345)
    # Half of a value cannot be written.
    assert twin.write(2 * limit.address, 1, 0b0011) == Response.DECERR


def test_wrong_registers_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        AxiLink(3)
