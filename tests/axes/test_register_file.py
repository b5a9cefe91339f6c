"""The register file of several axes: every output at every clock against the model, at the clocks promised."""

import cocotb
import pytest

from axes.banked_world import World, make, map_of
from hardwall.hdl.axes.register_file import BankedFile
from hardwall.model.axes import register_file as model
from hardwall.model.axes.registers import BANK, is_shared
from hardwall.model.axis.register_file import Operation
from hardwall.model.axis.registers import CAPTURE, COUNTERS, LIVE, MAP, PULSES, TELEMETRY, WRITTEN, RegisterMap
from hardwall.model.register import Register
from hardwall.testing import SAMPLES, simulate
from stimuli.lengths import REACHING, some_of
from stimuli.restless import Restless
from stimuli.specs import spec

CHANGES = 0, *(1 << bit for bit in range(17))
"""Nothing, or a bit of an address: one more than 16, for a frame's last address may lie behind the last one."""


def in_bank(registers: tuple[Register, ...], bank: int) -> list[Register]:
    """Return those of live words or pulses that a bank has."""
    return [each for each in registers if bank == 0 or not is_shared(each)]


async def write_words(world: World) -> None:
    """Write a word and pulses of an axis, and finish."""
    random, registers = world.random, world.registers
    bank = random.randrange(world.design.banks)
    register = random.choice((*registers.words, *in_bank(registers.live, bank)))
    await world.write_word(register, bank, random.randint(register.low, register.high))
    for pulse in random.sample(in_bank(registers.pulses, bank), random.randrange(4)):
        await world.write_word(pulse, bank, int(random.random() < 0.7))
    await world.finish()
    world.pulsed |= {(world.twin.bank, name) for name in world.twin.pulses}


async def read_status(world: World) -> None:
    """Take a snapshot of an axis, and read half of its status, at any pace; or take none, for none is asked for."""
    random = world.random
    base, half = BANK * random.randrange(world.design.banks), random.randrange(2)
    if random.random() < 0.3:
        await world.clear()
        await world.check_read(base + random.choice(world.registers.words).address)
        await world.do(Operation.SNAPSHOT)
    await world.check_read(base + random.choice(world.registers.status).address, 1)
    await world.do(Operation.SNAPSHOT)
    for each in world.registers.status:
        if random.random() < 0.5:
            await world.edge()
        await world.read(base + each.address + half)
    world.snapshots += 1


async def check_anything(world: World) -> None:
    random = world.random
    first, last = random.randrange(2), random.randrange(2)
    if random.random() < 0.4:
        await world.check_read(world.place(), first, last)
    else:
        await world.check_write(world.place(), random.getrandbits(16), first, last)


async def count(world: World) -> None:
    random = world.random
    address = COUNTERS + random.randrange(8)
    if random.random() < 0.5:
        # None is read so often that it comes to its upper bits.
        await world.write(address, random.choice((0xFFFF, random.getrandbits(16))))
    world.twin.count(address)
    await world.do(Operation.COUNT, address)


async def clear(world: World) -> None:
    await world.clear()
    await world.edge()


ACTS = (check_anything, write_words, count, read_status, clear)


