"""An axis a sample at a time: as the axis on the edges that exact arithmetic finds between the positions."""

import copy
import math
import pickle
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from hardwall.model import Sampler, stamped
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder import quadrature
from hardwall.model.estimators.acceleration import Accelerated
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.sampler import pass_edges
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.specs import PAPER, spec

COUNT_M = 2.0**-20
SPEC = replace(spec("paper", "fdm"), count_m=COUNT_M, actuation_hz=PAPER["sample_hz"])
EVERY = [(name, backend) for name in ESTIMATORS for backend in ("fixed", "float")]
SOME = EVERY if LONG else [("levant", "float"), ("edge-kalman", "fixed")]
SOME_ACCELERATED = [("edge-kalman", "fixed")]
if LONG:
    SOME_ACCELERATED = [(name, backend) for name, backend in EVERY if issubclass(ESTIMATORS[name], Accelerated)]
WALL = {"wall_stiffness": 20e3, "wall_damping": 10.0, "encoder_glitch_clocks": 1}
GRAY = (1, 3, 2, 0)
"""Levels of the pins, a | b << 1, in cells 0, 1, 2, 3 of a cycle."""


def walk(samples: int = 400) -> list[float]:
    """Return positions in 2**-30 m, whose edges floats find exactly: moves of no, some and many counts, and turns."""
    random = rng()
    moves = random.choice([0, 40, 900, 5000, 90_000], samples) * random.integers(-9, 10, samples)
    return ((5000 + np.cumsum(moves)) * 2.0**-30).tolist()


def edges_of(positions: list[float], clocks: int, first: int) -> tuple[list[int], list[int]]:
    """Return the clocks and the levels of the edges of positions, a sample apart, by rational numbers.

    `first` is the clock of the first position.
    """
    at, levels = [], []
    places = [Fraction(position) / Fraction(COUNT_M) for position in positions]
    for k, (place, after) in enumerate(pairwise(places)):
        up, count = after > place, math.floor(place)
        while count != math.floor(after):
            border = count + 1 if up else count
            share = math.floor(clocks * (border - place) / (after - place))
            count += 1 if up else -1
            # An edge at the very end of the sample comes at its last clock.
            at.append(first + k * clocks + 1 + min(share, clocks - 1))
            levels.append(GRAY[count % 4])
    return at, levels


@pytest.mark.parametrize(("estimator", "backend"), SOME_ACCELERATED)
def test_its_acceleration_is_that_of_the_axis(estimator, backend):
    of, positions = replace(SPEC, estimator=estimator), walk(200)
    sampler = Sampler(of, backend)
    assert sampler.acceleration_m_per_s2 == 0
    came = []
    for position in positions:
        sampler(position)
        came.append(sampler.acceleration_m_per_s2)
    clocks, levels = edges_of(positions, of.clocks_per_sample, of.design.timing.strobe)
    axis = Axis(of, backend == "float")
    record = stamped.run(axis, clocks, levels, len(positions), GRAY[math.floor(positions[0] / COUNT_M) % 4])
    assert came == record.acceleration_m_per_s2.tolist()
    assert max(came) > 0 > min(came)
    # A copy has it before its next sample.
    assert copy.deepcopy(sampler).acceleration_m_per_s2 == came[-1]


@pytest.mark.parametrize(("estimator", "backend"), SOME)
def test_it_is_the_axis_on_the_edges_between_the_positions(estimator, backend):
    of, positions = replace(SPEC, estimator=estimator), walk()
    sampler = Sampler(of, backend, **WALL)
    came = [(sampler(position), sampler.velocity_m_per_s, tuple(sampler.flags)) for position in positions]
    start = math.floor(positions[0] / COUNT_M)
    clocks, levels = edges_of(positions, of.clocks_per_sample, of.design.timing.strobe)
    # The decoder of a record starts at the count 0: the wall is moved as far.
    axis = Axis(of, backend == "float", **WALL, wall_position=-start * COUNT_M)
    record = stamped.run(axis, clocks, levels, len(positions), GRAY[start % 4])
    names = [tuple(of.design.flag_names(int(flags))) for flags in record.flags]
    assert came == list(zip(record.drive_n.tolist(), record.velocity_m_per_s.tolist(), names, strict=True))
    assert min(record.drive_n) < -1
    assert sampler.count == math.floor(positions[-1] / COUNT_M)


