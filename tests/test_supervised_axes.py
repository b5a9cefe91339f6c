"""Supervised axes: at every clock, what is let out for what the axes show and the host asks, against the models."""

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.supervised import COMPLEMENTS, LOOPS
from hardwall.hdl.supervised_axes import SupervisedAxes
from hardwall.model import supervised_axes
from hardwall.model.axes import AXES_MAX
from hardwall.model.monitors import IDLE_EDGES
from hardwall.model.supervisor import ALL, ARMED, DISARMED, TRIPPED, names
from hardwall.testing import SAMPLES, SEED, Bench, Recorded, parameters, simulate
from oracles.axes import Seen, Write, check, lanes_of
from oracles.supervised import BITS
from oracles.supervised_axes import Follower
from stimuli.lengths import LONG, REACHING, long_form
from stimuli.supervised_axes_world import AxesWorld, slow
from stimuli.supervised_world import QUARTERS

AXES_CLOCKS = 10_000
"""Clocks at most in which the axes inside are held to their own model."""


def make(**given) -> Recorded:
    return Recorded(SupervisedAxes(slow(**given)))


class Run:
    """Axes in the simulator, whose outputs are compared with the models' at every clock.

    Attributes:
        design: the axes' design.
        inputs: the names of their inputs.
        follower: the models.
        compared: the clocks that were compared.
        ready: whether words can be written.
        given, seen: the inputs and outputs of the first clocks, up to a reset.
    """

    def __init__(self, dut):
        self._recorded = make(**parameters())
        self.design, self._bench = self._recorded.component.design, Bench(dut, self._recorded)
        self.follower = Follower(self.design)
        self.inputs = tuple(self._recorded.stimuli.shapes)
        self.compared = self.ready = 0
        self.given: list[dict[str, int]] = []
        self.seen = Seen(self._recorded.records, self.design.spec)

    async def begin(self, given: dict[str, int]) -> None:
        """Reset the axes, with inputs."""
        await self._bench.reset()
        await self.edge(given, 1)
        self._first = given

    async def edge(self, given: dict[str, int], reset: int = 0) -> dict[str, int]:
        """Go on by a clock with inputs; return the outputs in it."""
        dut = self._bench.dut
        dut.stimulus.value, dut.rst.value = self._recorded.stimuli.pack(given), reset
        await RisingEdge(dut.clk)
        word = int(dut.record.value)
        shown = self._recorded.records.unpack(word)
        self.ready = shown["word_ready"]
        if self.compared or not reset:
            wanted = self.follower.wanted()
            assert {name: shown[name] for name in wanted} == wanted, f"clock {self.compared}"
            self.compared += 1
        if not reset and len(self.given) == self.compared - 1 < AXES_CLOCKS:
            self.given.append(given)
            self.seen.words.append(word)
        if reset:
            self.follower.restart(given)
        else:
            self.follower.edge(given, shown)
        return shown

    def check_axes(self) -> None:
        """Check what the axes inside showed in the first clocks, up to a reset, against their own model."""
        spec, words = self.design.spec, self.design.words
        # The loop of their enable is open in the clocks of a synchroniser.
        loops = [each["drive_enable"] for each in ({"drive_enable": 0}, self._first, *self.given)]
        given = [each | {"drive_enable": loop} for each, loop in zip(self.given, loops, strict=False)]
        writes = [
            Write(clock, each["word_axis"], words[each["word_number"]].name, each["word_value"])
            for clock, each in enumerate(self.given)
            if each["word_write"] and words[each["word_number"]] in self.design.committed
        ]
        lanes = lanes_of(spec, given, writes)
        check(spec, lanes, self.seen)
        assert all(each.committed > 5 for each in lanes)

    @property
    def supervisors(self) -> list:
        """The states of all supervisors."""
        return [state.supervisor for state in self.follower.states]


@cocotb.test()
async def follows_models(dut):
    run = Run(dut)
    design, world, seen_states, turns, resets, apart = run.design, AxesWorld(run.design, SEED), set(), 0, 0, 0
    clocks = max(SAMPLES, REACHING) // (2 if design.spec.axes == 1 else 4)
    await run.begin(world.act([(state.state, state.latched) for state in run.supervisors], 0))
    for clock in range(1, clocks):
        given = world.act([(state.state, state.latched) for state in run.supervisors], run.ready)
        # After half of the run the axes are reset in motion, again and again.
        reset = int(2 * clock > clocks and world.random.random() < 16 / clocks)
        shown = await run.edge(given, reset)
        turns += shown["turn_valid"]
        if reset:
            world.restart()
            resets += 1
        now = {(state.state, state.driven != 0) for state in run.supervisors}
        apart += {(TRIPPED, False), (ARMED, True)} <= now
        seen_states |= now
    assert run.compared == clocks - 1
    run.check_axes()
    assert turns > clocks // design.spec.clocks_per_sample * design.spec.axes * 0.9
    assert resets
    assert seen_states == {(DISARMED, False), (TRIPPED, False), (ARMED, False), (ARMED, True)}
    assert (apart > 100) == (design.spec.axes > 1)
    assert names(ALL & ~run.follower.reached & ~BITS["strobe_busy"]) == []


