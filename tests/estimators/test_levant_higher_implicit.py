"""Levant's implicit differentiators of order 2 and 3: RTL against model, the model against exact arithmetic."""

import math
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import accumulate

import cocotb
import numpy as np
import pytest
from levants import TURN_S, wrapped
from test_levant_higher import AXES, LIMIT, TIGHT, TURNS, design, half_up, limited, stimulus
from test_levant_higher_design import SCALES

from hardwall.hdl.estimators.levant_higher_implicit import Estimator
from hardwall.model.arithmetic.curves import ALIKE, MANTISSA_BITS, STEPS, term
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators.acceleration import acceleration_of
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant_higher_design import LAMBDA, MEAN_ERROR, State
from hardwall.model.estimators.levant_higher_implicit import LARGEST_L, Design, FloatParams, Order2, Order3
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from hardwall.testing.estimators import follow
from stimuli.lengths import some_of
from stimuli.papers_signal import axis_at, swing
from stimuli.specs import spec

NAMES = [each.name for each in (Order2, Order3)]
every = pytest.mark.parametrize("name", NAMES)
ENTRY = (1 + Fraction(1, STEPS)) * (1 + Fraction(ALIKE))
RESIDUAL = Fraction(7, 8), Fraction(9, 8)
ROUNDING = Fraction(1, 2 ** (MANTISSA_BITS + 1)) + Fraction(1, 10**9)
SLACK = (ENTRY - 1) / (ENTRY + 1) + ROUNDING
"""The largest relative error of a term from a table: half of the ratio of an entry's values, and its rounding."""


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = Estimator(design(**parameters()))
    d = component.design
    expected = await follow(dut, component, wrapped(d, stimulus(d, max(SAMPLES, 20_000))), d.start())
    assert 0 in expected["saturated"]
    if parameters()["axis"] == TIGHT:
        assert np.bitwise_or.reduce(expected["saturated"]) == 0b111


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    component = Estimator(design(**parameters()))
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


@pytest.mark.parametrize(("name", "axis"), some_of([(name, axis) for name in NAMES for axis in AXES], 1, 8, 9))
def test_rtl(name, axis):
    simulate(__file__, lambda name, axis: Estimator(design(name, axis)), name=name, axis=axis)


BITS = 60


GAINS = {order: [Fraction(str(each)) for each in LAMBDA[order]] for order in (2, 3)}


@cache
def published(order: int, beta: Fraction) -> tuple[tuple[Fraction, ...], Fraction]:
    """Return (s_0 / L, ..., s_N / L) at |b| = beta L by the published equation, and the residual of the polynomial.

    In integers: rho is bracketed by bisection to 2**-BITS, and the lower end taken.
    """
    gains = GAINS[order]
    if beta <= gains[0]:
        return (beta,) * (order + 1), Fraction(0)
    # The coefficients of the integer 2**BITS rho, all times 2**(BITS (N + 1)) and the gains' denominator.
    unit = math.lcm(*(each.denominator for each in gains))
    whole = [int(each * unit) << BITS * (order + 1 - n) for n, each in enumerate(gains)] + [unit]
    most = math.floor(beta * (unit << BITS * (order + 1)))

    def polynomial(rho: int) -> int:
        total = 0
        for each in reversed(whole):
            total = total * rho + each
        return total

    low, high = 0, 1 << BITS + max(math.ceil(beta).bit_length(), 1)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if polynomial(middle) <= most else (low, middle)
    rho = Fraction(low, 1 << BITS)
    sums = [*accumulate(each * rho**n for n, each in enumerate(gains))]
    return tuple(reversed(sums)), beta - Fraction(polynomial(low), unit << BITS * (order + 1))


def corrections(order: int, beta: Fraction) -> list[Fraction]:
    """Return T_0 to T_N at |b| = beta L, over L, of the published scheme in the states of the project."""
    s, residual = published(order, beta)
    assert 0 <= residual < Fraction(beta + 10, 2**40)
    return [sum(s, Fraction(0)), s[1] + s[2] / 2, *([s[2] + s[3], s[3]] if order == 3 else [s[2]])]


def near_band(d: Design) -> Fraction:
    """Return the |b| below which all is linear, by the definition: the first power of two within a_N; or 0."""
    power = Fraction(2) ** math.floor(math.log2(LAMBDA[d.order][0] * d.lipschitz))
    return power if d.powers.near else Fraction(0)


