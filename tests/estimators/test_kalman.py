"""All-integrator Kalman filter: RTL against model, model against exact rationals, gains and word lengths as derived."""

import math
import re
from dataclasses import replace
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from filters import SECONDS, equals, impulse, norms, rms, run, starts_afresh
from lowest_sums import BRINKS, brink
from scipy.linalg import solve_discrete_are

from hardwall.hdl.estimators.kalman import Estimator
from hardwall.model import velocity
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators import kalman
from hardwall.model.estimators.acceleration import Motions
from hardwall.model.estimators.kalman import FLOAT_START, START, Design, Gains, State, steady_state
from hardwall.model.estimators.riccati import INDEX_MAX
from hardwall.model.spec import AxisSpec
from hardwall.model.velocity_estimator import run as run_both
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, rng, simulate
from hardwall.testing.estimators import follow, model, reset_words
from stimuli.lengths import some_of
from stimuli.papers_signal import BOUND, RATES, axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import spec

JERK_M_PER_S3 = 12.0
"""The jerk that the axis `told` is told: about the largest of the paper's signal."""
PREDICT = np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]])


def axis_of(name: str) -> AxisSpec:
    """Return the axis of that name, or for `told` the one of `mhz` with a bound on the jerk."""
    return replace(spec("mhz", "kalman"), jerk_max_m_per_s3=JERK_M_PER_S3) if name == "told" else spec(name, "kalman")


def design(name: str) -> Design:
    return axis_of(name).design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def reset_params(d: Design):
    return d.params({word.name: word.reset for word in d.words})