@cocotb.test()
async def follows_the_model_at_every_clock(dut):
    world = World(dut)
    cells = BANK * world.design.banks
    for waits in (world.component.boot_clocks + 20, 0):
        await world.begin(waits)
        for _ in range(max(SAMPLES, REACHING) // 600):
            await world.random.choices(ACTS, (0.35, 0.3, 0.05, 0.2, 0.1))[0](world)
        captured = (CAPTURE + at for at in (0, 1, world.registers.capture_registers - 1) if world.registers.capture)
        for address in (*range(cells), MAP, MAP + len(world.design.map_cells) - 1, *captured):
            await world.read(address)
    assert world.compared > max(SAMPLES, REACHING) // 10
    assert world.snapshots > 20
    banks = range(world.design.banks)
    assert world.pulsed == {(bank, each.name) for bank in banks for each in in_bank(world.registers.pulses, bank)}


@cocotb.test()
async def every_bit_of_every_word(dut):
    world = World(dut)
    await world.begin(0)
    banks, registers, given = world.design.banks, world.registers, 0
    restless = {word.name: Restless(word, world.draws) for word in (*registers.words, *registers.live)}
    for number in range(8):
        bank = number % banks
        for word in (*registers.words, *in_bank(registers.live, bank)):
            await world.write_word(word, bank, restless[word.name].next())
            given += len(world.twin.writes)
        for pulse in in_bank(registers.pulses, bank):
            await world.write_word(pulse, bank, 1)
        await world.finish()
        given += len(world.twin.writes)
    # Committed words go out at a commit, all but the preload's count; live ones at once, but for those of the host and
    # of the capture memory.
    shared = sum(map(is_shared, registers.live))
    assert given == 8 * (len(registers.words) - 1 + len(registers.live) - shared - 1)


@cocotb.test()
async def every_bound_of_every_word_in_the_last_bank(dut):
    world = World(dut)
    await world.begin(0)
    bank, outside = world.design.banks - 1, 0
    for register in (*world.registers.words, *world.registers.live, *world.registers.pulses):
        span = 16 * register.size
        tried = {register.low, register.high, register.low - 1, register.high + 1, 0, -1, 1, 1 << 16, -(1 << 16)}
        tried |= {(1 << span - 1) - 1, -(1 << span - 1), register.low ^ 1 << 16, register.high ^ 1 << 15}
        for value in {each & (1 << span) - 1 for each in tried}:
            await world.clear()
            for k in range(register.size):
                half = value >> 16 * (register.size - 1 - k) & 0xFFFF
                await world.check_write(BANK * bank + register.address + k, half, k == 0, k == register.size - 1)
            await world.edge()
            signed = value - (1 << span) if value >> span - 1 else value
            assert world.twin.outside == (not register.low <= signed <= register.high)
            assert world.twin.absent == (bank > 0 and is_shared(register))
            outside += world.twin.outside
    assert outside > 50


@cocotb.test()
async def every_bit_of_an_address(dut):
    """What is asked for is where something begins or ends, or at an address that differs from such a one in one bit."""
    world = World(dut)
    await world.begin(0)
    random, end, pulses, refused = world.random, BANK * world.design.banks, world.registers.pulses, 0
    places = [0, TELEMETRY, COUNTERS, PULSES, WRITTEN, LIVE, end - 1, end]
    places += [MAP - 1, MAP, MAP + len(world.design.map_cells) - 1, MAP + len(world.design.map_cells)]
    behind = CAPTURE + world.registers.capture_registers
    places += [CAPTURE, behind - 1, behind]
    for address in (place ^ change for place in places for change in CHANGES):
        first, last = random.randrange(2), random.randrange(2)
        await world.clear()
        await world.check_read(address, first, last)
        await world.clear()
        await world.check_write(address, 1, first, last)
    # What one pulse is refused for stays when others of the frame are not.
    for place in (BANK * bank + pulse.address for bank in range(world.design.banks) for pulse in pulses):
        for address in (place ^ change for change in CHANGES):
            await world.check_write(address, int(random.random() < 0.9))
            refused += world.twin.refused
            if random.random() < 0.5:
                await world.clear()
    assert refused


@pytest.mark.parametrize(("axes", "captures"), some_of([(1, 0), (3, 1)], 1))
def test_rtl(axes, captures):
    simulate(__file__, make, axes=axes, captures=captures)


def test_cells_after_a_reset():
    design = model.Design(map_of(3))
    file, registers = model.BankedFile(design), design.registers
    for bank in range(3):
        for register in registers.registers:
            halves = tuple(file.live[BANK * bank + register.address + k] for k in range(register.size))
            once = bank and (register.address < 0x20 or is_shared(register))
            assert register.from_registers(halves) == (0 if once else register.reset), register.name


def test_no_frame_writes_to_two_banks_or_reads_the_status_of_two():
    design = model.Design(map_of(3))
    most_written, most_read = 123, 125
    written = [address for address in range(3 * BANK) if design.writable(address)]
    runs = [address for address in written if address - 1 not in written]
    assert all(max(a for a in range(run, run + most_written) if a in written) // BANK == run // BANK for run in runs)
    status = [address for address in range(3 * BANK) if design.shows(address)]
    for address in range(3 * BANK):
        frame = {each // BANK for each in status if address <= each < address + most_read}
        assert len(frame) <= 1


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"^design must be a banked_file.Design, not 3$"):
        BankedFile(3)
    with pytest.raises(TypeError, match=r"^registers must be an AxesMap, not <"):
        model.Design(RegisterMap(spec("mhz")))
