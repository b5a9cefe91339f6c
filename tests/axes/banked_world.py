"""A server and axes around the register file of several axes, which show anything at every clock, and its twin."""

import random as plain
from collections import deque

from cocotb.triggers import RisingEdge

from hardwall.hdl.axes.register_file import BankedFile
from hardwall.hdl.link.axis_status import OF_CAPTURE, WITH_RECORD
from hardwall.model.axes import register_file as model
from hardwall.model.axes.registers import BANK, AxesMap, is_shared
from hardwall.model.axis.register_file import Operation
from hardwall.model.axis.registers import ACTIVE, CAPTURE, COUNTERS, EDGE_STAMPS, LIVE, MAP, PULSES, WRITTEN
from hardwall.model.axis.supervisor import ARMED
from hardwall.model.register import VALUE_BITS, Register
from hardwall.testing import SEED, Bench, Recorded, parameters, rng
from stimuli.supervised import CAPTURE_REGISTERS
from stimuli.supervised_axes_world import slow

PATIENCE = 20_000
SPARE = 5
"""Clocks of a rota that are added, so that it has as many as a capture memory needs."""
CLOCKS = {
    Operation.CHECK_READ: 1,
    Operation.CHECK_WRITE: 4,
    Operation.READ: 2,
    Operation.WRITE: 3,
    Operation.COUNT: 3,
}
HOST = "start", "operation", "address", "first", "last", "value", "clear"
ANSWERS = "done", "data", "absent", "outside", "refused"
ADDRESS = "capture_address"
"""This output follows the host at once."""
WORD = "word_write", "word_axis", "word_number", "word_value"


def map_of(axes: int, captures: int = 1) -> AxesMap:
    """Return the registers of axes with a rota that has time for a capture memory, with one if wanted."""
    return AxesMap(slow(axes, "fdm", SPARE), CAPTURE_REGISTERS * captures)


def make(axes: int, captures: int = 1) -> Recorded:
    return Recorded(BankedFile(model.Design(map_of(axes, captures))))


