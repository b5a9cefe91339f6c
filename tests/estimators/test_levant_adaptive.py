"""Gains that adapt: RTL against model, model against exact integers, the law against what it promises."""

import itertools
import math
from dataclasses import replace
from random import Random

import levants
import numpy as np
import pytest

from hardwall.hdl.estimators.levant_adaptive import Estimator
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import levant_adaptive
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant_adaptive import LOST, RAISED, START
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import rng, simulate
from hardwall.testing.estimators import model, reset_words
from stimuli.lengths import WHOLE, some_of
from stimuli.papers_signal import BOUND, RATES, axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import spec

NAME = "levant-adaptive"
COUNT_M = 1e-6


def design(name: str) -> levant_adaptive.Design:
    # Narrow words at times of a few samples: at those of the narrow axis, a campaign ends before the second level.
    axis = replace(spec("narrow", NAME), acceleration_max_m_per_s2=12e3) if name == "brisk" else spec(name, NAME)
    return axis.design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def stimulus(d: levant_adaptive.Design, samples: int):
    """Yield the family's rows, then calm down to the last level, losses of all sizes from it, and a restart there."""
    yield from levants.stimulus(d, samples * 2 // 5)
    random, reset, count = seeded(), reset_words(d)[:2], 0
    yield from losses(d, samples // 10, random)
    most = max(samples // 20, 1)
    for run in range(10):
        # The first samples after a jump are for tracking, the rest for calm.
        for k in range(most):
            count += int(random.random() < 0.01) if run % 2 else 0
            yield count, int(k == 0 and run == 4), *reset, k & 1
        count += random.randrange(2, 4 ** (1 + run % 4)) * random.choice([-1, 1])
        for _ in range(20):
            count += run % 4
            yield count, 0, *reset, 0


def losses(d: levant_adaptive.Design, samples: int, random: Random):
    """Yield rows of a calm of any time, a time on one side and a loss there; the level then says what it reached."""
    leader, words = levants.Leader(d), reset_words(d)
    calm, reach = sum(map(d.hold_samples, range(d.levels))), d.reach_samples(d.levels)
    while samples > 0:
        side = random.choice((-1, 1))
        # Any time, or one beside that at which another level is reached.
        beside = d.reach_samples(random.randint(1, d.levels)) + random.randint(-2, 2)
        time = random.choice((max(beside, 1), 1 + random.randrange(reach + 10)))
        # An error from 0 to a count is on the one side, and from -1 to 0 on the other.
        parts = [
            (int(side > 0), -side, random.choice((calm, random.randrange(calm + 20)))),
            (int(side < 0), side, time),
            (LOST << random.randrange(3), side, 3),
        ]
        for size, where, rows in parts:
            yield from leader.rows(size, where, rows, words)
            samples -= rows


follows_model, reset_mid_stream_starts_afresh = levants.campaign(make, START, stimulus)


@pytest.mark.parametrize("name", some_of(["paper", "brisk"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@compiled
def _visit(params, state, counts):
    states = []
    for count in counts:
        state, _, _ = estimate(params, state, seen_count(count), 0)
        states.append(state)
    return states


def visit(d: levant_adaptive.Design, counts) -> list[levant_adaptive.State]:
    """Return the state after every count, with the words as after reset."""
    return _visit(d.params({word.name: word.reset for word in d.words}), START, np.array(counts, np.int64))


def test_the_campaign_sees_every_level():
    d = design("paper")
    counts = [row[0] for row in stimulus(d, 100_000)]
    levels = [state.level for state in visit(d, counts)]
    assert set(levels) == set(range(-RAISED, d.levels + 1)) == set(range(-4, 13))
    falls = {a - b for a, b in itertools.pairwise(levels) if b < a}
    assert {1, 2, d.levels} <= falls


class Law:
    """The law as its module states it, from the whole history of signs and sizes since the start."""

    def __init__(self, d):
        self.d, self.lost = d, LOST * 2**d.velocity.f
        self.reach = [d.reach_samples(n) for n in range(1, d.levels + 1)]
        self.start()

    def start(self):
        self.level, self.calm, self.sizes, self.side, self.reached, self.doublings = 0, 0, [], 0, 0, 0

    def level_after(self, b: int) -> int:
        """Return the level after a displacement b, in LSBs of the velocity."""
        sign = (b > 0) - (b < 0)
        if sign and sign != self.side:
            self.side, self.sizes, self.reached, self.doublings = sign, [], 0, 0
        self.sizes.append(abs(b))
        if self.reached < self.d.levels:
            explained = sum(samples <= len(self.sizes) for samples in self.reach)
            self.reached = min(self.reached + 1, explained)
        if abs(b) >= self.lost * 2**self.doublings:
            falls = {0: [], 1: [max(self.level - 2, 0)]}.get(self.doublings, [max(self.level - 2, -RAISED)])
            self.level = min(self.level, self.reached, *falls)
            self.doublings += 1
        self.calm = self.calm + 1 if abs(b) < self.lost and self.level < self.d.levels else 0
        if self.level < self.d.levels and self.calm >= self.d.hold_samples(self.level):
            self.level, self.calm = self.level + 1, 0
        return self.level


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "brisk"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    scale, one, unit, law = 2**d.root.f, 2**d.velocity.f, 2**d.lambda_.f, Law(d)

    def step(lam, alpha, b, first):
        if first:
            law.start()
        level = law.level_after(b)
        # Powers of the level from the least on, which is even, are whole.
        raised, halves = 2**RAISED, 2 ** (RAISED // 2)
        near = min(abs(b), alpha * raised // 2 ** (level + RAISED))
        beyond = abs(b) - near
        twice_root = 2 * math.isqrt(beyond * scale**2 // (one * 2 ** (level % 2))) + 1
        divisor = unit * 2 * scale * 2 ** ((level + RAISED) // 2)
        return near, min(levants.half_up(lam * twice_root * one * halves, divisor), beyond)

    rows = levants.wrapped(d, stimulus(d, 10_000 if WHOLE else 4000))
    seen = model(d, rows, START)
    for k, (velocity, flags) in enumerate(levants.oracle_run(d, rows, step)):
        assert (velocity, flags) == (seen["velocity"][k], seen["saturated"][k]), f"sample {k}: {rows[k]}"


@pytest.mark.parametrize("rate", [10_000, 100_000])
def test_rounding_is_a_small_change_of_position(rate):
    """Every u is the unrounded output for a `beyond` changed by no more than the derived eta."""
    axis = axis_at(NAME, rate, 12.0)
    d = axis.design.estimator
    t = np.arange(20_000) / axis.sample_hz
    counts = np.floor(0.01 / axis.count_m * np.sin(2 * np.pi * 4 * t)).astype(np.int64)
    levels = [state.level for state in visit(d, counts)]
    assert len(set(levels)) > 3
    lead = START
    params = d.params({word.name: word.reset for word in d.words})
    for count, level in zip(counts.tolist(), levels, strict=True):
        moved = count - lead.count if lead.running else 0
        b = (lead.lead - (moved << d.velocity.f)) * d.velocity.lsb
        lead, velocity, _ = estimate(params, lead, seen_count(count), 0)
        lam = d.lambda_.to_real(d.words[0].reset) * 2.0 ** (-level / 2)
        near = min(abs(b), math.floor(d.words[1].reset * 2.0**-level) * d.velocity.lsb)
        beyond, g = abs(b) - near, math.copysign(1, b) * (lead.u1 - velocity) * d.velocity.lsb
        # At odd levels the root is taken of half the radicand.
        delta = lam * 2.0 ** -(d.root.f + 1) * math.sqrt(1 + level % 2) + 2.0 ** -(d.velocity.f + 1)
        eta = abs(max((g / lam) ** 2, g) - beyond)
        assert eta <= max(2 * math.sqrt(beyond) * delta / lam + (delta / lam) ** 2, delta) + 1e-9


@pytest.mark.parametrize("bound", [BOUND, 12.0])
@pytest.mark.parametrize(("rate", "runs"), [*zip(RATES, (200, 200, 40, 8, 2), strict=True)])
def test_word_length_costs_a_hundredth_at_every_rate(rate, runs, bound):
    """Errors are RMS over many runs: a rounding that tips a loss changes a run by 2 to 8 % either way below 1 MHz."""
    exact, fixed = levants.rms_errors(axis_at(NAME, rate, bound), 0.4, runs)["u"]
    assert abs(fixed - exact) <= 0.01 * exact


@pytest.mark.parametrize("acceleration", [0.1, -1.0, 10.0])
@pytest.mark.parametrize("rate", [10_000, 100_000])
def test_a_step_of_acceleration_after_rest_is_seen_within_the_derived_error_and_time(rate, acceleration):
    """The error is sqrt(2 (LOST + 1) A q) and the time sqrt(2 (LOST + 1) q / A), each plus a sample.

    At the sample that detects the step, lambda_j's step may exceed the error.
    """
    axis_spec = axis_at(NAME, rate, 12.0)
    d, tau, steep = axis_spec.design.estimator, 1 / rate, abs(acceleration)
    error = math.sqrt(2 * (LOST + 1) * steep * COUNT_M) + steep * tau
    latest = math.sqrt(2 * (LOST + 1) * COUNT_M / steep) + tau
    for phase in rng().random(3):
        t = np.arange(-rate, round(2 * latest * rate)) * tau
        truth = acceleration * np.maximum(t, 0)
        counts = np.floor(truth * np.maximum(t, 0) / 2 / COUNT_M + phase).astype(np.int64)
        levels = np.array([state.level for state in visit(d, counts)])
        assert levels[rate] == d.levels
        seen = rate + int(np.argmax(levels[rate:] < d.levels))
        assert 0 < t[seen] <= latest
        velocity = levants.axis(axis_spec).run(counts).velocity_m_per_s
        assert np.abs(velocity - truth)[rate:seen].max() <= error
        overshoot = math.sqrt((LOST + 1) * 12.0 * 2.0 ** -levels[seen] * COUNT_M)
        assert abs(velocity[seen] - truth[seen]) <= max(error, overshoot)


def rms(name: str, rate: int, bound: float, counts: np.ndarray, truth: np.ndarray, first: int = 0) -> float:
    """Return the RMS error of u, m/s, from sample `first` on."""
    velocity = levants.axis(axis_at(name, rate, bound)).run(counts).velocity_m_per_s
    return math.sqrt(np.mean((velocity - truth)[first:] ** 2))


def test_a_bound_seven_times_too_large_costs_nothing():
    counts, truth = swing(100_000, 1.0, levants.TURN_S)
    fixed_gains = {bound: rms("levant", 100_000, bound, counts, truth) for bound in (BOUND, 12.0)}
    adapted = rms(NAME, 100_000, 12.0, counts, truth)
    assert adapted < fixed_gains[BOUND] < fixed_gains[12.0] / 2


@pytest.mark.parametrize("speed", [1e-4, 1e-3, 1e-2])
def test_slow_constant_speeds_are_ten_times_quieter(speed):
    rate = 100_000
    counts = np.floor(speed * np.arange(2 * rate) / rate / COUNT_M + 0.3).astype(np.int64)
    assert rms(NAME, rate, 12.0, counts, speed, rate) < rms("levant", rate, 12.0, counts, speed, rate) / 10


def test_a_hit_is_followed():
    """A hit of 0.35 kg at 0.3 m/s into 10 kN/m, then rest: no worse than gains made for it, and quieter afterwards."""
    rate, speed, omega = 100_000, 0.3, math.sqrt(10e3 / 0.35)
    t = np.arange(round(0.6 * rate)) / rate - 0.3
    braking = np.clip(t, 0, np.pi / 2 / omega)
    counts = np.floor((speed * np.minimum(t, 0) + speed / omega * np.sin(omega * braking)) / COUNT_M).astype(np.int64)
    truth = np.where(t < 0, speed, np.where(braking < t, 0.0, speed * np.cos(omega * braking)))
    hit = slice(round(0.25 * rate), round(0.4 * rate))
    assert rms(NAME, rate, 55.0, counts[: hit.stop], truth[: hit.stop], hit.start) < rms(
        "levant", rate, 55.0, counts[: hit.stop], truth[: hit.stop], hit.start
    )
    assert rms(NAME, rate, 55.0, counts, truth, round(0.5 * rate)) == 0


def impact(rate: int, acceleration: float, speed: float, late: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (times, velocities): a constant speed that a wall brakes as a quarter of a sine; it begins by 0.1 s."""
    omega = acceleration / speed
    t = np.arange(round(0.2 * rate)) / rate - 0.1 + late / rate
    braked = np.clip(t, 0, np.pi / 2 / omega)
    truth = np.where(t < 0, speed, speed * np.cos(omega * braked))
    return speed * np.minimum(t, 0) + speed / omega * np.sin(omega * braked), np.where(omega * t > np.pi / 2, 0, truth)


@pytest.mark.parametrize("acceleration", [24.0, 51.0])
@pytest.mark.parametrize("rate", [100_000, 500_000])
def test_an_impact_beyond_the_axis_s_acceleration_is_caught_within_the_derived_error(rate, acceleration):
    """With C = 12 the raised level -2 is enough, so |b| is at most twice the error that leads there."""
    axis_spec, random = axis_at(NAME, rate, 12.0), rng()
    at = LOST * 2**2
    before = math.sqrt(2 * (at + 1) * acceleration * COUNT_M)
    after = math.sqrt(2**RAISED * 12.0 * (2 * at + 1) * COUNT_M)
    speeds = [0.3, *10 ** random.uniform(-2, -0.2, 20)]
    largest = []
    for speed in speeds:
        path, truth = impact(rate, acceleration, speed, random.random())
        counts = np.floor(path / COUNT_M + random.random()).astype(np.int64)
        error = levants.axis(axis_spec).run(counts).velocity_m_per_s - truth
        largest.append(np.abs(error[round(0.09 * rate) :]).max())
    assert max(largest) <= max(before, after) + acceleration / rate


def test_levels_below_that_of_the_axis_are_left_after_a_calm():
    d = design("mhz")
    jump = [0] * 10 + [LOST << 5] * 20
    levels = [state.level for state in visit(d, [*jump, *jump[-1:] * 5 * d.hold_samples(0)])]
    raised = max(k for k, level in enumerate(levels) if level == -RAISED)
    assert levels[raised:].index(0) <= 2 * d.hold_samples(0)


@pytest.mark.parametrize(
    ("gains", "named"),
    [
        ({"lambda_sqrt_m_per_s": 1e-12, "alpha_m_per_s2": 4.9e5}, "alpha_m_per_s2"),
        ({"lambda_sqrt_m_per_s": 600.0, "alpha_m_per_s2": 1e-8}, "lambda_sqrt_m_per_s"),
    ],
)
def test_gains_that_raised_fit_no_word_are_refused(gains, named):
    with pytest.raises(ValueError, match=f"^{named} must be at most .* at these rates, not"):
        levant_adaptive.Design(spec("narrow", NAME), levant_adaptive.Gains(**gains))


def test_the_counters_of_the_law_are_bounded():
    for name in ("paper", "narrow"):
        d = design(name)
        rows = levants.wrapped(d, stimulus(d, 20_000))
        for state in visit(d, [row[0] for row in rows]):
            assert -RAISED <= state.level <= d.levels
            assert 0 <= state.reached <= d.levels
            assert 0 <= state.elapsed <= d.reach_samples(d.levels)
            assert 0 <= state.calm < max(d.hold_samples(d.levels - 1), 1)
            assert LOST <= state.limit <= 2 ** (d.error.i + 1)


def test_fewer_levels_where_words_or_strokes_are_short():
    narrow = axis_at(NAME, 10_000_000)
    assert 0 < narrow.design.estimator.levels < levant_adaptive.LEVELS
    assert narrow.design.estimator.velocity.f <= 60 - narrow.count_width