def around(ends: tuple[int, int], width: int) -> list[int]:
    """Return words of so many bits at the ends of a range, beside these, and unlike these in one bit."""
    changed = {end ^ 1 << bit for end in ends for bit in range(width)}
    near = {end + step for end in ends for step in (-1, 0, 1)}
    return sorted({word & (1 << width) - 1 for word in near | changed})


@cocotb.test()
async def every_word_around_an_end_of_its_range(dut):
    """Each is taken by an axis that is DISARMED, or trips it; of the one watchdog, every axis."""
    run, verdicts = Run(dut), set()
    axes, turn = run.design.spec.axes, 2 * run.design.spec.clocks_per_sample + run.design.latency
    everyone, words = (1 << axes) - 1, [word.name for word in run.design.words]
    watchdog = run.design.watchdog.word
    formats = {word.name: word.format for word in (watchdog, *run.design.words)}
    rest = dict.fromkeys(run.inputs, 0) | dict.fromkeys((*COMPLEMENTS, *LOOPS), everyone)
    rest |= {watchdog.name: run.design.ranges[watchdog.name][0]}
    await run.begin(rest)
    # Loops are open in the first clocks.
    for _ in range(turn):
        await run.edge(rest)
    await run.edge(rest | {"acknowledge": everyone, "acknowledged": run.supervisors[0].latched})
    for _ in range(turn):
        await run.edge(rest)
    for name, ends in run.design.ranges.items():
        for place, word in enumerate(around(ends, formats[name].width)):
            axis, states = place % axes, []
            port = {"word_write": 1, "word_axis": axis, "word_number": words.index(name)} if name in words else {}
            for each in (word, ends[1], None):
                acknowledged = {"acknowledge": everyone, "acknowledged": run.supervisors[axis].latched}
                given = acknowledged if each is None else port | {"word_value": each} if port else {name: each}
                await run.edge(rest | given)
                for _ in range(turn):
                    await run.edge(rest if port or each is None else rest | given)
                states.append(run.supervisors[axis].state)
            verdicts.add((name, ends[0] <= word <= ends[1], *states))
    came = {True: (DISARMED,) * 3, False: (TRIPPED, TRIPPED, DISARMED)}
    assert verdicts == {(name, fits, *came[fits]) for name in run.design.ranges for fits in came}


