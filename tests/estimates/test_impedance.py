"""Stiffness and damping that a wall renders, against the linear theory with a bound of the counts, and by hand."""

import cmath
import math

import numpy as np
import pytest

from hardwall.model.encoder.quadrature import latency
from hardwall.sim.estimates import impedance
from hardwall.sim.estimates.motions import Sine
from hardwall.sim.estimates.moved_handle import Answer, MotionError
from hardwall.sim.scene.case import Case
from hardwall.sim.studies.rates import at_rate
from hardwall.sim.walls import theory
from stimuli.lengths import LONG

AMPLITUDE_M = 1e-3
FILTER = {"controller.gains.butterworth": {"cutoff_hz": 150.0}}
WALL = {"wall.stiffness_n_per_m": 5e3, "wall.damping_n_s_per_m": 5.0}
"""So soft that the motion asks for less than the largest force."""
LINEAR = {"fdm": {}, "butterworth": FILTER}
AT = [(rate_hz, frequency_hz) for rate_hz in (1_000, 10_000, 1_000_000) for frequency_hz in (20, 130)]
if not LONG:
    AT = [(1_000, 20), (10_000, 130), (1_000_000, 130)]


def case(estimator: str, rate_hz: int | None, **changes) -> Case:
    own = {} if rate_hz is None else at_rate(rate_hz)
    chosen = {"controller.estimator": estimator, "controller.output": None} | WALL | LINEAR[estimator]
    return Case.of("seed-2011", own | chosen | {key.replace("__", "."): value for key, value in changes.items()})


def measured(of: Case, backend: str, frequency_hz: int, amplitude_m: float = AMPLITUDE_M) -> list[complex]:
    result = impedance.measure(
        **of.job(), backend=backend, frequency_hz=frequency_hz, amplitude_m=amplitude_m, starts=3
    )
    assert result["flags"] == []
    parts = zip(result["stiffness_n_per_m"], result["damping_n_s_per_m"], strict=True)
    return [complex(k, math.tau * frequency_hz * b) for k, b in parts]


@pytest.mark.parametrize(("rate_hz", "frequency_hz"), AT)
@pytest.mark.parametrize("estimator", LINEAR)
def test_float64_renders_what_theory_expects_within_a_count(estimator, rate_hz, frequency_hz):
    """The bound is derived in `impedance`: q / A of the magnitude."""
    of = case(estimator, rate_hz)
    expected = theory.impedance_n_per_m(of.scene, frequency_hz)
    bound = abs(expected) * of.scene.encoder.count_m / AMPLITUDE_M
    for found in measured(of, "float", frequency_hz):
        assert abs(found - expected) <= bound


@pytest.mark.parametrize("estimator", LINEAR)
def test_words_render_it_but_for_their_rounding(estimator):
    """A force is off by at most its LSB for the words' own K and B, so that a component of it is by twice that."""
    of, frequency_hz = case(estimator, 10_000), 130
    scene, words = of.scene, {word.name: word for word in of.scene.spec.design.words}
    own = (words[name].to_si(scene.words[name]) for name in ("wall_stiffness", "wall_damping"))
    expected = theory.impedance_n_per_m(scene.hitting(*own), frequency_hz)
    bound = abs(expected) * scene.encoder.count_m / AMPLITUDE_M
    bound += 2 * scene.controller.force_resolution_n / AMPLITUDE_M
    if estimator == "butterworth":
        # Its velocity is that of float64 to an LSB, by which the damper's force is off.
        velocity = scene.spec.design.estimator.velocity.lsb * scene.spec.velocity_unit_m_per_s
        bound += 2 * scene.wall.damping_n_s_per_m * velocity / AMPLITUDE_M
    for found in measured(of, "fixed", frequency_hz):
        assert abs(found - expected) <= bound


def test_the_force_of_every_tenth_sample_a_period_late():
    """The scene's own rates: what counts do to the samples in between is bounded by the estimator's largest gain."""
    of, frequency_hz = case("fdm", None), 20
    scene = of.scene
    expected = theory.impedance_n_per_m(scene, frequency_hz)
    wall, count_m = scene.wall, scene.encoder.count_m
    # A place that is wrong by half a count either way makes a difference that is wrong by a count a sample.
    wrong_n = count_m * (wall.stiffness_n_per_m / 2 + wall.damping_n_s_per_m * scene.controller.sample_hz)
    assert scene.spec.samples_per_actuation == 10
    for found in measured(of, "float", frequency_hz):
        assert abs(found - expected) <= 2 * wrong_n / AMPLITUDE_M


@pytest.mark.parametrize("frequency_hz", [1, 20, 130, 499])
def test_theory_is_that_of_its_formula(frequency_hz):
    """K + j w B H, late by the clocks of decoder and path and held for a period, with H of a difference."""
    of = case("fdm", 1_000)
    scene, omega, period_s = of.scene, math.tau * frequency_hz, 1e-3
    late_s = (latency(2) + scene.spec.design.latency_to_drive) / 50e6
    through = (1 - cmath.exp(-1j * omega * period_s)) / (1j * omega * period_s)
    hold = math.sin(omega * period_s / 2) / (omega * period_s / 2) * cmath.exp(-1j * omega * (late_s + period_s / 2))
    assert theory.impedance_n_per_m(scene, frequency_hz) == pytest.approx(
        (5e3 + 1j * omega * 5.0 * through) * hold, rel=1e-12
    )
    assert theory.impedance_n_per_m(scene, frequency_hz, exact=True) == pytest.approx(
        (5e3 + 1j * omega * 5.0) * hold, rel=1e-12
    )


