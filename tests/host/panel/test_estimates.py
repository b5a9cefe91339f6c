"""Two estimators of the same counts: record by record what the model makes of them at once, whatever the cuts."""

import numpy as np
import pytest

from hardwall.host.panel.estimates import KEPT, Estimates
from hardwall.model.axis.axis import Axis
from hardwall.sim.scene.load import load

SPEC = load("seed-2011", {"controller.clock_hz": 4_000_000}).spec
COUNTS = np.floor(3000 * np.sin(np.arange(900) / 150)).astype(int)
WORDS = {"wall_stiffness": 2e3, "wall_damping": 30.0, "wall_position": 1e-3, "levant_output": 1.0}


def rows(records: list[bytes]) -> np.ndarray:
    """Return the four rows of successive records."""
    return np.concatenate([np.frombuffer(each, "<f4").reshape(4, -1) for each in records], axis=1)


def test_records_in_a_row_are_one_run_of_the_model():
    estimates = Estimates(SPEC)
    estimates.use(WORDS | {"supervisor_ramp": 3.0})
    for part in np.split(COUNTS, [1, 200, 500]):
        estimates.feed(part.tolist())
    number, records = estimates.since(0)
    assert number == len(records) == 4
    # The model beside it had the sample of its compilation, too.
    counts = np.concatenate([[0], COUNTS])
    plain = {name: WORDS[name] for name in ("wall_stiffness", "wall_damping", "wall_position")}
    levant = Axis(SPEC, **WORDS).run(counts)
    fdm = Axis(load("seed-2011", {"controller.clock_hz": 4_000_000, "controller.estimator": "fdm"}).spec, **plain)
    record = fdm.run(counts)
    expected = [levant.velocity_m_per_s, record.velocity_m_per_s, levant.force_n, record.force_n]
    np.testing.assert_array_equal(rows(records), np.array(expected)[:, 1:].astype(np.float32))
    assert np.abs(rows(records)[2:]).max(axis=1).min() > 1


def test_an_estimator_with_an_acceleration_is_run_as_any_other():
    spec = load("seed-2011", {"controller.estimator": "kalman"}).spec
    estimates = Estimates(spec)
    estimates.feed(COUNTS.tolist())
    expected = Axis(spec).run(np.concatenate([[0], COUNTS])).velocity_m_per_s
    np.testing.assert_array_equal(rows(estimates.since(0)[1])[0], expected[1:].astype(np.float32))


def test_new_words_count_from_the_next_record_on():
    estimates = Estimates(SPEC)
    for stiffness in (1e3, 4e3):
        estimates.use(WORDS | {"wall_stiffness": stiffness, "wall_damping": 0.0})
        estimates.feed([2000] * 10)
    found = rows(estimates.since(0)[1])
    assert found[2:, [9, 19]].ravel() == pytest.approx([-1.0, -4.0, -1.0, -4.0], rel=0.01)


def test_positions_that_moved_start_both_afresh():
    estimates = Estimates(SPEC)
    for moved in (0, 4000):
        estimates.use(WORDS | {"wall_damping": 0.0}, moved * SPEC.count_m)
        estimates.feed([2000] * 10)
    found = rows(estimates.since(0)[1])
    assert np.all(found[:2, 10:] == 0)
    assert found[2:, [9, 19]].ravel() == pytest.approx([-2.0, -10.0, -2.0, -10.0], rel=0.01)


def test_records_that_were_seen_are_not_given_again_and_old_ones_are_left():
    estimates = Estimates(SPEC)
    for _ in range(KEPT + 3):
        estimates.feed([1])
    number, records = estimates.since(0)
    assert (number, len(records)) == (KEPT + 3, KEPT)
    assert estimates.since(number) == (number, [])
    estimates.feed([2])
    assert len(estimates.since(number)[1]) == 1


def test_a_count_beyond_its_width_wraps_as_the_hardware_s():
    estimates = Estimates(SPEC)
    half = 1 << SPEC.count_width - 1
    estimates.feed([half - 2, half - 1, half, half + 1])
    velocity = rows(estimates.since(0)[1])[1]
    assert velocity[1:] == pytest.approx([SPEC.count_m * SPEC.sample_hz] * 3)


def test_an_estimator_of_stamps_has_none_beside_it():
    spec = load("seed-2011", {"controller.estimator": "period"}).spec
    with pytest.raises(ValueError, match="must be one that needs only counts, not 'period'"):
        Estimates(spec)