def stimulus(name: str, samples: int):
    """Yield rows that visit a track, full swings, the wrap of the count and the ends of the gains."""
    d, random = design(name), seeded()
    half = 1 << (d.count_width - 1)
    reset, top = reset_words(d), [word.format.max for word in d.words]
    two = d.words_for(axis_of(name).design.gains, integrators=2)
    double = [word.from_si(two[word.name]) for word in d.words]
    # A standstill at any count, from the first sample on.
    for _ in range(20):
        yield half - 1, 0, *reset
    # A smooth motion through the wrap of the count.
    turn = min(1.0, d.step_max / half) / 2
    for k in range(samples // 4):
        count = math.floor(half * (1 + 0.5 * math.sin(k * turn)) + random.random())
        yield count, 0, *(double if k > samples // 8 else reset)
    # Full swings, the worst case for overflow of some state, with words at their ends, until everything saturates.
    for period in (1, 2, 3, 7, 50):
        for chosen in (reset, double, top, [0, *top[1:]], [top[0], 0, 0], [top[0], 0, top[2]]):
            for k in range(samples // 200):
                yield (-half, half // 2 - 1, half - 1)[k // period % 3], 0, *chosen
    # Long runs faster than the axis allows: the count outruns a position that follows, and one that does not.
    for chosen in ([0, 0, 0], [0, top[1], 0], [0, 0, top[2]], [1, 1, 1], top):
        for k in range(min(samples // 20, 2 * d.lead.max // (d.step_max << d.lead.f))):
            yield k * (d.step_max + 1), 0, *chosen
    # An acceleration that comes to an LSB beyond its lowest, and then stays there.
    if name in BRINKS:
        yield from brink(d, *BRINKS[name])[0]
    # A random walk with jumps and restarts, with gains anywhere in their range.
    count, chosen = 0, reset
    for _ in range(samples // 2):
        jump = random.random() < 0.01
        count += random.randrange(-half, half) if jump else random.randint(-d.step_max, d.step_max)
        if random.random() < 0.02:
            chosen = random.choice([reset, double, [random.randint(0, most) for most in top]])
        yield count, int(random.random() < 0.002), *chosen


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    samples = SAMPLES // 10 if name == "narrow" else SAMPLES
    expected = await follow(dut, make(name), stimulus(name, samples), START)
    # The campaign must reach every saturation, and the quiet track too.
    assert 0 in expected["saturated"]
    assert np.bitwise_or.reduce(expected["saturated"]) == 0b111


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    d = design(**parameters())
    await starts_afresh(
        dut, make(**parameters()), dict(zip((word.name for word in d.words), reset_words(d), strict=True))
    )


@pytest.mark.parametrize("name", some_of(["mhz", "narrow", "told"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", BRINKS)
def test_the_acceleration_comes_to_an_lsb_beyond_its_lowest_and_stays(name):
    d = design(name)
    _, seen = brink(d, *BRINKS[name])
    (before, _), (state, flags), (after, last) = seen[-3:]
    # The least gain makes an LSB of a lead up to this.
    assert 0 < state.lead <= 1 << (d.lead.f - d.operand.f + d.shifts[2])
    assert before.a == state.a == after.a == -d.a.max
    assert (flags & 4, last & 4) == (4, 0)


def oracle(d: Design, rows):
    """Yield the outputs of the module's equations in exact rationals, rounded as documented, on unwrapped positions."""
    fine_x, fine_v, fine_a = (Fraction(1, 2**fmt.f) for fmt in (d.lead, d.v, d.a))
    coarse, out, bent = (Fraction(1, 2**fmt.f) for fmt in (d.operand, d.velocity, d.acceleration))
    far, fast, hard = d.lead.max * fine_x, d.velocity.max * out, d.a.max * fine_a
    modulus, half = 2**d.count_width, 2 ** (d.count_width - 1)
    last = position = x = v = a = None
    for count, restart, *gains in rows:
        k_x, k_v, k_a = (
            Fraction(gain) / Fraction(2) ** word.format.f for gain, word in zip(gains, d.words, strict=True)
        )
        if last is None or restart:
            last, position, x, v, a = count, 0, Fraction(0), Fraction(0), Fraction(0)
        moved = (count - last + half) % modulus - half
        step = max(-d.step_max, min(d.step_max, moved))
        last, position = count, position + step
        a = a if k_a else Fraction(0)
        before, v = v, v + a // fine_v * fine_v
        x += (before + v) / 2 // fine_x * fine_x
        lead = max(-far, min(far, x - position))
        flags = (step != moved) | (lead != x - position) << 1
        r = -lead // coarse * coarse
        far_v, far_a = v + k_v * r // fine_v * fine_v, a + k_a * r // fine_a * fine_a
        v, a = max(-fast, min(fast, far_v)), max(-hard, min(hard, far_a))
        x = position + lead + k_x * r // fine_x * fine_x
        given = math.floor(v / out + Fraction(1, 2)), math.floor(a / bent + Fraction(1, 2))
        yield *given, flags | (v != far_v or a != far_a) << 2


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "told"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    equals(oracle, design(name), stimulus(name, 8_000), START)


@pytest.mark.parametrize("index", 2.0 ** np.arange(-8, 7, 2))
def test_gains_are_those_of_the_riccati_equation(index):
    """The gains agree to a hundredth of a gain word's resolution."""
    h = float(index)
    a = np.array([[1, h, h**2 / 2], [0, 1, h], [0, 0, 1]])
    q = np.array([[h**5 / 20, h**4 / 8, h**3 / 6], [h**4 / 8, h**3 / 3, h**2 / 2], [h**3 / 6, h**2 / 2, h]])
    for n, part in ((3, slice(0, 3)), (2, slice(1, 3))):
        p = solve_discrete_are(a[:n, :n].T, np.eye(n)[:, :1], q[part, part], np.array([[1 / h]]))
        expected = p[:, 0] / (p[0, 0] + 1 / h) * h ** np.arange(n)
        assert steady_state(h, n)[:n] == pytest.approx(expected, rel=2.0**-15 / 100)
    assert steady_state(h, 2)[2] == 0


def test_gains_at_the_least_and_the_largest_index():
    h = 2.0**-24
    assert steady_state(h) == pytest.approx((2 * h, 2 * h**2, h**3), rel=2 * h)
    assert steady_state(h, 2)[:2] == pytest.approx((math.sqrt(2) * h, h**2), rel=2 * h)
    assert steady_state(1e9) == steady_state(INDEX_MAX)


def test_default_bandwidth_is_that_of_the_bound_at_any_rate():
    for rate in (100_000, 1_000_000, 10_000_000):
        axis = axis_at("kalman", rate)
        expected = math.sqrt(BOUND / axis.count_m) / rate
        # tanh, exp and coth are linear up to a relative error of a sample over the minimax window.
        assert axis.design.gains.index(axis) == pytest.approx(expected, rel=expected)


@pytest.mark.parametrize("jerk", [1e-6, 1.0, 300.0])
def test_the_bandwidth_of_a_told_jerk_is_that_of_the_jerk_at_any_rate(jerk):
    for rate in (100_000, 1_000_000, 10_000_000):
        axis = replace(axis_at("kalman", rate), jerk_max_m_per_s3=jerk)
        expected = (2 * jerk / axis.count_m) ** (1 / 3) / rate
        assert axis.design.gains.index(axis) == pytest.approx(expected, rel=expected)


def test_a_jerk_is_told_where_it_says_more_than_the_acceleration_does():
    """The bandwidth grows with the jerk up to the one without it, and stays there."""
    axis = axis_at("kalman", 1_000_000)
    untold = axis.design.gains
    limit = BOUND * math.sqrt(BOUND / axis.count_m) / 2
    told = [Gains.default(replace(axis, jerk_max_m_per_s3=share * limit)) for share in (0.5, 0.99, 0.999999, 1.01, 1e6)]
    index = [gains.index(axis) for gains in told]
    assert index[0] < index[1] < index[2]
    assert tuple(vars(told[2]).values()) == pytest.approx(tuple(vars(untold).values()), rel=1e-6)
    assert told[3:] == [untold, untold]


@pytest.mark.parametrize("rate", some_of(RATES, 0, 1, 2, 3))
def test_a_told_jerk_takes_two_thirds_of_the_error_on_the_papers_signal(rate):
    """At least: at 1 kHz four fifths. The signal's own jerk is 11.5 m/s^3."""
    axis = axis_at("kalman", rate)
    counts, truth = swing(rate, 5.0)
    axes = axis, replace(axis, jerk_max_m_per_s3=JERK_M_PER_S3)
    untold, told = (rms((Axis(each).run(counts).velocity_m_per_s - truth)[rate:]) for each in axes)
    assert told < 0.35 * untold


def test_the_algorithm_is_the_textbooks():
    axis = axis_at("kalman", 10_000)
    counts, _ = swing(10_000, 1.0)
    seen = Axis(axis, floating=True).run(counts).velocity
    gains = np.array(steady_state(axis.design.gains.index(axis)))
    state, expected = np.zeros(3), np.zeros(len(counts))
    for k, count in enumerate(counts[1:] - counts[0], 1):
        state = PREDICT @ state
        state += gains * (count - state[0])
        expected[k] = state[1]
    # The textbook's position rounds some times a sample to float64's 53 bits of the distance covered.
    assert np.abs(seen - expected).max() <= 64 * 2.0**-53 * np.abs(counts).max()


def system(gains):
    """Return the matrix of the states (x, v, a) after an update, that of the update, and the response to an input d."""
    update = np.eye(3) - np.outer(gains, [1, 0, 0])
    return update @ PREDICT, update, update @ np.array([-1, 0, 0])


def rounding(d_bits: tuple[int, int, int], gains, samples: int, state: int = 1) -> float:
    """Return the largest error at v, or at another state by its number, from all floors, in LSB of lead.

    `d_bits` holds the fraction bits that (v, a, operand) have in addition to those of lead.
    """
    a, update, lead = system(gains)
    v_bits, a_bits, operand_bits = d_bits

    def at(b):
        return norms(a, b, samples)[state]

    of_x = at(lead) + at([1, 0, 0])
    of_v = at([0, 1, 0])
    if gains[2] == 0:
        # The acceleration a is exactly 0.
        return of_x + of_v * 2.0**-v_bits + at(gains) * 2.0**-operand_bits
    of_v += at(update @ [0.5, 1, 0])
    return of_x + of_v * 2.0**-v_bits + at([0, 0, 1]) * 2.0**-a_bits + at(gains) * 2.0**-operand_bits


@pytest.mark.parametrize("integrators", [3, 2])
def test_the_norms_are_those_of_the_module(integrators):
    used = []
    for index in 2.0 ** np.arange(-12, kalman.HEADROOM_BITS + 5, 0.25):
        h = min(index, 1.0)
        gains = np.array(steady_state(index, integrators))
        a, _, d = system(gains)
        samples = int(60 / h) + 200
        response = impulse(a, d, samples)
        lead = 1 + np.abs((PREDICT @ response)[0]).sum()
        _, v, acceleration = np.abs(response).sum(1)
        bounds = np.array(kalman.norms(index)) * [1, h, 1 / h]
        assert (np.array([v, acceleration, lead]) <= bounds).all(), index
        reach = max(math.ceil(math.log2(1 / h)), 0)
        error = rounding((reach, 2 * reach, -max(reach - 1, 0)), gains, samples)
        assert error <= kalman.ERROR_NORM
        used.append([v / bounds[0], error / kalman.ERROR_NORM])
        # The LSB of the acceleration that is given out is 2**-reach of the velocity's.
        bent = rounding((reach, 2 * reach, -max(reach - 1, 0)), gains, samples, state=2) if integrators == 3 else 0.0
        assert bent * 2.0 ** (reach - kalman.GUARD_BITS) < 0.5
    # Their purpose: all errors together are less than half an LSB.
    assert kalman.ERROR_NORM * 2.0**-kalman.GUARD_BITS < 0.5
    assert integrators == 2 or (np.max(used, 0) > 0.95).all()


SLOW = Gains.default(axis_at("fdm", 1_000_000)).__dict__ | {"acceleration_time_s": 1.0}


@pytest.mark.parametrize("gains", [None, Gains(**SLOW)], ids=["default", "slow"])
@pytest.mark.parametrize("sample_hz", RATES)
def test_fixed_is_float_within_the_derived_bound(sample_hz, gains):
    """On the paper's signal, rounding is within its norms; with the gains' errors it is within 1 % of the error."""
    axis = axis_at("kalman", sample_hz, gains=gains)
    d = axis.design.estimator
    counts, truth = swing(sample_hz, SECONDS[sample_hz])
    held = Axis(axis)
    fixed = held.run(counts)
    exact = Axis(axis, floating=True).run(counts)
    rounded = {word.name: word.to_si(held.words[word.name]) for word in d.words}
    params = d.float_params(axis.design.gains, "u", rounded)
    _, as_rounded, _ = run(params, FLOAT_START, counts)

    bits = tuple(fmt.f - d.lead.f for fmt in (d.v, d.a, d.operand))
    samples = int(60 / min(axis.design.gains.index(axis), 1)) + 200
    bound = rounding(bits, np.array(params[:3]), samples) * d.lead.lsb + d.velocity.lsb / 2
    # Float64 itself has slightly fewer bits than the states need.
    assert np.abs(fixed.velocity * d.velocity.lsb - as_rounded).max() <= bound * (1 + 1e-6)
    assert not fixed.flags.any()
    judged = slice(len(counts) // 5, None)
    own = rms((exact.velocity_m_per_s - truth)[judged])
    assert rms((fixed.velocity_m_per_s - exact.velocity_m_per_s)[judged]) <= 0.01 * own


def test_three_integrators_are_better_than_two():
    """Both filter the paper's signal with the same noise model."""
    axis = axis_at("kalman", 100_000)
    counts, truth = swing(100_000, 5.0)
    two = axis.design.estimator.words_for(axis.design.gains, integrators=2)
    errors = [rms((Axis(axis, **words).run(counts).velocity_m_per_s - truth)[100_000:]) for words in ({}, two)]
    assert errors == pytest.approx([0.087e-3, 0.165e-3], rel=0.02)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "told"])
def test_every_state_settles_to_the_exact_speed(name):
    """No limit cycle and no dead zone remains in the velocity and in the acceleration, from any state."""
    axis, random = axis_of(name), rng()
    d = axis.design.estimator
    settled = int(80 / min(axis.design.gains.index(axis), 1)) + 1000
    for integrators in (3, 2):
        si = d.words_for(axis.design.gains, integrators)
        params = d.params({word.name: word.from_si(si[word.name]) for word in d.words})
        for n in (0, 1, -d.step_max):
            for _ in range(5):
                lead, v, a = (int(random.integers(-top, top + 1)) for top in (d.lead.max, params.v_max, d.a.max))
                start = State(1, 0, lead, v, a if integrators == 3 else 0)
                state, _, _ = run(params, start, n * np.arange(1, settled))
                made = Motions(np.zeros(20_000, np.int64), np.zeros(20_000, np.int64))
                _, flags = run_both(params, state, state.count + n * np.arange(1, 20_001), made)
                assert (made.velocity == n << d.velocity.f).all()
                assert not made.acceleration.any()
                assert not flags


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "told"])
def test_no_input_overflows(name):
    """The worst input for a state has the signs of its impulse response."""
    d = design(name)
    params = reset_params(d)
    a, _, first = system([word.reset * word.format.lsb for word in d.words])
    states = impulse(a, first, 60_000)
    responses = [np.concatenate([[-1], (PREDICT @ states)[0]]), *states[1:]]
    for response, field in zip(responses, ("lead", "u", "a"), strict=True):
        steps = d.step_max * np.sign(response)[::-1].astype(np.int64)
        state, velocity, flags = run(params, START, np.cumsum([0, *steps]))
        assert not flags.any()
        if field == "u":
            assert abs(state.v) * d.v.lsb > 0.95 * np.abs(response).sum() * d.step_max
            assert np.abs(velocity).max() <= d.velocity.max


@pytest.mark.parametrize("share", [0.5, -1.0])
def test_a_constant_acceleration_is_read_to_the_norm_of_the_counts_roundings(share):
    """A count is off by half a count at most, beside a constant half, which is no acceleration."""
    axis = spec("mhz", "kalman")
    d = axis.design.estimator
    params, true = reset_params(d), share * axis.acceleration_max_m_per_s2 / axis.count_m / axis.sample_hz**2
    counts = np.floor(true * np.arange(300_000) ** 2 / 2 + 0.3).astype(np.int64)
    made = Motions(*(np.zeros(len(counts), np.int64) for _ in range(2)))
    _, flags = run_both(params, START, counts, made)
    gains = np.array([word.reset * word.format.lsb for word in d.words])
    a, *_ = system(gains)
    norm = norms(a, gains, 60_000)[2]
    seen = made.acceleration[100_000:] * d.acceleration.lsb
    assert np.abs(seen - true).max() <= norm / 2 + d.acceleration.lsb
    assert seen.mean() == pytest.approx(true, rel=1e-3)
    assert not flags


def test_the_largest_step_displaces_the_scale():
    d = design("mhz")
    _, velocity, flags = run(reset_params(d), START, [0] * 5 + [1 << (d.count_width - 2)] * 50_000)
    assert flags.tolist() == [0] * 5 + [1] + [0] * 49_999
    assert np.abs(velocity).max() <= d.step_max << d.velocity.f
    assert velocity[-1] == 0


def test_a_change_of_integrators_leaves_nothing_behind():
    axis = spec("mhz", "kalman")
    d = axis.design.estimator
    si = d.words_for(axis.design.gains, integrators=2)
    two = d.params({word.name: word.from_si(si[word.name]) for word in d.words})
    state, _, _ = run(reset_params(d), START, np.arange(1000) ** 2 // 2000)
    assert state.a > 0
    state, velocity, _ = run(two, state, state.count + np.arange(1, 20_001))
    assert state.a == 0
    assert velocity[-1] == 1 << d.velocity.f


def test_start_and_restart_make_no_transient():
    d = design("paper")
    rows = [(-777_777, 0, *reset_words(d))] * 50 + [(123_456, 1, *reset_words(d))] * 2 + [(123_456, 0, *reset_words(d))]
    seen = model(d, rows, START)
    assert not seen["velocity"].any()
    assert not seen["saturated"].any()


@pytest.mark.parametrize("name", Gains.__annotations__)
@pytest.mark.parametrize("value", [-1.0, 0.0, math.nan, math.inf, "1"])
def test_an_impossible_noise_model_is_refused(name, value):
    fields = dict(vars(Gains.default(spec("paper", "kalman")))) | {name: value}
    with pytest.raises((TypeError, ValueError), match=f"^{name} must be "):
        Gains(**fields)


def test_a_bandwidth_too_small_is_refused_with_the_least_acceleration():
    axis = spec("paper", "kalman")
    gains = Gains(1e-28, 1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match=r"^acceleration_rms_m_per_s2 must be at least .* at these rates, not 1e-28"):
        Design(axis, gains)


def test_a_jerk_too_small_is_refused_with_the_least_acceleration_and_what_it_follows_from():
    def told(jerk: float):
        bounds = {"acceleration_max": 1e3, "speed_max": 1e6, "travel": 10.0}
        return velocity([0, 1, 2, 3], 1e6, "kalman", count=1.0, jerk_max=jerk, **bounds)

    message = r"acceleration_rms_m_per_s2 must be at least (\S+) at these rates, not (\S+); .* and on the jerk"
    with pytest.raises(ValueError, match=message) as refused:
        told(1e-30)
    least, found = map(float, re.search(message, str(refused.value)).groups())
    # The acceleration grows with the jerk to the power 2/3.
    assert np.isfinite(told(1.001e-30 * (least / found) ** 1.5)).all()


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
