"""A learned map in the whole program: what it is worth, that no judged motion is in it, and where there is none."""

import numpy as np
import pytest

from hardwall.model.encoder.scale_fit import Fit
from hardwall.sim.estimates import learning
from hardwall.sim.estimates.accuracy import LEARNED, axis_spec, encoder_of, errors_of, measure
from stimuli.lengths import some_of

ALL = {
    "encoder.edge_error_counts": 0.05,
    "encoder.counts_per_turn": 4000,
    "encoder.eccentricity_counts": 10.0,
    "encoder.cycles": [{"edges": 4, "error_counts": 0.1}],
    "encoder.hysteresis_counts": 0.2,
    "encoder.jitter_s": 50e-9,
    "encoder.seed": 4,
}
RATE_HZ = 100_000


@pytest.mark.parametrize("backend", some_of(["float", "fixed"], 1))
def test_one_pass_is_worth_a_factor_of_ten(backend):
    unlearned = measure("edge-kalman", "u", "paper", RATE_HZ, backend, ALL)
    learned = measure("edge-kalman", "u", "paper", RATE_HZ, backend, ALL | {LEARNED: 1})
    assert "learned_passes" not in unlearned["encoder"]
    assert learned["encoder"]["learned_passes"] == 1
    assert LEARNED in encoder_of(learned)
    assert learned["rms_mm_s"] < 0.1 * unlearned["rms_mm_s"]
    assert learned["flags"] == []


def test_passes_differ_from_each_other_and_from_those_of_another_encoder():
    motions = {learning.swing(seed, number).motion for seed in (1, 2) for number in range(5)}
    assert len(motions) == 10
    assert {motion.amplitude_m > 0 for motion in motions} == {True, False}
    assert all(0.045 <= abs(motion.amplitude_m) <= 0.065 for motion in motions)


def test_a_perfect_scale_has_no_errors_to_learn():
    spec = axis_spec("edge-kalman", RATE_HZ, 1.7)
    fit = Fit(learning.bins_of(spec))
    learning.train(fit, spec, errors_of(None), 1, 0)
    found = fit.errors()
    visited = found[found != 0]
    assert len(visited) == fit.visited > 3000
    # What changes along the scale is speed: a thousandth of it in a bin of 16 edges.
    assert np.abs(np.diff(visited)).mean() < 16e-3


@pytest.mark.parametrize(
    ("passes", "estimator", "backend", "message"),
    [
        (1, "kalman", "float", "must be for edge-kalman, which takes a map of the scale, not for 'kalman'"),
        (1, "edge-kalman", "rtl", "must be on float or fixed"),
        (0, "edge-kalman", "float", "must be a whole number from 1 to 100, not 0"),
        (2.5, "edge-kalman", "float", "must be a whole number from 1 to 100, not 2.5"),
    ],
)
def test_where_there_is_no_map_it_is_refused(passes, estimator, backend, message):
    with pytest.raises(ValueError, match=f"encoder.learned_passes {message}"):
        measure(estimator, "u", "paper", RATE_HZ, backend, ALL | {LEARNED: passes})
