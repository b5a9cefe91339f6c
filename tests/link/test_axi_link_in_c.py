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
from hardwall.model.axis.supervisor import ARMED, DISARMED, names
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


def test_with_a_pointer_the_example_stores_at_the_byte_offset(tmp_path):
    """Without a bus, as it is compiled for a processor: memory stands for the axis."""
    example, memory = ctypes.CDLL(str(compiled(tmp_path, hooked=False))), (ctypes.c_uint8 * (1 << 17))()
    registers = RegisterMap(spec("mhz"))
    place = 2 * registers["heartbeat"].address
    memory[place] = 0xFF
    example.axis_beat(memory)
    assert {at: value for at, value in enumerate(memory) if value} == {place + 1: 1}
    memory[2 * registers["ready"].address] = 1
    example.axis_arm(memory)
    # The pulse has an odd address: it is the lower half of its word, and so the first two bytes.
    assert registers["arm"].address % 2
    assert memory[2 * (registers["arm"].address - 1)] == 1


def test_the_program_on_the_page_compiles(tmp_path):
    blocks = re.findall(r"```c\n(.*?)^```$", (ROOT / "docs/reference/link.md").read_text(), re.DOTALL | re.MULTILINE)
    (program,) = (block for block in blocks if "axis_arm" in block)
    compiled(tmp_path, hooked=False)
    (tmp_path / "main.c").write_text(f'#include "{EXAMPLE}"\nint main(void)\n{{\n{program}}}\n', encoding="utf-8")
    command = ["cc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I.", "main.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