@every
@pytest.mark.parametrize("axis", ["paper", "mhz", LIMIT])
def test_every_address_of_the_tables_solves_the_polynomial_as_nearly_as_derived(name, axis):
    """Over every eighth of every octave, at both ends, with three words: every term is within its error.

    Every term grows with |b|. Above the band each is the term of a |b| that is off by an eighth at most, but for its
    rounding: this is the residual of the polynomial.
    """
    d, tried = design(name, axis), 0
    p, bound = d.powers, Fraction(d.lipschitz)
    words = sorted({d.words[0].low, 0, d.words[0].high})
    for place in range(d.gap.width - 1):
        for eighth in range(STEPS) if place >= 3 else (0,):
            low = (STEPS + eighth) << place >> 3
            high = max(low, ((STEPS + eighth + 1) << place >> 3) - 1)
            for size, k in ((size, k) for size in {low, high} for k in words):
                argument = Fraction(size, 2**d.gap.f) / Fraction(2) ** k
                exact = corrections(d.order, argument / bound)
                # The word only shifts the argument: one is enough for the residual.
                off = RESIDUAL if (size, k) == (low, 0) else ()
                ends = [corrections(d.order, part * argument / bound) for part in off]
                for number, each in enumerate(exact):
                    word = term(p.params, number, size, k)
                    place_of = (d.gap, *d.z)[number].f
                    value = each * bound * Fraction(2) ** (k + place_of)
                    if argument < near_band(d):
                        assert abs(word - value) <= 1
                    else:
                        assert value * (1 - SLACK) - 1 <= word <= value * (1 + SLACK)
                        if ends:
                            least, most = (end[number] * bound * Fraction(2) ** place_of for end in ends)
                            assert least * (1 - ROUNDING) - 1 <= word <= most * (1 + ROUNDING) + 1
                    tried += word > 0
    assert tried > 1000


@every
@pytest.mark.parametrize("axis", ["paper", "narrow", LIMIT])
def test_every_step_is_the_published_one_in_exact_arithmetic(name, axis):
    """From the model's states to those of the paper, one step of the paper's cascade, and back: within roundings.

    z0, z1, ... of the paper are backward differences. A sample's states are taken from the model.
    """
    d, (word,) = design(name, axis), design(name, axis).words
    modulus, half, bound = 2**d.count_width, 2 ** (d.count_width - 1), Fraction(d.lipschitz)
    units = [Fraction(1, 2**each.f) for each in (d.gap, *d.z[: d.order])]
    state, last, far = d.start(), 0, 0
    made = {octaves: d.params({word.name: octaves}) for octaves in range(word.low, word.high + 1)}
    for count, restart, octaves in wrapped(d, [*stimulus(d, 1500)]):
        before, moved = state, (count - last + half) % modulus - half
        last = count
        params = made[octaves]
        state, velocity, flags = estimate(params, before, seen_count(count), restart)
        assert acceleration_of(params, state) == state.z2 // 2 ** (d.z[1].f - d.acceleration.f)
        assert velocity == half_up(Fraction(state.z1 - d.half, 2 ** (d.z[0].f - d.velocity.f)))
        if not before.running or restart:
            assert (velocity, flags, state.lead, state.z2, state.z3) == (0, 0, 0, 0, 0)
            continue
        if flags:
            far += 1
            continue
        b = (before.lead - moved * 2**d.gap.f) * units[0]
        v, a, z3 = ((before.z1 - d.half) * units[1], before.z2 * units[2], before.z3 * units[-1] * (d.order == 3))
        z = [b, v - (a - z3) / 2, a - z3, z3][: d.order + 1]
        z[0] -= sum(z[1:])
        size = abs(b) - (units[0] if b < 0 else 0)
        scale = bound * Fraction(2) ** octaves
        beta = round(size / scale * 2**64) / Fraction(2**64)
        s = [each * scale * ((b > 0) - (b < 0)) for each in published(d.order, beta)[0]]
        # The cascade, from the last state up; s_j is the sum of all that is subtracted from z_j on.
        after = [sum(z[j:]) - s[j] for j in range(d.order + 1)]
        after.append(Fraction(0))
        expected = [sum(after[: d.order + 1]), after[1] + after[2] / 2, after[2] + after[3], after[3]][: d.order + 1]
        found = [state.lead, state.z1 - d.half, state.z2, state.z3][: d.order + 1]
        for value, now, unit, share in zip(expected, found, units, corrections(d.order, beta), strict=True):
            # Two Taylor sums round, each by half an LSB; a term rounds down, and comes from a table.
            slack = 2 * unit + SLACK * share * scale * (size / Fraction(2) ** octaves >= near_band(d))
            assert abs(now * unit - value) <= slack
    assert far < 1400


@every
def test_the_float_kernel_is_the_published_algorithm(name):
    """The paper's cascade over unwrapped positions, with its own coefficients and a root by bisection."""
    d, axis = design(name), spec("mhz", name)
    counts, _ = swing(axis.sample_hz, 0.02, TURN_S)
    counts -= counts[0]
    run = Axis(axis, floating=True).run(counts)
    n = d.order
    a = [LAMBDA[n][n - j] * d.lipschitz ** ((j + 1) / (n + 1)) for j in range(n + 1)]
    z = [float(counts[0])] + [0.0] * n
    for k, count in enumerate(counts.tolist()):
        b = sum(z) - count
        y, share = 0.0, b / a[n]
        if abs(b) > a[n]:
            share, low, high = math.copysign(1, b), 0.0, 1 + abs(b)
            for _ in range(60):
                y, value = (low + high) / 2, 1.0
                for each in a:
                    value = value * y + each
                low, high = (y, high) if value <= abs(b) else (low, y)
        z[n] -= a[n] * share
        for j in range(n - 1, -1, -1):
            z[j] += z[j + 1] - a[j] * y ** (n - j) * share
        assert run.velocity[k] == pytest.approx(z[1] + z[2] / 2, rel=1e-6, abs=1e-8), k