@pytest.mark.parametrize(("damping", "rate_hz"), [(2.2, 1_000), (2.8, 1_000), (0.15, 10_000), (0.35, 10_000)])
def test_a_spring_that_is_late_takes_damping_and_none_is_left_below_k_t(damping, rate_hz):
    """At a low frequency a damper renders B - K T, and T is half a period and the path: so it flips at B = K T."""
    frequency_hz, stiffness = 20, WALL["wall.stiffness_n_per_m"]
    of = case("fdm", rate_hz, wall__damping_n_s_per_m=damping)
    total_s = theory.delay_s(of.scene) + 0.5 / rate_hz
    omega = math.tau * frequency_hz
    # Sine and cosine of w T, and of a sample more for the difference, are theirs of w T = 0 but for its square; counts
    # add q / A of the magnitude.
    squares = (omega * (total_s + 1 / rate_hz)) ** 2 * (damping + stiffness * total_s)
    counts = math.hypot(stiffness, omega * damping) * of.scene.encoder.count_m / AMPLITUDE_M / omega
    for found in measured(of, "float", frequency_hz):
        rendered = found.imag / omega
        assert (rendered > 0) == (damping > stiffness * total_s)
        assert abs(rendered - (damping - stiffness * total_s)) <= squares + counts


def test_a_projection_takes_a_wave_apart_exactly():
    """A held force by hand: mean, spring, damper and a wave of three times the frequency, which is the rest."""
    motion, step_s = Sine(0.0, 2e-3, 25.0, 3e-3), 1e-3
    begins = 0.01 + step_s * np.arange(200)

    def held(frequency_hz, phase):
        """Return the means of a sine over every step."""
        omega = math.tau * frequency_hz
        ends = [np.cos(omega * (begins + motion.since_s + more) + phase) for more in (0.0, step_s)]
        return (ends[0] - ends[1]) / (omega * step_s)

    other = 0.3 * held(75.0, 0.2)
    forces = 1.5 + 2e-3 * (4e3 * held(25.0, 0.0) + math.tau * 25 * 7.0 * held(25.0, math.pi / 2)) + other
    push = Answer(np.zeros(200), forces, 0.01, step_s, [])
    found, rest_n = impedance.projected(push, motion, (40, 160))
    # A sine that was held already is held once more: its mean over a step is so much less.
    less = np.sinc(25.0 * step_s) ** 2
    assert found == pytest.approx(complex(4e3, math.tau * 25 * 7.0) * less, rel=1e-12)
    left = np.mean((forces[40:160] - 1.5) ** 2) - abs(found * 2e-3) ** 2 / 2
    assert rest_n == pytest.approx(math.sqrt(left), rel=1e-9)


def test_a_window_is_whole_periods_of_handle_and_force():
    for frequency_hz, rate_hz, samples in ((1, 1_000, 1_000), (130, 1_000, 100), (3, 10_000, 10_000), (50, 1_000, 100)):
        first, behind = impedance.samples_of(case("fdm", rate_hz).scene, frequency_hz)
        assert first == rate_hz // 10
        assert behind - first == samples
        assert samples * frequency_hz % rate_hz == 0
    first, behind = impedance.samples_of(case("fdm", None).scene, 7)
    assert (first, behind - first) == (1010, 10_000)


def test_a_start_moves_the_centre_by_less_than_a_count_and_the_phase_by_less_than_a_period():
    scene = case("fdm", 1_000).scene
    paths = [impedance.path(scene, 10, 1e-4, each) for each in map(impedance.start, range(40))]
    centres, phases = ([getattr(each, name) for each in paths] for name in ("centre_m", "since_s"))
    assert 2e-4 <= min(centres) < max(centres) < 2e-4 + 1e-6
    assert 0 <= min(phases) < max(phases) < 1e-3
    assert np.ptp(centres) > 0.8e-6
    assert np.ptp(phases) > 0.8e-3


@pytest.mark.parametrize(
    ("frequency_hz", "amplitude_m", "said"),
    [
        (100, 1e-7, "an amplitude of 0.0001 mm at 100 Hz is a way of 1e-07 m, which must be 1e-06 to 0.0375"),
        (1, 0.04, "an amplitude of 40 mm at 1 Hz is a way of 0.04 m, which must be 1e-06 to 0.0375"),
        (400, 1e-3, "an amplitude of 1 mm at 400 Hz is a speed of 2.51327 m/s, which must be 0 to 2"),
    ],
)
def test_a_handle_that_cannot_be_moved_so_is_refused(frequency_hz, amplitude_m, said):
    with pytest.raises(MotionError) as refused:
        impedance.check(case("fdm", 1_000).scene, frequency_hz, amplitude_m)
    assert str(refused.value) == said


def test_runs_of_too_many_samples_or_edges_are_refused(monkeypatch):
    scene = case("fdm", 1_000).scene
    impedance.check(scene, 100, 1e-3)
    monkeypatch.setattr(impedance, "SAMPLES_MAX", 199)
    with pytest.raises(MotionError, match="is a run of 200 samples, which must be 1 to 199"):
        impedance.check(scene, 100, 1e-3)
    monkeypatch.undo()
    # 100 Hz for 0.2 s are 20 periods, of 4000 counts each.
    monkeypatch.setattr(impedance, "EDGES_MAX", 79_000)
    with pytest.raises(MotionError, match="is a run of 80000 edges, which must be 0 to 79000"):
        impedance.check(scene, 100, 1e-3)
