"""Every estimator at every steady speed and with every run-time word, against exact rational arithmetic.

Twins share their author's errors, so nothing here compares hardware with model: `oracles.steady` has the counts, the
edges and the means, and computes in integers and fractions alone. An estimator of counts has exact counts; one that
uses stamps has exact edges, through the decoder and up to its limit of an edge a clock. Speeds are in counts a sample.
"""

import itertools
import math
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest

from hardwall.model.axis import monitors
from hardwall.model.axis.axis import Axis
from hardwall.model.axis.monitors import POSITION_WRAP, VELOCITY_LIMIT
from hardwall.model.encoder import quadrature
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators import registry
from hardwall.model.estimators.acceleration import room_of
from hardwall.model.estimators.estimate import EstimatorDesign
from hardwall.model.estimators.levant_higher_design import LAMBDA
from hardwall.model.runtime.compiled import compiled
from hardwall.testing.estimators import run
from oracles.steady import Steady, ladder, polynomial, stable
from stimuli.lengths import WHOLE
from stimuli.seeded import seeded
from stimuli.specs import spec

EVERY_AXIS = ("mhz", "narrow", "paper", "wide")
AXES = EVERY_AXIS if WHOLE else EVERY_AXIS[:3]
RATIOS = (Fraction(9, 8), Fraction(9, 8)) if WHOLE else (Fraction(79, 25), Fraction(158, 5))
"""From a speed to the next; and for axes and a Levant whose start is long there. A power of each is just below 1000."""
SLOW_STARTS = ("mhz", "narrow")
SLOWEST = Fraction(1, 1000)
"""The slowest speed, of the axis's largest."""
WINDOWS = 60
"""Minimax windows, sqrt(q / C), after which a start in motion has left less than an LSB."""
SLEWS = 4, 24
"""Times of a slew to the speed after which a Levant's start has ended: with the designed gains, and with any."""
PLACES = 4
"""Counts that the position of a Levant may be away from the count in steady motion."""
FLOAT_WAYS = dict.fromkeys(EVERY_AXIS, (1, -1)) if WHOLE else {"mhz": (1,), "narrow": (-1,), "paper": (1, -1)}
"""The directions in which the float kernel is run, too."""
FAST = math.inf if WHOLE else 16
"""Counts a sample from which `levant-edge` knows less of a speed by its clock than by its place in 1000 samples."""
MOST_SAMPLES = 30_000_000 if WHOLE else 300_000
"""The longest start that is run with gains at the ends of their ranges."""
LEVANTS = ("levant", "levant-semi-implicit", "levant-implicit")
HIGHER = [*(f"levant-{order}{kind}" for kind in ("", "-filtering", "-implicit") for order in (2, 3)), "levant-adaptive"]
CASES = [(axis, name, output) for axis in AXES for name, kind in registry.ESTIMATORS.items() for output in kind.outputs]
every_case = pytest.mark.parametrize(("name", "estimator", "output"), CASES)


@compiled
def _decode(params, clocks, levels, per_sample, seen):
    """Fill `seen` with what the decoder shows at every sample, without a glitch filter; return its sticky faults."""
    state, clock, level, taken = quadrature.START, 0, 0, 0
    for k in range(len(seen.count)):
        strobe = (k + 1) * per_sample - 1
        while taken < len(clocks) and clocks[taken] < strobe:
            if clocks[taken] > clock:
                inputs = quadrature.Inputs(level & 1, level >> 1, 0, 0, 0)
                state = quadrature.advance(params, state, inputs, clocks[taken] - clock)
                clock = clocks[taken]
            level = levels[taken]
            taken += 1
        inputs = quadrature.Inputs(level & 1, level >> 1, 0, 0, 0)
        state = quadrature.advance(params, state, inputs, strobe - clock)
        clock = strobe
        now = quadrature.seen(state)
        seen.count[k], seen.stamp[k], seen.edge[k] = now.count, now.stamp, now.edge
        seen.stamp_a_rise[k], seen.stamp_b_rise[k] = now.stamp_a_rise, now.stamp_b_rise
        seen.stamp_a_fall[k], seen.stamp_b_fall[k] = now.stamp_a_fall, now.stamp_b_fall
        seen.down[k], seen.run[k] = now.down, now.run
    return quadrature.fault(state)


