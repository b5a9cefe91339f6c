"""The closed loop with an encoder as they are: RTL and model give the same force words with every error at once."""

import pytest

from hardwall.sim.scene.case import Case
from hardwall.sim.scene.load import load
from hardwall.sim.scene.tables import load_any
from hardwall.sim.studies.bench import under_cocotb
from hardwall.sim.walls import hit, hit_axes
from stimuli.lengths import LONG, long_form
from stimuli.scenes import CABLE, NARROW, ONE_SECOND, SHORT_OF_AXES

NEAR = ONE_SECOND | {"protocol.start_m": -2e-4} | NARROW
SCALE = {
    "encoder.edge_error_counts": 0.05,
    "encoder.cycles": [{"edges": 16, "error_counts": 0.05}, {"edges": 20, "error_counts": 0.02, "phase": 0.5}],
    "encoder.counts_per_turn": 400,
    "encoder.eccentricity_counts": 3.0,
    "encoder.hysteresis_counts": 0.3,
    "encoder.phase_error_counts": 0.05,
}
LINES = {"encoder.jitter_s": 2e-6, "encoder.glitches_hz": 300.0, "encoder.glitch_s": 2e-6}
DIES = {"encoder.dead": "a", "encoder.dead_s": 0.6}
ERRORS = {
    "scale": SCALE,
    "lines": LINES,
    "all": SCALE | LINES | DIES,
    "cable": SCALE | LINES | CABLE,
}
BRIEF = {"protocol.settle_s": 0.04, "protocol.mean_s": 0.01, "protocol.measure_s": 0.02}
if LONG:
    BRIEF = {"protocol.settle_s": 0.15, "protocol.mean_s": 0.05, "protocol.measure_s": 0.05}
CASES = [
    (estimator, name)
    for estimator in ("levant", "kalman", "period", "levant-edge")
    for name in ERRORS
    if LONG or (estimator, name) == ("levant", "all")
]


def same_words(changes: dict) -> hit.Hit:
    """Run `fixed` and `rtl`, compare them, and return the hit of `fixed`."""
    scene = load("seed-2011", changes)
    fixed, rtl = hit.run(scene, "fixed"), hit.run(scene, "rtl")
    assert fixed.force_sha256 == rtl.force_sha256
    for name in ("samples", "mean_m", "rms_m", "max_force_n", "flags"):
        assert getattr(fixed, name) == getattr(rtl, name), name
    assert fixed.max_force_n > 0.3
    return fixed


@pytest.mark.parametrize(("estimator", "name"), CASES)
def test_rtl_gives_the_models_force_words_with_errors_of_scale_and_lines(estimator, name):
    changes = NEAR | ERRORS[name] | {"controller.estimator": estimator, "controller.output": None}
    result = same_words(changes)
    absent = dict.fromkeys(ERRORS[name].keys() - CABLE.keys())
    perfect = hit.run(load("seed-2011", changes | absent), "fixed")
    assert result.force_sha256 != perfect.force_sha256


def test_the_loop_under_cocotb_sees_the_same_pins():
    case = Case.of("seed-2011", NEAR | ERRORS["lines"] | SCALE | {"protocol.start_m": -5e-6})
    short = case.changed(BRIEF)
    words = hit.run(short.scene, "fixed")
    assert under_cocotb(short, words.samples)["force_sha256"] == words.force_sha256
    assert words.max_force_n > 0


@long_form
def test_axes_of_one_pipeline_have_errors_of_their_own():
    own = {f"axis.elbow.{key}": value for key, value in SCALE.items()}
    own |= {
        "axis.elbow.encoder.jitter_s": 1e-8,
        "axis.elbow.encoder.glitches_hz": 2e4,
        "axis.elbow.encoder.glitch_s": 1e-7,
    }
    scene = load_any("eight-axes", SHORT_OF_AXES | own)
    fixed, rtl = (hit_axes.run(scene, backend) for backend in ("fixed", "rtl"))
    for name, each in fixed.hits.items():
        assert each.force_sha256 == rtl.hits[name].force_sha256, name


def test_a_run_in_pieces_has_the_glitches_of_a_whole_one():
    """Progress cuts the run into calls; what is on its way over the lines waits between them."""
    scene = load("seed-2011", NEAR | ERRORS["all"])
    whole, pieces = hit.run(scene, "fixed"), hit.run(scene, "fixed", progress=lambda _: None)
    assert whole.force_sha256 == pieces.force_sha256


def test_another_seed_is_another_encoder():
    changes = NEAR | ERRORS["all"]
    words = [hit.run(load("seed-2011", changes | {"encoder.seed": seed}), "fixed").force_sha256 for seed in (1, 1, 2)]
    assert words[0] == words[1] != words[2]
