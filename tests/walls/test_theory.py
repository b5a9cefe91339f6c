"""Theory of stiff walls: the closed forms, and the linear loop against a simulation reduced to what the loop models."""

import numpy as np
import pytest
import scipy

from hardwall.model.encoder.quadrature import latency
from hardwall.sim.scene.load import load
from hardwall.sim.walls import hit, theory
from stimuli.lengths import LONG
from stimuli.scenes import AMPLIFIER, CABLE, DRIVE, HAND, SHUNT

# No dry friction, fine counts, a threshold of fifty counts; slow enough for the decoder, long enough for growth.
LINEAR = {
    "handle.coulomb_n": None,
    "encoder.count_m": 1e-7,
    "controller.travel_m": 0.02,
    "controller.speed_max_m_per_s": 0.05,
    "controller.glitch_clocks": 0,
    "protocol.start_m": -2e-4,
    "protocol.settle_s": 40.0,
    "protocol.threshold_mm": 5e-3,
    "controller.output": "u",
}
# A growing oscillation here bounces off a stiffer wall, and no higher.
PROMPT = {
    "amplifier": None, "controller.actuation_hz": 10_000, "controller.stiffness_max_n_per_m": 1e6,
    "encoder.count_m": 1e-8, "protocol.threshold_mm": 5e-4,
}  # fmt: skip
# As few clocks a sample as the axis takes: the force comes behind the next sample. An oscillation soon leaves the wall.
OVERLAPPING = {
    "amplifier": None, "controller.sample_hz": 50_000, "controller.actuation_hz": 50_000,
    "controller.stiffness_max_n_per_m": 2e6, "controller.speed_max_m_per_s": 0.01, "protocol.start_m": -2e-5,
    "protocol.threshold_mm": 1e-3,
}  # fmt: skip
CASES = {
    "fdm, soft": ("fdm", {}, 10.0, {}),
    "fdm, damped": ("fdm", {}, 60.0, {}),
    "filter of 100 Hz": ("butterworth", {"cutoff_hz": 100.0}, 20.0, {}),
    "filter of 1 kHz": ("butterworth", {"cutoff_hz": 1000.0}, 100.0, {}),
    "force at every sample": ("fdm", {}, 10.0, PROMPT),
    "filter, force at every sample": ("butterworth", {"cutoff_hz": 300.0}, 30.0, PROMPT),
    "samples overlap": ("fdm", {}, 5.0, OVERLAPPING),
    "amplifier with a bandwidth": ("fdm", {}, 20.0, AMPLIFIER),
    "cable, encoder at the handle": ("fdm", {}, 20.0, CABLE),
    "cable, encoder at the motor": ("fdm", {}, 7.0, CABLE | {"transmission.encoder_at": "motor"}),
    "hand": ("fdm", {}, 10.0, HAND),
    "voltage drive": ("fdm", {}, 10.0, DRIVE),
    "damping circuit": ("fdm", {}, 10.0, AMPLIFIER | DRIVE | SHUNT),
    "damping resistor": ("fdm", {}, 10.0, AMPLIFIER | DRIVE | {"motor.damping_resistance_ohm": 3.0}),
    "all of them and a damping circuit": (
        "butterworth",
        {"cutoff_hz": 500.0},
        20.0,
        AMPLIFIER | CABLE | HAND | DRIVE | SHUNT,
    ),
    "all of them": ("butterworth", {"cutoff_hz": 500.0}, 20.0, AMPLIFIER | CABLE | HAND | DRIVE),
}


QUICK = "fdm, soft", "samples overlap", "all of them and a damping circuit"
"""Every part is in one of these, the filter and the overlap, too; `make soak` has each alone."""


@pytest.mark.parametrize("case", CASES if LONG else QUICK)
def test_the_simulation_turns_unstable_within_2_percent_of_the_linear_limit(case):
    name, gains, damping, others = CASES[case]
    changes = LINEAR | others | {"controller.estimator": name, "wall.damping_n_s_per_m": damping}
    changes |= {f"controller.gains.{name}": gains} if gains else {}
    if others.items() >= OVERLAPPING.items():
        interval = load("seed-2011", changes).spec.design.interval
        changes["controller.clock_hz"] = interval * OVERLAPPING["controller.sample_hz"]
    limit = theory.linear_limit_n_per_m(theory.Loop(load("seed-2011", changes)), damping)
    assert limit > 1000
    for share, stable in ((0.98, True), (1.02, False)):
        result = hit.run(
            load("seed-2011", changes | {"wall.stiffness_n_per_m": share * limit}), "float", until_sure=True
        )
        assert result.flags == [] or not result.stable
        assert result.stable == stable, f"{share} of {limit} N/m: RMS {result.rms_m} m"


