"""A virtual coupling: the tool against its own equations, and the RTL, whose surface moves, against the model."""

import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest
from test_loop import A_FIFTH, SLOW, same_words

from hardwall.model.axis.design import strobe_of
from hardwall.model.stamped import Edges
from hardwall.sim.loop.backends import opened
from hardwall.sim.loop.controllers import sample, sample_quietly
from hardwall.sim.loop.coupled import Tool, ToolState, advanced, coupled
from hardwall.sim.scene.build import start_of, tool_of, world_of
from hardwall.sim.scene.checks import COUPLING_CLOCKS
from hardwall.sim.scene.load import load
from hardwall.sim.walls import hit, repetition
from hardwall.sim.world.encoder import level
from hardwall.testing import rng
from stimuli.lengths import LONG, long_form, some_of
from stimuli.scenes import COUPLING, ONE_SECOND

NEAR = {"protocol.start_m": -2e-3} | ONE_SECOND
TOOL = Tool(
    period=10, latency=1, period_s=1e-3, ahead_s=6e-4, mass_kg=0.05, stiffness_n_per_m=20e3, damping_n_s_per_m=10.0,
    wall_stiffness_n_per_m=50e3, wall_damping_n_s_per_m=30.0, forbid_pull=False, start_m=-0.07, count_m=1e-6,
    velocity_m_per_s=0.01, surface_m_per_s=1e-4, position_max=(1 << 18) - 1, velocity_max=(1 << 15) - 1,
)  # fmt: skip


def tools(random: np.random.Generator, number: int):
    """Yield tools and their states about the wall, with handles: massless and heavy ones, with dampers and without."""
    for _ in range(number):
        mass, damping, wall_damping = (float(random.choice([0.0, 10.0 ** random.uniform(-3, 2)])) for _ in range(3))
        tool = TOOL._replace(
            mass_kg=mass,
            stiffness_n_per_m=10.0 ** random.uniform(0, 6),
            damping_n_s_per_m=damping,
            wall_stiffness_n_per_m=10.0 ** random.uniform(0, 9),
            wall_damping_n_s_per_m=wall_damping,
            forbid_pull=bool(random.random() < 0.5),
            period_s=10.0 ** random.uniform(-6, -1),
        )
        state = ToolState(0, random.normal(0, 1e-3), random.normal(0, 0.1), 0, 0, 0, 0)
        yield tool, state, int(70_000 + random.normal(0, 2_000)), random.normal(0, 10.0)


def test_a_step_is_newton_s_second_law_with_all_forces_at_its_end():
    """Against the law's exact solution in rationals, over all of the tool's parts.

    There is a push if the tool would be within its wall without one, and where it may not pull, none below 0.
    """
    met = set()
    for tool, state, count, velocity in tools(rng(), 4_000):
        after = advanced(tool, state, count, velocity)
        began, before = Fraction(state.velocity_m_per_s), Fraction(state.position_m)
        t, mass, k, b = map(Fraction, (tool.period_s, tool.mass_kg, tool.stiffness_n_per_m, tool.damping_n_s_per_m))
        wall = Fraction(tool.wall_stiffness_n_per_m), Fraction(tool.wall_damping_n_s_per_m)
        handle = Fraction(tool.start_m) + count * Fraction(tool.count_m)
        speed = Fraction(velocity) * Fraction(tool.velocity_m_per_s)

        def solved(wall_k, wall_b, m=mass, v=began, x=before, t=t, k=k, b=b, handle=handle, speed=speed):
            # m (v' - v) = t (k (handle - x') + b (speed - v') - wall_k x' - wall_b v') with x' = x + t v'
            return (m * v + t * (k * (handle - x) + b * speed - wall_k * x)) / (m + t * (b + wall_b + t * (k + wall_k)))

        free, pushed = solved(0, 0), solved(*wall)
        push = wall[0] * (before + t * pushed) + wall[1] * pushed
        within, pulls = before + t * free > 0, push < 0
        expected = pushed if within and not (tool.forbid_pull and pulls) else free
        scale = abs(began) + abs(speed) + (abs(handle) + abs(before)) / t
        if abs(before + t * free) > 1e-12 * t * scale and abs(push) > 1e-12 * (wall[0] * t + wall[1]) * scale:
            assert abs(Fraction(after.velocity_m_per_s) - expected) < 1e-12 * scale
            assert abs(Fraction(after.position_m) - before - t * expected) < 1e-12 * (t * scale + abs(before))
            met.add((within, tool.forbid_pull, pulls, tool.mass_kg == 0))
    assert len(met) == 16