def test_edges_come_one_a_clock_and_within_the_sample():
    """As many edges as a sample has clocks: evenly, and in bursts that would meet."""
    clocks = SPEC.clocks_per_sample
    fast = replace(SPEC, speed_max_m_per_s=20.0, glitch_clocks=0)
    for start in (0.0, 0.25, 0.999):
        sampler = Sampler(fast, encoder_glitch_clocks=0)
        for k in range(8):
            sampler((start + k * clocks) * COUNT_M)
        for _ in range(3):
            sampler((start + 7 * clocks) * COUNT_M)
        assert (sampler.flags, sampler.count) == ([], 7 * clocks)


def test_edges_keep_apart_where_floats_put_two_into_one_clock():
    """An edge a clock, from just before a border on: rounded down, the time of an edge is that of the one before."""
    clocks, count_m = SPEC.clocks_per_sample, 3e-7
    fast = replace(SPEC, count_m=count_m, speed_max_m_per_s=20.0, glitch_clocks=0)
    met = 0
    for border in range(1, 1000):
        place = math.nextafter(border * count_m, 0.0)
        position = place + clocks * count_m
        shares = [clocks * ((border + k) * count_m - place) / (position - place) for k in range(clocks)]
        if math.floor(position / count_m) - math.floor(place / count_m) != clocks or min(np.diff(np.floor(shares))) > 0:
            continue
        met += 1
        sampler = Sampler(fast, encoder_glitch_clocks=0)
        for each in (place, position, position):
            sampler(each)
        assert "encoder_illegal" not in sampler.flags
        assert sampler.count == math.floor(position / count_m)
    assert met > 0


@pytest.mark.parametrize("moved", [1, 2, 7, SPEC.clocks_per_sample])
@pytest.mark.parametrize("direction", [1, -1])
def test_no_edge_comes_after_the_sample_that_ends_its_motion(moved, direction):
    """A motion that ends on a border passes it in the last clock, and the edges before it in clocks before that."""
    words, state = stamped.controller(Axis(SPEC, encoder_glitch_clocks=0), GRAY[0])
    places = 4096 * COUNT_M, (4096 + direction * moved) * COUNT_M
    passed = pass_edges(words, state._replace(clock=100), COUNT_M, places, 100, SPEC.clocks_per_sample)
    assert 100 < passed.clock <= 100 + SPEC.clocks_per_sample
    assert not quadrature.fault(passed.decoder)


def test_more_edges_than_clocks_are_a_fault_without_a_force():
    sampler = Sampler(SPEC, wall_stiffness=20e3)
    assert sampler(1e-3) < 0
    sampler(1e-3 + (SPEC.clocks_per_sample + 1) * COUNT_M)
    assert sampler(1e-3) == 0
    assert "encoder_illegal" in sampler.flags
    sampler.reset()
    assert sampler(1e-3) < 0
    assert sampler.flags == []


def test_a_count_beyond_its_range_wraps_with_a_flag_and_without_a_force():
    half = 1 << (SPEC.count_width - 1)
    sampler = Sampler(SPEC, wall_stiffness=20e3, wall_position=-0.9)
    sampler((half - 3) * COUNT_M)
    for _ in range(2):
        force = sampler((half + 5) * COUNT_M)
    assert "count_wrapped" in sampler.flags
    assert (sampler.count, force) == (5 - half, 0)


def test_words_change_between_samples():
    sampler = Sampler(SPEC, wall_stiffness=20e3)
    first = sampler(1e-4)
    sampler.set(wall_stiffness=40e3)
    assert sampler(1e-4) == pytest.approx(2 * first, rel=1e-3)
    sampler.set(wall_damping=1.0)
    assert sampler(1e-4) == pytest.approx(2 * first, rel=1e-3)


