"""The register file of several axes: every output at every clock against the model, at the clocks promised."""

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.link.banked_file import BankedFile
from hardwall.model.axes_registers import BANK, SHARED, AxesMap
from hardwall.model.link import banked_file as model
from hardwall.model.link.register_file import Operation
from hardwall.model.register import VALUE_BITS, Register
from hardwall.model.registers import ACTIVE, COUNTERS, LIVE, MAP, PULSES, WRITTEN, RegisterMap
from hardwall.model.supervisor import ARMED
from hardwall.testing import SAMPLES, Bench, Recorded, parameters, rng, simulate
from stimuli.specs import spec
from stimuli.supervised_axes_world import slow

CLOCKS = {
    Operation.CHECK_READ: 1,
    Operation.CHECK_WRITE: 4,
    Operation.READ: 2,
    Operation.WRITE: 3,
    Operation.COUNT: 3,
}
HOST = "start", "operation", "address", "first", "last", "value", "clear"
ANSWERS = "done", "data", "absent", "outside", "refused"
WITH_RECORD = "illegal_count", "index_count", "index_armed", "index_latched"
WORD = "word_write", "word_axis", "word_number", "word_value"


def make(axes: int) -> Recorded:
    return Recorded(BankedFile(model.Design(AxesMap(slow(axes, "fdm")))))


