"""The supervised axis: monitors and supervisor see at every clock what the axis shows, and say when it drives."""

import random as plain

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.supervised import LOOPS, SupervisedAxis
from hardwall.model import monitors
from hardwall.model.supervised import FROM_AXIS, FROM_OUTSIDE
from hardwall.model.supervisor import ALL, ARMED, CAUSES, DISARMED, LINK, TRIPPED, names
from hardwall.testing import SAMPLES, SEED, Bench, Recorded, parameters, simulate
from oracles.supervised import BITS, Follower
from stimuli.specs import spec


def make(name: str) -> Recorded:
    return Recorded(SupervisedAxis(spec(name, "fdm")))


class World:
    """A handle that moves at random, loops that open, and a host that looks before it acts."""

    def __init__(self, axis: SupervisedAxis):
        self.random, self.position, self.speed = plain.Random(SEED), 0.0, 0.0
        self.axis, self.spec = axis, axis.design.spec
        words = {word.name: word.reset for word in axis.design.words}
        self.most = {word.name: word.format.max for word in axis.design.live}
        stiff, at_once = self.spec.design.wall.stiffness.max, axis.design.supervisor.ramp.max
        self.inputs = dict.fromkeys(("encoder_z", "clear_flags", "preload", "preload_count"), 0)
        self.inputs |= {"supervisor_causes": ALL, **words, **dict.fromkeys(LOOPS, 1), "heartbeat": 0}
        self.inputs |= {"supervisor_ramp": at_once, "wall_stiffness": stiff, "wall_position": -1}
        # Thresholds that the motion comes to.
        self.inputs |= {"supervisor_saturated": 2}
        self.inputs |= {"supervisor_turn": 4, "supervisor_index_tolerance": 1, "supervisor_runaway": 0}
        self.dead, self.reach = 0, 5

    def act(self, state: int, latched: int) -> dict[str, int]:
        """Return the inputs of a clock."""
        random, now = self.random, dict.fromkeys(("commit", "arm", "disarm", "acknowledge", "index_arm"), 0)
        now |= {"acknowledged": 0, "clear_flags": 0}
        if random.random() < 0.002:
            self.speed = random.choice((0.0, 0.005, 0.01, 0.02, 0.02, 0.05, 0.2)) * random.choice((-1, 1))
            self.reach = 13 if random.random() < 0.2 else 5
        if abs(self.position) >= self.reach:
            self.speed = -abs(self.speed) if self.position > 0 else abs(self.speed)
        self.position += self.speed
        self.position += 2 if random.random() < 0.0002 else 0
        quarter = int(self.position // 1) % 4
        a, b = ((0, 0), (1, 0), (1, 1), (0, 1))[quarter]
        if random.random() < 0.0005:
            self.dead = random.randrange(60)
        self.dead -= self.dead > 0
        now |= {"encoder_a": a, "encoder_a_n": 1 - a, "encoder_b": b, "encoder_b_n": b if self.dead else 1 - b}
        now["encoder_z"] = int(quarter == 2)
        for name in LOOPS:
            self.inputs[name] ^= int(random.random() < (0.0001 if self.inputs[name] else 0.02))
        if random.random() < 0.01:
            self.inputs["heartbeat"] = random.randrange(1 << 16)
        act = random.random()
        if act < 0.03 and state == TRIPPED:
            now |= {"acknowledge": 1, "acknowledged": latched, "clear_flags": int(random.random() < 0.8)}
        elif act < 0.03 and state == DISARMED:
            now["arm"] = 1
        elif act < 0.0305:
            now["disarm"] = 1
        elif act < 0.0315:
            now["commit"] = 1
            self.inputs["encoder_invert"] = int(random.random() < 0.2)
        elif act < 0.032:
            self.inputs["supervisor_force_limit"] = random.choice((1, 2, self.spec.force_limit_word))
        elif act < 0.033:
            self.inputs |= {"supervisor_causes": random.choice((ALL, ALL, ALL, 0)), "drive_invert": random.randrange(2)}
        return {**self.inputs, **now, **(self.beyond() if random.random() < 0.0002 else {})}

    def beyond(self) -> dict[str, int]:
        """Return a live word beyond its range, where its format allows one."""
        name, (least, most) = self.random.choice(list(self.axis.design.ranges.items()))
        fits = [word for word in (least - 1, most + 1) if 0 <= word <= self.most[name]]
        return {name: self.random.choice(fits)} if fits else {}


@cocotb.test()
async def follows_models(dut):
    recorded = make(**parameters())
    axis, bench = recorded.component, Bench(dut, recorded)
    await bench.reset()
    world, record = World(axis), bench.dut.record
    follower, states, compared = Follower(axis.design), set(), 0
    shown = {"state": DISARMED, "latched": 0}
    for clock in range(SAMPLES):
        given = world.act(shown["state"], shown["latched"])
        bench.dut.stimulus.value = recorded.stimuli.pack(given)
        await RisingEdge(dut.clk)
        word = int(record.value)
        seen = recorded.records.unpack(word)
        shown = {name: seen[name] for name in recorded.outputs}
        wanted = follower.wanted()
        found = {name: shown[name] for name in wanted}
        assert found == wanted, f"clock {clock}: RTL {found}, models {wanted}"
        compared += 1
        follower.edge(given, shown)
        states.add((follower.supervisor.state, follower.supervisor.driven != 0))
    assert compared == SAMPLES
    assert states == {(DISARMED, False), (TRIPPED, False), (ARMED, False), (ARMED, True)}
    missed = names(ALL & ~follower.reached & ~(1 << LINK | BITS["strobe_busy"]))
    assert missed == []


@pytest.mark.parametrize("name", ["narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_every_cause_has_one_source():
    sources = [*FROM_AXIS, *FROM_OUTSIDE, *monitors.MADE, "link_timeout"]
    assert sorted(sources) == sorted(cause.name for cause in CAUSES)


def test_every_word_is_written_once():
    design = SupervisedAxis(spec("mhz")).design
    every = [word.name for word in design.words]
    assert len(set(every)) == len(every)
    assert {word.name for word in spec("mhz").design.words} - set(every) == {"output_force_limit"}


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        SupervisedAxis(3)
