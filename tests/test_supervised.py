"""The supervised axis: monitors and supervisor see at every clock what the axis shows, and say when it drives."""

import random as plain

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.supervised import COMPLEMENTS, LOOPS, SHOWN, SupervisedAxis
from hardwall.model import monitors, supervisor
from hardwall.model.supervised import FROM_AXIS, FROM_OUTSIDE
from hardwall.model.supervisor import ALL, ARMED, CAUSES, DISARMED, LINK, TRIPPED
from hardwall.testing import SAMPLES, SEED, Bench, Recorded, parameters, simulate
from stimuli.specs import spec

SYNCHRONISER = 2
PINS = ("encoder_a", "encoder_b", *COMPLEMENTS, *LOOPS)
BITS = {cause.name: 1 << bit for bit, cause in enumerate(CAUSES)}


def make(name: str) -> Recorded:
    return Recorded(SupervisedAxis(spec(name, "fdm")))


class World:
    """A handle that moves at random, loops that open, and a host that looks before it acts."""

    def __init__(self, axis: SupervisedAxis):
        self.random, self.position, self.speed = plain.Random(SEED), 0.0, 0.0
        self.axis, self.spec = axis, axis.design.spec
        words = {word.name: word.reset for word in axis.design.words}
        stiff, at_once = self.spec.design.wall.stiffness.max, axis.design.supervisor.ramp.max
        self.inputs = dict.fromkeys(("encoder_z", "clear_flags", "preload", "preload_count", "word_range"), 0)
        self.inputs |= {"supervisor_causes": ALL, **words, **dict.fromkeys(LOOPS, 1), "beat_word": 0}
        self.inputs |= {"supervisor_ramp": at_once, "wall_stiffness": stiff, "wall_position": -3}
        # Thresholds that the motion comes to.
        self.inputs |= {"supervisor_saturated": 2}
        self.inputs |= {"supervisor_turn": 4, "supervisor_index_tolerance": 1, "supervisor_runaway": 0}
        self.dead, self.reach = 0, 5

    def act(self, state: int, latched: int) -> dict[str, int]:
        """Return the inputs of a clock."""
        random, now = self.random, dict.fromkeys(("commit", "arm", "disarm", "acknowledge", "beat", "index_arm"), 0)
        now |= {"acknowledged": 0, "clear_flags": 0}
        if random.random() < 0.002:
            self.speed = random.choice((0.0, 0.01, 0.05, 0.2)) * random.choice((-1, 1))
            self.reach = 13 if random.random() < 0.1 else 5
        self.position += self.speed if abs(self.position) < self.reach else -0.01 * self.position
        self.position += 2 if random.random() < 0.0005 else 0
        quarter = int(self.position // 1) % 4
        a, b = ((0, 0), (1, 0), (1, 1), (0, 1))[quarter]
        if random.random() < 0.0005:
            self.dead = random.randrange(30)
        self.dead -= self.dead > 0
        now |= {"encoder_a": a, "encoder_a_n": 1 - a, "encoder_b": b, "encoder_b_n": b if self.dead else 1 - b}
        now["encoder_z"] = int(quarter == 2)
        for name in LOOPS:
            if random.random() < (0.0002 if self.inputs[name] else 0.02):
                self.inputs[name] ^= 1
        if random.random() < 0.01:
            now["beat"], self.inputs["beat_word"] = 1, random.randrange(1 << 16)
        act = random.random()
        if act < 0.01 and state == TRIPPED:
            now |= {"acknowledge": 1, "acknowledged": latched, "clear_flags": int(random.random() < 0.8)}
        elif act < 0.02 and state == DISARMED:
            now["arm"] = 1
        elif act < 0.0205:
            now["disarm"] = 1
        elif act < 0.021:
            now["commit"] = 1
        elif act < 0.022:
            self.inputs["supervisor_force_limit"] = random.choice((1, 2, self.spec.force_limit_word))
        elif act < 0.0225:
            self.inputs["supervisor_causes"] = random.choice((ALL, 0))
        return {**self.inputs, **now, "word_range": int(random.random() < 0.0002)}


@cocotb.test()
async def follows_models(dut):
    recorded = make(**parameters())
    axis, bench = recorded.component, Bench(dut, recorded)
    await bench.reset()
    world, record = World(axis), bench.dut.record
    m_design, s_design = axis.design.monitors, axis.design.supervisor
    m_state, s_state = monitors.START, supervisor.START
    pins = [dict.fromkeys(PINS, 0)] * (SYNCHRONISER + 1)
    states, reached, compared = set(), 0, 0
    shown = {"state": DISARMED, "latched": 0}
    for clock in range(SAMPLES // 2):
        given = world.act(shown["state"], shown["latched"])
        bench.dut.stimulus.value = recorded.stimuli.pack(given)
        await RisingEdge(dut.clk)
        word = int(record.value)
        shown = {name: recorded.records.column(name, [word])[0] for name in recorded.outputs}
        wanted = {name: getattr(s_state, name) for name in SHOWN} | {"a_channel_idle": m_state.a_channel_idle}
        found = {name: shown[name] for name in wanted}
        assert found == wanted, f"clock {clock}: RTL {found}, models {wanted}"
        compared += 1

        pins = [*pins[1:], {name: given[name] for name in PINS}]
        level = pins[0]
        own = {name: shown[name] for name in monitors.Inputs._fields if name in shown}
        own |= {word.name: given[word.name] for word in m_design.words}
        seen = monitors.Inputs(**own | {
            "valid": shown["estimated"], "force_limit": given["supervisor_force_limit"],
            "a": level["encoder_a"], "a_n": level["encoder_a_n"], "b": level["encoder_b"], "b_n": level["encoder_b_n"],
        })  # fmt: skip
        stands = {"encoder_illegal": shown["illegal"], "encoder_overspeed": shown["overspeed"]}
        stands |= {"strobe_busy": shown["strobe_busy"], "word_range": given["word_range"]}
        stands |= {"external_fault": not level["external_fault"], "emergency_stop": not level["emergency_stop"]}
        assert set(stands) == {*FROM_AXIS, *FROM_OUTSIDE}
        causes = m_state.causes | sum(BITS[name] for name, present in stands.items() if present)
        own = {name: given[name] for name in supervisor.Inputs._fields if name in given}
        heard = supervisor.Inputs(**own | {
            "strobe": shown["sampled"], "drive": shown["drive"], "causes": causes, "stamp": shown["stamp"],
            "enable": level["drive_enable"], "referenced": shown["index_latched"],
        })  # fmt: skip
        m_state = monitors.step(m_design.params, m_state, seen)
        s_state = supervisor.step(s_design.params, s_state, heard)
        states.add((s_state.state, s_state.driven != 0))
        reached |= s_state.latched
    assert compared == SAMPLES // 2
    assert states == {(DISARMED, False), (TRIPPED, False), (ARMED, False), (ARMED, True)}
    missed = supervisor.names(ALL & ~reached & ~(1 << LINK | BITS["strobe_busy"]))
    assert missed == []


@pytest.mark.parametrize("name", ["narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_every_cause_has_one_source():
    sources = [*FROM_AXIS, *FROM_OUTSIDE, *monitors.MADE, "link_timeout"]
    assert sorted(sources) == sorted(cause.name for cause in CAUSES)


def test_every_word_is_written_once():
    design = SupervisedAxis(spec("mhz")).design
    names = [word.name for word in design.words]
    assert len(set(names)) == len(names)
    assert {word.name for word in spec("mhz").design.words} - set(names) == {"output_force_limit"}


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        SupervisedAxis(3)