def radius_clock_by_clock(scene, stiffness_n_per_m: float, damping_n_s_per_m: float) -> float:
    """Return the radius of a rigid handle's loop with `fdm`, from a matrix of every clock and a pipe of forces."""
    clock_s, per_sample, handle = 1 / scene.spec.clock_hz, scene.spec.clocks_per_sample, scene.handle
    pipe = latency(scene.glitch_clocks) + scene.spec.design.latency_to_drive + scene.delay_samples * per_sample
    x, v, before, held, first = range(5)
    acting = first + pipe - 1
    rates = np.zeros((3, 3))
    rates[0, 1], rates[1] = 1, np.array([0, -handle.viscous_n_s_per_m, 1]) / handle.mass_kg
    moved = scipy.linalg.expm(rates * clock_s)
    clock = np.zeros((acting + 1, acting + 1))
    clock[np.ix_([x, v], [x, v, acting])] = moved[:2]
    clock[before, before] = clock[held, held] = clock[first, held] = 1
    clock[range(first + 1, acting + 1), range(first, acting)] = 1
    sample, per_s = np.eye(acting + 1), damping_n_s_per_m * scene.spec.sample_hz
    sample[before], sample[held] = 0, 0
    sample[before, x], sample[held, x], sample[held, before] = 1, -stiffness_n_per_m - per_s, per_s
    return float(np.abs(np.linalg.eigvals(np.linalg.matrix_power(clock, per_sample) @ sample)).max())


@pytest.mark.parametrize("delay_s", [0.0, 20e-6])
def test_the_matrix_of_a_period_is_that_of_its_clocks(delay_s):
    """From the fewest clocks a sample on: the force comes behind the next sample, with it, and before it."""
    changes = LINEAR | OVERLAPPING | {"controller.estimator": "fdm", "handle.mass_kg": 0.005}
    changes |= {"amplifier.delay_s": delay_s}
    design = load("seed-2011", changes).spec.design
    path = design.latency_to_drive + latency(0)
    for clocks in (design.interval, path - 1, path, path + 1, 2 * path):
        scene = load("seed-2011", changes | {"controller.clock_hz": clocks * 50_000})
        for stiffness, damping in ((300e3, 5.0), (800e3, 20.0), (100e3, 60.0)):
            exact = radius_clock_by_clock(scene, stiffness, damping)
            assert theory.Loop(scene).radius(stiffness, damping) == pytest.approx(exact, rel=1e-9), clocks


def test_a_loop_without_damping_anywhere_is_unstable_at_every_stiffness():
    scene = load("seed-2011", {"handle.viscous_n_s_per_m": 0.0, "controller.estimator": "fdm"})
    assert theory.linear_limit_n_per_m(theory.Loop(scene), 0.0) == 0.0


def test_a_fast_undelayed_loop_has_the_limit_of_gil_and_hulin():
    """K < (b + B) / (T / 2 + delay) is linear stability's first order in T, without the estimator's half sample."""
    changes = {"controller.estimator": "fdm", "handle.viscous_n_s_per_m": 5.0}
    scene = load("mhz", changes)
    delay_s = (scene.spec.design.latency_to_drive + latency(scene.glitch_clocks)) / scene.spec.clock_hz
    expected = 5.0 / (0.5e-6 + delay_s)
    assert theory.linear_limit_n_per_m(theory.Loop(scene), 0.0) == pytest.approx(expected, rel=0.01)


def test_other_estimators_are_refused():
    with pytest.raises(ValueError, match=r"^estimator must be one of fdm, butterworth .*, not 'levant'$"):
        theory.Loop(load("seed-2011"))


def test_passivity():
    prompt = {"amplifier": None, "controller.clock_hz": 1_000_000_000, "handle.viscous_n_s_per_m": 3.0}
    scene = load("seed-2011", prompt)
    assert 0 < theory.delay_s(scene) < 1e-7
    # A nearly prompt wall has the condition b > K T / 2 + |B|.
    for damping in (1.0, -1.0):
        assert theory.colgate_schenkel_n_per_m(scene, damping) == pytest.approx((3 - 1) / 0.5e-3, rel=1e-3)
    assert theory.colgate_schenkel_n_per_m(scene, 4.0) == 0
    assert theory.abbott_okamura_n_per_m(scene) == pytest.approx(2 * 3 * 1000, rel=1e-3)
    damped = load("seed-2011", prompt | {"handle.viscous_n_s_per_m": 300.0})
    assert theory.abbott_okamura_n_per_m(damped) == pytest.approx(2 * 0.1 / 1e-6)


@pytest.mark.parametrize("damping", [0.0, 1.0, 3.0])
def test_a_late_wall_is_passive_as_colgate_and_schenkel_s_own_condition_has_it(damping):
    """b > T/2 sup Re((1 - z^-1) H(z)) / (1 - cos), evaluated numerically with the wall a period late as H."""
    scene = load("seed-2011", {"controller.clock_hz": 1_000_000_000, "handle.viscous_n_s_per_m": 8.0})
    period_s, z = 1e-3, np.exp(1j * np.linspace(1e-3, np.pi, 100_001))

    def needed(stiffness):
        wall = (stiffness + damping / period_s * (1 - 1 / z)) / z
        return period_s / 2 * np.max(((1 - 1 / z) * wall).real / (1 - z.real))

    largest = theory.colgate_schenkel_n_per_m(scene, damping)
    assert largest > 1000
    assert needed(0.999 * largest) < 8.0 < needed(1.001 * largest)


@pytest.mark.parametrize("amplifier", ["as it is", None])
def test_a_passive_wall_is_within_the_linear_limit(amplifier):
    changes = {"handle.viscous_n_s_per_m": 8.0, "controller.estimator": "fdm"}
    scene = load("seed-2011", changes | ({"amplifier": None} if amplifier is None else {}))
    loop = theory.Loop(scene)
    for damping in np.linspace(0, 7, 8):
        assert 0 < theory.colgate_schenkel_n_per_m(scene, damping) < theory.linear_limit_n_per_m(loop, damping)
