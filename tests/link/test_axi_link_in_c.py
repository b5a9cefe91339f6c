"""The page's example in C arms an axis of RTL: every load and store of the compiled code is a transfer on the bus."""

import ctypes
import re
import subprocess
from pathlib import Path

import cocotb
import pytest
from cocotb.task import bridge, resume
from cocotb.triggers import ClockCycles
from link.processor import make, started

from hardwall.model import register_header
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED, names
from hardwall.testing import parameters, simulate
from stimuli.specs import spec

ROOT = Path(__file__).absolute().parents[2]
EXAMPLE = ROOT / "docs/examples/axi_wall.c"
# What the example's loads and stores are made of here: two functions that Python puts into the library.
HOOKS = """
#include <stdint.h>
extern uint32_t (*bus_load)(uint32_t offset, int bytes);
extern void (*bus_store)(uint32_t offset, int bytes, uint32_t word);
#define LOAD32(axis, offset) ((void)(axis), bus_load((offset), 4))
#define STORE32(axis, offset, word) ((void)(axis), bus_store((offset), 4, (word)))
#define STORE16(axis, offset, half) ((void)(axis), bus_store((offset), 2, (half)))
"""
POINTERS = """
#include "hooks.h"
uint32_t (*bus_load)(uint32_t offset, int bytes);
void (*bus_store)(uint32_t offset, int bytes, uint32_t word);
"""
LOAD = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_uint32, ctypes.c_int)
STORE = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.c_int, ctypes.c_uint32)