@lru_cache(128)
def _edges_seen(name: str, steady: Steady, samples: int) -> tuple[Seen, int]:
    axis, seen = spec(name), Seen(*(np.zeros(samples, np.int64) for _ in Seen._fields))
    fault = _decode(axis.design.decoder, *steady.edges(axis.clocks_per_sample, samples), axis.clocks_per_sample, seen)
    return seen, fault


def shown(name: str, estimator: str, steady: Steady, samples: int) -> Seen:
    """Return what an estimator sees of a steady motion: of its edges if it uses stamps, else of its counts alone."""
    if registry.design_of(estimator).uses_stamps():
        seen, fault = _edges_seen(name, steady, samples)
        # A motion that goes on wraps the count: differences of counts are right all the same.
        assert fault & ~quadrature.WRAPPED == 0
        return seen
    half, rest = 1 << spec(name).count_width - 1, np.zeros(samples, np.int64)
    return Seen((steady.count(samples)[1:] + half & 2 * half - 1) - half, *[rest] * (len(Seen._fields) - 1))


class Settled(NamedTuple):
    """An estimate after its start, in counts a sample: its mean over ripple periods, its ends, and its flags."""

    mean: Fraction
    low: Fraction
    high: Fraction
    flags: int
    begun: int  # the flags of the start


def settled(axis: Axis, seen: Seen, start: int) -> Settled:
    """Return the estimate from sample `start` on."""
    samples, d = len(seen.count), axis.design.estimator
    made = room_of(d, (samples,), np.float64 if axis.floating else np.int64)
    flags = np.zeros(samples, np.int64)
    run(axis.params.estimator, d.start(axis.floating), seen, np.zeros(samples, np.int64), made, flags)
    rest, unit = made.velocity[start:], Fraction(1) if axis.floating else Fraction(1, 2**d.velocity.f)
    total = Fraction(math.fsum(rest)) if axis.floating else Fraction(sum(map(int, np.add.reduceat(rest, [0]))))
    ends = (Fraction(end.item()) * unit for end in (rest.min(), rest.max()))
    flagged = (int(np.bitwise_or.reduce(each, initial=0)) for each in (flags[start:], flags[:start]))
    return Settled(total * unit / len(rest), *ends, *flagged)


def fastest(name: str, estimator: str) -> Fraction:
    """Return the fastest speed that is tried: an edge a clock, and less than half of the count's range in a sample.

    An estimator by stamps compares counts that are as far apart as its memory, of two minimax windows. A motion of half
    of the count's range in that time is a way of four travels, which the causes of the position do not let pass.
    """
    axis = spec(name, estimator)
    half, stamps = (1 << axis.count_width - 1) - 1, registry.design_of(estimator).uses_stamps()
    most = half / (2 * _window(axis)) if stamps else half
    return min(Fraction(axis.clocks_per_sample), Fraction(most).limit_denominator(1000))


def _window(axis) -> float:
    """Return sqrt(q / C) in samples: half of the minimax window."""
    return math.sqrt(axis.count_m / axis.acceleration_max_m_per_s2) * axis.sample_hz


def speeds(name: str, estimator: str) -> list[tuple[int, int]]:
    """Return the speeds of an axis."""
    axis, ratio = spec(name, estimator), RATIOS[estimator in (*LEVANTS, *HIGHER) and name in SLOW_STARTS]
    least = SLOWEST * Fraction(axis.speed_max_counts_per_sample)
    return ladder(least, fastest(name, estimator), ratio, 4 if registry.design_of(estimator).uses_stamps() else 1)


def lengths(name: str, estimator: str, steady: Steady, words: dict[str, int], slews: int) -> tuple[int, int]:
    """Return the samples of a start, and those of the motion behind it, both of whole ripple periods."""
    axis = spec(name, estimator)
    d, period = axis.design.estimator, steady.samples
    start = WINDOWS * _window(axis) + 100
    behind = math.lcm(period, d.history.every) if hasattr(d, "history") else period
    if estimator in LEVANTS:
        alpha = words[d.words[1].name] / 2**d.velocity.f
        start += slews * min(abs(steady.speed), Fraction(d.velocity.max, 2**d.velocity.f)) / alpha
    if estimator in HIGHER:
        lipschitz = d.lipschitz * 2.0 ** words[d.words[0].name]
        moved = min(abs(steady.speed), Fraction(d.velocity.max, 2**d.velocity.f))
        start += slews * (float(moved) / lipschitz) ** (1 / d.order) + 60 * lipschitz ** (-1 / (d.order + 1))
    if estimator in (*LEVANTS, *HIGHER, "levant-edge"):
        of_edges = 8_000 if abs(steady.speed) < FAST else 1_000
        behind = period * math.ceil((of_edges if estimator == "levant-edge" else 40_000) / period)
    return math.ceil(start / period) * period, behind


