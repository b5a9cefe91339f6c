"""Every cause of supervised axes, injected alone into one of them: in time, by its name, and the others drive on."""

from collections.abc import Awaitable, Callable
from typing import Any

import cocotb
from cocotb.triggers import RisingEdge

from hardwall.hdl.axes.supervised import SupervisedAxes
from hardwall.hdl.axis.supervised import COMPLEMENTS, LOOPS
from hardwall.model.axis.supervisor import ARMED, CAUSES, DISARMED, TRIPPED, WATCHDOG_MS
from hardwall.model.encoder import quadrature
from hardwall.testing import Bench, Recorded, simulate
from oracles.supervised import BITS, SYNCHRONISER
from stimuli.supervised_axes_world import slow

AXES, WRONG = 3, 1
"""The number of axes, and the one that something is wrong with."""
QUARTERS = ((0, 0), (1, 0), (1, 1), (0, 1))
EVERY = (1 << AXES) - 1
BEAT_CLOCKS = 25
GLITCH_CLOCKS = 2
PIN_CLOCKS = quadrature.latency(GLITCH_CLOCKS)
ENOUGH = 400
"""Clocks for an axis to come to its drive, or for what goes wrong to go on."""


def make() -> Recorded:
    return Recorded(SupervisedAxes(slow(AXES, "levant", spare=2)))


class Device:
    """The axes at rest in their walls, and a host that beats: what goes wrong is done by hand.

    Attributes:
        design, bench: the axes' design, and the bench around them.
        inputs: what is at the inputs.
        shown: the outputs at the last clock.
        turns: for every axis what its last turn has shown.
        beats: whether the host does.
    """

    def __init__(self, dut: Any, recorded: Recorded):
        self.design, self._recorded, self.bench = recorded.component.design, recorded, Bench(dut, recorded)
        self._edge = RisingEdge(dut.clk)
        self.inputs = dict.fromkeys(recorded.stimuli.shapes, 0)
        self.inputs |= dict.fromkeys((*LOOPS, *COMPLEMENTS), EVERY) | {"supervisor_watchdog": WATCHDOG_MS[0]}
        self.numbers = {word.name: number for number, word in enumerate(self.design.words)}
        self.beats, self._clock, self.place = True, 0, 0
        self.turns = [{"state": DISARMED, "latched": 0}] * AXES
        self.shown: dict[str, int] = {}

    async def clock(self, **pulses: int) -> None:
        """Give the inputs for a clock, with some of them otherwise."""
        self._clock += 1
        if self.beats and self._clock % BEAT_CLOCKS == 0:
            self.inputs["heartbeat"] ^= 1
        self.bench.dut.stimulus.value = self._recorded.stimuli.pack(self.inputs | pulses)
        await self._edge
        self.shown = self._recorded.records.unpack(int(self.bench.dut.record.value))
        if self.shown["turn_valid"]:
            names = ("state", "latched", "ready", "first")
            self.turns[self.shown["turn_axis"]] = {name: self.shown[f"turn_{name}"] for name in names}

    async def clocks(self, number: int) -> None:
        for _ in range(number):
            await self.clock()

    async def write(self, axis: int, **words: int) -> None:
        """Write words of an axis."""
        for name, word in words.items():
            await self.clock(word_write=1, word_axis=axis, word_number=self.numbers[name], word_value=word)

    async def moves(self, counts: int, every: int = 2 * (GLITCH_CLOCKS + 1)) -> None:
        """Move the wrong axis by counts, an edge every so many clocks."""
        for _ in range(abs(counts)):
            self.place += 1 if counts > 0 else -1
            self.sets(*QUARTERS[self.place % 4])
            await self.clocks(every)

    def sets(self, a: int, b: int) -> None:
        """Set the channels of the wrong axis, and their complements."""
        for name, level in (("encoder_a", a), ("encoder_b", b), ("encoder_a_n", 1 - a), ("encoder_b_n", 1 - b)):
            self.level(name, level)

    def level(self, name: str, level: int) -> None:
        """Set a pin of the wrong axis."""
        self.inputs[name] = self.inputs[name] & ~(1 << WRONG) | level << WRONG

    def magnitude(self, axis: int) -> int:
        """Return the magnitude of the drive that an axis lets out."""
        width = self.design.supervisor.limit.width
        return self.shown["magnitude"] >> width * axis & (1 << width) - 1

    async def starts(self, enabled: int) -> None:
        """Reset, and bring all axes into their walls and to ARMED, with those causes enabled and the required ones."""
        self.place = 0
        self.sets(*QUARTERS[0])
        self.bench.drive(rst=1)
        await self.clocks(3)
        self.bench.drive(rst=0)
        await self.clocks(2 * self.design.spec.clocks_per_sample)
        half = 1 << self.design.spec.count_width - 1
        stiffness = next(word.format.max for word in self.design.words if word.name == "wall_stiffness")
        for axis in range(AXES):
            await self.write(
                axis, wall_stiffness=stiffness, wall_position=-1, encoder_glitch_clocks=GLITCH_CLOCKS,
                supervisor_ramp=self.design.supervisor.ramp.max, supervisor_causes=enabled,
                supervisor_position_low=-half, supervisor_position_high=half - 1, supervisor_saturated=1,
                supervisor_turn=4, supervisor_index_tolerance=0,
            )  # fmt: skip
        await self.clocks(BEAT_CLOCKS)
        await self.clock(commit=EVERY)
        await self.arms()

    async def arms(self) -> None:
        """Acknowledge what is latched of every axis, and arm it."""
        await self.clocks(2 * self.design.spec.clocks_per_sample)
        for axis, turn in enumerate(self.turns):
            await self.clock(acknowledge=1 << axis, acknowledged=turn["latched"], clear_flags=1 << axis)
            await self.clocks(2 * self.design.spec.clocks_per_sample)
        await self.clock(arm=EVERY)
        await self.clocks(ENOUGH)


