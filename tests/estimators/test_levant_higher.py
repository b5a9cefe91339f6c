"""Levant's differentiators of order 2 and 3: RTL against model, the model against exact and published arithmetic."""

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from fractions import Fraction
from functools import cache

import cocotb
import numpy as np
import pytest
from levants import TURN_S, wrapped

from hardwall.hdl.estimators.registry import block_of
from hardwall.model.arithmetic.fixed import SQ
from hardwall.model.arithmetic.powers import MANTISSA_BITS, STEPS
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators.acceleration import acceleration_of
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant_adaptive import Design as Adaptive
from hardwall.model.estimators.levant_higher import Filtering2, Filtering3, Order2, Order3
from hardwall.model.estimators.levant_higher_design import LAMBDA, Design
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from hardwall.testing.estimators import follow, model
from stimuli.lengths import LONG, some_of
from stimuli.papers_signal import axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import spec

FIXED = [each.name for each in (Order2, Order3, Filtering2, Filtering3)]
NAMES = [*FIXED, Adaptive.name]
TIGHT = "tight"
"""The axis `paper` with a shorter acceleration and jerk: derived formats hold them before they hold the velocity."""
LIMIT = "limit"
"""An axis of so large a jerk that L is `LARGEST_L`, and no word raises it."""
AXES = ["paper", "mhz", "narrow", TIGHT, LIMIT]
TURNS = 4 if LONG else 2
"""How often a motion goes there and back."""
PHASES = 4 if LONG else 2
"""The phases of the encoder's scale over which errors of the paper's signal are taken."""
every = pytest.mark.parametrize("name", FIXED)
every_law = pytest.mark.parametrize("name", NAMES)
every_form = pytest.mark.parametrize("name", [*NAMES, "levant-2-implicit", "levant-3-implicit"])


def limited(name: str) -> AxisSpec:
    return replace(axis_at(name, 1_000), jerk_max_m_per_s3=1e9)


def design(name: str, axis: str = "mhz") -> Design:
    if axis == LIMIT:
        return limited(name).design.estimator
    d = copy(spec("paper" if axis == TIGHT else axis, name).design.estimator)
    if axis == TIGHT:
        d.z = tuple(SQ(each.i - 5, each.f) if 0 < n < d.order else each for n, each in enumerate(d.z))
    return d


