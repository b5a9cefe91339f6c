"""The closed loop: the RTL, through its pins, gives all force words of the model."""

import json
import math
from collections.abc import Iterable

import numpy as np
import pytest

from hardwall.cli import app
from hardwall.model.axis.design import Design, overlap_of
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.studies.bench import under_cocotb
from hardwall.sim.walls import hit
from stimuli.bristles import DAHL_KEYS, LUGRE_KEYS
from stimuli.hit_paths import path_of
from stimuli.lengths import LONG, long_form
from stimuli.outputs import EVERY_OUTPUT
from stimuli.scenes import AMPLIFIER, CABLE, DRIVE, HAND, ONE_SECOND, SHUNT, TWO_SECONDS

STABLE = {"wall.stiffness_n_per_m": 10e3, "wall.damping_n_s_per_m": 20.0}
UNSTABLE = {"wall.stiffness_n_per_m": 100e3, "wall.damping_n_s_per_m": 20.0, "protocol.longest_s": 6.0}
ESTIMATORS = {
    f"{name} {output}": {"controller.estimator": name, "controller.output": output} for name, output in EVERY_OUTPUT
}
CORE = ("levant u", "levant u1", "fdm u")
WHOLE = tuple(ESTIMATORS) if LONG else ("levant u",)
"""These run whole in both walls, by `make soak` all; the others run for two seconds in one wall."""
KINDS = ("levant",)
LOOPS = tuple(name for name in ESTIMATORS if LONG or name.split()[0] in KINDS)
"""The others are left to the long form; their blocks are held to the model anyway. Stamps of edges are in `QUICK`."""
IMPERFECT = tuple(ESTIMATORS) if LONG else ("levant u",)
"""These have an encoder with errors; so has the wall that throws the handle back."""
QUICK = (*CORE, "levant-edge u") if LONG else ("levant-edge u",)
"""These run at 1 MHz, and one of them, or two in the long form, in a wall that throws the handle back."""
A_FIFTH = {
    "protocol.settle_s": 0.14, "protocol.mean_s": 0.02, "protocol.measure_s": 0.06, "protocol.longest_s": 0.2,
    "protocol.start_m": -1e-3,
}  # fmt: skip
"""A fifth of a second, from a start near the wall."""
AS_SEED_2011 = {} if LONG else {"amplifier.delay_s": 1e-6}
"""For `mhz`: the part that `seed-2011` has, too, as short as a sample. Both then have one loop to compile."""
SLOW = {"controller.clock_hz": 1_000_000, "controller.speed_max_m_per_s": 0.3}
"""A clock with few idle clocks between samples, which are most of the scene's own: these run in `WHOLE`, and for both
outputs of Levant's differentiator, whose hardware is one."""


def same_words(scene: str, changes: dict) -> hit.Hit:
    """Run `fixed` and `rtl`, compare them, and return the hit of `fixed`."""
    loaded = load(scene, changes)
    fixed, rtl = hit.run(loaded, "fixed"), hit.run(loaded, "rtl")
    assert fixed.force_sha256 == rtl.force_sha256
    for name in ("samples", "mean_m", "rms_m", "max_force_n", "flags"):
        assert getattr(fixed, name) == getattr(rtl, name), name
    return fixed


@pytest.mark.parametrize("estimator", LOOPS)
def test_rtl_gives_the_models_force_words(estimator):
    """Two seconds have the way, the contact, the bounces, and half a second of what the handle does from then on."""
    whole, slow = estimator in WHOLE, {} if estimator.startswith("levant ") else SLOW
    result = same_words("seed-2011", ESTIMATORS[estimator] | STABLE | ({} if whole else TWO_SECONDS | slow))
    assert result.samples == (60_000 if whole else 20_000)
    assert result.max_force_n > 1
    assert result.stable or estimator not in CORE


