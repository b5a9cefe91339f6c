"""An estimator for records in pieces: the axis's own velocities, whole, in pieces, in lanes, with words that change."""

import copy
import pickle
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import levant
from hardwall.model.estimators.acceleration import Accelerated, acceleration_of
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.motion import Motion
from hardwall.model.spec import AxisSpec
from hardwall.model.velocity_estimator import VelocityEstimator
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.specs import PAPER

OF_COUNTS = [name for name, design in ESTIMATORS.items() if not design.uses_stamps()]
SOME = OF_COUNTS if LONG else ["levant", "kalman", "window"]
ACCELERATED = [name for name in OF_COUNTS if issubclass(ESTIMATORS[name], Accelerated)]
OF_ACCELERATIONS = [
    (name, backend)
    for name in ACCELERATED
    for backend in ("fixed", "float")
    if LONG or (name, backend) in (("kalman", "fixed"), ("kalman", "float"), ("levant-2", "fixed"))
]
"""Two estimators with an acceleration, one of them on both backends; every one on both by `make soak`."""
MOTION = Motion(count=1e-6, acceleration_max=12.0, speed_max=2.0, travel=0.15)
RATE = PAPER["sample_hz"]


def swing(samples: int = 3000) -> np.ndarray:
    """Return counts of a sine, with jitter of a count."""
    noise = rng().integers(0, 2, samples)
    return np.floor(20e-3 * np.sin(np.arange(samples) / 400) / 1e-6).astype(np.int64) + noise


def in_true_seconds(taken: VelocityEstimator) -> AxisSpec:
    """Return the axis of a motion with a true second, and as many clocks a sample as the estimator's."""
    return AxisSpec(
        **{**PAPER, "clock_hz": taken.spec.clocks_per_sample * RATE, "glitch_clocks": 0}, estimator=taken.spec.estimator
    )


@pytest.mark.parametrize("backend", ["fixed", "float"])
@pytest.mark.parametrize("estimator", SOME)
def test_velocities_are_those_of_the_axis(estimator, backend):
    taken = VelocityEstimator(RATE, estimator, MOTION, backend=backend)
    counts = swing()
    record = Axis(in_true_seconds(taken), backend == "float").run(counts)
    made = taken(counts)
    if backend == "fixed":
        assert made.tolist() == record.velocity_m_per_s.tolist()
    else:
        assert made == pytest.approx(record.velocity_m_per_s, rel=1e-9, abs=1e-9)
    assert np.abs(made).max() > 0.1
    assert taken.flags == []


@pytest.mark.parametrize("estimator", SOME)
def test_pieces_are_the_whole(estimator):
    counts, cuts = swing(), [0, 1, 2, 700, 701, 2500, 3000]
    whole = VelocityEstimator(RATE, estimator, MOTION)(counts)
    taken = VelocityEstimator(RATE, estimator, MOTION)
    pieces = [taken(counts[first:last]) for first, last in pairwise(cuts)]
    assert np.concatenate(pieces).tolist() == whole.tolist()


@pytest.mark.parametrize("backend", ["fixed", "float"])
@pytest.mark.parametrize("estimator", SOME)
def test_a_record_may_have_any_origin(estimator, backend):
    """Where its counts wrap in the words of the axis is no matter."""
    motion = replace(MOTION, travel=0.05)
    half, counts = 1 << (VelocityEstimator(RATE, estimator, motion).spec.count_width - 1), swing()
    assert np.ptp(counts) > 1000
    true = VelocityEstimator(RATE, estimator, motion, backend=backend)(counts).tolist()
    for origin in (half - 500, -half + 500, 3 * half, 2**61):
        assert VelocityEstimator(RATE, estimator, motion, backend=backend)(counts + origin).tolist() == true


def test_pieces_join_at_the_last_count():
    """From one piece to the next, a count may go as far as within a piece, and no further."""
    taken = VelocityEstimator(RATE, "fdm", replace(MOTION, speed_max=1.2e4))
    half = 1 << (taken.spec.count_width - 1)
    ramp = (half - 1) * np.arange(40)
    whole = VelocityEstimator(RATE, "fdm", replace(MOTION, speed_max=1.2e4))(ramp)
    pieces = [taken(ramp[first:last]) for first, last in pairwise([0, 1, 2, 3, 10, 11, 40])]
    assert np.concatenate(pieces).tolist() == whole.tolist()
    with pytest.raises(ValueError, match=f"not by {half} at sample 0"):
        taken(ramp[-1:] + half)
    assert taken(ramp[-1:]).tolist() == [0.0]