@every
@pytest.mark.parametrize("axis", ["paper", "mhz", LIMIT])
def test_no_stop_start_or_reversal_of_the_axis_saturates(name, axis):
    """With every word: from rest to the largest speed at once, to the other direction at once, and to rest."""
    of = limited(name) if axis == LIMIT else spec(axis, name)
    d, speed = of.design.estimator, of.speed_max_counts_per_sample
    (word,) = d.words
    for octaves in sorted({word.low, 0, word.high}):
        tau = (2 * speed / (d.lipschitz * 2.0**octaves)) ** (1 / d.order)
        hold = min(math.ceil(5 * tau) + 200, math.floor(of.travel_m / of.count_m / speed))
        speeds = np.repeat([0.0, *[speed, -speed] * TURNS, 0.0], hold)
        counts = np.floor(np.cumsum(speeds) + 0.3).astype(np.int64)
        record = Axis(of, **{word.name: octaves}).run(counts)
        assert of.design.flag_names(int(np.bitwise_or.reduce(record.flags))) == []
        for part in range(1, 2 * TURNS + 2) if hold > 5 * tau else ():
            end = record.velocity[(part + 1) * hold - 1] * d.velocity.lsb
            assert abs(end - speeds[(part + 1) * hold - 1]) <= 0.02 * speed + 8 / tau


def test_the_largest_bound_is_the_largest():
    d = limited("levant-2-implicit").design.estimator
    assert (d.lipschitz, d.words[0].high) == (LARGEST_L, 0)


@compiled
def _mean(params, moved, period, phase, settle, samples):
    """Return how far the mean of z1 is from a steady speed of `moved` counts in `period` samples, in float64."""
    speed, total = moved / period, 0.0
    state = State(1, 0, 0.0, speed, speed, 0.0, 0.0)
    for k in range(settle + samples):
        state, velocity, _ = estimate(params, state, seen_count(math.floor(moved * k / period + phase)), 0)
        total += velocity - speed if k >= settle else 0.0
    return total / samples


@every
def test_the_mean_where_counts_lock_is_as_near_as_that_of_the_explicit_form(name):
    """Over patterns of up to 12 samples, three phases, and the largest L and less."""
    d, worst = design(name), 0.0
    for own in np.geomspace(1, 60, 40)[SCALES]:
        params = FloatParams(d.order, 40, own ** -(d.order + 1), LAMBDA[d.order])
        for period, moved in ((q, p) for q in range(1, 13) for p in range(q) if math.gcd(p, q) == 1):
            samples, settle = 4 * period * max(1, int(200 * own / period)), int(60 * own) // period * period
            for phase in (0.0, 0.01 / period, 0.5 / period):
                worst = max(worst, abs(_mean(params, moved, period, phase, settle, samples)) * own)
    assert worst <= MEAN_ERROR[d.order, 0]


@every
@pytest.mark.parametrize(("rate", "jerk"), [(1_000, None), (10_000, 1e5)])
def test_no_chatter_and_no_bias_at_rest_and_in_constant_motion(name, rate, jerk):
    """Rest, a steady speed and a steady acceleration in whole counts: the critique in arXiv 2404.02770.

    In float64 the estimate is exact; in words it is within a few LSBs of b. The explicit form is far from both.
    """
    of = replace(axis_at(name, rate), jerk_max_m_per_s3=jerk)
    d, k = of.design.estimator, np.arange(200 if jerk else 800)
    explicit = replace(axis_at(name.removesuffix("-implicit"), rate), jerk_max_m_per_s3=jerk)
    for speed, acceleration in ((0, 0), (3, 0), (0, 2), (-5, 2)):
        counts, truth = speed * k + acceleration * k * k // 2, speed + acceleration * k
        # A start in motion has its own time; the rest comes after a step.
        counts[0] += 2
        assert np.abs(Axis(of, floating=True).run(counts).velocity - truth)[-80:].max() < 1e-9
        words = Axis(of).run(counts)
        assert not words.flags.any()
        assert np.abs(words.velocity * d.velocity.lsb - truth)[-80:].max() <= 4 * d.gap.lsb
        other = Axis(explicit, floating=True).run(counts).velocity - truth
        assert np.ptp(other[-80:]) > 20 * d.gap.lsb or np.abs(other[-80:]).min() > 0.9 * acceleration > 0