def test_the_surface_is_where_the_tool_will_be_and_within_its_words():
    state = ToolState(0, 0.01, 0.2, 0, 0, 0, 0)
    free = TOOL._replace(stiffness_n_per_m=1e-9, damping_n_s_per_m=0.0, wall_stiffness_n_per_m=0.0, start_m=0.0)
    after = advanced(free._replace(wall_damping_n_s_per_m=0.0), state, 0, 0.0)
    assert after.position_m == pytest.approx(0.0102, rel=1e-9)
    assert (after.next_position, after.next_velocity) == (10_200 + 120, 2_000)
    far = advanced(free, state._replace(position_m=1e3, velocity_m_per_s=-1e3), 0, 0.0)
    assert (far.next_position, far.next_velocity) == (free.position_max, -free.velocity_max)


@pytest.mark.parametrize("backend", ["float", "fixed", "rtl"] if LONG else ["fixed"])
def test_the_surface_moves_as_many_samples_late_as_it_is_said(backend):
    """Before the first sample the handle goes by two counts, and the tool by one in each of the next two periods."""
    changes = {"stiffness_n_per_m": 200e3, "mass_kg": 0.25, "sample_hz": 1_000, "delay_s": 3e-4}
    changes = {f"coupling.{key}": value for key, value in changes.items()} | {"controller.actuation_hz": 10_000}
    scene = load("seed-2011", changes | SLOW)
    world = world_of(scene)
    start = start_of(scene, world)
    number, drives = start.moment.cell.number, []
    edges = Edges(np.array([40, 60]), np.array([level(number + 1), level(number + 2)]))
    first = int(level(number))
    with opened(scene.spec, backend, scene.parameters, first, short=True) as plain:
        axis = coupled(plain, tool_of(scene, backend))
        state, _ = sample(axis.controller, axis.state, edges, 2, strobe_of(scene.timing, 0))
        drives.append(state.drive)
        for k in range(1, 20):
            state = sample_quietly(axis.controller, state, strobe_of(scene.timing, k))
            drives.append(state.drive)
    changed = np.flatnonzero(np.diff(drives)) + 1
    assert abs(drives[0]) > 10
    assert changed.tolist() == [3, 13]


@pytest.mark.parametrize("scene", ["seed-2011", "mhz"] if LONG else ["mhz"])
@pytest.mark.parametrize("delay_s", [0.0, 4e-4])
def test_rtl_gives_the_models_force_words_with_a_tool(scene, delay_s):
    changes = COUPLING | {"coupling.delay_s": delay_s, "wall.stiffness_n_per_m": 200e3}
    paper = scene == "seed-2011"
    result = same_words(scene, changes | ({**NEAR, "amplifier": None} | SLOW if paper else A_FIFTH))
    assert result.touched
    assert result.max_force_n > 0.3


@long_form
@pytest.mark.parametrize("estimator", ["levant-edge", "kalman"])
def test_rtl_gives_the_models_force_words_with_an_observer_and_a_tool_of_no_mass(estimator):
    changes = COUPLING | {"coupling.mass_kg": 0.0, "passivity.damping_n_s_per_m": 50.0, "wall.damping_n_s_per_m": 0.0}
    result = same_words("mhz", changes | A_FIFTH | {"controller.estimator": estimator, "controller.output": None})
    assert "passivity_active" in result.flags