def stimulus(d: Design, samples: int) -> Iterator[tuple[int, int, int]]:
    """Yield rows that visit the track, every saturation and the way back, the wrap of the count and all octaves."""
    random = seeded()
    half, (word,) = 1 << (d.count_width - 1), d.words
    fast = min(max(d.velocity.max >> d.velocity.f, 1), half - 1)
    pace = min(1, fast / half) / 2
    for k in range(samples // 4):
        yield math.floor(half * (1 + 0.5 * math.sin(k * pace)) + random.random()), 0, 0
    # The worst signs for overflow: full swings of the count, held until everything saturates.
    for period in (1, 2, 3, 7, 50):
        for k in range(samples // 50):
            yield (-half, half // 2 - 1, half - 1)[k // period % 3], 0, (word.low, word.high, 0)[k // 500 % 3]
    # Ramps beyond the velocity's format, from a start and long enough for the last state to come to its end.
    for way, octaves in ((1, word.high), (-1, word.high), (1, word.low), (-1, 0)):
        for k in range(samples // 20):
            yield way * k * (fast + 1), int(k == 0), octaves
    # A random walk with jumps, words anywhere in their range, and restarts.
    count = 0
    for _ in range(samples - samples // 4 - samples // 10 - samples // 5):
        count += random.randrange(-half, half) if random.random() < 0.01 else random.randint(-2 * fast, 2 * fast)
        yield count, int(random.random() < 0.002), random.randint(word.low, word.high)


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = block_of(design(**parameters()))
    d = component.design
    expected = await follow(dut, component, wrapped(d, stimulus(d, max(SAMPLES, 20_000))), d.start())
    assert 0 in expected["saturated"]
    if parameters()["axis"] == TIGHT:
        assert np.bitwise_or.reduce(expected["saturated"]) == 0b111


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    component = block_of(design(**parameters()))
    bench = Bench(dut, component)
    await bench.reset()
    word = {component.design.words[0].name: 0}
    for count in range(0, 60, 3):
        await bench.transact("strobe", "valid", seen__count=count, **word)
    assert bench.reader("velocity")() != 0
    await bench.reset()
    assert bench.reader("velocity")() == 0
    await bench.transact("strobe", "valid", seen__count=-1, **word)
    assert bench.reader("velocity")() == 0


@pytest.mark.parametrize(("name", "axis"), some_of([(name, axis) for name in FIXED for axis in AXES], 1, 8, 12, 19))
def test_rtl(name, axis):
    simulate(__file__, lambda name, axis: block_of(design(name, axis)), name=name, axis=axis)


def half_up(value: Fraction) -> int:
    return (2 * value.numerator + value.denominator) // (2 * value.denominator)


@cache
def shares(n: int, j: int) -> tuple[Fraction, Fraction]:
    """Return the least and the largest correction of a state, over the root of its power times 2**40.

    A table's entry is for an eighth of the mantissas, and rounded.
    """
    ratio = Fraction((1 + 1 / STEPS) ** ((n - j) / (n + 1)))
    slack = (ratio - 1) / (ratio + 1) + Fraction(1, 2 ** (MANTISSA_BITS + 1)) + Fraction(1, 10**6)
    gain = Fraction(LAMBDA[n][n - j]) / 2**40
    return gain * (1 - slack), gain * (1 + slack)


@cache
def exactly(d: Design, octaves: int, size: int) -> list[tuple[int, int]]:
    """Return the least and the largest correction of every state with its root, in words, by the published formula.

    The size of the error is in its LSBs. g-th powers are compared with those of fractions: a root is bracketed in
    integers.
    """
    n, g = d.degree - 1, d.degree
    bound = Fraction(d.lipschitz) * Fraction(2) ** octaves
    error = Fraction(size, 2 ** (d.w if d.filtering else d.gap).f)
    places = [*([d.w.f] if d.filtering else []), d.gap.f, *(each.f for each in d.z)]
    found = []
    for j in range(n):
        # Of error^(n - j) bound^(j + 1), scaled by a power of two.
        numerator = error.numerator ** (n - j) * bound.numerator ** (j + 1) << g * (places[j] + 40)
        root = integer_root(numerator // (error.denominator ** (n - j) * bound.denominator ** (j + 1)), g)
        least, most = shares(n, j)
        # A word is rounded down.
        lowest = -(-root * least.numerator // least.denominator) - 1
        found.append((lowest, root * most.numerator // most.denominator + 1))
    return found


def integer_root(value: int, degree: int) -> int:
    """Return floor(value^(1 / degree)), in integers, by Newton's method from above."""
    root, lower = 2 << -(-value.bit_length() // degree), 1 << -(-value.bit_length() // degree)
    while 0 < lower < root:
        root = lower
        lower = ((degree - 1) * root + value // root ** (degree - 1)) // degree
    root = min(root, lower)
    assert root**degree <= value < (root + 1) ** degree
    return root


@every_law
@pytest.mark.parametrize("axis", ["mhz", "narrow", LIMIT])
def test_every_step_is_the_published_one_in_exact_arithmetic(name, axis):
    """Taylor's series is exact but for documented rounding; every correction is the formula's within the table's error.

    A sample's states are taken from the model, so that errors do not add up; positions are unwrapped.
    """
    d, (word,) = design(name, axis), design(name, axis).words
    rows = [*stimulus(d, 6000)]
    state, position, last, corrected = d.start(), 0, None, 0
    modulus, half = 2**d.count_width, 2 ** (d.count_width - 1)
    f = [d.gap.f, *(each.f for each in d.z)]
    made = {octaves: d.params({word.name: octaves}) for octaves in range(word.low, word.high + 1)}
    for count, restart, octaves in wrapped(d, rows):
        position = 0 if last is None or restart else position + (count - last + half) % modulus - half
        moved = 0 if last is None or restart else (count - last + half) % modulus - half
        before, last, params = state, count, made[octaves]
        state, velocity, flags = estimate(params, before, seen_count(count), restart)
        bent = Fraction(state.z2) * Fraction(2) ** (d.acceleration.f - f[2])
        assert acceleration_of(params, state) == math.floor(bent)
        if not before.running or restart:
            assert (velocity, flags, state.lead, state.w, state.z2, state.z3) == (0, 0, 0, 0, 0, 0)
            continue
        far = before.lead - moved * 2**d.gap.f
        gap = max(d.gap.min, min(d.gap.max, far))
        error = before.w if d.filtering else gap
        # In the LSBs of the state before.
        z2, z3 = Fraction(before.z2 << f[1], 1 << f[2]), Fraction(before.z3 << f[2], 1 << f[3])
        onward = half_up(z2 / 2) + before.z1 - d.half
        taylor = [gap + half_up(Fraction(onward, 2 ** (f[1] - f[0])))]
        more = before.z2 + half_up(z3 / 2)
        taylor.append(before.z1 + half_up(Fraction(more, 2 ** (f[2] - f[1]))))
        taylor += [before.z2 + half_up(z3), before.z3][: d.order - 1]
        after, formats = [state.lead, state.z1, state.z2, state.z3][: d.order + 1], [None, *d.z[: d.order]]
        if d.filtering:
            taylor.insert(0, before.w + half_up(Fraction(gap, 2 ** (d.gap.f - d.w.f))))
            after.insert(0, state.w)
            formats.insert(0, d.w)
        away = (error < 0) - (error > 0)
        # A negative error is complemented: it is an LSB less.
        size = error if error >= 0 else -error - 1
        raised = octaves - getattr(before, "level", 0)
        ranges = [*exactly(d, raised, size), (d.relays[raised],) * 2]
        for total, now, fmt, (least, most) in zip(taylor, after, formats, ranges, strict=True):
            if fmt in d.z[1:] and flags & 0b010:
                # It would go on pushing the velocity, which is at its end.
                assert now == 0
                continue
            if fmt and now in (fmt.min, fmt.max):
                assert flags & 0b111 or now == total
                continue
            change = (now - total) * away
            assert (least <= change <= most) if away else now == total
            corrected += change > 0
        assert bool(flags & 1) >= (gap != far)
        assert velocity == half_up(Fraction(state.z1 - d.half, 2 ** (f[1] - d.velocity.f)))
    assert corrected > 1000


@every
def test_the_float_kernel_is_the_published_algorithm(name):
    """A loop over unwrapped positions, with the coefficients of the 2020 paper in its own order, for the same L."""
    d, axis = design(name), spec("mhz", name)
    counts, _ = swing(axis.sample_hz, 0.02 if LONG else 0.01, TURN_S)
    run = Axis(axis, floating=True).run(counts)
    n, bound = d.degree - 1, d.lipschitz
    s = [0.0] * (n + 1)
    s[d.filtering] = float(counts[0])
    for k, count in enumerate(counts.tolist()):
        error = s[0] if d.filtering else s[0] - count
        change = []
        for j in range(n + 1):
            power = 1.0 if j == n else abs(error) ** ((n - j) / (n + 1))
            slope = -LAMBDA[n][n - j] * bound ** ((j + 1) / (n + 1)) * power * math.copysign(error != 0, error)
            slope += s[j + 1] if j < n else 0.0
            slope -= count if j == d.filtering - 1 else 0.0
            if j >= d.filtering and j + 2 <= n:
                slope += s[j + 2] / 2
            change.append(slope)
        s = [each + more for each, more in zip(s, change, strict=True)]
        assert run.velocity[k] == pytest.approx(s[d.filtering + 1], rel=1e-6, abs=1e-9), k


@every_law
@pytest.mark.parametrize("axis", ["paper", "mhz"])
def test_no_stop_start_or_reversal_of_the_axis_saturates(name, axis):
    """With every word: from rest to the largest speed at once, to the other direction at once, and to rest."""
    of = spec(axis, name)
    d, speed = of.design.estimator, of.speed_max_counts_per_sample
    (word,) = d.words
    for octaves in (word.low, 0, word.high):
        tau = (2 * speed / (d.lipschitz * 2.0**octaves)) ** (1 / d.order)
        # The axis is at an end of its travel then, or settled before.
        hold = min(math.ceil(5 * tau) + 200, math.floor(of.travel_m / of.count_m / speed))
        speeds = np.repeat([0.0, *[speed, -speed] * TURNS, 0.0], hold)
        counts = np.floor(np.cumsum(speeds) + 0.3).astype(np.int64)
        record = Axis(of, **{word.name: octaves}).run(counts)
        assert of.design.flag_names(int(np.bitwise_or.reduce(record.flags))) == []
        for part in range(1, 2 * TURNS + 2) if hold > 5 * tau else ():
            end = record.velocity[(part + 1) * hold - 1] * d.velocity.lsb
            assert abs(end - speeds[(part + 1) * hold - 1]) <= 0.02 * speed + 8 / tau


@every_law
def test_a_saturation_is_left_again(name):
    """A jump by half of the count's range, which no motion makes: flagged, and forgotten."""
    of = spec("mhz", name)
    d = of.design.estimator
    jump = 1 << (d.count_width - 2)
    samples = 500_000
    counts = np.floor(np.arange(samples) * 0.05).astype(np.int64)
    counts[1000:] += jump
    half = 1 << (d.count_width - 1)
    record = Axis(of, **{d.words[0].name: d.words[0].high}).run((counts + half) % (2 * half) - half)
    assert abs(record.velocity[-1] * d.velocity.lsb - 0.05) < 0.002


@pytest.mark.parametrize("name", [*FIXED, "levant-2-implicit", "levant-3-implicit"])
@pytest.mark.parametrize("rate", [1_000, 10_000, 100_000, 1_000_000])
def test_word_length_and_rough_terms_cost_a_hundredth(name, rate):
    """The RMS error on the paper's signal, over phases, in fixed point and in float64; of the implicit form two."""
    of, seconds = axis_at(name, rate), 8.0 if rate == 1_000 else 1.0
    squares = np.zeros(2)
    for phase in np.arange(PHASES) / PHASES:
        counts, truth = swing(rate, seconds, TURN_S, phase)
        for way, floating in enumerate((True, False)):
            error = Axis(of, floating).run(counts).velocity_m_per_s - truth
            squares[way] += (error[int(0.4 * rate) :] ** 2).sum()
    exact, fixed = np.sqrt(squares)
    assert abs(fixed - exact) <= (0.02 if "implicit" in name else 0.01) * exact


@every_form
def test_every_flag_is_raised_by_something(name):
    d = design(name, TIGHT)
    assert np.bitwise_or.reduce(model(d, wrapped(d, stimulus(d, 20_000)), d.start())["saturated"]) == 0b111


@every_form
def test_wrap_and_restart(name):
    of = axis_at(name, 10_000)
    d = of.design.estimator
    counts, _ = swing(of.sample_hz, 0.2, TURN_S)
    half = 1 << (d.count_width - 1)
    expected = Axis(of).run(counts).velocity
    assert expected.any()
    assert (Axis(of).run(counts + half - counts[0] - 1000).velocity == expected).all()
    rows = [(count, int(k == 700), 0) for k, count in enumerate(counts.tolist())]
    again = model(d, rows[700:], d.start())["velocity"]
    assert (model(d, rows, d.start())["velocity"][700:] == again).all()