@pytest.mark.parametrize("estimator", WHOLE)
def test_rtl_gives_the_models_force_words_in_an_unstable_wall(estimator):
    result = same_words("seed-2011", ESTIMATORS[estimator] | UNSTABLE)
    assert result.samples == 60_000
    assert not (result.stable and estimator in CORE)


@pytest.mark.parametrize("scene", ["seed-2011", "mhz"] if LONG else ["mhz"])
def test_rtl_gives_the_models_force_words_with_a_passivity_controller(scene):
    """In a wall without a damper, which chatters, and where the controller halves its own again and again."""
    changes = {"wall.stiffness_n_per_m": 100e3, "wall.damping_n_s_per_m": 0.0, "passivity.damping_n_s_per_m": 50.0}
    result = same_words(scene, changes | (ONE_SECOND | SLOW if scene == "seed-2011" else AS_SEED_2011 | A_FIFTH))
    assert result.max_force_n > 1
    assert "passivity_active" in result.flags


@pytest.mark.parametrize("estimator", IMPERFECT)
def test_rtl_gives_the_models_force_words_with_an_imperfect_encoder(estimator):
    errors = {"encoder.phase_error_counts": 0.25, "encoder.duty_error_counts": 0.1}
    slow = {} if estimator in WHOLE else SLOW
    result = same_words("seed-2011", ESTIMATORS[estimator] | UNSTABLE | errors | ONE_SECOND | slow)
    assert result.max_force_n > 1


@long_form
@pytest.mark.parametrize("keys", [LUGRE_KEYS, DAHL_KEYS], ids=lambda keys: keys["presliding.model"])
def test_rtl_gives_the_models_force_words_on_bristles(keys):
    result = same_words("seed-2011", keys | STABLE | ONE_SECOND | SLOW)
    assert result.samples == 10_000
    assert result.max_force_n > 1
    assert result.force_sha256 != hit.run(load("seed-2011", STABLE | ONE_SECOND | SLOW), "fixed").force_sha256


@pytest.mark.parametrize("output", ["dac", "pwm"] if LONG else ["dac"])
def test_rtl_gives_the_models_force_words_on_a_device_of_every_part(output):
    """The plant advances between the same instants, whatever its parts."""
    parts = AMPLIFIER | CABLE | HAND | DRIVE | {"amplifier.current_limit_a": 10.0, "output.full_scale_n": 40.0}
    parts |= {"output.dac_bits": 12} if output == "dac" else {"output.pwm_carrier_hz": 20_000, "output.pwm_steps": 600}
    parts |= {"protocol.push_n": 2.0}  # pulses meet the voltage's limit, and push the less
    assert same_words("seed-2011", STABLE | ONE_SECOND | parts).max_force_n > 1


@long_form
@pytest.mark.parametrize("keys", [SHUNT, {"motor.damping_resistance_ohm": 3.0}], ids=len)
def test_rtl_gives_the_models_force_words_with_a_damping_circuit(keys):
    changes = STABLE | ONE_SECOND | SLOW | {"protocol.start_m": -0.01}
    found = same_words("drive-2011", changes | keys)
    assert found.max_force_n > 1
    assert hit.run(load("drive-2011", changes | keys), "float").max_force_n == pytest.approx(found.max_force_n, rel=0.1)
    assert hit.run(load("drive-2011", changes), "fixed").force_sha256 != found.force_sha256


QUICK_HIT = {
    "controller.glitch_clocks": 0, "controller.travel_m": 0.01, "controller.speed_max_m_per_s": 0.2,
    "encoder.count_m": 1e-7, "protocol.start_m": -1e-5, "protocol.push_n": 20.0, "protocol.settle_s": 4e-3,
    "protocol.mean_s": 1e-3, "protocol.measure_s": 2e-3, "wall.stiffness_n_per_m": 100e3,
}  # fmt: skip
"""A hard hit near the start of `mhz`: a count at every other sample, and a wall that throws the handle back."""
CLOSE = [
    (estimator, overlap)
    for estimator in ("levant u", "fdm u", "levant-edge u")
    for overlap in ("all", "no slack", "some", "none")
    if LONG or (estimator, overlap) == ("levant u", "all")
]


