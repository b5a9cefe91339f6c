"""An estimator for edges in pieces: the whole record's velocities for any cut, words that change, what is refused."""

import copy
import pickle
import warnings
from collections.abc import Iterator

import numpy as np
import pytest

from hardwall.model import EdgeVelocityEstimator, Motion, RecordWarning, VelocityEstimator, stamped, velocity_of_edges
from hardwall.model.axis.axis import Axis
from hardwall.model.axis.design import strobe_of
from hardwall.model.encoder.level import level
from hardwall.model.encoder.quadrature import LATENCY
from hardwall.model.estimators import levant
from hardwall.model.estimators.acceleration import Accelerated, acceleration_of
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.testing import rng
from stimuli.lengths import LONG

EVERY = [(name, backend) for name in sorted(ESTIMATORS) for backend in ("fixed", "float")]
SOME = EVERY if LONG else [("period", "float"), ("levant", "fixed"), ("mt", "fixed")]
SOME_ACCELERATED = [("edge-kalman", "fixed"), ("kalman", "float")]
if LONG:
    SOME_ACCELERATED = [(name, backend) for name, backend in EVERY if issubclass(ESTIMATORS[name], Accelerated)]
RATE, CLOCKS = 1000.0, 1 << 17
CLOCK_HZ = 100e6
"""Of a sample of 2**17 clocks, the next power of two."""
MOTION = Motion(acceleration_max=1e6, speed_max=1e5, travel=1e4)
BOUNDS = {"acceleration_max": 1e6, "speed_max": 1e5, "travel": 1e4}