@pytest.mark.parametrize(("estimator", "backend"), OF_ACCELERATIONS)
def test_the_acceleration_is_the_kernels_in_the_unit_of_the_motion(estimator, backend):
    counts, taken = swing(), VelocityEstimator(RATE, estimator, MOTION, backend=backend)
    design, state = taken.spec.design.estimator, taken.spec.design.estimator.start(backend == "float")
    params = Axis(taken.spec, backend == "float").params.estimator
    unit = (1.0 if backend == "float" else design.acceleration.lsb) * 1e-6 * RATE**2
    expected = []
    for count in counts.tolist():
        state, *_ = estimate(params, state, seen_count(count), 0)
        expected.append(acceleration_of(params, state) * unit)
    velocity, acceleration = taken.with_acceleration(counts)
    assert acceleration.tolist() == pytest.approx(expected, rel=1e-12)
    assert np.abs(acceleration).max() > 1.0
    assert velocity.tolist() == VelocityEstimator(RATE, estimator, MOTION, backend=backend)(counts).tolist()


def test_accelerations_come_in_pieces_and_lanes_too():
    counts = np.stack([swing(), -swing()])
    velocity, acceleration = VelocityEstimator(RATE, "kalman", MOTION).with_acceleration(counts)
    taken = VelocityEstimator(RATE, "kalman", MOTION)
    first = taken.with_acceleration(counts[:, :700].T, axis=0)
    between = taken(counts[:, 700:1000].T, axis=0)
    last = taken.with_acceleration(counts[:, 1000:].T, axis=0)
    assert np.concatenate([first[0], between, last[0]]).T.tolist() == velocity.tolist()
    assert first[1].T.tolist() == acceleration[:, :700].tolist()
    assert last[1].T.tolist() == acceleration[:, 1000:].tolist()


@pytest.mark.parametrize("estimator", [name for name in SOME if name not in ACCELERATED])
def test_an_estimator_without_an_acceleration_says_which_have_one(estimator):
    taken = VelocityEstimator(RATE, estimator, MOTION)
    said = rf"^estimator must be one with an acceleration \(kalman, levant-edge, .*\), not '{estimator}'$"
    with pytest.raises(ValueError, match=said):
        taken.with_acceleration(swing())
    assert taken(swing()).any()


def test_a_copy_goes_on_from_the_same_state():
    counts = swing()
    taken = VelocityEstimator(RATE, "window", MOTION)
    taken(counts[:1000])
    others = copy.deepcopy(taken), pickle.loads(pickle.dumps(taken))
    first = taken(counts[1000:])
    assert [other(counts[1000:]).tolist() for other in others] == [first.tolist()] * 2
    taken.reset()
    assert taken(counts).tolist() == VelocityEstimator(RATE, "window", MOTION)(counts).tolist()


def test_words_change_between_pieces_as_on_the_axis():
    counts = swing()
    taken = VelocityEstimator(RATE, "levant", MOTION, output="u1")
    taken(counts[:1500])
    taken.set(levant_lambda=10.0, levant_alpha=40.0)
    made = taken(counts[1500:])
    spec = in_true_seconds(taken)
    design, state, expected = spec.design.estimator, spec.design.estimator.start(), []
    changed = {"levant_lambda": 10.0, "levant_alpha": 40.0}
    before, after = (design.params(spec.design.encode(levant_output=1, **more)) for more in ({}, changed))
    for k, count in enumerate(counts.tolist()):
        state, velocity, _ = estimate(before if k < 1500 else after, state, seen_count(count), 0)
        expected.append(velocity * design.velocity.lsb * spec.velocity_unit_m_per_s)
    assert made.tolist() == expected[1500:]


def test_lanes_are_independent_along_any_axis():
    lanes = np.stack([swing(), -swing(), 2 * swing()]).reshape(3, 1, -1)
    apart = [VelocityEstimator(RATE, "kalman", MOTION)(lane[0]) for lane in lanes]
    for axis in (-1, 0, 1, 2):
        counts = np.moveaxis(lanes, -1, axis)
        made = VelocityEstimator(RATE, "kalman", MOTION)(counts, axis=axis)
        assert made.shape == counts.shape
        assert np.moveaxis(made, axis, -1)[:, 0].tolist() == [each.tolist() for each in apart]


def test_arrays_of_words_are_broadcast_against_the_lanes():
    counts = np.stack([swing(), -swing()])
    lambdas = np.array([[2.0], [5.0], [10.0]])
    made = VelocityEstimator(RATE, "levant", MOTION, levant_lambda=lambdas, levant_alpha=[20.0, 40.0])(counts)
    assert made.shape == (3, 2, counts.shape[-1])
    for i, of_lambda in enumerate(lambdas.ravel()):
        for j, alpha in enumerate((20.0, 40.0)):
            alone = VelocityEstimator(RATE, "levant", MOTION, levant_lambda=of_lambda, levant_alpha=alpha)
            assert made[i, j].tolist() == alone(counts[j]).tolist()