def spacings(design: Design, overlap: str) -> Iterable[int]:
    """Return the clocks a sample with which samples overlap so much; the long test has every number of them."""
    least, latency = design.interval, design.latency_to_drive
    few = {"all": [least], "some": [latency - 1], "no slack": [latency], "none": [latency + 2]}
    every = few | {"some": range(least + 1, latency), "none": [latency + 1, latency + 2]}
    return (every if LONG else few)[overlap]


@pytest.mark.parametrize(("estimator", "overlap"), CLOSE)
def test_rtl_gives_the_models_force_words_however_closely_samples_follow(estimator, overlap):
    """From the fewest clocks that the axis takes: two samples are under way at once, or the strobe comes as the drive
    changes, or before the next one there is a rest."""
    changes = ESTIMATORS[estimator] | QUICK_HIT
    for clocks in spacings(load("mhz", changes).spec.design, overlap):
        case = Case.of("mhz", changes | {"controller.clock_hz": clocks * 1_000_000})
        assert overlap_of(case.scene.spec.design.timing) == (overlap in ("all", "some"))
        result = same_words("mhz", case.changes)
        assert result.max_force_n > 30
        # Under cocotb it is a second build; `test_pins` has one.
        assert not LONG or under_cocotb(case, result.samples)["force_sha256"] == result.force_sha256


def test_rtl_gives_the_models_force_words_and_flags_when_the_encoder_is_too_fast():
    # The motor turns the encoder faster than promised: on a slow clock, no level lasts as long as the longest filter.
    changes = {"protocol.push_n": 20.0, "encoder.phase_error_counts": 0.1, "controller.glitch_clocks": 15}
    changes |= {"controller.clock_hz": 2_000_000, "controller.speed_max_m_per_s": 0.2}
    result = same_words("seed-2011", changes | (ONE_SECOND if LONG else A_FIFTH | {"protocol.start_m": -0.01}))
    assert "encoder_overspeed" in result.flags
    assert result.max_force_n == 0, "a position that is a guess drives nothing"


@pytest.mark.parametrize("estimator", QUICK)
def test_rtl_gives_the_models_force_words_at_a_megahertz(estimator):
    result = same_words("mhz", ESTIMATORS[estimator] | AS_SEED_2011 | (ONE_SECOND if LONG else A_FIFTH))
    assert result.samples == (1_000_000 if LONG else 200_000)
    assert result.max_force_n > 1


@pytest.mark.parametrize("estimator", ["levant u", "levant-edge u"] if LONG else ["levant-edge u"])
def test_rtl_gives_the_models_force_words_at_a_megahertz_in_a_wall_that_throws_the_handle_back(estimator):
    """The stiffest wall that the words hold, and an encoder out of phase."""
    wall = {"wall.stiffness_n_per_m": 200e3, "wall.damping_n_s_per_m": 0.0, "encoder.phase_error_counts": 0.25}
    seconds = ONE_SECOND | {"protocol.measure_s": 0.05} if LONG else A_FIFTH
    result = same_words("mhz", ESTIMATORS[estimator] | AS_SEED_2011 | wall | seconds)
    assert not result.stable


def test_float_and_fixed_agree_on_what_the_wall_does():
    for changes, stable in ((STABLE, True), (UNSTABLE, False)):
        floating, fixed = (hit.run(load("seed-2011", changes), backend) for backend in ("float", "fixed"))
        assert floating.stable is fixed.stable is stable
        assert floating.max_force_n == pytest.approx(fixed.max_force_n, rel=0.02)


