"""The supervised axis: monitors and supervisor see at every clock what the axis shows, and say when it drives."""

import dataclasses
import random as plain

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.axis.supervised import SupervisedAxis
from hardwall.model.axis import monitors
from hardwall.model.axis.supervised import FROM_AXIS, FROM_OUTSIDE
from hardwall.model.axis.supervisor import ALL, ARMED, CAUSES, DISARMED, TRIPPED, names
from hardwall.testing import SAMPLES, SEED, Bench, Recorded, parameters, simulate
from oracles.axis import AxisTwin
from oracles.supervised import BITS, Follower
from stimuli.lengths import REACHING, WHOLE, some_of
from stimuli.specs import spec
from stimuli.supervised_world import World

# A clock at which a stamp wraps in a few samples, and a heartbeat is overdue after 500 clocks; with as many counts a
# sample as in the narrow axis, and a damping that is as large in the words of its samples.
SLOW = {"clock_hz": 10_000, "sample_hz": 250, "actuation_hz": 125, "speed_max_m_per_s": 250e-6}
SLOW |= {"damping_max_n_s_per_m": 800e3}


def make(overlaps: bool) -> Recorded:
    axis = dataclasses.replace(spec("narrow", "fdm"), **SLOW)
    clocks = axis.design.interval if overlaps else axis.clocks_per_sample
    per_s = axis.clock_hz // clocks / axis.sample_hz
    fields = ("sample_hz", "actuation_hz", "speed_max_m_per_s")
    faster = {name: type(getattr(axis, name))(getattr(axis, name) * per_s) for name in fields}
    faster["damping_max_n_s_per_m"] = axis.damping_max_n_s_per_m / per_s
    return Recorded(SupervisedAxis(dataclasses.replace(axis, **faster)))


@cocotb.test()
async def follows_models(dut):
    recorded = make(**parameters())
    design, bench = recorded.component.design, Bench(dut, recorded)
    await bench.reset()
    world, record, random = World(design, SEED), bench.dut.record, plain.Random(SEED)
    follower, axis = Follower(design), AxisTwin(design)
    states, compared, resets = set(), 0, 0
    shown = {"state": DISARMED, "latched": 0, "live": 0}
    clocks = max(SAMPLES, REACHING) // (1 if WHOLE else 2)
    for clock in range(clocks):
        given = world.act(shown["state"], shown["latched"], shown["live"])
        # First the counts of the causes fill; then the axis is reset in motion, again and again.
        reset = int(clock == 0 or (2 * clock > clocks and random.random() < 0.0003))
        bench.dut.stimulus.value, bench.dut.rst.value = recorded.stimuli.pack(given), reset
        await RisingEdge(dut.clk)
        seen = recorded.records.unpack(int(record.value))
        shown = {name: seen[name] for name in recorded.outputs}
        if clock:
            wanted = follower.wanted() | axis.outputs()
            assert shown == wanted, f"clock {clock}: {unlike(shown, wanted)}"
            compared += 1
        if reset:
            follower.restart(given)
            axis.restarted()
            resets += 1
        else:
            axis.advance(given | {"slip": follower.slip(given)}, follower.level("drive_enable"))
            follower.edge(given, shown)
        states.add((follower.supervisor.state, follower.supervisor.driven != 0))
    assert compared == clocks - 1
    assert resets > 1
    assert states == {(DISARMED, False), (TRIPPED, False), (ARMED, False), (ARMED, True)}
    missed = names(ALL & ~follower.reached & ~BITS["strobe_busy"])
    assert missed == []


def unlike(shown: dict[str, int], wanted: dict[str, int]) -> str:
    """Return the outputs that are not as wanted, in words."""
    names_of_both = [name for name in {**shown, **wanted} if shown.get(name) != wanted.get(name)]
    return ", ".join(f"{name} is {shown.get(name)}, not {wanted.get(name)}" for name in names_of_both)


@pytest.mark.parametrize("overlaps", some_of([False, True], 1))
def test_rtl(overlaps):
    simulate(__file__, make, overlaps=overlaps)


def test_every_cause_has_one_source_but_for_a_count_that_wraps():
    sources = [*FROM_AXIS, *FROM_OUTSIDE, *monitors.MADE, "link_timeout"]
    assert sorted(sources) == sorted([*(cause.name for cause in CAUSES), "position_wrap"])


def test_every_word_is_written_once():
    design = SupervisedAxis(spec("mhz")).design
    every = [word.name for word in design.words]
    assert len(set(every)) == len(every)
    assert {word.name for word in spec("mhz").design.words} - set(every) == {"output_force_limit"}


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        SupervisedAxis(3)