def bound(axis: Axis, words: dict[str, int], output: str, steady: Steady, samples: int) -> Fraction:
    """Return how far from a steady speed the mean of an estimate may be that raises no flag.

    - A finite difference, and a fit to counts, is exact: what is rounded toward zero is less than an LSB. So is a
      linear filter with the designed gains, whose floors are less than half an LSB together.
    - A Levant's u moves its position, so that the mean is the way of that position. u1 differs from it by the mean of
      lambda sqrt(|e|), with |e| of a count at most, and by a step of alpha.
    - The mean of z1 differs by the mean correction of z0, for an error of some counts, and by half of that of z1.
    - An edge that is made from counts errs by half a count at most, which a memory averages with gains that differ.
    - An estimator by stamps counts whole cycles of four edges, in a time that it knows to a clock. Those of every edge
      know the time of one, and `levant-edge` has a position, too.
    """
    d, speed = axis.design.estimator, abs(steady.speed)
    lsb = Fraction(1, 10**9) if axis.floating else Fraction(1, 2**d.velocity.f)
    if d.uses_stamps():
        clocks = axis.spec.clocks_per_sample / speed
        if d.name not in ("levant-edge", "edge-kalman"):
            return speed / (4 * clocks - 1) + lsb
        return speed / clocks + lsb + (Fraction(2 * PLACES, samples) if d.name == "levant-edge" else 0)
    if d.name == "count-kalman":
        row = 2 * max(2, math.floor(2 / speed)).bit_length()
        return lsb + Fraction(1 / (2 * d.filter.agile_s[0, row] * axis.spec.sample_hz))
    if d.name in HIGHER:
        own = (d.lipschitz * 2.0 ** words[d.words[0].name]) ** (1 / (d.order + 1))
        first, second = (LAMBDA[d.degree - 1][n] * PLACES ** (n / d.degree) * own for n in (d.order, d.order - 1))
        return Fraction(2 * PLACES, samples) + lsb + Fraction(first + second * own / 2)
    if d.name not in LEVANTS:
        return lsb
    lam, alpha, *_ = (words[word.name] / Fraction(2) ** word.format.f for word in d.words)
    return Fraction(2 * PLACES, samples) + lsb + (lam + alpha if output == "u1" else 0)


