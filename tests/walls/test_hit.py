"""The protocol of a hit: its report against plain NumPy on every sample of the run."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from hardwall.sim.loop.backends import opened
from hardwall.sim.scene.build import start_of, world_of
from hardwall.sim.scene.load import load
from hardwall.sim.walls import hit, repetition
from hardwall.sim.world.rigid import Motion, glide, span
from stimuli.lengths import LONG
from stimuli.scenes import CABLE, HAND, PULSES

# The wall is unstable, so that means and distances are large; no time is a whole number of chunks or actuations.
SCENE = {
    "protocol.settle_s": 0.8503,
    "protocol.mean_s": 0.1207,
    "protocol.measure_s": 0.2111,
    "wall.stiffness_n_per_m": 60e3,
    "protocol.verdict": "literal",
}


def traced(changes: dict) -> hit.Hit:
    """Return a run with an overview that holds every sample of one window."""
    scene = load("seed-2011", SCENE | changes)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hit, "OVERVIEW_POINTS", scene.samples)
        patch.setattr(hit, "CHUNK", 1000)
        return hit.run(scene, "fixed", traces=True)


@pytest.fixture(scope="module")
def run():
    """Return a run of the literal protocol."""
    return traced({})


def test_mean_rms_offset_and_drift_are_those_of_the_positions(run):
    detrended = traced({"protocol.verdict": "detrended", "protocol.longest_s": 1.0})
    x, settled = detrended.overview.position_m, 8503
    assert (x == run.overview.position_m).all()
    at, window = np.arange(2111), x[settled:]
    line = np.polynomial.Polynomial.fit(at, window, 1)
    assert detrended.rms_m == pytest.approx(np.sqrt(np.mean((window - line(at)) ** 2)), rel=1e-9)
    assert detrended.mean_m == pytest.approx(window.mean(), rel=1e-12)
    for each in (run, detrended):
        assert each.drift_m_per_s == pytest.approx(line.convert().coef[1] * 1e4, rel=1e-6)
        assert each.offset_m == pytest.approx(window.mean() - x[settled - 1207 : settled].mean(), rel=1e-9)


def test_mean_and_rms_of_the_literal_protocol_are_those_of_the_positions(run):
    x, settled = run.overview.position_m, 8503
    assert len(x) == run.samples == 8503 + 2111
    mean = x[settled - 1207 : settled].mean()
    assert run.mean_m == pytest.approx(mean, rel=1e-12)
    assert run.rms_m == pytest.approx(np.sqrt(np.mean((x[settled:] - mean) ** 2)), rel=1e-12)
    assert run.rms_m > 1e-4


def test_the_verdict_is_the_thresholds(run):
    assert not run.stable
    for factor, stable in ((0.999, False), (1.001, True)):
        threshold = {"protocol.threshold_mm": run.rms_m * 1e3 * factor}
        assert hit.run(load("seed-2011", SCENE | threshold), "fixed").stable is stable


@pytest.mark.parametrize("side", [-1, 1])
def test_in_place_is_within_friction_a_count_and_the_rms(run, side):
    """The case has 60 kN/m, a push of 0.3572 N, 0.1 N of friction, counts of 1 um, and an RMS of 2 um."""
    farthest_n = 0.1 + 60e3 * 3e-6
    for factor, in_place in ((0.999, True), (1.001, False)):
        mean_m = (0.3572 + side * factor * farthest_n) / 60e3
        assert replace(run, mean_m=mean_m, rms_m=2e-6).in_place is in_place


CODES = {"output.full_scale_n": 32.0, "output.dac_bits": 8}
FIRM = HAND | {"hand.stiffness_n_per_m": 40e3, "hand.rest_m": 1e-4}


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("parts", "carried_n", "farthest_n", "spring_n_per_m"),
    [
        (PULSES, 0.3572, 0.1 + 2 * 50 / 300, 0.0),
        (CODES, 0.3572, 0.1 + 2 * 32 / 2**8, 0.0),
        (CABLE, 0.3572, 0.1, 0.0),
        (CABLE | {"transmission.encoder_at": "motor"}, 0.3572, 0.1 + 60e3 / 2e5 * (0.3572 + 0.1), 0.0),
        (FIRM, 0.3572 + 40e3 * 1e-4, 0.1, 40e3),
    ],
    ids=["pulses", "converter", "cable", "encoder at the motor", "hand"],
)
def test_in_place_allows_what_a_part_hides(run, side, parts, carried_n, farthest_n, spring_n_per_m):
    """The cases have counts of 1 um and an RMS of 2 um. The force that a hand carries shrinks as the hand follows."""
    scene = load("seed-2011", SCENE | parts)
    for factor, in_place in ((0.999, True), (1.001, False)):
        off_n = side * factor * (farthest_n + 60e3 * 3e-6)
        mean_m = (carried_n + off_n) / (60e3 + spring_n_per_m)
        assert replace(run, scene=scene, mean_m=mean_m, rms_m=2e-6).in_place is in_place


@pytest.mark.parametrize(("sample_hz", "met"), [(10_000, True), (20_000, True), (15_000, False)])
def test_a_chatter_that_the_force_always_meets_on_one_side_is_stable_and_out_of_place(sample_hz, met):
    """Levant's u with large gains has a period of two samples; the force is updated every 10, 20 or 15 of them."""
    lam, alpha, tau = 100.0, 560.0, 1 / sample_hz
    gains = {"controller.gains.levant": {"lambda_sqrt_m_per_s": lam, "alpha_m_per_s2": alpha}}
    wall = {"wall.stiffness_n_per_m": 20e3, "wall.damping_n_s_per_m": 100.0}
    result = hit.run(load("seed-2011", gains | wall | {"controller.sample_hz": sample_hz}), "fixed")
    assert result.stable is met
    # x goes from e to -e and back, 2 e = tau u, and u = lambda sqrt(e) - alpha tau / 2 where u1 is even about 0; it may
    # be one of its steps off, alpha tau.
    root = lam * (tau / 2) ** 0.5
    speed = ((root + (root**2 - 2 * alpha * tau) ** 0.5) / 2) ** 2
    damper_n = 20e3 * result.mean_m - 0.3572
    assert (abs(damper_n - 100.0 * speed) <= 100.0 * alpha * tau + 0.1 + 20e3 * 1e-6) is met
    assert not (result.stable and result.in_place)


