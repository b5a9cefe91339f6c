"""The linear loop with a virtual coupling, against the simulation and against the same loop run in time."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from hardwall.model.encoder.quadrature import latency
from hardwall.sim.loop.coupled import ToolState, advanced
from hardwall.sim.scene.build import tool_of
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.studies.zwidth import ZWidth
from hardwall.sim.walls import hit, theory
from hardwall.sim.walls.coupled_theory import CoupledLoop, loop_of
from stimuli.lengths import LONG
from stimuli.scenes import COUPLING

from .test_theory import LINEAR, PROMPT

KEYS = (
    "wall.stiffness_n_per_m", "wall.damping_n_s_per_m", "coupling.damping_n_s_per_m", "coupling.mass_kg",
    "coupling.sample_hz", "coupling.delay_s",
)  # fmt: skip
STEEP = {
    "a tool of 50 g, late": (3e3, 2.0, 1.0, 0.05, 500, 1e-3),
    "a tool of 50 g": (3e3, 0.0, 2.0, 0.05, 500, 0.0),
    "no mass, no damper": (3e3, 0.0, 0.0, 0.0, 500, 1e-3),
}
"""Couplings whose radius rises steeply where they turn unstable, so that a hit of seconds tells."""


SECONDS = {"protocol.settle_s": 5.0} if LONG else {"protocol.settle_s": 2.0, "protocol.measure_s": 0.5}


def scene(stiffness_n_per_m: float, *values: float, **others: float):
    changes = LINEAR | PROMPT | dict(zip(KEYS, values, strict=True)) | {"controller.estimator": "fdm"}
    changes |= {"coupling.stiffness_n_per_m": stiffness_n_per_m} | SECONDS
    return load("seed-2011", changes | {f"coupling.{key}": value for key, value in others.items()})


def radius(stiffness_n_per_m: float, *values: float) -> float:
    return CoupledLoop(scene(stiffness_n_per_m, *values)).radius(*values[:2])


@pytest.mark.parametrize("case", STEEP if LONG else list(STEEP)[:1])
def test_the_simulation_turns_unstable_within_2_percent_of_the_linear_limit(case):
    values = STEEP[case]
    tried = np.geomspace(1e3, 9e5, 25)
    first = next(k for k in tried if radius(k, *values) >= 1)
    limit = scipy.optimize.brentq(lambda k: radius(k, *values) - 1, first / (tried[1] / tried[0]), first, rtol=1e-5)
    for share, stable in ((0.98, True), (1.02, False)):
        result = hit.run(scene(share * limit, *values), "float", until_sure=True)
        assert result.stable == stable, f"{share} of {limit} N/m: RMS {result.rms_m} m"
        assert result.touched


@pytest.mark.parametrize("ahead_s", [0.0, 1.7e-3])
@pytest.mark.parametrize(("mass", "damping", "delay_s"), [(0.0, 3.0, 0.0), (0.05, 1.0, 0.0), (0.2, 4.0, 7e-4)])
def test_the_radius_is_the_growth_of_the_loop_in_time(mass, damping, delay_s, ahead_s):
    """A rigid handle in contact, sample by sample, with the tool's own step and a surface that is not rounded."""
    values = 8e3, 2.0, damping, mass, 1_000, delay_s
    known = scene(12e3, *values, ahead_s=ahead_s)
    # The wall is beyond the tool in the linear loop; here it is so by a tool that never leaves.
    tool = tool_of(known, "float")._replace(start_m=0.0, count_m=1.0)
    spec, handle = known.spec, known.handle
    rates = np.array([[0, 1, 0], [0, -handle.viscous_n_s_per_m, 1], [0, 0, 0]]) / np.array([[1], [handle.mass_kg], [1]])
    seen_s = latency(known.glitch_clocks) / spec.clock_hz
    early = scipy.linalg.expm(rates * (seen_s + spec.design.latency_to_drive / spec.clock_hz))
    rest = scipy.linalg.expm(rates * (1 / spec.sample_hz - seen_s - spec.design.latency_to_drive / spec.clock_hz))
    far, state = 1.0, np.array([1e-3, 0.0, 0.0])
    carried = ToolState(0, far, 0.0, 0, 0, 0, 0)
    before, surface, coming = 0.0, np.zeros(2), np.zeros(2)
    sizes = []
    for k in range(8_000):
        x = state[0]
        velocity = (x - before) * spec.sample_hz
        force = -tool.stiffness_n_per_m * (x - surface[0]) - tool.damping_n_s_per_m * (velocity - surface[1])
        if k % tool.period == 0:
            # Far within a wall that carries it there, so that the tool is always in contact.
            lifted = tool._replace(start_m=far * (1 + tool.wall_stiffness_n_per_m / tool.stiffness_n_per_m))
            carried = advanced(lifted._replace(velocity_m_per_s=1.0), carried, x, velocity)
            speed = carried.velocity_m_per_s
            coming = np.array([carried.position_m - far + tool.ahead_s * speed, speed])
            sizes.append(np.abs([*state[:2], carried.position_m - far, speed]).max())
        if k % tool.period + 1 == tool.latency:
            surface = coming
        before = x
        after = early @ state
        after[2] = force
        state = rest @ after
    found = CoupledLoop(known).radius(*values[:2])
    grown = np.log(sizes)
    # Every oscillation has its largest values once in a while: the growth is that of the largest of many periods.
    first, last = grown[100:300].max(), grown[-200:].max()
    assert np.exp((last - first) / (grown[-200:].argmax() + len(grown) - 200 - grown[100:300].argmax() - 100)) == (
        pytest.approx(found, abs=1e-3)
    )


@pytest.mark.parametrize("damping", [0.0, 10.0, 30.0])
@pytest.mark.parametrize(("ahead_s", "growth"), [(0.0, 0.0), (0.55e-3, 0.0), (0.6e-3, 1.2e-3), (1e-3, 0.03)])
def test_a_surface_that_is_too_far_ahead_is_unstable_in_free_motion(ahead_s, growth, damping):
    """A handle that goes anywhere has a radius of 1."""
    known = scene(30e3, 0.0, 0.0, damping, 0.05, 1_000, 0.0, ahead_s=ahead_s)
    assert CoupledLoop(known).radius(0.0, 0.0) - 1 == pytest.approx(growth, rel=0.2, abs=1e-9)


def test_a_map_has_the_limits_of_the_loop_with_its_coupling():
    plain = Case.of("seed-2011", {"controller.estimator": "fdm", "zwidth.damping_step_n_s_per_m": 98.0})
    maps = [SimpleNamespace(case=plain.changed(changes)) for changes in ({}, COUPLING | {"amplifier": None})]
    without, endless = ZWidth(plain.scene, maps, [], None).linear_limits
    assert all(math.isfinite(limit) for limit in without)
    assert set(endless) == {math.inf}


def test_a_scene_without_a_coupling_has_the_loop_without_one():
    changes = LINEAR | {"controller.estimator": "fdm"}
    assert type(loop_of(load("seed-2011", changes))) is theory.Loop
    assert type(loop_of(scene(1e3, *STEEP["a tool of 50 g"]))) is CoupledLoop
