"""A bound that follows the signal: RTL against model, the law against exact arithmetic, and what it is good for."""

import itertools
import math
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from levants import TURN_S, wrapped
from test_levant_higher import stimulus as motions

from hardwall.hdl.estimators.levant_adaptive import Estimator
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant_adaptive import FALL, HOLD, LARGEST_L, LEVELS, Design, Gains, State
from hardwall.model.estimators.levant_higher_design import LAMBDA
from hardwall.model.runtime.compiled import compiled
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, simulate
from hardwall.testing.estimators import follow
from stimuli.lengths import LONG, WHOLE, some_of
from stimuli.papers_signal import axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import spec

NAME = Design.name
AXES = ("paper", "mhz", "narrow", "wide")
POOR = "poor"
"""The axis `mhz` with an encoder whose edges err by half a count: two counts are four there."""
COUNT_M = 1e-6
BOUNDS = (1.68, 12.0, 28.5)
"""C, m/s^2: of the paper's signal, of the paper's hit, and of the impact here."""


def brisk(axis: str) -> AxisSpec:
    """Return an axis with the largest bound that its rate allows: levels last as short as they can."""
    of = replace(spec("mhz", NAME), edge_error_max_counts=0.5) if axis == POOR else spec(axis, NAME)
    return replace(of, gains=Gains(LARGEST_L * of.count_m * float(of.sample_hz) ** 4))


def design(axis: str) -> Design:
    """Return the design of a brisk axis, with holds so short that a campaign sees every level many times."""
    d = copy(brisk(axis).design.estimator)
    d.holds = 5 + np.arange(len(d.holds)) // 3
    return d