def walk(edges: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Return the clocks and the counts of edges at random, with turns: some at a sample, or a few clocks beside it.

    Some of these come in pairs, so that a sample is complete before the second one has left the decoder.
    """
    random = rng()
    clocks = np.cumsum(random.integers(CLOCKS // 50, 3 * CLOCKS, edges))
    near = random.random(edges) < 0.3
    clocks[near] = np.round(clocks[near] / CLOCKS).astype(np.int64) * CLOCKS + random.integers(-5, 6, near.sum())
    clocks = np.unique(np.abs([0, *clocks, *clocks[near] + random.integers(1, 4, near.sum())]))
    return clocks, np.cumsum(np.where(random.random(len(clocks)) < 0.3, -1, 1))


def cuts(length: int) -> Iterator[slice]:
    """Yield pieces of a record: none, one, a few or many edges each, in any order."""
    random, first = rng(), 0
    while first < length:
        last = first + int(random.choice([0, 1, 1, 2, 3, 50, 400]))
        yield slice(first, last)
        first = last


def in_pieces(taken: EdgeVelocityEstimator, times: np.ndarray, counts: np.ndarray) -> list[float]:
    return np.concatenate([taken(times[piece], counts[piece]) for piece in cuts(len(times))]).tolist()


def by_the_axis(taken: EdgeVelocityEstimator, clocks: np.ndarray, counts: np.ndarray, floating: bool) -> list[float]:
    """Return the velocities of the whole record by `stamped.run`."""
    first = taken.spec.design.timing.strobe - LATENCY
    samples = int(clocks[-1]) // CLOCKS + 1
    record = stamped.run(
        Axis(taken.spec, floating), first + clocks[1:], level(counts[1:] - counts[0]), samples, int(level(0))
    )
    lsb = 1.0 if floating else taken.spec.design.estimator.velocity.lsb
    return (record.velocity[1:] * (lsb * RATE)).tolist()


@pytest.mark.filterwarnings("ignore:raised flags")
@pytest.mark.parametrize(("estimator", "backend"), SOME)
def test_pieces_are_the_whole(estimator, backend):
    clocks, counts = walk()
    times = clocks / (RATE * CLOCKS)
    made = EdgeVelocityEstimator(RATE, estimator, MOTION, backend=backend, clock_hz=CLOCK_HZ)
    assert made.spec.clocks_per_sample == CLOCKS
    pieces = in_pieces(made, times, counts)
    whole = velocity_of_edges(times, counts, RATE, estimator, backend=backend, clock_hz=CLOCK_HZ, **BOUNDS)
    assert pieces == whole.tolist() == by_the_axis(made, clocks, counts, backend == "float")
    assert np.abs(pieces).max() > 100


@pytest.mark.parametrize("piece", [1, 2, 7])
def test_edges_one_by_one_are_the_whole(piece):
    clocks, counts = walk(300)
    times = clocks / (RATE * CLOCKS)
    made = EdgeVelocityEstimator(RATE, "mt", MOTION, clock_hz=CLOCK_HZ)
    pieces = [made(times[k : k + piece], counts[k : k + piece]) for k in range(0, len(times), piece)]
    assert np.concatenate(pieces).tolist() == by_the_axis(made, clocks, counts, False)


def far(times: np.ndarray, kind: str) -> np.ndarray:
    """Return times from 0 to some seconds in a form of its own, far from 0."""
    if kind == "datetime64":
        return np.datetime64("2026-11-28T21:00:00", "ns") + np.round(times * 1e9).astype("timedelta64[ns]")
    return 1.7e9 + times


@pytest.mark.parametrize("kind", ["datetime64", "float64"])
@pytest.mark.parametrize("estimator", ["fdm", "mt"])
def test_pieces_far_from_zero_are_the_whole(estimator, kind):
    """Quarters of a sample, so that many edges are at one; float64 is less certain there than a clock."""
    quarters = np.cumsum(rng().integers(1, 9, 1500))
    counts = np.cumsum(np.where(rng().random(1500) < 0.3, -1, 1))
    times = far(quarters / (4 * RATE), kind)
    whole = velocity_of_edges(times, counts, RATE, estimator, clock_hz=CLOCK_HZ, **BOUNDS)
    for _ in range(4):
        assert (
            in_pieces(EdgeVelocityEstimator(RATE, estimator, MOTION, clock_hz=CLOCK_HZ), times, counts)
            == whole.tolist()
        )
    assert len(whole) == (quarters[-1] - quarters[0]) // 4


def test_whole_seconds_far_from_zero_are_the_whole():
    seconds = 2**60 + np.cumsum(rng().integers(1, 9, 1000))
    counts = np.cumsum(np.where(rng().random(1000) < 0.3, -1, 1))
    motion = Motion(acceleration_max=1.0, speed_max=2.0, travel=1e4)
    whole = velocity_of_edges(seconds, counts, 0.7, "period", acceleration_max=1.0, speed_max=2.0, travel=1e4)
    made = EdgeVelocityEstimator(0.7, "period", motion)
    assert in_pieces(made, seconds, counts) == whole.tolist()
    assert np.abs(whole).max() > 0.1


def test_edges_closer_than_float64_tells_keep_their_order():
    """Two spacings of float64 apart, at a sample: they are one after the other, in pieces as in the whole."""
    spacing = float(np.spacing(1.7e9))
    times = 1.7e9 + np.array([0.0, 0.25, 0.25 + spacing, 0.25 + 2 * spacing, 0.5, 1.0])
    whole = velocity_of_edges(times, np.arange(6), 4.0, "fdm", clock_hz=CLOCK_HZ, **BOUNDS)
    made = EdgeVelocityEstimator(4.0, "fdm", MOTION, clock_hz=CLOCK_HZ)
    assert np.concatenate([made([time], [k]) for k, time in enumerate(times)]).tolist() == whole.tolist()
    assert whole.sum() == 5 * 4.0


def test_a_standstill_goes_on_until_it_is_said():
    times, counts = np.arange(400) * 0.7e-3, np.arange(400)
    later = times[-1] + 0.1234
    whole = velocity_of_edges([*times, later], [*counts, 400], RATE, "period", clock_hz=CLOCK_HZ, **BOUNDS)
    made = EdgeVelocityEstimator(RATE, "period", MOTION, clock_hz=CLOCK_HZ)
    pieces = [made(times, counts), made([], [], times[-1]), made([], [], times[-1] + 0.05), made([], [], later - 1e-7)]
    assert [len(each) for each in pieces[:3]] == [279, 0, 50]
    assert np.concatenate([*pieces, made([later], [400])]).tolist() == whole.tolist()
    assert 0 < whole[-2] < whole[300] < whole[278]


@pytest.mark.parametrize("behind", [1, 2, 3])
def test_an_edge_just_after_the_end_of_a_piece_counts_for_the_next_sample(behind):
    """Far from 0 its time is not sure: the whole record would count it for the sample that was returned already."""
    start, counts = 1.7e9, np.arange(200)
    end = start + 100 / RATE
    times = start + np.concatenate([np.arange(99) * 0.97e-3, 0.1 + np.arange(101) * 0.97e-3])
    times[99] = end + behind * np.spacing(start)
    made = EdgeVelocityEstimator(RATE, "kalman", MOTION, clock_hz=CLOCK_HZ)
    pieces = [made(times[:99], counts[:99], until_s=end), made(times[99:], counts[99:])]
    assert len(pieces[0]) == 100
    moved = np.where(np.arange(200) == 99, end + 10 * np.spacing(start), times)
    whole = EdgeVelocityEstimator(RATE, "kalman", MOTION, clock_hz=CLOCK_HZ)(moved, counts)
    assert np.concatenate(pieces).tolist() == whole.tolist()
    unmoved = EdgeVelocityEstimator(RATE, "kalman", MOTION, clock_hz=CLOCK_HZ)(times, counts)
    assert (unmoved.tolist() == whole.tolist()) == (behind > 2)


def test_words_change_from_the_next_velocity_on():
    """As if a host wrote them between two samples of the axis."""
    clocks, counts = walk(400)
    made = EdgeVelocityEstimator(RATE, "levant", MOTION, output="u1", clock_hz=CLOCK_HZ)
    spec, changed = made.spec, {"levant_lambda": 500.0, "levant_alpha": 3e5}
    times = clocks / (RATE * CLOCKS)
    first = made(times[:200], counts[:200])
    for name, value in changed.items():
        made.set(**{name: value})
    second = made(times[200:], counts[200:])
    edges = stamped.Edges(spec.design.timing.strobe - LATENCY + clocks[1:], level(counts[1:] - counts[0]))
    scale = spec.sample_hz / RATE
    scaled = {"levant_lambda": 500.0 * scale, "levant_alpha": 3e5 * scale**2}
    before, state = stamped.controller(Axis(spec, levant_output=1), int(level(0)))
    after, expected, taken = stamped.controller(Axis(spec, levant_output=1, **scaled), 0)[0], [], 0
    for k in range(len(first) + len(second) + 1):
        rest = stamped.Edges(edges.clocks[taken:], edges.levels[taken:])
        strobe = strobe_of(spec.design.timing, k)
        state, more = stamped.sample(before if k <= len(first) else after, state, rest, len(rest.clocks), strobe)
        taken += more
        expected.append(state.velocity * (spec.design.estimator.velocity.lsb * RATE))
    assert [*first, *second] == expected[1:]
    plain = EdgeVelocityEstimator(RATE, "levant", MOTION, output="u1", clock_hz=CLOCK_HZ)(times, counts)
    assert plain[: len(first)].tolist() == first.tolist()
    assert plain[len(first) :].tolist() != second.tolist()


@pytest.mark.parametrize("estimator", ["mt", "window", *(["edge-kalman"] if LONG else [])])
def test_a_copy_goes_on_from_the_same_state(estimator):
    clocks, counts = walk(400)
    times = clocks / (RATE * CLOCKS)
    made = EdgeVelocityEstimator(RATE, estimator, MOTION, clock_hz=CLOCK_HZ)
    made(times[:150], counts[:150])
    others = copy.deepcopy(made), pickle.loads(pickle.dumps(made))
    rest = made(times[150:], counts[150:]).tolist()
    assert [other(times[150:], counts[150:]).tolist() for other in others] == [rest] * 2
    made.reset()
    again = EdgeVelocityEstimator(RATE, estimator, MOTION, clock_hz=CLOCK_HZ)
    assert made(times, counts).tolist() == again(times, counts).tolist()


def test_an_estimator_of_counts_gives_the_velocities_of_its_counts_at_the_samples():
    """With gains in true seconds."""
    clocks, counts = walk(400)
    gains = levant.Gains(500.0, 3e5)
    made = EdgeVelocityEstimator(RATE, "levant", MOTION, gains=gains, clock_hz=CLOCK_HZ)
    at = counts[np.searchsorted(clocks, np.arange(0, clocks[-1] + 1, CLOCKS), side="right") - 1]
    expected = VelocityEstimator(RATE, "levant", MOTION, gains=gains)(at)
    assert made(clocks / (RATE * CLOCKS), counts).tolist() == expected[1:].tolist()


def test_flags_are_those_of_the_whole():
    times, counts, slow = np.arange(10_000) * 500e-9, np.arange(10_000), {**BOUNDS, "speed_max": 100.0}
    made = EdgeVelocityEstimator(RATE, "fdm", Motion(**slow), clock_hz=CLOCK_HZ)
    assert made.flags == []
    pieces = in_pieces(made, times, counts)
    with pytest.warns(RecordWarning, match="raised flags: velocity_saturated; a larger speed_max may help"):
        whole = velocity_of_edges(times, counts, RATE, "fdm", clock_hz=CLOCK_HZ, **slow)
    assert (pieces, made.flags) == (whole.tolist(), ["velocity_saturated"])
    made.reset()
    assert made.flags == []


def test_what_is_refused_leaves_no_trace():
    clocks, counts = walk(300)
    times = clocks / (RATE * CLOCKS)
    made = EdgeVelocityEstimator(RATE, "period", MOTION, clock_hz=CLOCK_HZ)
    with pytest.raises(ValueError, match="until_s needs the time and the count of the start first"):
        made([], [], 1.0)
    pieces = [made(times[:100], counts[:100])]
    end, count = times[99], counts[99]
    dates = np.array(["2026-11-28T21:00:00"], "M8[ns]")
    for error, said, *arguments in (
        (ValueError, r"times_s must increase, not from .* to .* at element 0; 1 of 1 are", [end], [count + 1]),
        (ValueError, r"times_s must increase, not from .* to .* at element 1; 1 of 2 are",
         [end + 1, end + 1], [count + 1, count]),
        (ValueError, r"counts must change by 1 at an edge, not by 2 at element 0$", [end + 1], [count + 2]),
        (ValueError, r"counts must change by 1 at an edge, not by 0 at element 0$", [end + 1], [count]),
        (ValueError, r"not by -3 at element 1$", [end + 1, end + 2], [count + 1, count - 2]),
        (ValueError, r"one shape \(edges,\), not \(2,\) and \(1,\)", [end + 1, end + 2], [count + 1]),
        (ValueError, r"one shape \(edges,\), not \(\) and \(\)", end + 1, count + 1),
        (ValueError, "times_s must be finite, not nan at element 0", [np.nan], [count + 1]),
        (TypeError, "counts must be integers, not float64", [end + 1], [0.5]),
        (TypeError, r"times_s must be float64 as the times before, not datetime64\[ns\]", dates, [count + 1]),
        (ValueError, r"a clock of .* s apart or more, not 1e-09 s at element 1; clock_hz",
         [end + 1e-9, end + 2e-9], [count + 1, count + 2]),
        (ValueError, r"at most 1e\+08 samples at 1000 Hz, not .*: are they in seconds\?", [end + 1e9], [count + 1]),
        (ValueError, r"until_s must be 0\.\d+ or later, the last time that was given, not 0\.\d+", [], [], end - 1e-3),
        (ValueError, r"until_s must be one time, not an array of shape \(1,\)", [], [], [end]),
        (ValueError, "until_s must be finite, not inf", [], [], np.inf),
        (TypeError, "until_s must be numbers or datetime64, not <U1", [], [], "x"),
    ):  # fmt: skip
        with pytest.raises(error, match=said):
            made(*arguments)
    pieces.append(made(times[100:], counts[100:]))
    assert np.concatenate(pieces).tolist() == by_the_axis(made, clocks, counts, False)


def test_datetimes_may_come_in_a_coarser_unit_but_in_no_finer_one():
    start = np.datetime64("2026-11-28T21:00:00", "ms")
    made = EdgeVelocityEstimator(RATE, "fdm", MOTION, clock_hz=CLOCK_HZ)
    assert made([start], [0]).tolist() == []
    assert made([np.datetime64("2026-11-28T21:00:01", "s")], [1]).tolist() == [0.0] * 999 + [RATE]
    assert len(made([], [], np.datetime64("2026-11-28T21:00:02", "s"))) == 1000
    with pytest.raises(TypeError, match=r"must be datetime64\[ms\] as the times before, not datetime64\[us\]"):
        made(np.array(["2026-11-28T21:00:03"], "M8[us]"), [2])
    with pytest.raises(TypeError, match=r"must be datetime64\[ms\] as the times before, not int64"):
        made([3], [2])


def test_what_the_constructor_refuses():
    for error, said, more in (
        (TypeError, "motion must be a Motion, not None", {"motion": None}),
        (ValueError, "estimator must be one of fdm, .* not 'euler'", {"estimator": "euler"}),
        (ValueError, "output of period must be one of u, not 'u1'", {"output": "u1"}),
        (ValueError, "backend must be one of fixed, float, not 'rtl'", {"backend": "rtl"}),
        (ValueError, r"clock_hz must be 1e-06 to 2.81475e\+14, not 0", {"clock_hz": 0}),
        (TypeError, "sample_hz must be a number, not None", {"sample_hz": None}),
        (TypeError, "gains must be period.Gains or None, not 3", {"gains": 3}),
        (ValueError, "levant_lambda is no setting; accepted are", {"levant_lambda": 1.0}),
    ):
        arguments = {"sample_hz": RATE, "estimator": "period", "motion": MOTION} | more
        with pytest.raises(error, match=said):
            EdgeVelocityEstimator(**arguments)


def test_a_long_standstill_before_the_first_piece_costs_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = EdgeVelocityEstimator(RATE, "edge-kalman", MOTION, clock_hz=CLOCK_HZ)
        assert made([], []).shape == (0,)
        assert made([5], [7], 7).tolist() == [0.0] * 2000


@pytest.mark.parametrize(("estimator", "backend"), SOME_ACCELERATED)
def test_the_acceleration_is_the_kernels_in_any_pieces(estimator, backend):
    clocks, counts = walk(400)
    times = clocks / (CLOCKS * RATE)
    floating = backend == "float"
    taken = EdgeVelocityEstimator(RATE, estimator, MOTION, backend=backend, clock_hz=CLOCK_HZ)
    design, timing = taken.spec.design.estimator, taken.spec.design.timing
    edges = stamped.Edges(timing.strobe - LATENCY + clocks[1:], level(counts[1:] - counts[0]))
    params, state = stamped.controller(Axis(taken.spec, floating), int(level(0)))
    expected, unit = [], (1.0 if floating else design.acceleration.lsb) * RATE**2
    for k in range(int(clocks[-1]) // CLOCKS + 1):
        state, some = stamped.sample(params, state, edges, len(edges.clocks), strobe_of(timing, k))
        edges = stamped.Edges(edges.clocks[some:], edges.levels[some:])
        expected.append(acceleration_of(params.axis.estimator, state.axis.estimator) * unit)
    velocity, acceleration = taken.with_acceleration(times, counts)
    assert acceleration.tolist() == pytest.approx(expected[1:], rel=1e-12)
    assert np.abs(acceleration).max() > 0
    again = EdgeVelocityEstimator(RATE, estimator, MOTION, backend=backend, clock_hz=CLOCK_HZ)
    pieces = [again.with_acceleration(times[piece], counts[piece]) for piece in cuts(len(times))]
    assert np.concatenate([of_piece for _, of_piece in pieces]).tolist() == acceleration.tolist()
    assert np.concatenate([of_piece for of_piece, _ in pieces]).tolist() == velocity.tolist()


def test_an_estimator_without_an_acceleration_says_which_have_one():
    taken = EdgeVelocityEstimator(RATE, "mt", MOTION)
    with pytest.raises(ValueError, match=r"^estimator must be one with an acceleration \(kalman, .*\), not 'mt'$"):
        taken.with_acceleration([0.0, 1.0], [0, 1])
    assert len(taken([0.0, 1.0], [0, 1])) == 1000
