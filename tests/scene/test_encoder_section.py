"""The section `encoder`: what it refuses, and what the decoder's limits and the glitch filter take of its errors."""

import math

import numpy as np
import pytest

from hardwall.model.encoder.quadrature_speed import max_edge_rate
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.scene.tables import load_any
from hardwall.sim.walls import hit
from hardwall.sim.world.encoder import Encoder, edge
from stimuli.lengths import LONG
from stimuli.scenes import ONE_SECOND

CYCLE = {"edges": 16, "error_counts": 0.1}
EMISSION = {"emission_period_s": 2e-5, "edge_separation_s": 5e-7}
GLITCHES = {"encoder.glitches_hz": 50.0, "encoder.glitch_s": 1e-7}
REFUSED = [
    ({"edge_error_counts": 0.24}, "edge_error_counts must be a number of 0 to 0.2375, not 0.24"),
    ({"edge_error_counts": 0.1, "phase_error_counts": 0.4}, "edge_error_counts must be at most 0.0375, for with the"),
    ({"edge_error_counts": -0.1}, "edge_error_counts must be a number of 0 to 0.2375, not -0.1"),
    ({"cycles": []}, "cycles must be a list of 1 to 4, each a section, not []"),
    ({"cycles": [CYCLE] * 5}, "cycles must be a list of 1 to 4, each a section, not "),
    ({"cycles": [CYCLE, 3]}, "cycles[1] must be a section, not 3"),
    ({"cycles": [{"edge": 16}]}, "cycles[0].edge is not a key of a scene; did you mean edges?"),
    ({"cycles": [{"edges": 16}]}, "cycles[0].error_counts is missing"),
    ({"cycles": [CYCLE | {"edges": 1}]}, "cycles[0].edges must be a whole number of 2 to 1e+09, not 1"),
    ({"cycles": [CYCLE | {"phase": 2.0}]}, "cycles[0].phase must be a number of 0 to 1, not 2.0"),
    ({"cycles.edges": 4}, "cycles.edges is not a key of a scene: encoder.cycles is no section"),
    (
        {"cycles": [{"edges": 4, "error_counts": 0.6}]},
        "phase_error_counts, duty_error_counts, cycles and eccentricity_counts must move each edge against its "
        "neighbours by less than 0.5 counts, not 0.6",
    ),
    ({"counts_per_turn": 4000}, "eccentricity_counts is missing, which encoder.counts_per_turn needs"),
    ({"eccentricity_counts": 10.0}, "counts_per_turn is missing, which encoder.eccentricity_counts needs"),
    ({"counts_per_turn": 4000, "eccentricity_counts": 400.0}, "phase_error_counts, duty_error_counts, cycles and"),
    ({"hysteresis_counts": 101.0}, "hysteresis_counts must be a number of 0 to 100, not 101.0"),
    ({"jitter_s": 1e-5}, "jitter_s must be less than 6.25e-08: at controller.speed_max_m_per_s, 2, 4 sigma would"),
    ({"emission_period_s": 2e-5}, "edge_separation_s is missing, which encoder.emission_period_s needs"),
    ({"edge_separation_s": 2e-7}, "emission_period_s is missing, which encoder.edge_separation_s needs"),
    ({"emission_period_s": 1e-7, "edge_separation_s": 2e-7}, "edge_separation_s must be at most emission_period_s, "),
    (EMISSION | {"edge_separation_s": 6e-7}, "edge_separation_s must be at most 5e-07: edges come so often at"),
    (EMISSION | {"edge_separation_s": 1e-8}, "edge_separation_s must be at least 3e-08, the decoder's limit at this"),
    (EMISSION | {"emission_phase": 1.5}, "emission_phase must be a number of 0 to 1, not 1.5"),
    ({"glitches_hz": 10.0}, "glitch_s is missing, which encoder.glitches_hz needs"),
    ({"glitches_hz": 1e7, "glitch_s": 1e-3}, "glitches_hz must be at most 1e+06, 1000 in a sample or at the same time"),
    ({"dead": "c", "dead_s": 0.0}, "dead must be one of a, b, both, not 'c'"),
    ({"dead": "a"}, "dead_s is missing, which encoder.dead needs"),
    ({"seed": 2**32}, "seed must be a whole number of 0 to 4294967295, not 4294967296"),
]


@pytest.mark.parametrize(("keys", "said"), REFUSED)
def test_what_cannot_be_is_refused_in_a_line(keys, said):
    with pytest.raises(SceneError) as refusal:
        load("mhz", {f"encoder.{key}": value for key, value in keys.items()})
    told = str(refusal.value)
    assert told.startswith(f"mhz: encoder.{said}")
    assert "\n" not in told
    assert len(told) < 400


def test_what_is_absent_is_none():
    section = load("mhz").encoder
    assert section.errors == ((0.0, 0.0, 0.0, 0.0), None, None)
    assert section.error_counts == section.error_counts_at(1e6) == 0
    assert section.closest_counts == 1
    assert not section.depends_on_the_way


POOR = [
    {"encoder.edge_error_counts": 0.05, "encoder.seed": 3},
    {"encoder.edge_error_counts": 0.05, "encoder.phase_error_counts": 0.15, "encoder.duty_error_counts": -0.1},
    {"encoder.cycles": [CYCLE, {"edges": 3, "error_counts": 0.1, "phase": 0.3}], "encoder.edge_error_counts": 0.02},
    {"encoder.counts_per_turn": 400, "encoder.eccentricity_counts": 10.0, "encoder.eccentricity_phase": 0.2},
]