async def opens(name: str, device: Device) -> None:
    device.level(name, 0)


async def both_channels_change(device: Device) -> None:
    device.sets(*QUARTERS[2])


async def a_pulse_is_outrun(device: Device) -> None:
    device.sets(*QUARTERS[1])
    await device.clock()
    device.sets(*QUARTERS[2])
    await device.clock()
    device.sets(*QUARTERS[3])


async def a_channel_is_lost(device: Device) -> None:
    device.level("encoder_a_n", 0)


async def an_index_is_out_of_place(device: Device) -> None:
    device.level("encoder_z", 0)
    await device.moves(2)
    await device.clocks(PIN_CLOCKS)
    device.level("encoder_z", 1)
    await device.clocks(PIN_CLOCKS)
    await device.moves(1, 0)


async def a_count_is_out_of_range(device: Device) -> None:
    await device.write(WRONG, supervisor_position_high=-1)


async def a_count_is_about_to_wrap(device: Device) -> None:
    await device.clock(preload=1 << WRONG, preload_count=3 << device.design.spec.count_width - 3)


async def the_speed_is_beyond(device: Device) -> None:
    await device.write(WRONG, supervisor_velocity_limit=0)
    await device.moves(1, every=0)


async def the_handle_runs_away(device: Device) -> None:
    await device.write(WRONG, supervisor_force_limit=1, supervisor_runaway=0)
    await device.clocks(ENOUGH)
    await device.moves(1, every=0)


async def the_estimate_saturates(device: Device) -> None:
    # From within the wall on the other side of 0, so that the count stays far from its ends.
    clocks = device.design.spec.clocks_per_sample
    await device.write(WRONG, encoder_glitch_clocks=0, wall_position=-2 * clocks)
    await device.clock(commit=1 << WRONG)
    await device.moves(-clocks)
    await device.clocks(ENOUGH)
    # Half a sample and more is beyond the format: so many edges are that in two samples, wherever a sample begins.
    await device.moves(2 * clocks + 1, every=1)


async def a_word_is_out_of_range(device: Device) -> None:
    await device.write(WRONG, supervisor_ramp=0)


Injection = tuple[Callable[[Device], Awaitable[None]], Callable[[Any], int]]


def by_a_loop(name: str) -> Injection:
    return lambda device: opens(name, device), lambda design: 3


def by_a_look(inject: Callable[[Device], Awaitable[None]], pins: int = 0) -> Injection:
    return inject, lambda design: pins + design.trip_clocks


def by_a_sample(inject: Callable[[Device], Awaitable[None]], pins: int = PIN_CLOCKS, samples: int = 1) -> Injection:
    return inject, lambda design: pins + samples * design.spec.clocks_per_sample + design.latency