def test_the_digest_is_of_the_drive_of_every_actuation(run):
    words = np.round(run.overview.force_n / run.scene.spec.force_resolution_n)[::10].astype("<i4")
    assert run.force_sha256 == hashlib.sha256(words.tobytes()).hexdigest()
    assert run.max_force_n == pytest.approx(np.abs(run.overview.force_n).max())


def test_the_estimates_error_is_that_of_the_contact_alone(run):
    inside = run.detail.position_m > 0
    first = int(np.argmax(inside))
    last = first + int(np.argmin(inside[first:]))
    assert 0 < first < last < len(inside)
    assert not inside[last]
    assert run.contact == slice(first, last)
    assert run.contact_s == run.detail.time_s[first]
    error = (run.detail.estimate_m_per_s - run.detail.velocity_m_per_s)[first:last]
    assert run.estimate_rms_m_per_s == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)


def test_a_contact_lasts_at_most_as_long_as_its_trace(run):
    def traced(position_m):
        return replace(run, detail=replace(run.detail, position_m=position_m))

    inside = run.detail.position_m > 0
    stays = traced(np.where(np.arange(len(inside)) < 100, -1e-6, 1e-6))
    assert stays.contact == slice(100, len(inside))
    away = traced(-np.ones(len(inside)))
    assert away.contact is None
    assert away.contact_s == run.samples / 10_000
    assert away.estimate_rms_m_per_s is None
    plain = replace(run, overview=None, detail=None)
    assert plain.estimate_rms_m_per_s is None
    assert "--plot" in " ".join(plain.notes())
    assert run.notes() == []
    (note,) = replace(run, judged="undecided").notes()
    assert "protocol.longest_s" in note