def compiled(folder: Path, hooked: bool) -> Path:
    """Compile the example as a shared library, with every warning, and return its path."""
    (folder / "registers.h").write_text(register_header.header(RegisterMap(spec("mhz"))), encoding="ascii")
    (folder / "hooks.h").write_text(HOOKS, encoding="ascii")
    (folder / "pointers.c").write_text(POINTERS, encoding="ascii")
    hooks = ["-include", "hooks.h", "pointers.c"] if hooked else []
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-O2"]
    command = ["cc", *strict, "-shared", "-fPIC", "-I.", *hooks, str(EXAMPLE), "-o", "example.so"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "example.so"


@cocotb.test()
async def a_program_in_c_arms_an_axis_and_beats(dut):
    board = make(parameters()["name"])
    registers, axis = board.registers, board.spec
    bench, master = await started(dut, board)
    answers = []

    @resume
    async def load(offset: int, size: int) -> int:
        read = await master.read(offset, size)
        answers.append(int(read.resp))
        return int.from_bytes(read.data, "little")

    @resume
    async def store(offset: int, size: int, word: int) -> None:
        answers.append(int((await master.write(offset, word.to_bytes(size, "little"))).resp))

    example = ctypes.CDLL(parameters()["library"])
    example.axis_driven.restype, example.axis_wall.argtypes = ctypes.c_int32, [ctypes.c_void_p, *2 * [ctypes.c_int32]]
    kept = LOAD(load), STORE(store)
    for name, function in zip(("bus_load", "bus_store"), kept, strict=True):
        ctypes.c_void_p.in_dll(example, name).value = ctypes.cast(function, ctypes.c_void_p).value

    @bridge
    def call(function: str, *arguments: int) -> int:
        return getattr(example, f"axis_{function}")(None, *arguments)

    async def read(name: str) -> int:
        register = registers[name]
        word = int.from_bytes((await master.read(register_header.offset_of(register), 4)).data, "little")
        return register.from_registers((word >> 16, word & 0xFFFF))

    # The loop of the emergency stop is open: the program sees that the axis is not ready, and asks for nothing.
    assert await call("arm") == 0
    bench.drive(emergency_stop=1)
    assert names(await call("acknowledge")) == ["emergency_stop"]
    assert await call("acknowledge") == 0
    assert await read("state") == DISARMED
    stiffest, inside = registers["wall_stiffness"].high, registers["wall_position"].low + 1
    assert await call("wall", registers["wall_position"].low - 1, stiffest) == 0
    assert await call("wall", inside, stiffest + 1) == 0
    assert await read("active_wall_stiffness") == 0
    assert await call("wall", inside, stiffest) == 1
    assert await call("arm") == 1
    assert await read("state") == ARMED
    assert (await read("active_wall_position"), await read("active_wall_stiffness")) == (inside, stiffest)
    # The limit rises from 0: the wall pushes already, and not yet with all its force.
    await ClockCycles(dut.clk, 60 * axis.samples_per_actuation * axis.clocks_per_sample)
    driven = await call("driven")
    assert -axis.force_limit_word < driven < 0
    beats = await read("heartbeat")
    await call("beat")
    assert (await read("heartbeat"), await read("live")) == (beats + 1, 1)
    assert set(answers) == {0}, "the bus refused something"


@pytest.mark.parametrize("name", ["mhz"])
def test_rtl(name, tmp_path):
    # The library is of the simulator's side alone.
    simulate(__file__, lambda name, library: make(name), name=name, library=str(compiled(tmp_path, hooked=True)))


@pytest.fixture(scope="module")
def example(tmp_path_factory) -> ctypes.CDLL:
    """Return the example without a bus, as it is compiled for a processor: memory stands for the axis."""
    library = ctypes.CDLL(str(compiled(tmp_path_factory.mktemp("example"), hooked=False)))
    library.axis_wall.argtypes = [ctypes.c_void_p, *2 * [ctypes.c_int32]]
    return library


class Memory:
    """Memory in the place of an axis: what a store writes, a load reads."""

    def __init__(self):
        self.bytes = (ctypes.c_uint8 * (1 << 17))()
        self.registers = RegisterMap(spec("mhz"))

    def _place(self, name: str) -> tuple[int, int]:
        register = self.registers[name]
        return register_header.offset_of(register), 2 * register.size

    def __setitem__(self, name: str, word: int) -> None:
        at, size = self._place(name)
        self.bytes[at : at + size] = word.to_bytes(size, "little", signed=word < 0)

    def __getitem__(self, name: str) -> int:
        at, size = self._place(name)
        return int.from_bytes(bytes(self.bytes[at : at + size]), "little", signed=self.registers[name].format.signed)

    @property
    def written(self) -> set[int]:
        """The places that are not 0."""
        return {at for at, value in enumerate(bytes(self.bytes)) if value}


@pytest.fixture
def memory() -> Memory:
    return Memory()


def test_with_a_pointer_the_example_stores_at_the_byte_offset(example, memory):
    place = 2 * memory.registers["heartbeat"].address
    memory.bytes[place] = 0xFF
    example.axis_beat(memory.bytes)
    assert memory.written == {place + 1}
    assert memory.bytes[place + 1] == 1
    memory.bytes[2 * memory.registers["ready"].address] = 1
    example.axis_arm(memory.bytes)
    # The pulse has an odd address: it is the lower half of its word, and so the first two bytes.
    assert memory.registers["arm"].address % 2
    assert memory.bytes[2 * (memory.registers["arm"].address - 1)] == 1


def test_the_beat_after_the_last_word_is_the_first(example, memory):
    """The bus refuses a word beyond the register's range."""
    most = memory.registers["heartbeat"].high
    memory["heartbeat"] = most - 1
    example.axis_beat(memory.bytes)
    assert memory["heartbeat"] == most
    example.axis_beat(memory.bytes)
    assert memory["heartbeat"] == memory.registers["heartbeat"].low == 0


def test_a_wall_at_a_bound_is_written_and_one_beyond_is_not(example, memory):
    position, stiffness = memory.registers["wall_position"], memory.registers["wall_stiffness"]
    for outside in (
        (position.low - 1, stiffness.low), (position.high + 1, stiffness.low),
        (position.low, stiffness.low - 1), (position.low, stiffness.high + 1),
    ):  # fmt: skip
        assert example.axis_wall(memory.bytes, *outside) == 0
        assert memory.written == set()
    for inside in ((position.low, stiffness.high), (position.high, stiffness.low)):
        memory["commit"] = 0
        assert example.axis_wall(memory.bytes, *inside) == 1
        assert (memory["wall_position"], memory["wall_stiffness"], memory["commit"]) == (*inside, 1)


@pytest.mark.parametrize("state", [DISARMED, ARMED, TRIPPED])
@pytest.mark.parametrize("ready", [0, 1])
def test_arming_returns_whether_the_axis_is_armed(example, memory, ready, state):
    memory["ready"], memory["state"] = ready, state
    assert example.axis_arm(memory.bytes) == (ready and state == ARMED)
    assert (memory["arm"], memory["heartbeat"]) == (ready, 1)


@pytest.mark.parametrize("state", [DISARMED, ARMED, TRIPPED])
def test_only_a_trip_is_acknowledged(example, memory, state):
    memory["state"], memory["latched"] = state, 0b101
    tripped = state == TRIPPED
    assert example.axis_acknowledge(memory.bytes) == 0b101 * tripped
    assert (memory["acknowledged"], memory["acknowledge"]) == (0b101 * tripped, tripped)


def test_the_drive_has_its_sign(example, memory):
    example.axis_driven.restype = ctypes.c_int32
    for word in (memory.registers["driven"].format.min, -1, memory.registers["driven"].format.max):
        memory["driven"] = word
        assert example.axis_driven(memory.bytes) == word


def test_the_program_on_the_page_compiles(tmp_path):
    blocks = re.findall(r"```c\n(.*?)^```$", (ROOT / "docs/reference/link.md").read_text(), re.DOTALL | re.MULTILINE)
    (program,) = (block for block in blocks if "axis_arm" in block)
    compiled(tmp_path, hooked=False)
    (tmp_path / "main.c").write_text(f'#include "{EXAMPLE}"\nint main(void)\n{{\n{program}}}\n', encoding="utf-8")
    command = ["cc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I.", "main.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
