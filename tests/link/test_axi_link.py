"""The board with a bus instead of a line: brought up by a bus master that others wrote, as the page on safety says."""

import cocotb
import pytest
from cocotb.triggers import ClockCycles
from link.processor import make, started

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.hdl.link.axi_link import AxiLink
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED, names
from hardwall.testing import parameters, simulate
from stimuli.specs import spec


@cocotb.test()
async def a_processor_brings_an_axis_up(dut):
    board = make(**parameters())
    registers, axis = board.registers, board.spec
    bench, master = await started(dut, board)

    async def write(name: str, word: int) -> int:
        place = registers[name].address
        if registers[name].kind.wide:
            return (await master.write(2 * place, (word & 0xFFFFFFFF).to_bytes(4, "little"))).resp
        return (await master.write(2 * (place ^ 1), word.to_bytes(2, "little"))).resp

    async def read(name: str) -> int:
        register = registers[name]
        word = int.from_bytes((await master.read(2 * register.address, 4)).data, "little")
        return register.from_registers((word >> 16, word & 0xFFFF))

    # The loop of the emergency stop is open.
    assert await read("state") == TRIPPED
    assert await write("arm", 1) == 2
    bench.drive(emergency_stop=1)
    latched = await read("latched")
    assert names(latched) == ["emergency_stop"]
    assert await write("acknowledged", latched) == 0
    assert await write("acknowledge", 1) == 0
    assert await read("state") == DISARMED
    for name, word in (
        ("wall_stiffness", registers["wall_stiffness"].high), ("wall_position", registers["wall_position"].low + 1),
        ("commit", 1), ("supervisor_ramp", registers["supervisor_ramp"].high), ("heartbeat", 1),
    ):  # fmt: skip
        assert await write(name, word) == 0
    assert await read("ready") == 1
    assert await write("arm", 1) == 0
    assert await read("state") == ARMED
    await ClockCycles(dut.clk, 3 * axis.samples_per_actuation * axis.clocks_per_sample)
    assert await read("driven") == -axis.force_limit_word
    # A lower limit holds at the next clock.
    assert await write("supervisor_force_limit", 3) == 0
    assert await read("driven") == -3
    assert await write("disarm", 1) == 0
    assert (await read("state"), await read("driven")) == (DISARMED, 0)


@pytest.mark.parametrize("name", ["mhz"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_the_bus_has_the_registers_that_it_was_given():
    assert AxiLink(RegisterMap(spec("mhz"))).registers.identity == RegisterMap(spec("mhz")).identity
    assert set(LOOPS) <= set(make("mhz").signature.members)