INJECTIONS: dict[str, Injection] = {
    "encoder_illegal": by_a_look(both_channels_change, PIN_CLOCKS),
    "encoder_overspeed": by_a_look(a_pulse_is_outrun, PIN_CLOCKS),
    "encoder_loss": (
        a_channel_is_lost,
        lambda design: SYNCHRONISER + next(word.reset for word in design.words if word.name == "supervisor_loss")
        + 2 * design.spec.clocks_per_sample + design.turn_clocks,
    ),
    "index_spacing": by_a_sample(an_index_is_out_of_place),
    "position_range": by_a_sample(a_count_is_out_of_range, 1),
    "position_wrap": by_a_sample(a_count_is_about_to_wrap, 1),
    "velocity_limit": by_a_sample(the_speed_is_beyond),
    "runaway": by_a_sample(the_handle_runs_away),
    "estimator_saturated": by_a_sample(the_estimate_saturates),
    "word_range": by_a_look(a_word_is_out_of_range),
    "external_fault": by_a_loop("external_fault"),
    "emergency_stop": by_a_loop("emergency_stop"),
}  # fmt: skip
"""What injects a cause, and the most clock edges from its last clock to a drive of zero."""


async def is_at_zero(device: Device, most: int) -> int:
    """Wait until the wrong axis lets out nothing; return the clock edges. The others drive on meanwhile."""
    before = [device.magnitude(axis) for axis in range(AXES)]
    for edges in range(most + 1):
        if not device.magnitude(WRONG):
            return edges
        await device.clock()
        assert [device.magnitude(axis) for axis in range(AXES) if axis != WRONG] == [before[0], before[2]]
    raise AssertionError(f"the drive is not zero after {most} clock edges")


@cocotb.test()
async def every_cause_trips_its_axis_alone(dut):
    recorded = make()
    device, design = Device(dut, recorded), recorded.component.design
    await device.bench.reset()
    for name, (inject, most) in INJECTIONS.items():
        await device.starts(BITS[name])
        assert [turn["state"] for turn in device.turns] == [ARMED] * AXES, name
        assert min(device.magnitude(axis) for axis in range(AXES)) > 0
        if name == "index_spacing":
            await device.moves(1)
            await device.clocks(PIN_CLOCKS)
            device.level("encoder_z", 1)
            await device.clocks(PIN_CLOCKS)
            await device.moves(1)
            await device.clocks(ENOUGH)
        await inject(device)
        edges = await is_at_zero(device, most(design) + 1)
        dut._log.info(f"{name}: {edges} edges of {most(design)} at most")
        # The outputs are those before the edge.
        assert edges - 1 <= most(design)
        await device.clocks(2 * design.spec.clocks_per_sample + design.latency)
        assert [turn["state"] for turn in device.turns] == [ARMED, TRIPPED, ARMED], name
        assert device.turns[WRONG]["first"] == BITS[name] == device.turns[WRONG]["latched"], name
        assert min(device.magnitude(0), device.magnitude(2)) > 0


@cocotb.test()
async def a_silent_host_trips_all_axes(dut):
    recorded = make()
    device, design = Device(dut, recorded), recorded.component.design
    await device.bench.reset()
    await device.starts(0)
    device.beats = False
    await device.clocks(WATCHDOG_MS[0] * design.spec.clock_hz // 1000 + design.trip_clocks + 2)
    assert [device.magnitude(axis) for axis in range(AXES)] == [0] * AXES
    assert [turn["latched"] for turn in device.turns] == [BITS["link_timeout"]] * AXES


@cocotb.test()
async def an_open_enable_disarms_its_axis_alone_and_another_acknowledgement_is_void(dut):
    recorded = make()
    device = Device(dut, recorded)
    await device.bench.reset()
    await device.starts(0)
    device.level("drive_enable", 0)
    await device.clocks(4)
    assert [device.magnitude(axis) > 0 for axis in range(AXES)] == [True, False, True]
    device.level("drive_enable", 1)
    await device.clocks(ENOUGH)
    assert [turn["state"] for turn in device.turns] == [ARMED, DISARMED, ARMED]
    device.level("emergency_stop", 0)
    await device.clocks(ENOUGH)
    device.level("emergency_stop", 1)
    await device.clocks(ENOUGH)
    for named in (0, BITS["emergency_stop"] | BITS["runaway"]):
        await device.clock(acknowledge=1 << WRONG, acknowledged=named)
        await device.clocks(ENOUGH)
        assert device.turns[WRONG]["state"] == TRIPPED
    # One that another replaces within its rota is void, whatever that one names.
    await device.clock(acknowledge=1 << WRONG, acknowledged=BITS["emergency_stop"])
    await device.clock(acknowledge=1, acknowledged=0)
    await device.clocks(ENOUGH)
    await device.arms()
    assert [turn["state"] for turn in device.turns] == [ARMED] * AXES


def test_rtl():
    simulate(__file__, make)


def test_every_cause_is_injected():
    assert set(INJECTIONS) == {cause.name for cause in CAUSES} - {"strobe_busy", "link_timeout"}