def stimulus(d: Design, samples: int) -> Iterator[tuple[int, int, int]]:
    """Yield the rows of every order, then calm for a time up to that of all levels, and losses of every size."""
    yield from motions(d, samples // 2)
    random, (word,), count, left = seeded(), d.words, 0, samples // 2
    half, calm = 1 << d.count_width - 1, sum(d.holds)
    while left > 0:
        octaves = random.choice((0, 0, word.low, word.high, random.randint(word.low, word.high)))
        start, pace, time = count, random.choice((0.0, 0.0, 0.1)) * random.random(), random.randrange(calm)
        for k in range(time):
            count = start + math.floor(k * pace)
            yield count, int(k == 0 and random.random() < 0.1), octaves
        # A loss that stays, or comes and goes; some are far beyond a motion.
        far = random.random() < 0.1
        size, way = random.randrange(1, half if far else 1 << 11) >> random.randrange(11), random.choice((-1, 1))
        moves = random.choice(((0,), (0, size, -size)))
        for k in range(10):
            count += way * (size if k == 0 else random.choice(moves))
            yield count, int(far and k == 9), octaves
        left -= time + 10


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = Estimator(design(**parameters()))
    d = component.design
    await follow(dut, component, wrapped(d, stimulus(d, SAMPLES)), d.start())


@pytest.mark.parametrize("axis", some_of((*AXES, POOR), 1, 4))
def test_rtl(axis):
    simulate(__file__, lambda axis: Estimator(design(axis)), axis=axis)


@compiled
def _visit(params, state, counts):
    states = []
    for count in counts:
        state, _, _ = estimate(params, state, seen_count(count), 0)
        states.append(state)
    return states


def visit(d: Design, counts: np.ndarray) -> list[State]:
    """Return the state after every count, with the words as after reset."""
    params = d.params({word.name: word.reset for word in d.words})
    return _visit(params, d.start(), counts)


def test_a_campaign_sees_every_level_and_every_fall():
    """On an axis whose distances have room for all doublings."""
    d = design("paper")
    states = visit(d, np.array([row[0] for row in wrapped(d, stimulus(d, 12_500))], np.int64))
    levels = [state.level for state in states]
    assert set(levels) == set(range(LEVELS + 1))
    assert {a - b for a, b in itertools.pairwise(levels) if b < a} == {1, 2, 3, FALL}
    assert max(state.doublings for state in states) == math.ceil(LEVELS / FALL)


class Law:
    """The law as the pages state it, in rationals: a hold is compared by fourth powers, without a root.

    Its figures are those of the pages: two counts, four levels, 64 T, 26 levels.
    """

    def __init__(self, lipschitz: float):
        self._lipschitz = Fraction(lipschitz)
        self.start()

    def start(self) -> None:
        self.level = self._calm = self._lost = 0

    def see(self, distance: Fraction, octaves: int) -> int:
        """Return the level after a sample that is so far from its count."""
        if distance < 2 or (self.level < 4 and distance < 4):
            self._calm, self._lost = self._calm + 1, 0
            bound = self._lipschitz * Fraction(2) ** (octaves - self.level)
            if self._calm**4 * bound >= 64**4:
                self.level, self._calm = min(self.level + 1, 25), 0
        else:
            self._calm = 0
            if distance >= 2 * 2**self._lost and self.level:
                self.level, self._lost = max(self.level - 4, 0), self._lost + 1
        return self.level


def losses(hold: int, samples: int) -> np.ndarray:
    """Return counts that jump by every size up to 300, and rest or move slowly in between, for up to 12 first holds."""
    random, parts, count = seeded(), [np.zeros(1)], 0.0
    while sum(map(len, parts)) < samples:
        count += random.choice((-1, 1)) * 300 * random.random() ** 3
        motion = count + random.choice((0.0, 0.0, 1 / hold)) * np.arange(random.randrange(1, 12 * hold))
        parts.append(motion)
        count = motion[-1]
    return np.floor(np.concatenate(parts)).astype(np.int64)


@pytest.mark.parametrize("axis", AXES)
def test_the_law_is_the_documented_one_in_exact_arithmetic(axis):
    d, random = brisk(axis).design.estimator, seeded()
    (word,), half = d.words, 1 << d.count_width - 1
    counts = losses(d.holds[word.high], 100 * d.holds[word.high])
    for octaves in sorted({word.low, 0, word.high}):
        law, state, changes = Law(d.lipschitz), d.start(), 0
        params = d.params({word.name: octaves})
        for k, count in enumerate(counts.tolist()):
            before, restart = state, int(random.random() < 1e-4)
            state, _, _ = estimate(params, before, seen_count(count), restart)
            if k == 0 or restart:
                law.start()
                continue
            moved = (count - before.count + half) % (2 * half) - half
            far = max(d.gap.min, min(d.gap.max, before.lead - (moved << d.gap.f)))
            # A negative distance is complemented: it is an LSB less.
            size = Fraction(far if far >= 0 else -far - 1, 2**d.gap.f)
            assert state.level == law.see(size, octaves), k
            changes += state.level != before.level
        assert changes > 20


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize(("told", "lost"), [(0.01, 2), (0.1, 2), (0.11, 4), (0.5, 4), (1e6, 4)])
def test_a_loss_is_at_its_counts_and_not_an_lsb_below(told, lost, side):
    d = replace(spec("mhz", NAME), edge_error_max_counts=told).design.estimator
    law = d.params({word.name: 0 for word in d.words}).law
    for size, far in ((lost, 1), (2 * lost, 2)):
        least = size << d.gap.f
        for distance in (least - 1, least):
            lead = ~distance if side else distance
            state = d.start()._replace(running=1, lead=lead, level=9, doublings=far - 1)
            after, _, _ = estimate(d.params({word.name: 0 for word in d.words}), state, seen_count(0), 0)
            assert after.level == (5 if distance == least else 9)
    assert law.lost_bits == lost.bit_length() - 1


def test_the_float_kernel_is_the_published_algorithm_at_the_level_of_the_law():
    """Sample by sample from the kernel's own state: near an error of 0 a root makes much of a rounding."""
    axis = brisk("mhz")
    d, n, levels = axis.design.estimator, 4, set()
    counts, _ = swing(axis.sample_hz, 0.03 if LONG else 0.01, TURN_S)
    counts = np.concatenate([counts, np.repeat(counts[-1], 10_000), np.repeat(counts[-1] + 40, 10_000)]) - counts[0]
    params, law, after = Axis(axis, floating=True).params.estimator, Law(d.lipschitz), d.start(floating=True)
    for k, count in enumerate(counts.tolist()):
        state, (after, velocity, _) = after, estimate(params, after, seen_count(count), 0)
        if k == 0:
            continue
        error, gap = state.w, state.lead - (count - state.count)
        levels.add(state.level)
        bound = d.lipschitz * 2.0**-state.level
        # The published lines, with z0 as its distance from the count, and Taylor's terms.
        s = [error, gap, state.z1, state.z2, state.z3]
        further = [*s[1:], 0.0], [0.0, s[3] / 2, s[4] / 2, 0.0, 0.0]
        moved = [sum(each) for each in zip(s, *further, strict=True)]
        for j in range(n + 1):
            power = abs(error) ** ((n - j) / 5) * bound ** ((j + 1) / 5)
            moved[j] -= LAMBDA[4][n - j] * power * np.sign(error)
        assert (after.w, after.lead, after.z1, after.z2, after.z3) == pytest.approx(moved, rel=1e-9, abs=1e-18)
        assert (velocity, after.level) == (after.z1, law.see(Fraction(abs(gap)), 0))
    assert len(levels) > 10


@pytest.mark.parametrize("axis", AXES)
def test_every_level_and_word_has_its_hold_and_a_correction_that_moves_the_last_state(axis):
    of = replace(spec(axis, NAME), gains=None)
    d, steepest = of.design.estimator, 32 * of.acceleration_max_m_per_s2**2 / of.count_m
    assert of.design.gains.snap_m_per_s4 == min(steepest, 2**-7 * of.count_m * float(of.sample_hz) ** 4)
    (word,) = d.words
    for octaves, hold in zip(range(word.high, word.low - LEVELS - 1, -1), d.holds, strict=True):
        bound = Fraction(d.lipschitz) * Fraction(2) ** octaves
        assert (int(hold) - 1) ** 4 * bound < HOLD**4 <= int(hold) ** 4 * bound
    assert min(d.relays.values()) >= 2**4


def test_gains_that_no_word_holds_are_refused_with_the_range():
    of = spec("mhz", NAME)
    with pytest.raises(ValueError, match=r"^snap_m_per_s4 must be .* to .* at these rates, not 1e-30"):
        assert replace(of, gains=type(of.design.gains)(1e-30)).design


def rms(of: AxisSpec, counts: np.ndarray, truth: np.ndarray, first: int = 0, floating: bool = False) -> float:
    """Return the RMS error, m/s, from sample `first` on."""
    error = Axis(of, floating).run(counts).velocity_m_per_s - truth
    return math.sqrt(np.mean(error[first:] ** 2))


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("rate", [10_000, 100_000])
def test_word_length_costs_little(rate, bound):
    """A rounding moves a loss, so single runs differ either way: over sixteen, RMS is within three hundredths.

    At 10 kHz they are sixteen; at 100 kHz, where a run has more losses, half of that does.
    """
    of, squares = axis_at(NAME, rate, bound), np.zeros(2)
    phases = 16 if LONG or rate < 100_000 else 8
    for phase in np.arange(phases) / phases:
        counts, truth = swing(rate, 2.0, TURN_S, phase)
        for way, floating in enumerate((True, False)):
            squares[way] += rms(of, counts, truth, rate // 2, floating) ** 2
    exact, fixed = np.sqrt(squares)
    assert abs(fixed - exact) <= 0.03 * exact


def impact(rate: int, acceleration: float, speed: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (counts, velocities, m/s): a rest, a speed that a wall brakes as a quarter of a sine, and a rest."""
    omega = acceleration / speed
    t = np.arange(round(0.7 * rate)) / rate - 0.4
    braked = np.clip(t, 0, np.pi / 2 / omega)
    path = np.where(t < 0, speed * t, speed / omega * np.sin(omega * braked))
    truth = np.where(t < 0, speed, np.where(omega * t > np.pi / 2, 0.0, speed * np.cos(omega * braked)))
    return np.floor(path / COUNT_M + phase).astype(np.int64), truth


@pytest.mark.parametrize("rate", [100_000, 1_000_000][: 1 + WHOLE])
def test_one_setting_serves_swing_and_impact(rate):
    """Every fixed bound reads the swing worse, or the impact three times worse."""
    ours, fixed = axis_at(NAME, rate, 28.5), axis_at("levant-3-filtering", rate, 28.5)
    moves = swing(rate, 2.0, TURN_S, 0.3), impact(rate, 28.5, 0.3, 0.3)
    of_swing, of_impact = (rms(ours, *move, len(move[0]) // 2) for move in moves)
    kind = fixed.design.estimator.gains_class
    for snap in np.geomspace(1e4, 1e11, 15):
        of = replace(fixed, gains=kind(min(snap, kind.largest * COUNT_M * float(rate) ** 4)))
        assert of_swing < rms(of, *moves[0], rate) or of_impact < rms(of, *moves[1], len(moves[1][0]) // 2) / 3


@pytest.mark.parametrize("rate", [100_000, 1_000_000])
def test_a_bound_on_the_acceleration_that_is_far_too_small_costs_little(rate):
    counts, truth = impact(rate, 51.0, 0.3, 0.6)
    told = [rms(axis_at(NAME, rate, bound), counts, truth, len(counts) // 2) for bound in (51.0, 3.0)]
    assert told[1] < 2 * told[0]


@pytest.mark.parametrize("speed", [1e-4, 1e-3, 1e-2, 0.1])
def test_slow_constant_speeds_are_ten_times_quieter_than_at_level_4(speed):
    rate = 100_000
    counts = np.floor(speed * np.arange(4 * rate) / rate / COUNT_M + 0.3).astype(np.int64)
    fixed = axis_at("levant-3-filtering", rate, 12.0)
    gains = fixed.design.estimator.gains_class(axis_at(NAME, rate, 12.0).design.gains.snap_m_per_s4 / 16)
    level_4 = replace(fixed, gains=gains)
    assert rms(axis_at(NAME, rate, 12.0), counts, speed, 3 * rate) < rms(level_4, counts, speed, 3 * rate) / 10


@pytest.mark.parametrize("rate", [10_000, 100_000])
def test_a_standstill_is_read_as_one(rate):
    counts, _ = swing(rate, 0.5, TURN_S, 0.2)
    rest = np.full(2 * rate, counts[-1])
    record = Axis(axis_at(NAME, rate, 12.0)).run(np.concatenate([counts, rest]))
    assert np.abs(record.velocity_m_per_s[-rate // 2 :]).max() < 1e-4


@pytest.mark.parametrize("speed", [0.1, 0.2, 0.5])
def test_a_start_in_motion_settles_as_fast_as_level_0(speed):
    """In 3.6 times tau of the largest L, the documented time, and with what a loss costs on the way."""
    rate = 1_000_000
    of = axis_at(NAME, rate, 12.0)
    bound = of.design.gains.snap_m_per_s4
    tau = (speed / bound) ** (1 / 3)
    counts = np.floor(speed * np.arange(round(20 * tau * rate)) / rate / COUNT_M).astype(np.int64)
    error = np.abs(Axis(of).run(counts).velocity_m_per_s - speed)
    ripple = 4 * (COUNT_M**3 * bound) ** (1 / 4)
    settled = np.flatnonzero(error > 0.005 * speed + ripple)[-1] / rate
    assert settled <= 3.7 * tau


def flicker(period: int, duty: float, samples: int) -> np.ndarray:
    """Return counts of a motion that stops at once on an edge, where the count then comes and goes."""
    rest = np.arange(samples) % period < period * duty
    return np.concatenate([5 * np.arange(300), 1500 + rest])


@pytest.mark.parametrize("axis", ["paper", "mhz"])
def test_no_stop_or_reversal_saturates_where_edges_are_poor(axis):
    """From rests in which levels rise: to the largest speed at once, to the other direction, and to rest."""
    of = replace(spec(axis, NAME), edge_error_max_counts=0.5)
    d, speed = of.design.estimator, of.speed_max_counts_per_sample
    (word,) = d.words
    hold, random = 20 * int(d.holds[word.high]), np.random.default_rng(3)
    speeds = np.repeat([0.0, speed, -speed, speed, 0.0, -speed, 0.0], [hold, *[hold // 20] * 3, hold, hold // 20, hold])
    places = np.cumsum(speeds) + 0.5 * random.standard_normal(len(speeds))
    record = Axis(of).run(np.floor(places).astype(np.int64))
    assert of.design.flag_names(int(np.bitwise_or.reduce(record.flags))) == []


@pytest.mark.parametrize("axis", [brisk("mhz"), axis_at(NAME, 1_000, 12.0), axis_at(NAME, 10_000, 12.0)], ids=str)
def test_a_count_that_flickers_holds_no_level_for_ever(axis):
    """With the largest bound that a rate allows, whose chatter is the largest."""
    d = axis.design.estimator
    assert d.lipschitz == LARGEST_L
    samples = 60 * int(d.holds[d.words[0].high])
    for period in (*range(2, 24), 40, 100) if LONG else (*range(2, 8), 11, 16, 23, 40, 100):
        for duty in (0.2, 0.5, 0.8):
            states = visit(d, flicker(period, duty, samples).astype(np.int64))
            assert min(state.level for state in states[-samples // 4 :]) >= 2 * FALL


@pytest.mark.parametrize("error", [0.1, 0.25, 0.5])
def test_edges_that_err_as_much_as_the_axis_says_hold_no_level_for_ever(error):
    axis = replace(axis_at(NAME, 10_000, 12.0), edge_error_max_counts=error)
    d, random, samples = axis.design.estimator, np.random.default_rng(1), 20_000
    for speed in np.linspace(0.02, 1.5, 12):
        places = np.arange(int(speed * samples) + 3) + error * random.standard_normal(int(speed * samples) + 3)
        motion = np.searchsorted(np.sort(places), speed * np.arange(samples))
        states = visit(d, np.concatenate([5 * np.arange(300), 1500 + motion]))
        assert min(state.level for state in states[-samples // 4 :]) >= 2 * FALL