class World:
    """A server and axes around a register file, which show anything at every clock, and the twin.

    Attributes:
        wanted: every output that is no answer, as it must be at the next edge.
        coming: what these become, by the number of the edge.
        compared: how many edges all of them were compared at.
    """

    def __init__(self, dut):
        self.recorded, self.random = make(**parameters()), rng()
        self.component = self.recorded.component
        self.design, self.bench = self.component.design, Bench(dut, self.recorded)
        self.registers, self.pulses = self.design.registers, [each.name for each in self.design.registers.pulses]
        self.shown = [name for name in self.recorded.stimuli.shapes if name not in HOST]
        self.clock = self.compared = 0
        self.ready = 1

    async def reset(self) -> None:
        """Reset the register file, whatever it does, and take a new twin."""
        if not self.compared:
            await self.bench.reset()
        dut = self.bench.dut
        dut.stimulus.value, dut.rst.value = 0, 1
        await RisingEdge(dut.clk)
        dut.rst.value = 0
        self.twin = model.BankedFile(self.design)
        self.host = dict.fromkeys(HOST, 0)
        own = (name for name in self.recorded.outputs if name not in ANSWERS)
        self.wanted = dict.fromkeys(own, 0) | {name: getattr(self.twin, name) for name in SHARED}
        self.coming: dict[int, dict[str, int]] = {}
        self.begun = self.clock

    def _shows(self) -> dict[str, int]:
        """Return what the axes show now."""
        random, shapes = self.random, self.recorded.stimuli.shapes
        words = {name: int.from_bytes(random.bytes(12), "little") & (1 << shapes[name].width) - 1
                 for name in self.shown}  # fmt: skip
        for stream in ("record", "turn"):
            words[f"{stream}_valid"] = int(random.random() < 0.3)
            words[f"{stream}_axis"] = int(random.integers(0, self.design.banks))
        words |= {"turn_state": int(random.integers(0, 3)), "word_ready": self.ready}
        return words

    async def edge(self) -> dict[str, int]:
        """Go to the next edge; return what was seen there, after the outputs were compared."""
        given = {**self._shows(), **self.host}
        self.bench.dut.stimulus.value = self.recorded.stimuli.pack(given)
        await RisingEdge(self.bench.dut.clk)
        seen = self.recorded.records.unpack(int(self.bench.dut.record.value))
        self.wanted |= dict.fromkeys(("word_write", *self.pulses), 0) | self.coming.pop(self.clock, {})
        assert {name: seen[name] for name in self.wanted} == self.wanted, f"edge {self.clock}"
        if not self.host["start"]:
            assert (seen["done"], *(seen[name] for name in ANSWERS[2:])) == (0, *self.found()), f"edge {self.clock}"
        self.clock, self.compared = self.clock + 1, self.compared + 1
        if seen["turn_valid"]:
            refused = {"arm": not seen["turn_ready"], "preload": seen["turn_state"] == ARMED}
            self.twin.refused_of[seen["turn_axis"]] = frozenset(name for name, is_so in refused.items() if is_so)
        return seen

    def found(self) -> tuple[int, ...]:
        """Return what the checks must have found."""
        return tuple(map(int, (self.twin.absent, self.twin.outside, self.twin.refused)))

    async def do(self, operation: Operation, address: int = 0, value: int = 0, first: int = 0, last: int = 0) -> dict:
        """Do an operation; return what was seen when it was done."""
        self.host |= {"operation": operation, "address": address, "value": value, "first": first, "last": last}
        self.host["start"], begun, waits = 1, self.clock, None
        twin, asked = self.twin, self.twin.asked if operation is Operation.SNAPSHOT else None
        taken: dict[str, int] = {}
        while True:
            seen = await self.edge()
            clocks = self.clock - 1 - begun
            if seen["done"]:
                break
            assert clocks < 60_000, "the register file hangs"
            # A snapshot begins with the first record behind its start, and ends with the first turn behind that.
            if asked is not None and clocks and waits is None:
                if not taken and seen["record_valid"] and seen["record_axis"] == asked:
                    taken |= self._with_record(seen, asked)
                elif taken and seen["turn_valid"] and seen["turn_axis"] == asked:
                    taken |= self._with_turn(seen, asked)
                    waits = clocks + 1
        self.host["start"] = 0
        if operation is Operation.SNAPSHOT:
            assert clocks == (1 if asked is None else waits)
            if asked is not None:
                twin.statuses[asked] |= taken
            twin.snapshot()
        elif operation is not Operation.FINISH:
            assert clocks == CLOCKS[operation], operation.name
        return seen | {"clocks": clocks}

    def _of(self, seen: dict[str, int], name: str, axis: int, register: str = "") -> int:
        """Return the word of an axis of an output that has one for each."""
        width = self.recorded.stimuli.shapes[name].width // self.design.banks
        return self._signed(register or name, seen[name] >> width * axis & (1 << width) - 1)

    def _signed(self, register: str, word: int) -> int:
        """Return bits as the word of a status."""
        fmt = self.registers[register].format
        word &= (1 << fmt.width) - 1
        return word - (1 << fmt.width) if fmt.signed and word >> fmt.width - 1 else word

    def _with_record(self, seen: dict[str, int], axis: int) -> dict[str, int]:
        """Return the status that is taken with a record."""
        taken = {name: seen[f"record_{name}"] for name in ("count", "wall_force", "drive", "flags")}
        taken |= {name: self._of(seen, name, axis) for name in WITH_RECORD}
        more = self.design.registers.spec.design.estimator.velocity.width - self.registers["velocity"].format.width
        return {name: self._signed(name, word) for name, word in taken.items()} | {
            "velocity": seen["record_velocity"] >> more,
            "stamp": seen["stamp"],
        }

    def _with_turn(self, seen: dict[str, int], axis: int) -> dict[str, int]:
        """Return the status that is taken with a turn."""
        named = ("state", "ready", "latched", "first", "first_stamp", "a_channel_idle")
        width = self.recorded.stimuli.shapes["magnitude"].width // self.design.banks
        magnitude = seen["magnitude"] >> width * axis & (1 << width) - 1
        # As large as the largest force, which no axis exceeds.
        driven = self._signed("driven", -magnitude if seen["negative"] >> axis & 1 else magnitude)
        counts = {f"counts_{k}": seen["turn_counts"] >> VALUE_BITS * k & (1 << VALUE_BITS) - 1 for k in range(2)}
        return {
            **{name: seen[f"turn_{name}"] for name in named},
            **{name: word for name, word in counts.items() if any(each.name == name for each in self.registers.status)},
            "referenced": self._of(seen, "referenced", axis),
            "live": seen["live"],
            "driven": driven,
        }

    def _comes(self, clock: int, **outputs: int) -> None:
        self.coming.setdefault(clock, {}).update(outputs)

    def _gives(self, clock: int, written: tuple[int, int, int]) -> None:
        """Let a word go out at a clock."""
        axis, number, word = written
        bits = word & (1 << self.recorded.records.shapes["word_value"].width) - 1
        self._comes(clock, **dict(zip(WORD, (1, axis, number, bits), strict=True)))

    async def check_write(self, address: int, value: int, first: int = 0, last: int = 0) -> None:
        self.twin.check_write(address, bool(first), bool(last), value)
        await self.do(Operation.CHECK_WRITE, address, value, first, last)

    async def check_read(self, address: int, first: int = 0, last: int = 0) -> None:
        self.twin.check_read(address, bool(first), bool(last))
        await self.do(Operation.CHECK_READ, address, 0, first, last)

    async def write(self, address: int, value: int) -> None:
        """Write a register; a live word goes out with its lower half."""
        twin = self.twin
        twin.writes.clear()
        twin.write(address, value)
        for written in twin.writes:
            self._gives(self.clock + 2, written)
        self._comes(self.clock + 2, **{name: getattr(twin, name) for name in SHARED})
        await self.do(Operation.WRITE, address, value)

    async def write_word(self, register: Register, bank: int, word: int) -> None:
        for k, half in enumerate(register.to_registers(word)):
            await self.write(BANK * bank + register.address + k, half)

    async def finish(self) -> tuple[str, ...]:
        """Finish a frame; return the pulses that went out."""
        twin, begun = self.twin, self.clock
        twin.writes.clear()
        twin.finish()
        commits, written = "commit" in twin.pulses, iter(twin.writes)
        words = self.registers.words if commits else ()
        for k, word in enumerate(words):
            if word.address + 1 in self.design.numbers:
                self._gives(begun + 7 + 6 * k, next(written))
        assert next(written, None) is None
        behind = begun + 6 * len(words)
        if twin.pulses:
            self._comes(behind + 7, preload_count=twin.preload_count)
            self._comes(behind + 13, acknowledged=twin.acknowledged)
            self._comes(behind + 14, **dict.fromkeys(twin.pulses, 1 << twin.bank))
        seen = await self.do(Operation.FINISH)
        assert seen["clocks"] == (self.component.finish_clocks[commits] if twin.pulses else 1)
        return twin.pulses

    async def read(self, address: int) -> None:
        seen = await self.do(Operation.READ, address)
        assert seen["data"] == self.twin.read(address), hex(address)

    async def clear(self) -> None:
        """Forget what was found, in one clock, which shows it no more."""
        self.host["clear"] = 1
        await self.edge()
        self.host["clear"] = 0
        self.twin.clear()

    def place(self) -> int:
        """Return an address, mostly near those where there is something."""
        random = self.random
        near = random.choice((0, 0x20, 0x60, PULSES + 8, WRITTEN, ACTIVE, LIVE, BANK - 4)) + random.integers(0, 24)
        end = BANK * self.design.banks
        far = random.choice((end, MAP - 20, MAP, MAP + len(self.design.map_cells) - 20, 0x8000, 0x10000))
        chosen = random.choice((BANK * random.integers(0, self.design.banks) + near, far + random.integers(0, 40)),
                               p=(0.85, 0.15))  # fmt: skip
        return int(chosen)