def test_gains_in_true_seconds_are_those_of_the_axis():
    gains = levant.Gains(4.0, 30.0)
    taken = VelocityEstimator(RATE, "levant", MOTION, gains=gains)
    axis = Axis(replace(in_true_seconds(taken), gains=gains))
    assert taken(swing()).tolist() == axis.run(swing()).velocity_m_per_s.tolist()


def test_a_count_beyond_its_width_wraps_without_a_trace():
    counts = 40 * np.arange(-20_000, 20_000)
    taken = VelocityEstimator(RATE, "fdm", Motion(count=1.0, acceleration_max=1.0, speed_max=40 * RATE, travel=500.0))
    assert taken(counts)[1:].tolist() == [40.0 * RATE] * 39_999
    assert taken.spec.count_width < 20


def test_a_velocity_beyond_the_bound_saturates_with_a_flag():
    taken = VelocityEstimator(RATE, "fdm", replace(MOTION, speed_max=0.05))
    made = taken(np.arange(100) * 1000)
    assert made.max() < 1000 * 1e-6 * RATE
    assert taken.flags == ["velocity_saturated"]


@pytest.mark.parametrize("estimator", [name for name in ESTIMATORS if name not in OF_COUNTS])
def test_estimators_by_edges_are_refused(estimator):
    with pytest.raises(ValueError, match=f"only counts, not '{estimator}': velocity_of_edges and"):
        VelocityEstimator(RATE, estimator, MOTION)


def test_what_is_refused():
    taken = VelocityEstimator(RATE, "levant", MOTION)
    with pytest.raises(TypeError, match="counts must be integers, not float64"):
        taken(swing() * 1.0)
    with pytest.raises(ValueError, match="axis -1 is out of bounds for array of dimension 0"):
        taken(3)
    with pytest.raises(ValueError, match="axis 1 is out of bounds for array of dimension 1"):
        taken(swing(), axis=1)
    taken(swing(10))
    with pytest.raises(ValueError, match=r"lanes must have the shape \(\) as before, not \(2,\)"):
        taken(np.zeros((2, 5), np.int64))
    with pytest.raises(
        ValueError,
        match=r"must change by less than 1048576 .* not by 2000000 at sample 1; if the counter wraps, give c",
    ):
        taken(np.array([0, 2_000_000]))
    with pytest.raises(ValueError, match=r"counts have lanes of shape \(2,\), and levant_lambda has the shape \(3,\)"):
        VelocityEstimator(RATE, "levant", MOTION, levant_lambda=[2.0, 3.0, 4.0])(np.zeros((2, 5), np.int64))
    with pytest.raises(ValueError, match="levant_output is no setting; accepted are levant_lambda, levant_alpha"):
        VelocityEstimator(RATE, "levant", MOTION, levant_output=1)
    with pytest.raises(ValueError, match="kalman_position must be"):
        VelocityEstimator(RATE, "kalman", MOTION, kalman_position=[0.1, 1e9])
    with pytest.raises(ValueError, match="output of levant must be one of u, u1, not 'v'"):
        VelocityEstimator(RATE, "levant", MOTION, output="v")
    with pytest.raises(ValueError, match="backend must be one of fixed, float, not 'rtl'"):
        VelocityEstimator(RATE, "levant", MOTION, backend="rtl")
    with pytest.raises(ValueError, match=r"estimator must be one of fdm, .* not 'euler'"):
        VelocityEstimator(RATE, "euler", MOTION)


def test_counters_of_a_few_bits_are_unwrapped_in_pieces():
    counts = swing()
    true = VelocityEstimator(RATE, "kalman", MOTION)(counts)
    for bits, kind in ((16, np.uint16), (16, np.int16), (32, np.uint32), (17, np.int64)):
        taken = VelocityEstimator(RATE, "kalman", MOTION, count_bits=bits)
        read = (counts % 2**bits).astype(np.uint64).astype(kind)
        pieces = np.concatenate([taken(read[:777]), taken(read[777:778]), taken(read[778:])])
        assert pieces.tolist() == true.tolist()
    with pytest.raises(ValueError, match=r"not by -65532 at sample 1; if the counter wraps, give count_bits=16"):
        VelocityEstimator(RATE, "fdm", replace(MOTION, travel=1e-3))([65535, 3])
    with pytest.raises(ValueError, match="count_bits must be 2 to 62, not 1"):
        VelocityEstimator(RATE, "fdm", MOTION, count_bits=1)


