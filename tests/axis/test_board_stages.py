"""The board with each of its drive stages, against the models clock for clock: a push, every stop, and safe pins."""

import cocotb
import pytest
from cocotb.triggers import ClockCycles, RisingEdge, Timer

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axis.supervisor import ARMED, DISARMED
from hardwall.model.board import clock_monitor
from hardwall.testing import parameters, simulate
from oracles.board import STAGES, make
from oracles.board_host import Host
from oracles.supervised import SYNCHRONISER
from stimuli.lengths import LONG, WHOLE, some_of

SAFE = {
    "pdm": {"drive_pdm": 0},
    "pwm": {"gate_high_a": 0, "gate_low_a": 0, "gate_high_b": 0, "gate_low_b": 0},
    "dac": {"dac_clear_n": 0, "dac_cs_n": 1},
}
"""The pins that safety is about, and their levels, by stage."""


class Pusher:
    """A host whose wall pushes with all that the axis has, and the pins of its drive."""

    def __init__(self, dut):
        self.host = Host(dut, **parameters())
        self.dut, self.safe = dut, SAFE[self.host.board.spec.stage.name]

    async def reset(self) -> None:
        host = self.host
        await host.reset()
        assert self.is_safe
        await host.write(supervisor_ramp=host.registers["supervisor_ramp"].high)
        stiffness, position = host.registers["wall_stiffness"], host.registers["wall_position"]
        await host.write(commit=1, wall_position=1 + position.low, wall_stiffness=stiffness.high)

    @property
    def is_safe(self) -> bool:
        """Whether the pins are safe now."""
        return all(int(getattr(self.dut, name).value) == level for name, level in self.safe.items())

    async def push(self, inverted: int = 0) -> None:
        """Arm, and wait until the pins are those of the largest drive, and not safe."""
        host = self.host
        await host.write(drive_invert=inverted)
        await host.arm()
        await host.edges(host.settling + host.board.stage.latency)
        assert host.shown()["driven"] == -host.twin.spec.force_limit_word
        while self.is_safe:
            await host.edges(1)


@cocotb.test()
async def an_open_loop_makes_the_pins_safe(dut):
    pusher = Pusher(dut)
    await pusher.reset()
    host = pusher.host
    seen = set()
    for inverted, loop in enumerate(LOOPS):
        await pusher.push(inverted & 1)
        seen |= set(host.pulses)
        # The pins are safe between two edges; a fault of the amplifier comes through the supervisor.
        host.change(**{loop: 0})
        if loop == "external_fault":
            await host.edges(SYNCHRONISER + host.board.safe_latency)
        await Timer(1, "ns")
        assert pusher.is_safe
        await host.edges(host.settling)
        # A loop that is closed again is no arm.
        host.change(**{loop: 1})
        host.pulses.clear()
        await host.edges(host.settling)
        assert pusher.is_safe
        assert len(set(host.pulses)) == 1
    # Every pin has been at both levels on the way.
    assert all({pins[number] for pins in seen} == {0, 1} for number in range(len(host.pulses[0])))


@cocotb.test(skip=not WHOLE)
async def a_disarm_makes_the_pins_safe(dut):
    pusher = Pusher(dut)
    await pusher.reset()
    await pusher.push()
    await pusher.host.write(disarm=1)
    while pusher.host.shown()["state"] == ARMED:
        await pusher.host.edges(1)
    await pusher.host.edges(pusher.host.board.stage.design.safe_latency)
    assert pusher.is_safe


@cocotb.test()
async def a_clock_that_stops_makes_the_pins_safe_and_comes_back_disarmed(dut):
    pusher = Pusher(dut)
    await pusher.reset()
    await pusher.push()
    host = pusher.host
    host.leave()
    host.bench.clock.stop()
    # The clocks of an oscillator of 1 Hz are its seconds; one more, for an edge sees what was before it.
    await ClockCycles(dut.oscillator, 1 + int(clock_monitor.Design(host.twin.spec.clock_hz).stop_latency_s(1.0)))
    assert pusher.is_safe
    assert host.shown()["state"] == ARMED
    host.bench.clock.start()
    await RisingEdge(dut.outputs_enable)
    assert (host.shown()["state"], host.shown()["driven"]) == (DISARMED, 0)
    assert pusher.is_safe


# The board's own test has pulses; those that are scaled belong to `make soak`.
TESTED = some_of((name for name in STAGES if name != "pdm" and (name != "pdm scaled" or LONG)), -1)


@pytest.mark.parametrize("stage", TESTED)
def test_rtl(stage):
    simulate(__file__, make, name="paper", estimator="fdm", stage=stage)


def test_the_stages_are_all_there():
    assert {stage.name for stage in STAGES.values()} == set(SAFE)