@every_case
def test_an_estimate_never_falls_as_the_speed_grows(name, estimator, output):
    """Up to the decoder's limit the mean is the speed, or a flag is up and it does not fall, in either direction."""
    of = spec(name, estimator)
    chosen = of.design.estimator.choose(output)
    axes = Axis(of, **chosen), Axis(of, True, **chosen)
    words, lsb = axes[0].words, Fraction(1, 2**of.design.estimator.velocity.f)
    last: dict[tuple[int, bool], Fraction] = {}
    flagged = False
    for counts, samples in speeds(name, estimator):
        means = {}
        for way in (1, -1):
            steady = Steady(counts, samples, way, begun=samples // 3)
            start, behind = lengths(name, estimator, steady, words, SLEWS[0])
            seen = shown(name, estimator, steady, start + behind)
            fixed = settled(axes[0], seen, start)
            within = bound(axes[0], words, output, steady, behind)
            if not fixed.flags:
                assert abs(fixed.mean - steady.speed) <= within, float(steady.speed)
                # A speed that is flagged is followed by none that is not.
                assert not flagged, float(steady.speed)
            means[way] = way * fixed.mean
            # u1, as z1, has a ripple that may lock to that of the counts.
            slack = within if output in ("u1", "z1") and not fixed.flags else 0
            assert means[way] >= last.get((way, False), Fraction(0)) - slack, float(steady.speed)
            last[way, False] = means[way]
            # The float kernel has no format, and is not followed to where a Levant's start is too long.
            if way in FLOAT_WAYS[name] and (not fixed.flags or estimator not in (*LEVANTS, *HIGHER)):
                real = settled(axes[1], seen, start)
                assert abs(real.mean - steady.speed) <= bound(axes[1], words, output, steady, behind)
                assert way * real.mean >= last.get((way, True), Fraction(0)) - slack, float(steady.speed)
                last[way, True] = way * real.mean
                if not fixed.flags | fixed.begun:
                    assert abs(fixed.mean - real.mean) <= 2 * within, float(steady.speed)
        flagged |= bool(fixed.flags)
        assert fixed.flags or abs(means[1] - means[-1]) <= 2 * within
    # Beyond the format the estimate is at its end.
    if flagged:
        assert last[1, False] >= of.design.estimator.fastest * lsb - 2 * within
        assert last[-1, False] >= of.design.estimator.fastest * lsb - 2 * within
    assert flagged or Fraction(counts, samples) <= of.design.estimator.fastest * lsb


@every_case
def test_every_limit_of_the_speed_is_one_that_trips(name, estimator, output):
    """At each speed beyond the largest limit that is accepted the cause is up; at the largest speed of the axis not."""
    of = spec(name, estimator)
    axis, d = Axis(of, **of.design.estimator.choose(output)), of.design.estimator
    watch = monitors.Design(of, d)
    (word,) = (each for each in watch.words if each.name == "supervisor_velocity_limit")
    unit = Fraction(2**watch.params.velocity_shift, 2**d.velocity.f)
    most, tried = word.high * unit, 0
    largest = Fraction(of.speed_max_counts_per_sample)
    steps = speeds(name, estimator)
    usual = [each for each in steps if Fraction(*each) <= largest][-1:]
    faster = [each for each in steps if Fraction(*each) > max(most, largest)]
    ends = faster if WHOLE else [*faster[:1], *faster[1:][-1:]]
    # The nearest end is tried in both directions, the farthest in one.
    ways = [(1, -1)] * len(ends) if WHOLE else [(1, -1), (-1,)][: len(ends)]
    asked = [(each, False, (1, -1)) for each in usual]
    asked += [(each, True, of) for each, of in zip(ends, ways, strict=True)]
    for (counts, samples), beyond, ways in asked:
        for way in ways:
            steady = Steady(counts, samples, way)
            start, behind = lengths(name, estimator, steady, axis.words, SLEWS[0])
            estimate = settled(axis, shown(name, estimator, steady, start + behind), start)
            velocity = way * int(max(estimate.high, -estimate.low) * 2**d.velocity.f)
            limit = word.high if beyond else word.reset
            inputs = monitors.Inputs(valid=1, velocity=velocity, supervisor_velocity_limit=limit)
            causes = monitors.step(watch.params, monitors.START, inputs).causes
            assert (causes >> VELOCITY_LIMIT & 1) == beyond, (float(steady.speed), velocity, limit)
            tried += beyond
    # Where there is no such speed, other causes are up at those beyond the fastest: the decoder's, or the position's.
    assert tried or most >= fastest(name, estimator)


@pytest.mark.parametrize("name", AXES)
def test_beyond_the_decoders_limit_a_flag_is_up(name):
    """The limit is that of `quadrature_speed`, but for speeds that no synchronous decoder can tell from slow ones."""
    of = spec(name)
    for edges_per_clock in (Fraction(k, 97) for k in range(98, 292, 5)):
        counts, samples = edges_per_clock.numerator * 4, edges_per_clock.denominator * 4
        for way in (1, -1):
            # The samples of this motion are clocks.
            steady = Steady(counts, samples, way)
            clocks, levels = steady.edges(1, 400)
            seen = Seen(*(np.zeros(400, np.int64) for _ in Seen._fields))
            assert _decode(of.design.decoder, clocks, levels, 1, seen), float(edges_per_clock)


def test_half_of_the_counts_range_in_a_sample_is_a_motion_to_where_the_count_wraps():
    """A difference of counts is modulo their width: a larger motion reads as another, and trips within two samples."""
    of = spec("narrow")
    watch, half = monitors.Design(of, of.design.estimator), 1 << of.count_width - 1
    assert half < of.clocks_per_sample
    for edges_per_sample in range(half, of.clocks_per_sample + 1):
        steady = Steady(edges_per_sample, of.clocks_per_sample)
        for first in range(0, 5 * of.clocks_per_sample, of.clocks_per_sample):
            counts = steady.count(7 * of.clocks_per_sample)[first : first + 2 * of.clocks_per_sample]
            causes = 0
            for count in counts.tolist():
                inputs = monitors.Inputs(count=(count + half) % (2 * half) - half)
                causes |= monitors.step(watch.params, monitors.START, inputs).causes
            assert causes >> POSITION_WRAP & 1, edges_per_sample


@pytest.mark.parametrize("name", AXES)
@pytest.mark.parametrize("estimator", ["window", "foaw", "least-squares"])
def test_the_largest_change_over_the_longest_window_is_unambiguous(name, estimator):
    """Two positions are subtracted modulo their width: the largest change between them must fit it with its sign."""
    d = spec(name, estimator).design.estimator
    assert d.history.change.max * d.history.age_max * d.history.every < 1 << d.history.width - 1
    assert (1 << d.history.age_bits) > d.history.age_max >= d.history.longest
    for word in d.words:
        # A window's largest word is one that the memory holds.
        if word.name == "window_length":
            assert word.high <= d.history.age_max


F = Fraction
POLES = {
    "butterworth": lambda gamma, beta, exponent: _lowpass(gamma / 16**exponent, beta / 16**exponent),
    "kalman": lambda k_x, k_v, k_a: _observer([k_x, k_v, k_a] if k_a else [k_x, k_v]),
    "tracking-loop": lambda h: _observer([2 * h, h * h]),
}
"""The matrices of the linear filters, from the equations that their pages and the sources have."""


def _lowpass(gamma: Fraction, beta: Fraction) -> list[list[Fraction]]:
    """Return the matrix of w' = w - gamma y - beta w, y' = y + gamma w'."""
    w = [1 - beta, -gamma]
    return [w, [gamma * w[0], 1 + gamma * w[1]]]


def _observer(gains: list[Fraction]) -> list[list[Fraction]]:
    """Return the matrix of a position's derivatives, predicted by Taylor's series and corrected by the position."""
    size = len(gains)
    predict = [[F(1, math.factorial(k - j)) if k >= j else F(0) for k in range(size)] for j in range(size)]
    return [[predict[j][k] - gains[j] * predict[0][k] for k in range(size)] for j in range(size)]


def _flags_at_rest(d: EstimatorDesign, words: tuple[int, ...]) -> list[str]:
    """Return the flags that are up at rest, with run-time words."""
    params, rest = d.params(dict(zip((word.name for word in d.words), words, strict=True))), np.zeros(8, np.int64)
    flags = np.zeros(8, np.int64)
    run(params, d.start(), Seen(*[rest] * len(Seen._fields)), rest, room_of(d, (8,), np.int64), flags)
    return [flag for bit, flag in enumerate(d.flags) if np.bitwise_and.reduce(flags) >> bit & 1]


@pytest.mark.parametrize("name", [*EVERY_AXIS, "1 kHz"])
@pytest.mark.parametrize("estimator", POLES)
def test_no_word_that_is_accepted_makes_a_linear_filter_unstable(name, estimator):
    """All ends of the ranges together, and words anywhere between: every pole is within the unit circle, or flagged."""
    of = replace(spec("paper", estimator), sample_hz=1_000) if name == "1 kHz" else spec(name, estimator)
    d, random = of.design.estimator, seeded()
    grids = [sorted({word.low, word.low + 1, word.reset, word.high - 1, word.high}) for word in d.words]
    between = [tuple(random.randint(word.low, word.high) for word in d.words) for _ in range(2000 if WHOLE else 300)]
    found = set()
    for words in (*itertools.product(*grids), *between):
        values = [F(word) / F(2) ** each.format.f for word, each in zip(words, d.words, strict=True)]
        if estimator == "butterworth":
            values[2] = min(int(values[2]), d.exponent_max)
        is_stable = stable(polynomial(POLES[estimator](*values)))
        is_flagged = "gains_unstable" in _flags_at_rest(d, words) if estimator == "butterworth" else False
        assert is_stable or is_flagged, words
        found.add((is_stable, is_flagged))
    assert (True, False) in found
    assert estimator != "butterworth" or (False, True) in found


@pytest.mark.parametrize("name", EVERY_AXIS)
def test_a_cutoff_has_words_that_are_accepted_and_raise_no_flag(name):
    d = spec(name, "butterworth").design.estimator
    for cutoff in np.geomspace(d.cutoff_min_hz, d.cutoff_max_hz, 200):
        words = d.words_for(cutoff)
        encoded = tuple(word.from_si(words[word.name]) for word in d.words)
        assert not d.unstable(*encoded)
        assert _flags_at_rest(d, encoded) == []


@pytest.mark.parametrize("name", EVERY_AXIS)
@pytest.mark.parametrize("estimator", [*POLES, *LEVANTS])
def test_a_word_that_leaves_an_estimate_without_its_gain_is_refused(name, estimator):
    """A gain of 0 holds the velocity, or leaves an oscillation without damping."""
    of = spec(name, estimator)
    for word in of.design.estimator.words:
        if word.name in ("kalman_acceleration", "butterworth_exponent") or word.name.endswith("_output"):
            continue
        assert 0 < word.low <= word.reset <= word.high
        with pytest.raises(ValueError, match=f"^{word.name} must be .* to .*, not 0"):
            of.design.encode(**{word.name: 0})


ENDS = list(itertools.product(AXES, (*POLES, *LEVANTS)))


@pytest.mark.parametrize(("name", "estimator"), ENDS)
def test_an_estimate_settles_to_the_speed_with_every_end_of_its_words(name, estimator):
    """From rest, and with no flag: a linear filter to its last bits, a Levant to a ripple that its gains bound."""
    of = spec(name, estimator)
    d, tried = of.design.estimator, 0
    for words in itertools.product(*(sorted({word.low, word.reset, word.high}) for word in d.words)):
        given = dict(zip((word.name for word in d.words), words, strict=True))
        values = [F(word) / F(2) ** each.format.f for word, each in zip(words, d.words, strict=True)]
        steady = Steady(round(25 * of.speed_max_counts_per_sample) or 1, 500, begun=7)
        if estimator in LEVANTS:
            lam, alpha, _ = map(float, values)
            start, behind = lengths(name, estimator, steady, given, SLEWS[1])
            within = 2 * alpha**1.5 / lam + lam + lam**2 / 2 + 2 * alpha
        else:
            if estimator == "butterworth":
                values[2] = min(int(values[2]), d.exponent_max)
                if "gains_unstable" in _flags_at_rest(d, words):
                    continue
            poles = np.roots([float(each) for each in polynomial(POLES[estimator](*values))])
            start, behind = math.ceil(-30 / math.log(np.abs(poles).max()) / 500) * 500 + 500, 500
            within = 0.0
        if start > MOST_SAMPLES:
            continue
        seen = shown(name, estimator, steady, start + behind)
        axis = Axis(of)
        axis.params = axis.params._replace(estimator=d.params(given))
        estimate = settled(axis, seen, start)
        assert estimate.flags == 0, words
        if within:
            assert max(estimate.high - steady.speed, steady.speed - estimate.low) <= within, words
            # An explicit sign holds u1 still within lambda^2 / 4 of the speed: a count a sample, as the words end.
            still = max(1.0, (d.words[0].reset * d.words[0].format.lsb) ** 2 / 4)
            assert abs(estimate.mean - steady.speed) <= still + alpha, words
        else:
            assert abs(estimate.mean - steady.speed) <= _floors(d, values), words
        tried += 1
    assert tried >= 2


def _floors(d: EstimatorDesign, values: list[Fraction]) -> Fraction:
    """Return how far from a steady speed the floors may hold a linear filter, counts a sample.

    Of the low pass: in the mean gamma (x - y) is beta w and less than an LSB of a product, and gamma w less than
    another, each with operands that are floored. The two others are exact to an LSB within the ranges of their words.
    """
    lsb = F(1, 2**d.velocity.f)
    if d.name != "butterworth":
        return lsb
    gamma, beta = (value / 16 ** values[2] for value in values[:2])
    return lsb + (beta / gamma + 1) * (F(1, 2**d.state.f) / gamma + F(1, 2**d.operand.f))
