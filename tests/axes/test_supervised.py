"""Supervised axes: at every clock, what is let out for what the axes show and the host asks, against the models."""

import cocotb
import pytest

from hardwall.hdl.axes.supervised import SupervisedAxes
from hardwall.hdl.axis.supervised import COMPLEMENTS
from hardwall.model.axes import supervised as supervised_axes
from hardwall.model.axes.axis import AXES_MAX
from hardwall.model.axis.monitors import IDLE_EDGES
from hardwall.model.axis.supervisor import ALL, ARMED, DISARMED, TRIPPED, names
from hardwall.testing import SAMPLES, SEED, simulate
from oracles.followed_axes import Run, Spin, Still, make
from oracles.supervised import BITS
from stimuli.lengths import LONG, REACHING, WHOLE, long_form, some_of
from stimuli.supervised_axes_world import AxesWorld, slow


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
    axes, turn, rest = run.design.spec.axes, run.turn, run.rest
    everyone, words, watchdog = run.everyone, [word.name for word in run.design.words], run.design.watchdog.word
    formats = {word.name: word.format for word in (watchdog, *run.design.words)}
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
            port = run.port(axis, name, 0) if name in words else {}
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
    spec, rest, everyone, longest = run.design.spec, run.rest, run.everyone, 255
    await run.until_ready()
    for axis in range(spec.axes):
        for name, word in (("supervisor_loss", longest), ("supervisor_causes", ALL)):
            await run.edge(rest | run.port(axis, name, word))
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


@cocotb.test()
async def an_estimate_that_is_saturated_for_too_long(dut):
    """That is no cause until the axis is ARMED, but its samples are counted before."""
    run = Run(dut)
    spec, rest, everyone, longest, cause = run.design.spec, run.rest, run.everyone, 127, BITS["estimator_saturated"]
    await run.until_ready()
    for axis in range(spec.axes):
        for name, word in (("encoder_glitch_clocks", 0), ("supervisor_causes", cause)):
            await run.edge(rest | run.port(axis, name, word))
    # The filter is off before the handles turn.
    for wait in range(2 * spec.clocks_per_sample):
        await run.edge(rest | {"commit": everyone * (not wait)})
    spin, trips, behind = Spin(run), [], run.design.latency // spec.clocks_per_sample
    while not trips or trips[-1] < longest // 2:
        for axis in range(spec.axes):
            await spin.edge(**run.port(axis, "supervisor_saturated", longest))
        await spin.edge(acknowledge=everyone, acknowledged=run.supervisors[0].latched)
        await spin.until_all(DISARMED)
        # From here on it is the longest until the count is about to wrap; a turn is of a sample some time ago.
        while await spin.edge() != -3 << spec.count_width - 3:
            assert spin.clocks < 10_000
        # The count has wrapped on its way, which is a cause of its own.
        for wait in range(run.design.latency):
            await spin.edge(clear_flags=everyone * (not wait), arm=everyone * (wait == run.design.latency - 1))
        await spin.until_all(ARMED)
        trips.append(run.follower.states[0].monitors.samples + behind + 1 + len(trips) % 3)
        for axis in range(spec.axes):
            await spin.edge(**run.port(axis, "supervisor_saturated", trips[-1]))
        await spin.until_all(TRIPPED)
        assert {each.latched for each in run.supervisors} == {cause}
    assert len(trips) > 2
    # They are counted on, up to one more than the longest.
    for axis in range(spec.axes):
        await spin.edge(**run.port(axis, "supervisor_saturated", longest))
    last = spin.clocks + 2 * longest * spec.clocks_per_sample
    while any(each.monitors.samples <= longest for each in run.follower.states):
        await spin.edge()
        assert spin.clocks < last
    ended: set[int] = set()
    for _ in range(10 * run.turn):
        await run.edge(rest)
        ended |= {axis for axis, each in enumerate(run.follower.states) if not each.monitors.samples}
    assert len(ended) == spec.axes


@cocotb.test()
async def handles_within_a_count_of_their_limits(dut):
    """At a limit of its position an axis is ARMED, and a count beyond it trips, whichever bits the limit has."""
    run = Run(dut)
    handles, half = Still(run), 1 << run.design.spec.count_width - 1
    await run.until_ready()
    await handles.write(supervisor_causes=BITS["position_range"])
    # Closer to the ends of its range a count is about to wrap.
    for place in range(1 - 3 * half // 4, 3 * half // 4 - 1, 1 if WHOLE else 5):
        for limit, beyond in (("supervisor_position_low", 1), ("supervisor_position_high", -1)):
            for at, state in ((0, ARMED), (beyond, TRIPPED)):
                await handles.write(supervisor_position_low=-half, supervisor_position_high=half - 1)
                await handles.arm_at(place)
                await handles.write(**{limit: place + at})
                await handles.go_on(run.turn)
                assert handles.states == {state}, (limit, place, at)


@cocotb.test()
async def handles_that_run_away_by_a_count_too_many(dut):
    """By as many counts as `supervisor_runaway` says, an axis is ARMED, and one more trips, whatever the way."""
    run = Run(dut)
    handles, half = Still(run), 1 << run.design.spec.count_width - 1
    words = {word.name: word.format for word in run.design.words}
    most = 3 * half // 4 - 1
    (high,) = [word.high for word in run.design.words if word.name == "supervisor_runaway"]
    await run.until_ready()
    stiffest = {"encoder_glitch_clocks": 0, "wall_stiffness": words["wall_stiffness"].max}
    await handles.write(supervisor_causes=BITS["runaway"], supervisor_ramp=words["supervisor_ramp"].max, **stiffest)
    await handles.write(supervisor_force_limit=1)
    for left, way in ((0, 1), (1, -1)):
        await handles.write(wall_left=left, wall_position=-way * (most + 1))
        await handles.go_on(run.turn, commit=run.everyone)
        for longest in range(high + 1):
            await handles.write(supervisor_runaway=longest)
            await handles.arm_at(-way * most)
            await handles.go_on(2 * run.turn)
            assert {each.at_limit for each in run.supervisors} == {1}
            for _ in range(longest):
                await handles.step(way)
            assert handles.states == {ARMED}, (way, longest)
            await handles.step(way)
            assert handles.states == {TRIPPED}, (way, longest)


@pytest.mark.parametrize(
    ("axes", "estimator", "spare"),
    [*some_of([(1, "fdm", 0), (3, "levant", 2)], 1), *([(3, "window", 0)] if LONG else [])],
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
