"""A velocity in one call: as a plain difference must be, as the replay says, at any rate; what it says and refuses."""

import warnings

import numpy as np
import pytest

from hardwall.model import (
    EdgeVelocityEstimator,
    Motion,
    RecordWarning,
    VelocityEstimator,
    stamped,
    velocity,
    velocity_and_acceleration,
    velocity_and_acceleration_of_edges,
    velocity_of_edges,
)
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.level import level
from hardwall.model.encoder.quadrature import latency
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.spec import AxisSpec
from hardwall.sim.estimates.replay import replay
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.replays import recording, swing

STAMPED = [name for name, design in ESTIMATORS.items() if design.uses_stamps()]
WIDE = {"acceleration_max": 1e6, "speed_max": 1e5, "travel": 1e4}
BOUNDS = {"acceleration_max": 50.0, "speed_max": 1.0, "travel": 1.0}


@pytest.fixture(autouse=True)
def _no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def walk(edges: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    """Return times (s) and counts of edges at random, with turns."""
    random = rng()
    times = np.cumsum(random.integers(20, 3000, edges)) * 1e-6
    return times, np.cumsum(np.where(random.random(edges) < 0.3, -1, 1))


@pytest.mark.parametrize("rate", [10e3, 12.5, 0.3, 333.3333, 44.1e3])
def test_fdm_is_the_plain_difference_at_any_rate(rate):
    counts = np.cumsum(rng().integers(-40, 41, 500))
    made = velocity(counts, rate, "fdm", count=1e-3, acceleration_max=1.0, speed_max=0.1 * rate, travel=20.0)
    assert made[0] == 0
    assert made[1:] == pytest.approx(np.diff(counts) * 1e-3 * rate, rel=1e-14)


@pytest.mark.parametrize(
    "estimator", ["levant", "kalman", "butterworth"] if not LONG else sorted(set(ESTIMATORS) - set(STAMPED))
)
def test_it_is_the_replays_velocity(estimator):
    recorded = swing(1500)
    rate = recorded.rate_hz
    seen = replay(recorded, estimator, acceleration_max_counts_per_s2=1e6)
    same = {"speed_max": seen.spec.speed_max_m_per_s / 1024 * rate, "travel": seen.spec.travel_m}
    made = velocity(recorded.counts, rate, estimator, acceleration_max=1e6, **same)
    assert made == pytest.approx(seen.velocity_counts_per_s, rel=1e-12, abs=1e-12)


def test_bounds_that_are_not_given_are_said():
    counts = np.floor(1000 * np.sin(np.arange(3000) / 100)).astype(np.int64)
    with pytest.warns(
        RecordWarning, match=r"acceleration_max=[\d.e+-]+, speed_max=[\d.]+, travel=2048: taken from the record"
    ) as said:
        made = velocity(counts, 1e3)
    assert len(said) == 1
    assert said[0].filename == __file__
    motion, _ = Motion.of(counts[None], 1e3)
    assert made.tolist() == VelocityEstimator(1e3, "kalman", motion)(counts).tolist()
    true = 1e4 * np.cos(np.arange(3000) / 100)
    plain = np.diff(counts, prepend=0) * 1e3
    assert np.std((made - true)[500:]) < np.std((plain - true)[500:]) / 2


def test_a_word_that_saturated_is_said():
    with pytest.warns(RecordWarning, match="raised flags: velocity_saturated; a larger speed_max may help"):
        velocity(np.arange(100) * 4, 1e3, "fdm", acceleration_max=50.0, speed_max=1e3, travel=1e3)


def test_a_counter_that_wraps_is_named_and_unwrapped():
    counts = np.cumsum(rng().integers(-900, 1000, 5000))
    made = velocity(counts, 1e3, "kalman", acceleration_max=1e6, speed_max=2e6, travel=1e6)
    wrapped = counts.astype(np.int16)
    again = velocity(wrapped, 1e3, "kalman", acceleration_max=1e6, speed_max=2e6, travel=1e6, count_bits=16)
    assert again.tolist() == made.tolist()
    with pytest.warns(RecordWarning, match=r"not given; if the counter wraps, give count_bits=16$"):
        velocity(wrapped, 1e3, "fdm")


def test_a_counter_of_a_turn_is_unwrapped():
    counts = np.cumsum(rng().integers(-900, 1000, 5000))
    bounds = {"acceleration_max": 1e6, "speed_max": 2e6, "travel": 1e6}
    made = velocity(counts, 1e3, "kalman", **bounds)
    assert velocity(counts % 4000, 1e3, "kalman", count_modulus=4000, **bounds).tolist() == made.tolist()


def test_no_lanes_are_no_velocities():
    assert velocity(np.zeros((0, 5), np.int64), 1e3).shape == (0, 5)


def test_lanes_and_the_axis_of_time():
    counts = np.cumsum(rng().integers(-5, 6, (4, 3, 200)), axis=-1)
    bounds = {"acceleration_max": 1e3, "speed_max": 40.0, "travel": 1.0, "count": 1e-3}
    made = velocity(counts, 1e3, "levant", **bounds)
    assert made.shape == counts.shape
    turned = velocity(np.moveaxis(counts, -1, 0), 1e3, "levant", axis=0, **bounds)
    assert np.moveaxis(turned, 0, -1).tolist() == made.tolist()
    assert made[2, 1].tolist() == velocity(counts[2, 1], 1e3, "levant", **bounds).tolist()


@pytest.mark.parametrize("start_s", [0.0, 1.0, -3.3, 1.7e9])
@pytest.mark.parametrize("rate", [10.0, 1000.0, 777.7, 44.1e3])
def test_fdm_of_edges_is_the_difference_of_the_counts_at_the_samples(rate, start_s):
    """Edges at the times of samples, and between them: each counts at the sample at or after it."""
    random = rng()
    ticks = np.cumsum(random.integers(1, 9, 2000))  # quarters of a sample
    times, counts = start_s + ticks / (4 * rate), np.cumsum(np.where(random.random(2000) < 0.3, -1, 1))
    bounds = {"speed_max": 1e3 * rate, "acceleration_max": 1e3 * rate**2, "travel": 1e4}
    made = velocity_of_edges(times, counts, rate, "fdm", clock_hz=64 * rate, **bounds)
    since = ticks - ticks[0]
    at = counts[np.searchsorted(since, 4 * np.arange(since[-1] // 4 + 1), side="right") - 1]
    assert made == pytest.approx(np.diff(at) * rate, rel=1e-12)


def test_times_of_nanoseconds_are_as_good_as_seconds():
    times, counts = walk()
    made = velocity_of_edges(times, counts, 1e3, "period", **WIDE)
    stamps = np.datetime64("2026-11-28T21:00:00", "ns") + np.round(times * 1e9).astype("timedelta64[ns]")
    assert velocity_of_edges(stamps, counts, 1e3, "period", **WIDE).tolist() == made.tolist()


@pytest.mark.parametrize("rate", [1000, 10_000, 100_000] if LONG else [1000, 100_000])
@pytest.mark.parametrize("estimator", STAMPED if LONG else ["period", "mt"])
def test_edges_far_apart_are_those_of_the_hardware_at_that_rate(estimator, rate):
    """The axis with true seconds, on edges 10 to 2000 samples apart, up to half a second."""
    random = rng()
    gaps = random.integers(10, min(2000, rate // 2), 200) * 1024 + random.integers(0, 1024, 200)
    clocks = np.concatenate([[0], np.cumsum(gaps)])
    counts = np.concatenate([[0], np.cumsum(np.where(random.random(200) < 0.1, -1, 1))])
    bounds = {"acceleration_max": 40.0 * rate, "speed_max": 2.0 * rate, "travel": 2.0**20}
    made = velocity_of_edges(clocks / (rate * 1024), counts, rate, estimator, clock_hz=rate * 1024, **bounds)
    spec = AxisSpec(
        clock_hz=rate * 1024, sample_hz=rate, actuation_hz=rate, count_m=1.0, travel_m=2.0**20, glitch_clocks=0,
        speed_max_m_per_s=2.0 * rate, acceleration_max_m_per_s2=40.0 * rate, force_max_n=1.0, force_resolution_n=1.0,
        stiffness_max_n_per_m=1.0, damping_max_n_s_per_m=1.0 / rate, estimator=estimator,
    )  # fmt: skip
    first = spec.design.timing.strobe - latency(0)
    true = stamped.run(Axis(spec), first + clocks[1:], level(counts[1:]), len(made) + 1, int(level(0)))
    # The second of the record is a power of two: gains and formats may differ by their rounding.
    assert made == pytest.approx(true.velocity_m_per_s[1:], rel=1e-3, abs=1e-3 * np.abs(made).max())
    assert np.abs(made).max() > 1


STEADY = [(name, backend) for name in STAMPED for backend in ("fixed", "float")]


@pytest.mark.parametrize(("estimator", "backend"), STEADY if LONG else [("period", "float"), ("edge-kalman", "fixed")])
def test_a_steady_turn_is_known_from_its_edges_at_any_rate(estimator, backend):
    """37.5 counts a second sampled at 10 Hz, and a thousandth and a million times of that."""
    for scale in (1e-3, 1.0, 1e6):
        times = np.arange(800) / 37.5 / scale
        made = velocity_of_edges(
            times, np.arange(800), 10 * scale, estimator, count=0.5, backend=backend, clock_hz=1e5 * scale,
            acceleration_max=10 * scale**2, speed_max=40 * scale, travel=400.0,
        )  # fmt: skip
        assert made[-100:].mean() == pytest.approx(37.5 / 2 * scale, rel=1e-3)
        assert made[-100:] == pytest.approx(37.5 / 2 * scale, rel=5e-3)


def test_edges_are_those_that_a_replay_makes_of_counts():
    """Counts that change by one in the middle of a sample are edges whose times are known."""
    counts = np.cumsum(np.tile([1, 0, 0, 1, 0, 1, 1, 0, -1, 0], 100))
    recorded = recording(counts, 1000.0)
    seen = replay(recorded, "period", acceleration_max_counts_per_s2=1e5)
    moved = np.flatnonzero(np.diff(counts)) + 1
    times, behind = np.r_[0.0, (moved - 0.5) / 1000], np.r_[counts[0], counts[moved]]
    made = velocity_of_edges(
        times, behind, 1000.0, "period", acceleration_max=1e5, travel=seen.spec.travel_m,
        speed_max=seen.spec.speed_max_m_per_s / 1024 * 1000, clock_hz=seen.clock_hz,
    )  # fmt: skip
    assert np.abs(made).max() > 100
    # Each of two edges, a sample apart or more, may be a clock earlier or later.
    assert made == pytest.approx(seen.velocity_counts_per_s[1 : len(made) + 1], rel=2 / seen.spec.clocks_per_sample)


def test_what_velocity_refuses():
    with pytest.raises(ValueError, match=r"two samples or more along axis -1, not 1"):
        velocity([1], 1e3)
    with pytest.raises(ValueError, match=r"axis 2 is out of bounds for array of dimension 2"):
        velocity(np.zeros((4, 5), np.int64), 1e3, axis=2)
    with pytest.raises(TypeError, match="counts must be integers, not float64"):
        velocity([1.5, 2.0], 1e3)
    with pytest.raises(ValueError, match="sample_hz must be 1e-06 to"):
        velocity([1, 2], 0.0)
    with pytest.raises(TypeError, match="sample_hz must be a number, not None"):
        velocity([1, 2], None)
    with pytest.raises(ValueError, match="levant_lamda is no setting; accepted are levant_lambda, levant_alpha"):
        velocity([1, 2], 1e3, "levant", levant_lamda=1.0, **BOUNDS)
    with pytest.raises(ValueError, match="kalman_position is no setting; accepted are none"):
        velocity([1, 2], 1e3, "fdm", kalman_position=1.0, **BOUNDS)
    with pytest.raises(ValueError, match="velocity_of_edges and velocity_and_acceleration_of_edges take the edges"):
        velocity([1, 2], 1e3, "period", **BOUNDS)
    with pytest.raises(ValueError, match="estimator must be one of"):
        velocity([1, 2], 1e3, "euler", **BOUNDS)


def test_what_velocity_of_edges_refuses():
    def refused(times, counts, rate=10.0, **more):
        velocity_of_edges(times, counts, rate, "period", **BOUNDS, **more)

    with pytest.raises(ValueError, match=r"must have one shape \(edges,\) of 2 or more, not \(3,\) and \(2,\)"):
        refused([0.0, 1.0, 2.0], [0, 1])
    with pytest.raises(ValueError, match=r"times_s must increase, not from 1.0 to 1.0 at element 2"):
        refused([0.0, 1.0, 1.0], [0, 1, 2])
    with pytest.raises(ValueError, match="times_s must be finite, not nan at element 1"):
        refused([0.0, np.nan, 1.0], [0, 1, 2])
    with pytest.raises(TypeError, match="times_s must be numbers or datetime64, not <U1"):
        refused(["0", "1"], [0, 1])
    with pytest.raises(ValueError, match="counts must change by 1 at an edge, not by 2 at element 2"):
        refused([0.0, 1.0, 2.0], [0, 1, 3])
    with pytest.raises(ValueError, match=r"times_s must last a sample of 0.1 s or more, not 0.05 s"):
        refused([0.0, 0.05], [0, 1])
    with pytest.raises(ValueError, match=r"must be a clock of .* s apart or more, not 1e-09 s at element 2; clock_hz"):
        refused([0.0, 0.123456, 0.123456 + 1e-9], [0, 1, 2], clock_hz=1e6)
    with pytest.raises(ValueError, match=r"period has no words for this motion \(as if 1024 samples were a second: "):
        refused([0.0, 1.0, 1.0 + 1e-9], [0, 1, 2])
    with pytest.raises(
        ValueError, match=r"at most 1e\+08 samples at 1000 Hz, not 2e\+09 in 2e\+06 s: are they in seconds\?"
    ):
        refused([0, 10**6, 2 * 10**6], [0, 1, 2], 1000.0)
    with pytest.raises(ValueError, match=r"clock_hz must be 1e-06 to 2.81475e\+14, not nan"):
        refused([0.0, 1.0], [0, 1], clock_hz=np.nan)
    with pytest.raises(TypeError, match="clock_hz must be a number, not 'x'"):
        refused([0.0, 1.0], [0, 1], clock_hz="x")


SECONDS = np.datetime64("2026-11-29T10:00:00") + np.arange(20) // 4
MANY = np.arange(2000)


@pytest.mark.parametrize(
    ("times", "error", "said"),
    [
        (SECONDS, ValueError,
         "times_s must increase, not from 2026-11-29T10:00:00 to 2026-11-29T10:00:00 at element 1; 15 of 19 are as the "
         "one before: give times fine enough to tell edges apart"),
        (SECONDS[::-4], ValueError,
         "times_s must increase, not from 2026-11-29T10:00:04 to 2026-11-29T10:00:03 at element 1"),
        (1.7e9 + np.arange(20) * 1e-9, ValueError,
         "times_s must increase, not from 1700000000.0 to 1700000000.0 at element 1; 19 of 19 are as the one before: "
         "give times fine enough to tell edges apart"),
        (MANY * 10**6, ValueError,
         "times_s must last at most 1e+08 samples at 1000 Hz, not 1.999e+12 in 1.999e+09 s: are they in seconds? Times "
         "in ms, us or ns may be datetime64 of that unit"),
        ((MANY * 10**6).astype("M8[s]"), ValueError,
         "times_s must last at most 1e+08 samples at 1000 Hz, not 1.999e+12 in 1.999e+09 s: are they in seconds? Times "
         "in ms, us or ns may be datetime64 of that unit"),
        (MANY.astype("M8[ns]"), ValueError,
         "times_s must last a sample of 0.001 s or more, not 1.999e-06 s: are they in seconds? Times in ms, us or ns "
         "may be datetime64 of that unit"),
        (MANY.astype("m8[ms]"), TypeError,
         "times_s must be numbers or datetime64, not timedelta64[ms]: divide them by np.timedelta64(1, 's')"),
        (MANY.astype("M8[M]"), TypeError, "times_s must be datetime64 in days or a finer unit, not datetime64[M]"),
        (np.array([-(2**62), 2**62]).view("M8[ns]"), ValueError,
         "times_s must last less than 2**63 ns: give datetime64[ns] in a coarser unit"),
    ],
)  # fmt: skip
def test_times_of_a_wrong_unit_say_what_to_do(times, error, said):
    with pytest.raises(error) as caught:
        velocity_of_edges(times, np.arange(len(times)), 1e3, "period", **BOUNDS)
    assert str(caught.value) == said


def test_times_in_a_unit_of_their_own_are_those_in_seconds():
    made = velocity_of_edges(MANY * 1e-3, MANY, 100.0, "period", **WIDE)
    assert velocity_of_edges(MANY.astype("M8[ms]"), MANY, 100.0, "period", **WIDE).tolist() == made.tolist()


@pytest.mark.parametrize("backend", ["fixed", "float"])
def test_the_acceleration_in_one_call_is_that_of_the_estimator(backend):
    t = np.arange(5000) / 10e3
    counts = np.stack([np.floor(1000 * np.sin(20 * np.pi * t)), np.floor(500 * np.cos(20 * np.pi * t))]).astype(int)
    bounds = {"acceleration_max": 5.0, "speed_max": 0.1, "travel": 4e-3}
    made, accelerations = velocity_and_acceleration(counts, 10e3, count=1e-6, backend=backend, **bounds)
    assert made.tolist() == velocity(counts, 10e3, count=1e-6, backend=backend, **bounds).tolist()
    taken = VelocityEstimator(10e3, "kalman", Motion(count=1e-6, **bounds), backend=backend)
    assert accelerations.tolist() == taken.with_acceleration(counts)[1].tolist()
    true = -1e-3 * (20 * np.pi) ** 2 * np.sin(20 * np.pi * t)
    assert (accelerations[0] - true)[1000:].std() < 0.3 * true.std()
    turned = velocity_and_acceleration(counts.T, 10e3, count=1e-6, backend=backend, axis=0, **bounds)
    assert turned[1].T.tolist() == accelerations.tolist()
    none = velocity_and_acceleration(counts[:0], 10e3, count=1e-6, backend=backend, **bounds)
    assert [each.shape for each in none] == [(0, 5000)] * 2


def test_the_acceleration_of_edges_in_one_call_is_that_of_the_estimator():
    times, counts = walk()
    made, accelerations = velocity_and_acceleration_of_edges(times, counts, 1e3, clock_hz=1e6, **WIDE)
    assert made.tolist() == velocity_of_edges(times, counts, 1e3, clock_hz=1e6, **WIDE).tolist()
    taken = EdgeVelocityEstimator(1e3, "edge-kalman", Motion(**WIDE), clock_hz=1e6)
    assert accelerations.tolist() == taken.with_acceleration(times, counts)[1].tolist()
    assert np.abs(accelerations).max() > 0


def test_an_estimator_without_an_acceleration_is_refused_in_one_call():
    with pytest.raises(ValueError, match=r"^estimator must be one with an acceleration \(.*\), not 'levant'$"):
        velocity_and_acceleration([0, 1], 1e3, "levant")
    with pytest.raises(ValueError, match=r"^estimator must be one with an acceleration \(.*\), not 'mt'$"):
        velocity_and_acceleration_of_edges([0.0, 1.0], [0, 1], 1e3, "mt")
    with pytest.raises(ValueError, match=r"^estimator must be one of fdm, .*, not 'euler'$"):
        velocity_and_acceleration([0, 1], 1e3, "euler")
    with pytest.raises(ValueError, match=r"only counts, not 'levant-edge': velocity_of_edges and"):
        velocity_and_acceleration([0, 1], 1e3, "levant-edge")