class World:
    """A server and axes around a register file, which show anything at every clock, and the twin.

    Attributes:
        wanted: every output that is no answer, as it must be at the next edge.
        coming: what these become, by the number of the edge.
        compared: how many edges all of them were compared at.
        stamps: for every axis the stamps of its last edges, by name.
    """

    def __init__(self, dut):
        self.recorded, self.random = make(**parameters()), plain.Random(SEED)
        self.draws = rng()
        self.component = self.recorded.component
        self.design, self.bench = self.component.design, Bench(dut, self.recorded)
        self.registers, self.pulses = self.design.registers, [each.name for each in self.design.registers.pulses]
        self.records, self._edge = self.recorded.records, RisingEdge(dut.clk)
        self._done = self.records.bit("done")
        own = [name for name in self.recorded.outputs if name not in (*ANSWERS, ADDRESS)]
        self._mask, self._own = sum(map(self.records.mask, own)), own
        self._free: int | None = None
        self.clock = self.compared = self.snapshots = 0
        self.pulsed: set[tuple[int, str]] = set()
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
        self.wanted = dict.fromkeys(self._own, 0) | self.twin.active
        self._wanted_bits, self._momentary = self.records.pack(self.wanted), {}
        self.coming: dict[int, dict[str, int]] = {}
        self.begun = self.clock
        self.stamps = [dict.fromkeys(EDGE_STAMPS, 0) for _ in range(self.design.banks)]
        self._stamp_before = 0
        # What the capture memory has shown at the last clocks of a READ but the first.
        self._captured: deque[int] = deque(maxlen=CLOCKS[Operation.READ] + 1)

    def _shows(self) -> tuple[int, dict[str, int]]:
        """Return all inputs in a word, with anything as what the axes show; and what of it is not anything."""
        random, banks = self.random, self.design.banks
        given = {
            **self.host,
            "strobe": random.random() < 0.3,
            "strobe_axis": random.randrange(banks),
            "record_valid": random.random() < 0.3,
            "record_axis": random.randrange(banks),
            "turn_valid": random.random() < 0.3,
            "turn_axis": random.randrange(banks),
            "turn_state": random.randrange(3),
            "turn_ready": random.randrange(2),
            "word_ready": self.ready,
            **({"capture_done": self.twin.capture is not None} if self.registers.capture else {}),
        }
        stimuli = self.recorded.stimuli
        if self._free is None:
            self._free = ~sum(stimuli.mask(name) for name in given)
        return random.getrandbits(stimuli.width) & self._free | stimuli.pack(given), given

    async def edge(self) -> int:
        """Go to the next edge; return what was seen there, in a word, after the outputs were compared."""
        bits, given = self._shows()
        self.bench.dut.stimulus.value = bits
        await self._edge
        seen = int(self.bench.dut.record.value)
        if self._momentary or self.clock in self.coming:
            self._momentary = self.coming.pop(self.clock, {})
            self.wanted |= dict.fromkeys(("word_write", *self.pulses), 0) | self._momentary
            self._wanted_bits = self.records.pack(self.wanted)
        if self.registers.capture:
            address = self.records.pack({ADDRESS: self.host["address"]})
            assert seen & self.records.mask(ADDRESS) == address, f"edge {self.clock}"
        # The outputs are taken apart only to be told: most clocks have nothing new.
        assert seen & self._mask == self._wanted_bits, f"edge {self.clock}: {self._unlike(seen)}"
        if not self.host["start"]:
            answers = [bool(seen & self.records.mask(name)) for name in ANSWERS if name != "data"]
            assert answers == [False, *self.found()], f"edge {self.clock}"
        self.clock, self.compared = self.clock + 1, self.compared + 1
        self._step(bits)
        if given["turn_valid"]:
            refused = dict.fromkeys(("preload", "origin_shift"), given["turn_state"] == ARMED)
            refused |= {"arm": not given["turn_ready"]}
            self.twin.refused_of[given["turn_axis"]] = frozenset(name for name, is_so in refused.items() if is_so)
        return seen

    def _step(self, bits: int) -> None:
        """Remember the stamps of edges, which are those of the clock before, and what the capture memory shows."""
        stimuli = self.recorded.stimuli
        stepped, kinds, stamp = (stimuli.column(name, [bits])[0] for name in ("stepped", "edge_kind", "stamp"))
        for axis, stamps in enumerate(self.stamps):
            if stepped >> axis & 1:
                stamps[EDGE_STAMPS[kinds >> 2 * axis & 3]] = self._stamp_before
        self._stamp_before = stamp
        if self.registers.capture:
            self._captured.append(stimuli.column("capture_data", [bits])[0])

    def _unlike(self, seen: int) -> str:
        """Return the outputs that differ from what they must be."""
        found = self.records.unpack(seen)
        return ", ".join(f"{k} is {found[k]}, not {word}" for k, word in self.wanted.items() if found[k] != word)

    def found(self) -> list[bool]:
        """Return what the checks must have found."""
        return [self.twin.absent, self.twin.outside, self.twin.refused]

    async def do(self, operation: Operation, address: int = 0, value: int = 0, first: int = 0, last: int = 0) -> tuple:
        """Do an operation; return the register that was given, and the clocks until it was done."""
        self.host |= {"operation": operation, "address": address, "value": value, "first": first, "last": last}
        self.host["start"], begun, waits = 1, self.clock, None
        twin = self.twin
        asked = twin.asked if operation is Operation.SNAPSHOT else None
        taken: dict[str, int] = {}
        comes = None
        while True:
            word = await self.edge()
            clocks = self.clock - 1 - begun
            if word & self._done:
                break
            assert clocks < PATIENCE, "the register file hangs"
            # A snapshot begins with the first strobe behind its start, and ends with the first turn behind the record
            # that comes for it.
            if asked is not None and clocks and waits is None:
                seen = self.records.unpack(word)
                if comes is None and seen["strobe"] and seen["strobe_axis"] == asked:
                    taken, comes = dict(self.stamps[asked]), clocks + self.design.axes.spec.latency + 1
                elif "stamp" not in taken and self._shown(seen, "record", asked) and comes and clocks >= comes:
                    taken |= self._with_record(seen, asked)
                elif "stamp" in taken and self._shown(seen, "turn", asked):
                    taken |= self._with_turn(seen, asked)
                    waits = clocks + 1
        self.host["start"] = 0
        if operation is Operation.SNAPSHOT:
            assert clocks == (1 if asked is None else waits)
            if asked is not None:
                twin.statuses[asked] |= taken
            twin.snapshot()
        elif operation is not Operation.FINISH:
            captured = operation is Operation.READ and self._in_capture(address)
            assert clocks == CLOCKS[operation] + captured, operation.name
        return self.records.unpack(word)["data"], clocks

    @staticmethod
    def _shown(seen: dict[str, int], what: str, axis: int) -> bool:
        """Return whether a record, or a turn, of an axis is shown."""
        return bool(seen[f"{what}_valid"]) and seen[f"{what}_axis"] == axis

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
            **{name: seen[name] for name in ("live", *OF_CAPTURE) if name in seen},
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
        if self.random.random() < 0.3:
            # A capture is done, or another one begins.
            self.twin.capture = None if self.twin.capture is not None else ()
        self.twin.check_read(address, bool(first), bool(last))
        await self.do(Operation.CHECK_READ, address, 0, first, last)

    async def write(self, address: int, value: int) -> None:
        """Write a register; a live word goes out with its lower half."""
        twin = self.twin
        twin.writes.clear()
        twin.write(address, value)
        for written in twin.writes:
            self._gives(self.clock + 2, written)
        self._comes(self.clock + 2, **twin.active)
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
            self._comes(behind + 14, **{name: 1 << self.place_of(name) for name in twin.pulses})
        _, clocks = await self.do(Operation.FINISH)
        assert clocks == (self.component.finish_clocks[commits] if twin.pulses else 1)
        return twin.pulses

    def place_of(self, pulse: str) -> int:
        """Return the bit of a pulse of the last frame's bank: one of all axes has a single bit."""
        return 0 if is_shared(self.registers[pulse]) else self.twin.bank

    def _in_capture(self, address: int) -> bool:
        """Return whether an address is one of the capture memory."""
        return CAPTURE <= address < CAPTURE + self.registers.capture_registers

    async def read(self, address: int) -> None:
        data, _ = await self.do(Operation.READ, address)
        if self._in_capture(address):
            assert data == (0 if self.twin.capture is None else self._captured[0]), hex(address)
        else:
            assert data == self.twin.read(address), hex(address)

    async def clear(self) -> None:
        """Forget what was found, in one clock, which shows it no more."""
        self.host["clear"] = 1
        await self.edge()
        self.host["clear"] = 0
        self.twin.clear()

    def place(self) -> int:
        """Return an address, mostly near those where there is something."""
        random = self.random
        near = random.choice((0, 0x20, 0x60, PULSES + 8, WRITTEN, ACTIVE, LIVE, BANK - 4)) + random.randrange(24)
        end = BANK * self.design.banks
        far = [end, MAP - 20, MAP, MAP + len(self.design.map_cells) - 20, CAPTURE, 0x10000]
        far = random.choice((*far, CAPTURE + self.registers.capture_registers - 20))
        if random.random() < 0.15:
            return far + random.randrange(40)
        return BANK * random.randrange(self.design.banks) + near

    async def begin(self, waits: int) -> None:
        """Reset, and begin an operation as soon as it may: its end waits for the cells, and for axes that take words.

        Args:
            waits: clocks for which no words can be written.
        """
        await self.reset()
        self.ready = 0
        self.host |= {"start": 1, "operation": Operation.COUNT, "address": COUNTERS}
        for _ in range(waits):
            assert not await self.edge() & self._done
        self.ready = 1
        while not await self.edge() & self._done:
            pass
        self.host["start"] = 0
        self.twin.count(COUNTERS)
        booted = max(self.component.boot_clocks, waits + 1)
        assert self.clock - 1 - self.begun == booted + CLOCKS[Operation.COUNT]