def test_the_overview_has_the_extremes_between_its_samples(run, monkeypatch):
    """The estimate chatters, and every tenth sample alone would hide how far."""
    monkeypatch.setattr(hit, "OVERVIEW_POINTS", run.samples // 10)
    coarse, every = hit.run(run.scene, "fixed", traces=True).overview, run.overview
    starts = np.arange(0, run.samples, 10)
    assert coarse.position_m.tolist() == every.position_m[starts].tolist()
    error = every.estimate_m_per_s - every.velocity_m_per_s
    assert coarse.error_least_m_per_s == pytest.approx(np.minimum.reduceat(error, starts), abs=1e-15)
    assert coarse.error_largest_m_per_s == pytest.approx(np.maximum.reduceat(error, starts), abs=1e-15)
    assert coarse.force_least_n.tolist() == np.minimum.reduceat(every.force_n, starts).tolist()
    assert coarse.force_largest_n.tolist() == np.maximum.reduceat(every.force_n, starts).tolist()
    assert np.abs(error[starts] - coarse.error_least_m_per_s).max() > 0.01


def test_scene_keys_reach_the_hardwares_words():
    spec = load("seed-2011").spec
    words = {word.name: word for word in spec.design.words}
    changed = load("seed-2011", {"controller.slew_limit_n_per_s": 500.0, "wall.forbid_pull": True}).words
    assert words["output_slew_limit"].to_si(changed["output_slew_limit"]) == 500.0
    assert changed["wall_forbid_pull"] == 1
    assert load("seed-2011").words["wall_forbid_pull"] == 0


def test_a_slew_limit_limits_and_a_wall_that_may_not_pull_does_not():
    free, slow, pushing = (
        hit.run(load("seed-2011", change), "fixed", traces=True)
        for change in ({}, {"controller.slew_limit_n_per_s": 500.0}, {"wall.forbid_pull": True})
    )
    assert "slew_limited" in slow.flags
    assert "slew_limited" not in free.flags
    growth, unlimited = (np.diff(np.abs(result.detail.force_n)).max() for result in (slow, free))
    assert growth <= 0.5 + 1e-9 < unlimited
    assert free.detail.force_n.max() > 0.1
    assert pushing.detail.force_n.max() == 0


def test_half_samples_in_the_protocol_are_no_trouble():
    times = {"protocol.settle_s": 3.5e-4, "protocol.mean_s": 1e-4, "protocol.measure_s": 1e-4, "amplifier": None}
    assert hit.run(load("seed-2011", times), "fixed").samples == 5


EARLY = [
    ("fdm", "fixed", "detrended", 3),
    ("fdm", "float", "literal", 2),
    ("levant", "float", "detrended", 1),
    ("levant", "fixed", "literal", 2),
    ("kalman", "fixed", "detrended", 3),
    ("foaw", "fixed", "detrended", 0),
    ("period", "fixed", "detrended", 0),
]
"""Estimator, backend, verdict, and how many hits at least end early: none with a long cycle in the state, or stamps."""


@pytest.mark.parametrize(("estimator", "backend", "verdict", "least"), EARLY if LONG else EARLY[2:4])
def test_an_early_end_changes_no_verdict(estimator, backend, verdict, least):
    """A detrended run ends early if the handle rests for ever, a literal one if it is sure to be unstable."""
    ended = 0
    for stiffness in (5e3, 40e3, 150e3):
        for damping in (10.0, 60.0, 300.0):
            wall = {"wall.stiffness_n_per_m": stiffness, "wall.damping_n_s_per_m": damping}
            scene = load("seed-2011", wall | {"controller.estimator": estimator, "protocol.verdict": verdict})
            whole, early = hit.run(scene, backend), hit.run(scene, backend, until_sure=True)
            assert (early.verdict, early.in_place) == (whole.verdict, whole.in_place), wall
            ended += early.samples < whole.samples
            if whole.stable or early.samples == whole.samples:
                # Sums over other pieces round differently.
                for of in ("rms_m", "mean_m", "offset_m", "drift_m_per_s"):
                    assert getattr(early, of) == pytest.approx(getattr(whole, of), rel=1e-9, abs=1e-14), of
    assert ended >= least
    assert least or not ended


LATE = {"amplifier.delay_s": 1e-6}


def test_a_wall_that_settles_late_is_not_ended_early():
    """The force is at its limit for a sample now and then, but the handle still comes to rest."""
    changes = {"controller.estimator": "fdm", "protocol.push_n": 0.138, "wall.stiffness_n_per_m": 10e3}
    changes |= {"wall.damping_n_s_per_m": 40.0, "protocol.verdict": "literal"}
    # With an amplifier that is late the loop is that of `seed-2011`, which others compile, too.
    scene, backend = (load("mhz", changes), "float") if LONG else (load("mhz", changes | LATE), "fixed")
    result = hit.run(scene, backend, until_sure=True)
    assert result.stable
    assert result.samples == result.scene.samples


@pytest.mark.parametrize("mass_kg", [1e-3, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0])
def test_a_heavy_handle_in_a_stable_wall_is_never_unstable(mass_kg):
    """It bounces for a while, so slowly that the windows of 2 s have a swing or two; the lightest one never rests."""
    changes = {"controller.estimator": "fdm", "handle.mass_kg": mass_kg}
    verdicts = (
        hit.run(load("seed-2011", changes | longest), "fixed", until_sure=True).verdict
        for longest in ({}, {"protocol.longest_s": 400.0})
    )
    truth = "stable" if mass_kg > 0.01 else "unstable"
    assert tuple(verdicts) == ("undecided" if mass_kg > 20 else truth, truth)


@pytest.mark.parametrize("part", ["state", "delay", "force"])
def test_a_loop_that_differs_in_one_thing_does_not_repeat(part):
    """What the handle's rest depends on is compared: an early end after a look that differs is refused."""
    scene = load("seed-2011", {"wall.damping_n_s_per_m": 60.0, "controller.estimator": "fdm"})
    loop = hit.Loop(scene, "fixed", False, True)
    with opened(scene.spec, "fixed", scene.parameters, loop.start_level) as axis:
        state, at, memory = axis.state, loop.at, loop.memory
        clocks = scene.spec.clocks_per_sample
        before = repetition.seen(state, at, memory, clocks)
        later = state._replace(clock=state.clock + 2520 * clocks), at._replace(sample=2520)
        assert repetition.seen(*later, memory, clocks) == before
        if part == "state":
            later = later[0]._replace(axis=state.axis._replace(flags=1)), later[1]
        elif part == "force":
            later = later[0], later[1]._replace(force_n=at.force_n + 1e-16)
        else:
            memory.delay[3] = 1
        assert repetition.seen(*later, memory, clocks) != before


def test_a_start_is_at_its_place_in_the_count_with_its_phase_of_the_push():
    """The push of 0.3572 N less 0.1 N of friction, on 0.35 kg, with 1 N s/m."""
    changes = {"protocol.start_counts": 0.25, "protocol.start_periods": 0.5}
    for parts in ({}, CABLE | {"transmission.stiffness_n_per_m": 1e7}):
        scene = load("seed-2011", changes | parts)
        begin = start_of(scene, world_of(scene))
        # -0.07 / 1e-6 is rounded down: the handle of the scene's own start is at the upper end of its count.
        assert begin.moment.cell == start_of(load("seed-2011"), world_of(load("seed-2011"))).moment.cell
        assert begin.moment.motion.position_m == pytest.approx(-0.07 - 0.75e-6, abs=1e-15)
        if not parts:
            assert begin.moment.motion.velocity_m_per_s == pytest.approx(0.2572 * -np.expm1(-0.5e-3 / 0.35), rel=1e-12)
        else:
            assert begin.moment.motion.velocity_m_per_s > 0
    assert (
        start_of(load("seed-2011", {"protocol.start_counts": 0.0}), world_of(scene)).moment.motion.velocity_m_per_s == 0
    )


def test_a_phase_is_the_same_motion_some_time_later():
    """A start that was pushed for half a period goes as one from rest there whose samples come half a period later."""
    scene = load("seed-2011", {"protocol.start_periods": 0.5})
    begin = start_of(scene, world_of(scene)).moment.motion
    handle = world_of(scene).plant.handle
    rest_m = begin.position_m - glide(Motion(0.0, 0.0), 0.2572, span(handle, 0.5e-3)).position_m
    later = glide(begin, 0.2572, span(handle, 0.1))
    whole = glide(Motion(rest_m, 0.0), 0.2572, span(handle, 0.1005))
    assert later.position_m == pytest.approx(whole.position_m, abs=1e-14)
    assert later.velocity_m_per_s == pytest.approx(whole.velocity_m_per_s, rel=1e-12)
