"""The register file: every operation of RTL and twin alike, at the clocks promised, and every bound of every word."""

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.axis.register_file import RegisterFile
from hardwall.model.axis import register_file as model
from hardwall.model.axis.register_file import WITH_WORDS, Operation
from hardwall.model.axis.registers import CAPTURE, COUNTERS, EDGE_STAMPS, MAP, SPACE
from hardwall.testing import Bench, parameters, rng, simulate
from stimuli.lengths import some_of
from stimuli.restless import Restless
from stimuli.status import edge, show
from stimuli.supervised import CAPTURE_REGISTERS, supervised

CLOCKS = {
    Operation.CHECK_READ: 1,
    Operation.CHECK_WRITE: 4,
    Operation.READ: 2,
    Operation.WRITE: 3,
    Operation.COUNT: 3,
}


PLACES = 0, 0x60, 0xC0, MAP, CAPTURE, CAPTURE + CAPTURE_REGISTERS - 150, SPACE, SPACE + CAPTURE
"""Where there are registers or their end, and the same beyond the last address."""


def place(random: np.random.Generator) -> int:
    """Return an address, mostly near these."""
    near = random.choice(PLACES) + random.integers(0, 160)
    return int(random.choice((near, random.integers(0, 2 * SPACE)), p=(0.8, 0.2)))


def make(name: str) -> RegisterFile:
    return RegisterFile(model.Design(supervised(name)))


class Host:
    """A server beside a register file, and the twin."""

    def __init__(self, dut):
        self.dut, self.component, self.random = dut, make(**parameters()), rng()
        self.bench, self.design = Bench(dut, self.component), self.component.design
        self.registers, self.twin = self.design.registers, model.RegisterFile(self.design)

    async def do(self, operation: Operation, address: int = 0, value: int = 0, first: int = 0, last: int = 0) -> int:
        """Do an operation; return the clocks until it was done."""
        self.bench.drive(host__operation=operation, host__address=address, host__value=value)
        self.bench.drive(host__first=first, host__last=last, host__start=1)
        clocks = 0
        while True:
            await RisingEdge(self.dut.clk)
            if int(self.dut.host__done.value):
                break
            clocks += 1
            assert clocks < 4000, "the register file hangs"
        self.bench.drive(host__start=0)
        captured = operation is Operation.READ and address >> 15 & 1
        assert clocks == CLOCKS.get(operation, clocks) + captured, operation.name
        return clocks

    async def clear(self) -> None:
        self.bench.drive(host__clear=1)
        await RisingEdge(self.dut.clk)
        self.bench.drive(host__clear=0)
        await RisingEdge(self.dut.clk)
        self.twin.clear()

    def found(self) -> tuple[int, ...]:
        return tuple(int(getattr(self.dut, f"host__{name}").value) for name in ("absent", "outside", "refused"))

    def expected(self) -> tuple[int, ...]:
        return tuple(map(int, (self.twin.absent, self.twin.outside, self.twin.refused)))

    async def follow_status(self) -> None:
        """Show another status, take a snapshot of it, and read all of it."""
        status = self.registers.status
        now = {each.name: int(self.random.integers(each.format.min, each.format.max + 1)) for each in status}
        await show(self.dut, self.bench, self.registers, now)
        assert await self.do(Operation.SNAPSHOT) == self.component.snapshot_clocks
        self.twin.status = now
        self.twin.snapshot()
        for address in (each.address + k for each in status for k in range(each.size)):
            assert await self.read(address) == self.twin.read(address), hex(address)

    async def read(self, address: int) -> int:
        await self.do(Operation.READ, address)
        return int(self.dut.host__data.value)


@cocotb.test()
async def every_bound_of_every_word(dut):
    host = Host(dut)
    await host.bench.reset()
    most = host.component.boot_clocks + host.component.snapshot_clocks
    assert await host.do(Operation.SNAPSHOT) <= most
    for register in (*host.registers.words, *host.registers.live, *host.registers.pulses):
        span = 16 * register.size
        tried = {register.low, register.high, register.low - 1, register.high + 1, 0, -1, 1, 1 << 16, -(1 << 16)}
        tried |= {(1 << span - 1) - 1, -(1 << span - 1), register.low ^ 1 << 16, register.high ^ 1 << 15}
        for value in {each & (1 << span) - 1 for each in tried}:
            await host.clear()
            for k in range(register.size):
                half = value >> 16 * (register.size - 1 - k) & 0xFFFF
                first, last = k == 0, k == register.size - 1
                await host.do(Operation.CHECK_WRITE, register.address + k, half, first, last)
                host.twin.check_write(register.address + k, first, last, half)
            await RisingEdge(dut.clk)
            signed = value - (1 << span) if value >> span - 1 else value
            assert host.found() == host.expected() == (0, int(not register.low <= signed <= register.high), 0)