def test_the_first_moments_are_those_of_the_undisturbed_handle():
    """Until the wall, the handle is a mass under constant force: the loop must not have touched it."""
    scene = load("seed-2011", ONE_SECOND)
    position_m, _ = path_of(scene, "float")
    time_s = np.arange(len(position_m)) / scene.spec.sample_hz
    free = time_s < 0.5
    m, b, force = scene.handle.mass_kg, scene.handle.viscous_n_s_per_m, scene.protocol.push_n - scene.handle.coulomb_n
    t = time_s[free]
    exact = scene.protocol.start_m + force / b * (t - m / b * (1 - np.exp(-b * t / m)))
    assert np.abs(position_m[free] - exact).max() < 1e-12


def test_a_late_amplifier_is_late_by_exactly_its_delay():
    """With a delay the handle feels the wall later by the delay, and leaves the path of the prompt handle only then."""
    late = load("seed-2011", ONE_SECOND | {"amplifier.delay_s": 5e-3})
    prompt = load("seed-2011", ONE_SECOND | {"amplifier.delay_s": 0.0})
    paths = [hit.run(scene, "fixed", traces=True).detail for scene in (late, prompt)]
    apart = int(np.argmax(paths[0].position_m != paths[1].position_m))
    first_force = int(np.argmax(paths[1].force_n != 0))
    assert apart == first_force + 1
    # The motor pushes the late handle until the first force acts, exactly 50 samples late.
    speed = np.diff(paths[0].velocity_m_per_s[first_force : first_force + 53])
    assert (speed[:50] > 0).all()
    assert (speed[51:] < 0).all()


def test_a_hit_can_be_repeated():
    first, second = (hit.run(load("seed-2011"), "fixed") for _ in range(2))
    assert (first.force_sha256, first.rms_m) == (second.force_sha256, second.rms_m)


def test_pictures_traces_and_waveforms_are_written(tmp_path, capsys, monkeypatch):
    picture, trace, wave = (tmp_path / name for name in ("hit.svg", "hit.npz", "hit.fst"))
    short = [f"--set={key}={value}" for key, value in (ONE_SECOND | ({} if LONG else SLOW)).items()]
    monkeypatch.setattr("signal.signal", lambda *_: None)  # the signals are pytest's
    for option, path, backend in (("--plot", picture, "fixed"), ("--trace", trace, "fixed"), ("--trace", wave, "rtl")):
        monkeypatch.setattr("sys.argv", ["hardwall", "hit", "--backend", backend, option, str(path), "--json", *short])
        app.main()
        report = json.loads(capsys.readouterr().out)
        assert report["force_sha256"]
    for text in (
        "position (mm)",
        "velocity (m/s)",
        "force (N)",
        "time (s)",
        "error (mm/s)",
        "estimate (levant u)",
        "true",
    ):
        assert text in picture.read_text()
    with np.load(trace) as arrays:
        assert json.loads(str(arrays["report"]))["samples"] == 10_000
        assert arrays["detail_force_n"].min() < -1
        assert math.isclose(arrays["overview_time_s"][-1], 1.0, abs_tol=0.01)
    names = fst_names(wave)
    assert {"axis.encoder_a", "axis.drive[17:0]", f"axis.axis.estimator.u1[{19 if LONG else 16}:0]"} <= names
    assert not any("$auto" in name for name in names)


def fst_names(path) -> set[str]:
    """Return the full names of the signals of a waveform that changed in it."""
    import pylibfst  # noqa: PLC0415

    reader = pylibfst.lib.fstReaderOpen(str(path).encode())
    assert reader != pylibfst.ffi.NULL
    assert pylibfst.lib.fstReaderGetEndTime(reader) > pylibfst.lib.fstReaderGetStartTime(reader) > 0
    assert pylibfst.lib.fstReaderGetValueChangeSectionCount(reader) > 0
    _, signals = pylibfst.get_scopes_signals2(reader)
    names = {name.replace(" ", "") for name in signals.by_name}
    pylibfst.lib.fstReaderClose(reader)
    return names