@cocotb.test()
async def follows_the_model_at_every_clock(dut):
    world = World(dut)
    random, pulsed, shown = world.random, set(), 0
    live, words = world.registers.live, world.registers.words
    for turn in range(2):
        await world.reset()
        # The first operation waits for the cells, and for axes that take words.
        world.ready = 0
        for _ in range(20 + turn * world.component.boot_clocks):
            await world.edge()
        world.ready = 1
        while not (await world.edge())["done"]:
            world.host |= {"start": 1, "operation": Operation.SNAPSHOT}
        assert world.clock - world.begun in (world.component.boot_clocks + 2, world.component.boot_clocks + 23)
        world.host["start"] = 0
        for _ in range(SAMPLES // 400):
            case, value = random.random(), int(random.integers(0, 1 << 16))
            first, last = (int(random.integers(0, 2)) for _ in range(2))
            if case < 0.15:
                await world.check_read(world.place(), first, last)
            elif case < 0.35:
                await world.check_write(world.place(), value, first, last)
            elif case < 0.65:
                bank = int(random.integers(0, world.design.banks))
                register = random.choice((*words, *live) if bank == 0 else (*words, *live[1:4], *live[5:]))
                await world.write_word(register, bank, int(random.integers(register.low, register.high + 1)))
                for pulse in random.choice(world.registers.pulses, int(random.integers(0, 3)), replace=False):
                    await world.write_word(pulse, bank, int(random.random() < 0.7))
                pulsed |= {(world.twin.bank, name) for name in await world.finish()}
            elif case < 0.7:
                address = COUNTERS + value % 8
                world.twin.count(address)
                await world.do(Operation.COUNT, address)
            elif case < 0.9:
                bank = int(random.integers(0, world.design.banks))
                status = random.choice(world.registers.status)
                await world.check_read(BANK * bank + status.address, 1)
                await world.do(Operation.SNAPSHOT)
                for each in world.registers.status:
                    await world.read(BANK * bank + each.address + value % 2)
                shown += 1
            else:
                await world.clear()
                await world.edge()
        for address in (*range(BANK * world.design.banks), MAP, MAP + len(world.design.map_cells) - 1):
            await world.read(address)
    assert world.compared > 10_000
    assert shown > 30
    assert pulsed == {(bank, name) for bank in range(world.design.banks) for name in world.pulses}


@cocotb.test()
async def every_bound_of_every_word_in_the_last_bank(dut):
    world = World(dut)
    await world.reset()
    bank, outside = world.design.banks - 1, 0
    await world.do(Operation.SNAPSHOT) if False else None
    host = world.host
    host |= {"start": 1, "operation": Operation.SNAPSHOT}
    while not (await world.edge())["done"]:
        pass
    host["start"] = 0
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
            assert world.twin.absent == (bank > 0 and register.name in SHARED)
            outside += world.twin.outside
    assert outside > 50


@pytest.mark.parametrize("axes", [1, 3])
def test_rtl(axes):
    simulate(__file__, make, axes=axes)


def test_cells_after_a_reset():
    design = model.Design(AxesMap(slow(3, "fdm")))
    file, registers = model.BankedFile(design), design.registers
    for bank in range(3):
        for register in registers.registers:
            halves = tuple(file.live[BANK * bank + register.address + k] for k in range(register.size))
            once = bank and (register.address < 0x20 or register.name in SHARED)
            assert register.from_registers(halves) == (0 if once else register.reset), register.name


def test_no_frame_writes_to_two_banks_or_reads_the_status_of_two():
    design = model.Design(AxesMap(slow(3, "fdm")))
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
