"""Supervised axes: at every clock, what is let out for what the axes show and the host asks, against the models."""

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.supervised_axes import SupervisedAxes
from hardwall.model import supervised_axes
from hardwall.model.axes import AXES_MAX
from hardwall.model.supervisor import ALL, ARMED, DISARMED, TRIPPED, names
from hardwall.testing import SAMPLES, SEED, Bench, Recorded, parameters, simulate
from oracles.supervised import BITS
from oracles.supervised_axes import Follower
from stimuli.lengths import LONG, long_form
from stimuli.supervised_axes_world import AxesWorld, slow


def make(**given) -> Recorded:
    return Recorded(SupervisedAxes(slow(**given)))


@cocotb.test()
async def follows_models(dut):
    recorded = make(**parameters())
    design, bench = recorded.component.design, Bench(dut, recorded)
    await bench.reset()
    world, follower = AxesWorld(design, SEED), Follower(design)
    record, seen_states, compared, turns, resets, apart = bench.dut.record, set(), 0, 0, 0, 0
    clocks, ready = SAMPLES // (2 if design.spec.axes == 1 else 4), 0
    for clock in range(clocks):
        states = [(state.supervisor.state, state.supervisor.latched) for state in follower.states]
        given = world.act(states, ready)
        # After half of the run the axes are reset in motion, again and again.
        reset = int(clock == 0 or (2 * clock > clocks and world.random.random() < 16 / clocks))
        bench.dut.stimulus.value, bench.dut.rst.value = recorded.stimuli.pack(given), reset
        await RisingEdge(dut.clk)
        shown = recorded.records.unpack(int(record.value))
        ready = shown["word_ready"]
        if clock:
            wanted = follower.wanted()
            assert {name: shown[name] for name in wanted} == wanted, f"clock {clock}"
            compared, turns = compared + 1, turns + shown["turn_valid"]
        if reset:
            follower.restart(given)
            world.restart()
            resets += 1
        else:
            follower.edge(given, shown)
        now = {(state.supervisor.state, state.supervisor.driven != 0) for state in follower.states}
        apart += {(TRIPPED, False), (ARMED, True)} <= now
        seen_states |= now
    assert compared == clocks - 1
    assert turns > clocks // design.spec.clocks_per_sample * design.spec.axes * 0.9
    assert resets > 1
    assert seen_states == {(DISARMED, False), (TRIPPED, False), (ARMED, False), (ARMED, True)}
    assert (apart > 100) == (design.spec.axes > 1)
    assert names(ALL & ~follower.reached & ~BITS["strobe_busy"]) == []


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