@cocotb.test()
async def random_operations(dut):
    host = Host(dut)
    random = host.random
    await host.bench.reset()
    words, pulses = (*host.registers.words, *host.registers.live), host.registers.pulses
    await host.do(Operation.SNAPSHOT)
    host.twin.snapshot()
    pulsed, before = [host.bench.monitor(pulse.name) for pulse in pulses], [0] * len(pulses)
    for _ in range(400):
        case, first, last = random.random(), int(random.integers(0, 2)), int(random.integers(0, 2))
        address = place(random)
        value = int(random.integers(0, 1 << 16))
        if case < 0.25:
            await host.do(Operation.CHECK_READ, address, 0, first, last)
            host.twin.check_read(address, first, last)
        elif case < 0.4:
            refused = [int(random.random() < 0.2) for _ in pulses]
            host.bench.drive(refuse=sum(bit << k for k, bit in enumerate(refused)))
            host.twin.refusing = frozenset(pulse.name for pulse, bit in zip(pulses, refused, strict=True) if bit)
            await host.do(Operation.CHECK_WRITE, address, value, first, last)
            host.twin.check_write(address, first, last, value)
        elif case < 0.7:
            register = random.choice((*pulses, *words))
            word = int(random.integers(register.low, register.high + 1))
            for k, half in enumerate(register.to_registers(word)):
                await host.do(Operation.WRITE, register.address + k, half)
                host.twin.write(register.address + k, half)
                for each in host.registers.live:
                    assert host.bench.reader(each.name)() == host.twin.active[each.name]
        elif case < 0.8:
            await host.do(Operation.COUNT, COUNTERS + value % 8)
            host.twin.count(COUNTERS + value % 8)
        elif case < 0.9:
            clocks = await host.do(Operation.FINISH)
            host.twin.finish()
            shifted = bool({*WITH_WORDS} & {*host.twin.pulses})
            assert clocks == 3 + host.component.shift_clocks * shifted
            ported = {name: host.bench.reader(name)() for name in host.twin.ports}
            await RisingEdge(dut.clk)
            seen = [len(monitor.clocks) for monitor in pulsed]
            assert [now - then for now, then in zip(seen, before, strict=True)] == [
                host.twin.pulses.count(pulse.name) > 0 for pulse in pulses
            ]
            before = seen
            assert host.twin.ports == ported
        else:
            await host.follow_status()
        await RisingEdge(dut.clk)
        assert host.found() == host.expected()
        if host.expected() != (0, 0, 0):
            await host.clear()
    for address in (*range(256), 0x4000, 0x4000 + len(host.design.map_cells) - 1):
        assert await host.read(address) == host.twin.read(address)


@cocotb.test()
async def a_bit_beside_an_address_is_another_address(dut):
    host = Host(dut)
    await host.bench.reset()
    await host.do(Operation.SNAPSHOT)
    host.twin.snapshot()
    registers = (*host.registers.words, *host.registers.live, *host.registers.pulses, *host.registers.status)
    places = {register.address + k for register in registers for k in range(register.size)}
    wide = (2 * SPACE - 1).bit_length()
    end = MAP + len(host.design.map_cells)
    for address in sorted({each ^ 1 << bit for each in places for bit in range(wide)} | {*range(end - 20, end + 20)}):
        await host.clear()
        await host.do(Operation.CHECK_READ, address, 0, 1, 1)
        host.twin.check_read(address, 1, 1)
        await RisingEdge(dut.clk)
        assert host.found() == host.expected(), hex(address)
        if not host.twin.absent:
            assert await host.read(address) == host.twin.read(address), hex(address)
        await host.clear()
        await host.do(Operation.CHECK_WRITE, address, 1, 1, 1)
        host.twin.check_write(address, 1, 1, 1)
        await RisingEdge(dut.clk)
        assert host.found() == host.expected(), hex(address)