@pytest.mark.parametrize("backend", some_of(["float", "fixed"], 1))
@pytest.mark.parametrize("stiffness", some_of([500.0, 2e3, 5e3, 20e3, 200e3], 0, 2, 4))
def test_a_handle_at_rest_is_as_deep_as_wall_and_coupling_one_behind_the_other(stiffness, backend):
    changes = COUPLING | {"wall.stiffness_n_per_m": stiffness, "wall.damping_n_s_per_m": 50.0}
    changes |= {"handle.coulomb_n": None, "controller.estimator": "kalman", "coupling.stiffness_n_per_m": 50e3}
    scene = load("mhz", changes | {"coupling.sample_hz": 10_000})
    result = hit.run(scene, backend, until_sure=True)
    assert result.stable
    assert result.in_place
    assert scene.felt_n_per_m == pytest.approx(1 / (1 / stiffness + 1 / 50e3))
    # The surface is at a whole count, and the handle within one.
    off_m = 50e3 * 0.5e-6 / scene.felt_n_per_m + 1e-6
    assert result.mean_m == pytest.approx(scene.protocol.push_n / scene.felt_n_per_m, abs=off_m)
    assert not dataclasses.replace(result, mean_m=result.mean_m + 2 * off_m).in_place


def test_a_handle_that_a_coupling_holds_back_has_not_touched_its_wall():
    dragged = {"coupling.stiffness_n_per_m": 200e3, "coupling.sample_hz": 100, "protocol.settle_s": 0.5}
    short = {"protocol.mean_s": 0.1, "protocol.measure_s": 0.1, "protocol.longest_s": 0.6}
    result = hit.run(load("mhz", COUPLING | dragged | short), "fixed")
    assert result.max_force_n > 0.1
    assert not result.touched


def test_a_hit_that_repeats_ends_as_one_that_goes_on():
    scene = load("mhz", COUPLING | {"coupling.sample_hz": 10_000, "protocol.start_m": -1e-3})
    short, whole = (hit.run(scene, "fixed", until_sure=sure) for sure in (True, False))
    assert short.samples < whole.samples
    assert (short.verdict, short.mean_m) == (whole.verdict, pytest.approx(whole.mean_m, abs=1e-12))
    assert math.isclose(short.rms_m, whole.rms_m, abs_tol=1e-15)


def test_a_loop_whose_tool_is_elsewhere_is_another_one():
    scene = load("seed-2011", COUPLING)
    world = world_of(scene)
    progress = start_of(scene, world)
    with opened(scene.spec, "fixed", scene.parameters, 0) as plain:
        state = coupled(plain, tool_of(scene, "fixed")).state
    memory = hit.Loop(scene, "fixed", False, True).memory
    moving = state._replace(tool=state.tool._replace(velocity_m_per_s=1e-9))
    clocks = scene.spec.clocks_per_sample
    seen = [repetition.seen(each, progress, memory, clocks) for each in (state, state, moving)]
    assert seen[0] == seen[1] != seen[2]
    assert repetition.period_of(scene, world, state) % 10 == 0


@pytest.mark.parametrize("delay_s", [0.0, 2e-5])
def test_rtl_gives_the_models_force_words_with_the_fewest_clocks_a_sample(delay_s):
    changes = COUPLING | {"coupling.sample_hz": 10_000, "coupling.delay_s": delay_s, "controller.sample_hz": 100_000}
    changes |= {"controller.actuation_hz": 100_000, "amplifier": None, "protocol.start_m": -2e-4}
    changes |= {"controller.speed_max_m_per_s": 0.1, "controller.clock_hz": 2_000_000}
    latency = load("seed-2011", changes).spec.design.latency_to_drive
    changes["controller.clock_hz"] = (latency + COUPLING_CLOCKS) * 100_000
    assert same_words("seed-2011", changes | ONE_SECOND).touched