def test_two_samplers_know_nothing_of_each_other():
    one, other = (Sampler(replace(SPEC, estimator="window"), wall_stiffness=20e3, wall_damping=50.0) for _ in range(2))
    alone = Sampler(replace(SPEC, estimator="window"), wall_stiffness=20e3, wall_damping=50.0)
    positions = walk(100)
    both = [(one(position), other(-position)) for position in positions]
    assert [force for force, _ in both] == [alone(position) for position in positions]


def test_a_copy_goes_on_from_the_same_state():
    positions = walk(60)
    sampler = Sampler(replace(SPEC, estimator="window"), wall_stiffness=20e3, wall_damping=50.0)
    assert [copy.deepcopy(sampler)(positions[0])] == [sampler(positions[0])]
    for position in positions[1:30]:
        sampler(position)
    held = sampler.state
    others = copy.deepcopy(sampler), copy.copy(sampler), pickle.loads(pickle.dumps(sampler))
    first = [(sampler(position), sampler.velocity_m_per_s) for position in positions[30:]]
    assert all(repr(other.state) == repr(held) for other in others)
    for other in others:
        assert [(other(position), other.velocity_m_per_s) for position in positions[30:]] == first


def test_before_the_first_sample():
    sampler = Sampler(SPEC)
    assert (sampler.state, sampler.velocity_m_per_s, sampler.count, sampler.flags) == (None, 0.0, 0, [])
    assert sampler(0.0) == 0.0
    assert sampler.state.decoder.count == 0
    assert sampler.acceleration_m_per_s2 is None


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 2.0**33])
def test_positions_without_a_count_are_refused(wrong):
    reach = quadrature_reach()
    with pytest.raises(ValueError, match=rf"must begin within -{reach} to {reach} m, not {wrong}"):
        Sampler(SPEC)(wrong)
    sampler = Sampler(SPEC)
    sampler(0.0)
    with pytest.raises(ValueError, match=rf"must be finite, and within 2\*\*52 counts, not {wrong}"):
        sampler(wrong)
    assert sampler(0.0) == 0


def quadrature_reach() -> str:
    """Return the first position that is beyond the count, in m, as messages show it."""
    return f"{(1 << (SPEC.count_width - 1)) * COUNT_M:g}"


def test_what_is_refused():
    with pytest.raises(TypeError, match="spec must be an AxisSpec, not 'mhz'"):
        Sampler("mhz")
    with pytest.raises(ValueError, match=r"parameter must be one of .* not 'wall_stifness'"):
        Sampler(SPEC, wall_stifness=1.0)
    sampler = Sampler(SPEC)
    for _ in range(2):
        for wrong in (None, "0.001", True, [1.0]):
            with pytest.raises(TypeError, match="position_m must be a number, not "):
                sampler(wrong)
        assert sampler(np.array(0.0)) == sampler(np.float32(0.0)) == sampler(0) == 0.0
    with pytest.raises(ValueError, match="must be finite"):
        sampler(10**400)
    with pytest.raises(ValueError, match="backend must be one of fixed, float, not True"):
        Sampler(SPEC, True)
    with pytest.raises(ValueError, match="wall_stiffness must be 0 to"):
        sampler.set(wall_stiffness=-1.0)


def test_the_decoders_latency_is_that_of_the_hardware():
    """An edge just before a sample counts at the next one, and one as early as the latency at this one."""
    latency, clocks = quadrature.latency(0), SPEC.clocks_per_sample
    for early, counted in ((latency - 1, 0), (latency, 1)):
        sampler = Sampler(SPEC, encoder_glitch_clocks=0)
        sampler(0.5 * COUNT_M)
        # The border of cells 0 and 1 is passed (clocks - early - 1/2) clocks after the first sample.
        sampler((0.5 + 0.5 * clocks / (clocks - early - 0.5)) * COUNT_M)
        assert sampler.count == counted
        sampler((0.5 + 0.5 * clocks / (clocks - early - 0.5)) * COUNT_M)
        assert sampler.count == 1