@pytest.mark.parametrize("modulus", [1500, 4000, 4001, 65_536, 10**6])
def test_counters_of_any_modulus_are_unwrapped_in_pieces(modulus):
    counts = swing()
    true = VelocityEstimator(RATE, "kalman", MOTION)(counts)
    for read in (counts % modulus, (counts + modulus // 2) % modulus - modulus // 2):
        taken = VelocityEstimator(RATE, "kalman", MOTION, count_modulus=modulus)
        pieces = np.concatenate([taken(read[:777]), taken(read[777:778]), taken(read[778:])])
        assert pieces.tolist() == true.tolist()


def test_the_largest_modulus_is_unwrapped_exactly():
    modulus = 2**62
    counts = np.array([2**62 - 3, 2**62 - 1, 1, 2**62 - 2, 0, 4])
    taken = VelocityEstimator(
        1.0, "fdm", Motion(acceleration_max=9.0, speed_max=9.0, travel=99.0), count_modulus=modulus
    )
    assert taken(counts).tolist() == [0.0, 2.0, 2.0, -3.0, 2.0, 4.0]


def test_a_modulus_that_is_refused():
    for modulus, error, said in (
        (3, ValueError, "count_modulus must be 4 to 4611686018427387904, not 3"),
        (4e3, TypeError, "count_modulus must be an int, not 4000.0"),
    ):
        with pytest.raises(error, match=said):
            VelocityEstimator(RATE, "fdm", MOTION, count_modulus=modulus)
    with pytest.raises(ValueError, match="count_modulus and count_bits are both the range of the counter: give one"):
        VelocityEstimator(RATE, "fdm", MOTION, count_bits=16, count_modulus=4000)
    taken = VelocityEstimator(RATE, "fdm", MOTION, count_modulus=400)
    with pytest.raises(ValueError, match="counts must span less than the 400 counts of their counter, not 400"):
        taken([0, 30, 400])
    assert taken([0, 30, 399]).tolist() == pytest.approx([0.0, 0.3, -0.31])


def test_a_call_that_is_refused_leaves_no_trace():
    taken = VelocityEstimator(RATE, "kalman", MOTION)
    for refused in ([0, 10**9], np.array([[0, 10**9], [0, 0]])):
        with pytest.raises(ValueError, match="counts must change by less than"):
            taken(refused)
    counts = swing() + 5 * 10**6
    assert taken(counts).tolist() == VelocityEstimator(RATE, "kalman", MOTION)(counts).tolist()


def test_the_words_have_their_ranges_in_true_seconds():
    taken = VelocityEstimator(RATE, "levant", MOTION)
    words = {word.name: word for word in in_true_seconds(taken).design.estimator.words}
    for name, word in taken.words.items():
        assert (word.si_min, word.si_max) == pytest.approx((words[name].si_min, words[name].si_max))
    taken.set(levant_lambda=taken.words["levant_lambda"].si_max)


def test_a_setting_is_a_copy():
    lambdas, counts = np.array([2.0, 5.0]), swing()
    taken = VelocityEstimator(RATE, "levant", MOTION, levant_lambda=lambdas)
    lambdas[:] = 10.0
    same = VelocityEstimator(RATE, "levant", MOTION, levant_lambda=[2.0, 5.0])
    assert taken(counts).tolist() == same(counts).tolist()
    with pytest.raises(ValueError, match="levant_alpha must have a value at least"):
        taken.set(levant_alpha=[])


def test_gains_and_motions_of_another_kind_are_refused():
    with pytest.raises(TypeError, match=r"gains must be kalman.Gains or None, not Gains\("):
        VelocityEstimator(RATE, "kalman", MOTION, gains=levant.Gains(4.0, 30.0))
    with pytest.raises(TypeError, match="motion must be a Motion, not None"):
        VelocityEstimator(RATE, "kalman", None)
    with pytest.raises(ValueError, match=r"travel must be 1e-06 to 536.871 with counts of 1e-06 at 10000 Hz, not"):
        VelocityEstimator(RATE, "kalman", replace(MOTION, travel=1e-7))
    with pytest.raises(ValueError, match="speed_max must be 0 to 167772 with counts of 1e-06 at 10000 Hz, not 1e"):
        VelocityEstimator(RATE, "kalman", replace(MOTION, speed_max=1e9))


def test_no_counts_are_no_velocities():
    taken = VelocityEstimator(RATE, "levant", MOTION)
    assert taken(np.zeros((0,), np.int64)).shape == (0,)
    assert taken(np.zeros((3, 0), np.int64)).shape == (3, 0)
    assert taken(swing(5)).shape == (5,)