@cocotb.test()
async def an_encoder_that_ails(dut):
    """A channel that rests while the other has edges is shown; for the longest loss, nothing trips until it is over."""
    run = Run(dut)
    spec, words = run.design.spec, {word.name: number for number, word in enumerate(run.design.words)}
    everyone, longest = (1 << spec.axes) - 1, 255
    rest = dict.fromkeys(run.inputs, 0) | dict.fromkeys((*COMPLEMENTS, *LOOPS), everyone)
    rest |= {run.design.watchdog.word.name: run.design.ranges[run.design.watchdog.word.name][0]}
    await run.begin(rest)
    while not run.ready:
        await run.edge(rest)
    for axis in range(spec.axes):
        for name, word in (("supervisor_loss", longest), ("supervisor_causes", ALL)):
            port = {"word_write": 1, "word_axis": axis, "word_number": words[name], "word_value": word}
            await run.edge(rest | port)
    shown = []
    # No rota is without an edge of the channel, and none has two.
    for clock in range((IDLE_EDGES + 8) * spec.clocks_per_sample):
        level = everyone * (clock // spec.clocks_per_sample & 1)
        seen = await run.edge(rest | {"encoder_a": level, "encoder_a_n": level ^ everyone})
        shown += [seen["turn_a_channel_idle"]] * seen["turn_valid"]
    assert shown == sorted(shown)
    assert shown[-1] == 1
    lost = rest | dict.fromkeys(COMPLEMENTS, 0)
    for _ in range(longest):
        await run.edge(lost)
    assert not any(each.latched & BITS["encoder_loss"] for each in run.supervisors)
    for _ in range(2 * spec.clocks_per_sample + run.design.latency):
        await run.edge(lost)
    assert all(each.latched & BITS["encoder_loss"] for each in run.supervisors)
    for _ in range(2 * spec.clocks_per_sample + run.design.latency):
        await run.edge(rest)


class Spin:
    """Handles that all go round, at twice the counts of a sample that their estimates are made for.

    Attributes:
        clocks: how many they have gone so far.
    """

    def __init__(self, run: Run, rest: dict[str, int]):
        self._run, self._rest, self.clocks = run, rest, 0
        self._everyone = (1 << run.design.spec.axes) - 1

    async def edge(self, **more: int) -> int:
        """Go on by a clock; return the count of the first axis in it."""
        spec = self._run.design.spec
        a, b = QUARTERS[self.clocks // (spec.clocks_per_sample // 2) % 4]
        self.clocks += 1
        channels = {"encoder_a": a * self._everyone, "encoder_b": b * self._everyone}
        shown = await self._run.edge(self._rest | channels | {"heartbeat": self.clocks} | more)
        half = 1 << spec.count_width - 1
        return (shown["count"] + half) % (2 * half) - half

    async def until_all(self, state: int) -> None:
        """Go on until all axes are in a state."""
        last = self.clocks + 20 * self._run.design.spec.clocks_per_sample
        while any(each.state != state for each in self._run.supervisors):
            await self.edge()
            assert self.clocks < last, f"state {state}"


@cocotb.test()
async def an_estimate_that_is_saturated_for_too_long(dut):
    """That is no cause until the axis is ARMED, but its samples are counted before."""
    run = Run(dut)
    spec, words = run.design.spec, {word.name: number for number, word in enumerate(run.design.words)}
    everyone, longest, cause = (1 << spec.axes) - 1, 127, BITS["estimator_saturated"]
    rest = dict.fromkeys(run.inputs, 0) | dict.fromkeys((*COMPLEMENTS, *LOOPS), everyone)
    rest |= {run.design.watchdog.word.name: run.design.ranges[run.design.watchdog.word.name][0]}

    def port(axis: int, name: str, word: int) -> dict[str, int]:
        return {"word_write": 1, "word_axis": axis, "word_number": words[name], "word_value": word}

    await run.begin(rest)
    while not run.ready:
        await run.edge(rest)
    for axis in range(spec.axes):
        for name, word in (("encoder_glitch_clocks", 0), ("supervisor_causes", cause)):
            await run.edge(rest | port(axis, name, word))
    # The filter is off before the handles turn.
    for wait in range(2 * spec.clocks_per_sample):
        await run.edge(rest | {"commit": everyone * (not wait)})
    spin, trips, behind = Spin(run, rest), [], run.design.latency // spec.clocks_per_sample
    while not trips or trips[-1] < longest // 2:
        for axis in range(spec.axes):
            await spin.edge(**port(axis, "supervisor_saturated", longest))
        await spin.edge(acknowledge=everyone, acknowledged=run.supervisors[0].latched)
        await spin.until_all(DISARMED)
        # From here on it is the longest until the count is about to wrap; a turn is of a sample some time ago.
        while await spin.edge() != -3 << spec.count_width - 3:
            assert spin.clocks < 10_000
        for wait in range(run.design.latency):
            await spin.edge(arm=everyone * (wait == run.design.latency - 1))
        await spin.until_all(ARMED)
        trips.append(run.follower.states[0].monitors.samples + behind + 1 + len(trips) % 3)
        for axis in range(spec.axes):
            await spin.edge(**port(axis, "supervisor_saturated", trips[-1]))
        await spin.until_all(TRIPPED)
        assert {each.latched for each in run.supervisors} == {cause}
    assert len(trips) > 2


@pytest.mark.parametrize(
    ("axes", "estimator", "spare"), [(1, "fdm", 0), (3, "levant", 2), *([(3, "window", 0)] if LONG else [])]
)
def test_rtl(axes, estimator, spare):
    simulate(__file__, make, axes=axes, estimator=estimator, spare=spare)


@long_form
@pytest.mark.parametrize("axes", [16, AXES_MAX])
def test_rtl_of_many_axes(axes):
    simulate(__file__, make, axes=axes, estimator="fdm")


def test_every_word_has_a_number():
    design = supervised_axes.Design(slow(2, "fdm"))
    assert len({word.name for word in design.words}) == len(design.words)
    assert {word.name for word in design.words} - set(design.writable) == {"output_force_limit"}


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        SupervisedAxes(3)