@cocotb.test()
async def every_bit_of_every_word_and_of_the_capture_memory(dut):
    host = Host(dut)
    await host.bench.reset()
    await host.do(Operation.SNAPSHOT)
    words, live, pulses = host.registers.words, host.registers.live, host.registers.pulses
    values = {word.name: Restless(word, host.random) for word in (*words, *live)}
    committed = host.bench.monitor("commit", *(word.name for word in words))
    for number in range(4):
        drawn = {name: value.next() for name, value in values.items()}
        for word in (*words, *live):
            for k, half in enumerate(word.to_registers(drawn[word.name])):
                await host.do(Operation.WRITE, word.address + k, half)
        for pulse in pulses:
            await host.do(Operation.WRITE, pulse.address, 1)
        await host.do(Operation.FINISH)
        await RisingEdge(dut.clk)
        assert committed.rows[number:] == [tuple(drawn[word.name] for word in words)]
        assert {word.name: host.bench.reader(word.name)() for word in live} == {
            word.name: drawn[word.name] for word in live
        }
        for refuse in ((1 << len(pulses)) - 1, 0):
            host.bench.drive(refuse=refuse)
            for pulse in pulses:
                await host.clear()
                await host.do(Operation.CHECK_WRITE, pulse.address, 1, 1, 1)
                await RisingEdge(dut.clk)
                assert host.found() == (0, 0, int(refuse > 0)), pulse.name
        for done in (0, 1):
            host.bench.drive(capture_done=done)
            await host.clear()
            await host.do(Operation.CHECK_READ, CAPTURE, 0, 1, 1)
            await RisingEdge(dut.clk)
            assert host.found() == (0, 0, 1 - done)
            for data in (0x5AC3, 0xA53C):
                host.bench.drive(capture_data=data)
                assert await host.read(CAPTURE) == data * done


@cocotb.test()
async def a_snapshot_takes_every_turn_at_its_clock(dut):
    host, random = Host(dut), rng()
    await host.bench.reset()
    await host.do(Operation.SNAPSHOT)
    statuses, component = host.registers.status, host.component
    for _ in range(4):
        await RisingEdge(dut.clk)
        now, shown, kind = dict(host.twin.status), [], ""
        host.bench.drive(host__operation=Operation.SNAPSHOT, host__start=1)
        while not int(dut.host__done.value):
            now |= {r.name: int(random.integers(r.format.min, r.format.max + 1)) for r in statuses
                    if r.name not in EDGE_STAMPS}  # fmt: skip
            host.bench.drive(stepped=0, **{name: word for name, word in now.items() if name not in EDGE_STAMPS})
            if random.random() < 0.7:
                # No two edges of one kind follow one another.
                kind = str(random.choice([name for name in EDGE_STAMPS if name != kind]))
                stamped = edge(host.registers, kind, int(random.integers(0, host.registers[kind].high + 1)))
                host.bench.drive(**stamped)
                now |= {"stamp": stamped["stamp"], kind: (stamped["stamp"] - 1) % (host.registers[kind].high + 1)}
            shown.append(dict(now))
            await RisingEdge(dut.clk)
        host.bench.drive(host__start=0, stepped=0)
        assert len(shown) - 1 == component.snapshot_clocks
        host.twin.status = {name: shown[clock][name] for name, clock in component.taken_clocks.items()}
        host.twin.snapshot()
        host.twin.status = shown[-1]
        await RisingEdge(dut.clk)
        for register in statuses:
            halves = [await host.read(register.address + k) for k in range(2)]
            assert halves == host.twin.live[register.address : register.address + 2], register.name


@cocotb.test()
async def a_commit_is_done_when_the_axis_has_it(dut):
    host = Host(dut)
    await host.bench.reset()
    await host.do(Operation.SNAPSHOT)
    await host.do(Operation.WRITE, host.registers["commit"].address, 1)
    cocotb.start_soon(host.do(Operation.FINISH))
    await RisingEdge(dut.commit)
    await RisingEdge(dut.clk)
    host.bench.drive(commit_pending=1)
    await ClockCycles(dut.clk, 100)
    assert int(dut.host__done.value) == 0
    host.bench.drive(commit_pending=0)
    await ClockCycles(dut.clk, 3)
    host.bench.drive(host__start=0)


@pytest.mark.parametrize("name", some_of(["mhz", "wide"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", ["mhz", "wide"])
def test_a_snapshot_is_as_long_as_the_page_promises(name):
    component = make(name)
    assert max(component.taken_clocks.values()) < component.snapshot_clocks <= 1130


def test_the_book_holds_what_the_map_describes():
    design = model.Design(supervised("mhz"))
    file, registers = model.RegisterFile(design), design.registers
    for register in registers.registers:
        halves = tuple(file.live[register.address : register.address + register.size])
        assert register.from_registers(halves) == register.reset
    assert len(design.map_cells) * 2 >= len(registers.compressed)


def test_a_status_is_extended_by_its_sign():
    design = model.Design(supervised("mhz"))
    file = model.RegisterFile(design)
    status = {each.name: each.format.min if each.format.signed else each.format.max for each in design.registers.status}
    file.status = status
    file.snapshot()
    for each in design.registers.status:
        assert each.from_registers(tuple(file.live[each.address : each.address + 2])) == status[each.name]


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        RegisterFile(3)
    with pytest.raises(TypeError, match=r"registers must be a RegisterMap, not 3$"):
        model.Design(3)