@pytest.mark.parametrize("keys", POOR)
def test_the_decoder_is_given_no_less_than_the_errors_of_the_edges(keys):
    section = load("mhz", keys).encoder
    of = Encoder(1.0, 1.0, *section.errors)
    at = np.array([edge(of, number) for number in range(-20_000, 20_000)])
    assert np.diff(at).min() >= section.closest_counts - 1e-9
    assert np.diff(at).min() >= 1 - 2 * section.error_counts - 1e-9
    assert (at[2:] - at[:-2]).min() >= 2 - 2 * section.error_counts - 1e-9
    # No key makes the promise idle: the shortest level takes half of what is kept for it, at least.
    assert 1 - np.diff(at).min() > 0.5 * section.error_counts


@pytest.mark.parametrize("jitter_s", [0.0, 3e-9])
@pytest.mark.parametrize("keys", POOR)
def test_the_glitch_filter_is_the_longest_that_leaves_twice_the_speed(keys, jitter_s):
    slow = {"controller.glitch_clocks": None, "controller.clock_hz": 20_000_000}
    scene = load("mhz", slow | keys | ({"encoder.jitter_s": jitter_s} if jitter_s else {}))
    rate, clock_hz, glitch = 2 * scene.edges_hz, scene.controller.clock_hz, scene.glitch_clocks

    def shortest_level(edges_hz: float) -> float:
        """Return the clocks of the shortest level: both of its ends may jitter by 4 sigma."""
        return ((2 - 2 * scene.encoder.error_counts) / edges_hz - 8 * jitter_s) * clock_hz

    assert glitch + 1 <= shortest_level(rate) * (1 + 1e-9)
    assert glitch + 2 > shortest_level(rate) * (1 - 1e-9)
    assert glitch < load("mhz", slow).glitch_clocks
    assert scene.words["encoder_glitch_clocks"] == glitch


def test_a_given_filter_that_is_too_long_for_the_errors_is_refused():
    """At 2 m/s a level of two counts has 20 clocks, and of an encoder with 0.4 counts of error 12."""
    keys = {"controller.glitch_clocks": 15, "controller.clock_hz": 20_000_000}
    load("mhz", keys | {"controller.speed_max_m_per_s": 2.0})
    with pytest.raises(SceneError, match=r"speed_max_m_per_s must be at most .* edge error, not 2"):
        load("mhz", keys | {"controller.speed_max_m_per_s": 2.0, "encoder.edge_error_counts": 0.1})
    assert max_edge_rate(2e7, 15, 0.4) == pytest.approx(1.5e6)


@pytest.mark.parametrize(("separation_s", "glitch"), [(5e-7, 15), (1e-7, 9), (2e-8, 1)])
def test_the_glitch_filter_leaves_the_levels_of_a_burst(separation_s, glitch):
    """A level is two separations long, whatever the speed."""
    keys = {"encoder.emission_period_s": 2e-5, "encoder.edge_separation_s": separation_s}
    scene = load("mhz", {"controller.glitch_clocks": None} | keys)
    assert scene.glitch_clocks == glitch <= 2 * separation_s * scene.controller.clock_hz - 1 + 1e-9
    with pytest.raises(SceneError, match="edge_separation_s must be at least"):
        load("mhz", keys | {"controller.glitch_clocks": 15, "encoder.edge_separation_s": 1e-7})


def test_the_axes_of_a_scene_have_encoders_of_their_own():
    own = {"axis.elbow.encoder.edge_error_counts": 0.05, "axis.elbow.encoder.seed": 7}
    axes = {axis.axis: axis.encoder for axis in load_any("eight-axes", own).axes}
    assert axes["elbow"].errors.scale.seed == 7
    assert [name for name, section in axes.items() if section.errors.scale] == ["elbow"]


BESIDE = {} if LONG else {"encoder.edge_error_counts": 1e-3, "encoder.jitter_s": 1e-9}
"""Small errors of the scale and of the lines: with both, encoders have one loop to compile."""


@pytest.mark.parametrize("backend", ["fixed", "float"] if LONG else ["fixed"])
@pytest.mark.parametrize(
    "keys",
    [
        {"encoder.edge_error_counts": 0.2, "encoder.hysteresis_counts": 100.0},
        {"encoder.counts_per_turn": 10**9, "encoder.eccentricity_counts": 1e6},
        {"encoder.glitches_hz": 9e4, "encoder.glitch_s": 1e-3, "encoder.jitter_s": 1e-6},
        {"encoder.dead": "both", "encoder.dead_s": 0.0},
    ],
)
def test_the_largest_errors_run_to_finite_numbers(keys, backend):
    slow = {"controller.speed_max_m_per_s": 0.02, "protocol.start_m": -1e-4}
    result = hit.run(load("seed-2011", ONE_SECOND | slow | BESIDE | keys), backend)
    assert all(map(math.isfinite, (result.mean_m, result.rms_m, result.max_force_n)))
    assert result.samples == 10_000


def test_a_dead_encoder_feels_no_wall():
    """Both lines stand before the handle moves: the count is that of the start."""
    near = ONE_SECOND | {"protocol.start_m": -1e-4}
    alive, dead = (
        hit.run(load("seed-2011", near | keys), "fixed")
        for keys in ({}, BESIDE | {"encoder.dead": "both", "encoder.dead_s": 0.0})
    )
    assert alive.max_force_n > 0.3
    assert dead.max_force_n == 0
    assert dead.mean_m > 10 * alive.mean_m
