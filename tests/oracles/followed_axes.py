"""Supervised axes in the simulator, held to their models at every clock."""

from cocotb.triggers import RisingEdge

from hardwall.hdl.axes.supervised import SupervisedAxes
from hardwall.hdl.axis.supervised import COMPLEMENTS, LOOPS
from hardwall.model.axis.supervisor import ARMED
from hardwall.testing import Bench, Recorded, parameters
from stimuli.supervised_axes_world import slow
from stimuli.supervised_world import QUARTERS

from .axes import Seen, Write, check, lanes_of
from .supervised_axes import Follower

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
        everyone: a bit for every axis.
        rest: inputs of axes at which nothing happens, with everything in order and the shortest watchdog.
        given, seen: the inputs and outputs of the first clocks, up to a reset.
    """

    def __init__(self, dut):
        self._recorded = make(**parameters())
        self.design, self._bench = self._recorded.component.design, Bench(dut, self._recorded)
        self.follower = Follower(self.design)
        self.inputs = tuple(self._recorded.stimuli.shapes)
        self.compared = self.ready = 0
        self.everyone, watchdog = (1 << self.design.spec.axes) - 1, self.design.watchdog.word.name
        self.rest = dict.fromkeys(self.inputs, 0) | dict.fromkeys((*COMPLEMENTS, *LOOPS), self.everyone)
        self.rest |= {watchdog: self.design.ranges[watchdog][0]}
        self._numbers = {word.name: number for number, word in enumerate(self.design.words)}
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
        kept = not reset and len(self.given) == self.compared - 1 < AXES_CLOCKS
        if reset:
            self.follower.restart(given)
        else:
            self.follower.edge(given, shown)
        if kept:
            self.given.append(given | {"slip": self.follower.slips})
            self.seen.words.append(word)
        return shown

    async def until_ready(self) -> None:
        """Reset, and go on at rest until words can be written."""
        await self.begin(self.rest)
        while not self.ready:
            await self.edge(self.rest)

    def port(self, axis: int, name: str, word: int) -> dict[str, int]:
        """Return the inputs by which a word of an axis is written."""
        return {"word_write": 1, "word_axis": axis, "word_number": self._numbers[name], "word_value": word}

    @property
    def turn(self) -> int:
        """Clocks in which every axis has looked, and its turn is over."""
        return 2 * self.design.spec.clocks_per_sample + self.design.latency

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


class Spin:
    """Handles that all go round, at twice the counts of a sample that their estimates are made for.

    Attributes:
        clocks: how many they have gone so far.
    """

    def __init__(self, run: Run):
        self._run, self.clocks = run, 0

    async def edge(self, **more: int) -> int:
        """Go on by a clock; return the count of the first axis in it."""
        spec = self._run.design.spec
        a, b = QUARTERS[self.clocks // (spec.clocks_per_sample // 2) % 4]
        self.clocks += 1
        channels = {"encoder_a": a * self._run.everyone, "encoder_b": b * self._run.everyone}
        shown = await self._run.edge(self._run.rest | channels | {"heartbeat": self.clocks} | more)
        half = 1 << spec.count_width - 1
        return (shown["count"] + half) % (2 * half) - half

    async def until_all(self, state: int) -> None:
        """Go on until all axes are in a state."""
        last = self.clocks + 20 * self._run.design.spec.clocks_per_sample
        while any(each.state != state for each in self._run.supervisors):
            await self.edge()
            assert self.clocks < last, f"state {state}"


class Still:
    """Handles that move by hand, all of them alike, between which nothing happens but the host's beats."""

    def __init__(self, run: Run):
        self._run, self._clock, self._quarter = run, 0, 0

    async def go_on(self, clocks: int, **more: int) -> None:
        """Go on by clocks, in the first of which some inputs are otherwise."""
        run = self._run
        for wait in range(clocks):
            self._clock += 1
            a, b = QUARTERS[self._quarter % 4]
            channels = {"encoder_a": a, "encoder_b": b, "encoder_a_n": 1 - a, "encoder_b_n": 1 - b}
            of_all = {name: level * run.everyone for name, level in channels.items()}
            await run.edge(run.rest | of_all | {"heartbeat": self._clock} | ({} if wait else more))

    async def write(self, **words: int) -> None:
        """Write words of all axes."""
        for name, word in words.items():
            for axis in range(self._run.design.spec.axes):
                await self.go_on(1, **self._run.port(axis, name, word))

    async def step(self, way: int) -> None:
        """Move the handles by a count, and let every axis see that."""
        self._quarter += way
        await self.go_on(self._run.turn)

    async def arm_at(self, place: int) -> None:
        """Say that the handles are at a count, and arm all axes."""
        run = self._run
        await self.go_on(run.turn, disarm=run.everyone, preload=run.everyone, preload_count=place)
        (latched,) = {each.latched for each in run.supervisors}
        await self.go_on(run.turn, acknowledge=run.everyone, acknowledged=latched)
        await self.go_on(run.turn, arm=run.everyone)
        assert self.states == {ARMED}

    @property
    def states(self) -> set[int]:
        """The states of the axes."""
        return {each.state for each in self._run.supervisors}
