"""Tracking loop: RTL against model, model against exact rationals, stability of every word, word lengths as derived."""

import math
from fractions import Fraction
from itertools import product

import cocotb
import numpy as np
import pytest
from filters import SECONDS, equals, impulse, norms, rms, run, starts_afresh

from hardwall.hdl.estimators.tracking_loop import Estimator
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import tracking_loop
from hardwall.model.estimators.tracking_loop import FLOAT_START, INDEX_MAX, START, Design, Gains, State
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, rng, simulate
from hardwall.testing.estimators import follow, model, reset_words
from stimuli.lengths import REACHING, some_of
from stimuli.papers_signal import RATES, axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import PAPER, spec

AXES = ("paper", "mhz", "narrow", "wide")
INDICES = np.concatenate([2.0 ** -np.arange(2.0, 13), np.linspace(0.05, INDEX_MAX, 40)])
WORD = "tracking_loop_bandwidth"
WIDEST = AxisSpec(
    **PAPER | {"sample_hz": 1_000, "travel_m": 0.5, "count_m": 1e-9, "stiffness_max_n_per_m": 1e6},
    estimator="tracking-loop",
)
"""An axis whose counts have 32 bits, and may move by half of their range in a sample."""


def design(name: str) -> Design:
    return spec(name, "tracking-loop").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def word_at(d: Design, index: float) -> int:
    """Return the word for h, the next larger one."""
    return min(math.ceil(index * 2.0 ** d.words[0].format.f), d.words[0].format.max)


def params_at(d: Design, index: float):
    return d.params({WORD: word_at(d, index)})


def stimulus(name: str, samples: int):
    """Yield rows that visit a track, full swings, the wrap of the count, and every bandwidth."""
    d, random = design(name), seeded()
    half, (reset,), top = 1 << (d.count_width - 1), reset_words(d), d.words[0].format.max
    # A standstill at any count, from the first sample on.
    for _ in range(20):
        yield half - 1, 0, reset
    # A smooth motion through the wrap of the count.
    turn = min(1.0, d.step_max / half) / 2
    for k in range(samples // 4):
        yield math.floor(half * (1 + 0.5 * math.sin(k * turn)) + random.random()), 0, reset
    # Full swings, the worst case for overflow at some bandwidth, at the range's and the words' ends and beyond them.
    for period in (1, 2, 3, 7, 50):
        for chosen in (reset, word_at(d, d.least), top, 1, 0):
            for k in range(samples // 200):
                yield (-half, half // 2 - 1, half - 1)[k // period % 3], 0, chosen
    # Long runs with words too small to follow, until the position is out of its range. Then the largest word leads the
    # velocity to its end, small ones press on by a few LSB, and the largest takes the position in.
    longest = min(samples // 8, 3 * d.lead.max // (2 * d.step_max << d.lead.f))
    for chosen, sign in ((0, 1), (0, -1), (1, -1), (word_at(d, d.least / 4), 1)):
        for k in range(longest):
            yield sign * k * d.step_max, 0, chosen
        for word in (top, *(1 << bit for bit in range(2, 8)), *[top] * 50):
            yield sign * longest * d.step_max, 0, word
    # A random walk with jumps and restarts, with any bandwidth.
    count, chosen = 0, reset
    for _ in range(samples // 2):
        jump = random.random() < 0.01
        count += random.randrange(-half, half) if jump else random.randint(-d.step_max, d.step_max)
        if random.random() < 0.02:
            chosen = random.choice([reset, random.randint(0, top), word_at(d, d.most * 2.0 ** -random.uniform(0, 10))])
        yield count, int(random.random() < 0.002), chosen


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    samples = SAMPLES if name == "mhz" else max(SAMPLES, REACHING) // 10
    expected = await follow(dut, make(name), stimulus(name, samples), START)
    # The campaign must reach every saturation, and the quiet track too.
    assert 0 in expected["saturated"]
    assert np.bitwise_or.reduce(expected["saturated"]) == 0b111


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    await starts_afresh(dut, make(**parameters()), {WORD: design(**parameters()).words[0].format.max})


@pytest.mark.parametrize("name", some_of(["mhz", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: Design, rows):
    """Yield the outputs of the module's equations in exact rationals, rounded as documented, on unwrapped positions."""
    fine, finer, coarse, out = (Fraction(1, 2**fmt.f) for fmt in (d.lead, d.v, d.operand, d.velocity))
    far, fast = d.lead.max * fine, d.velocity.max * out
    modulus, half = 2**d.count_width, 2 ** (d.count_width - 1)
    last = position = x = v = None
    for count, restart, word in rows:
        h = Fraction(word, 2 ** d.words[0].format.f)
        if last is None or restart:
            last, position, x, v = count, 0, Fraction(0), Fraction(0)
        moved = (count - last + half) % modulus - half
        step = max(-d.step_max, min(d.step_max, moved))
        last, position = count, position + step
        x += v // fine * fine
        lead = max(-far, min(far, x - position))
        pull = h * (lead // coarse * coarse) // fine * fine
        flags = (step != moved) | (lead != x - position) << 1
        x = position + lead - 2 * pull
        far_v = v - h * pull // finer * finer
        v = max(-fast, min(fast, far_v))
        yield math.floor(v / out + Fraction(1, 2)), flags | (v != far_v) << 2


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    equals(oracle, design(name), stimulus(name, 8_000), START)


@pytest.mark.parametrize("bandwidth_hz", [1000 / (2 * math.pi), None], ids=["1000 rad/s", "default"])
def test_the_algorithm_is_that_of_servo_drives(bandwidth_hz):
    """It is written here as their firmware has it: in seconds, with kp and ki, and a position that is not relative."""
    axis = axis_at("tracking-loop", 10_000, gains=bandwidth_hz and Gains(bandwidth_hz))
    counts, _ = swing(10_000, 1.0)
    seen = Axis(axis, floating=True).run(counts).velocity
    period, kp = 1e-4, 2 * 2 * math.pi * axis.design.gains.bandwidth_hz
    ki = 0.25 * kp * kp
    position = velocity = 0.0
    expected = np.zeros(len(counts))
    for k, count in enumerate(counts[1:] - counts[0], 1):
        position += period * velocity
        error = count - position
        position += period * kp * error
        velocity += period * ki * error
        expected[k] = velocity * period
    # The position rounds some times a sample to float64's 53 bits of the distance covered.
    assert np.abs(seen - expected).max() <= 64 * 2.0**-53 * np.abs(counts).max()


def system(h: float):
    """Return the matrix of the states (lead, v) after a sample, and the column of the difference of counts."""
    return np.array([[1 - 2 * h, 1 - 2 * h], [-h * h, 1 - h * h]]), np.array([2 * h - 1, h * h])


def is_calm(h: Fraction) -> bool:
    """Return whether both poles are real, not negative, and below 1: by the signs of the polynomial alone.

    It is z^2 - s z + p: real poles by its discriminant, of one sign by p and of the sign of s, and both below 1 where
    the polynomial is positive at 1 and their product is below 1.
    """
    s, p = 2 - 2 * h - h * h, 1 - 2 * h
    return s * s > 4 * p and 0 <= p < 1 and s > 0 and 1 - s + p > 0


def test_every_word_is_a_stable_loop_that_does_not_oscillate():
    """The words of all axes are among those of the coarsest and the finest format, below 1/2."""
    for name in AXES:
        fmt = design(name).words[0].format
        assert all(is_calm(Fraction(word, 2**fmt.f)) for word in range(1, fmt.max + 1))
    coarsest = tracking_loop._format(INDEX_MAX)
    assert coarsest.to_real(coarsest.max) == INDEX_MAX < 0.5 <= INDEX_MAX + coarsest.lsb
    # Beyond the words: the first bandwidth that rings, and the first that is unstable.
    assert is_calm(Fraction(1, 2))
    assert not is_calm(Fraction(1, 2) + Fraction(1, 2**20))
    for h, stable in ((0.82842, True), (0.82843, False)):
        assert (np.abs(np.linalg.eigvals(system(h)[0])).max() < 1) == stable
    # The polynomial is that of the loop.
    for h in INDICES:
        assert np.poly(system(h)[0]) == pytest.approx([1, -(2 - 2 * h - h * h), 1 - 2 * h], abs=1e-14)


def rounding(h: float, reach: int, less: int) -> float:
    """Return the largest error at v from all floors, in LSB of lead."""
    a, d = system(h)

    def at_v(b):
        return norms(a, b, int(60 / h) + 200)[1]

    of_v = at_v(d) + at_v(np.array([0, 1])) * 2.0**-reach
    return of_v + at_v(np.array([2 * h, h * h])) * 2**less + at_v(np.array([2, h]))


def test_the_norms_are_those_of_the_module():
    reached, errors = [], []
    for h in INDICES:
        a, d = system(h)
        samples = int(60 / h) + 200
        response = impulse(a, d, samples)
        # The response of v is nowhere negative, up to the rounding of float64.
        assert response[1].min() > -1e-12
        assert np.abs(response[1]).sum() == pytest.approx(1)
        reached.append(h * (1 + np.abs(np.array([1, 1]) @ response).sum()))
        assert norms(a, np.array([2 * h, h * h]), samples)[1] <= h * (1 + 1e-9)
        assert norms(a, np.array([0, 1]), samples)[1] == pytest.approx(2 / h)
        # The formats are for a range of bandwidths, of which this one may be anywhere.
        for most in h * 2.0 ** np.arange(6):
            if most < 0.5:
                reach = max(math.ceil(math.log2(1 / most)) + 5, 1)
                errors.append(rounding(h, reach, math.ceil(math.log2(1 / most)) - 1))
    assert 0.95 * tracking_loop.LEAD_NORM < max(reached) <= tracking_loop.LEAD_NORM
    assert max(errors) <= tracking_loop.ERROR_NORM * (1 + 1e-9)
    # Their purpose: all errors together are less than half an LSB.
    assert tracking_loop.ERROR_NORM * 2.0**-tracking_loop.GUARD_BITS < 0.5


def test_the_range_of_a_design_is_that_of_the_module():
    for name in AXES:
        d = design(name)
        h = d.words[0].reset * d.words[0].format.lsb
        assert d.least == pytest.approx(h / 8, rel=2.0**-12)
        assert min(4 * h, INDEX_MAX) * (1 - 2.0**-12) <= d.most == d.words[0].si_max / d._hz
        assert d.most * 2.0 ** (d.lead.f - d.operand.f) < 1 <= d.least * 2.0 ** (d.v.f - d.lead.f) * (1 + 2.0**-12)


@pytest.mark.parametrize("share", [None, 30.0, 1.0], ids=["default", "30 Hz", "largest"])
@pytest.mark.parametrize("sample_hz", RATES)
def test_fixed_is_float_within_the_derived_bound(sample_hz, share):
    """On the paper's signal, rounding is within its norms; with the word's error it is within 1 % of the error."""
    widest = INDEX_MAX * sample_hz / (2 * math.pi)
    gains = None if share is None else Gains(share if share > 1 else widest)
    axis = axis_at("tracking-loop", sample_hz, gains=gains)
    d = axis.design.estimator
    counts, truth = swing(sample_hz, SECONDS[sample_hz])
    held = Axis(axis)
    fixed = held.run(counts)
    exact = Axis(axis, floating=True).run(counts)
    params = d.float_params(axis.design.gains, "u", {WORD: d.words[0].to_si(held.words[WORD])})
    _, as_rounded, _ = run(params, FLOAT_START, counts)

    errors = rounding(params.h, d.v.f - d.lead.f, d.lead.f - d.operand.f)
    assert np.abs(fixed.velocity * d.velocity.lsb - as_rounded).max() <= errors * d.lead.lsb + d.velocity.lsb / 2
    assert not fixed.flags.any()
    judged = slice(len(counts) // 5, None)
    own = rms((exact.velocity_m_per_s - truth)[judged])
    assert rms((fixed.velocity_m_per_s - exact.velocity_m_per_s)[judged]) <= 0.01 * own


@pytest.mark.parametrize("name", AXES)
def test_every_state_settles_to_the_exact_speed(name):
    """No limit cycle and no dead zone remains in the velocity, from any state and at any bandwidth of the range."""
    d, random = design(name), rng()
    for index in np.geomspace(d.least, d.most, 6):
        params = params_at(d, index)
        for n in (0, 1, -d.step_max):
            lead, v = (int(random.integers(-top, top + 1)) for top in (d.lead.max, params.v_max))
            state, _, _ = run(params, State(1, 0, lead, v), n * np.arange(1, int(80 / index) + 1000))
            state, velocity, flags = run(params, state, state.count + n * np.arange(1, 5001))
            assert (velocity == n << d.velocity.f).all()
            assert not flags.any()


@pytest.mark.parametrize("name", AXES)
def test_no_input_overflows(name):
    """The worst input for a state has the signs of its impulse response."""
    d = design(name)
    reached = 0.0
    for index in (d.least, math.sqrt(d.least * d.most), d.most):
        params = params_at(d, index)
        h = params.h * d.words[0].format.lsb
        states = impulse(*system(h), int(20 / h) + 100)
        lead = np.concatenate([[-1], np.array([1, 1]) @ states])
        for response in (lead, states[1]):
            worst = d.step_max * np.sign(response)[::-1].astype(np.int64)
            state, velocity, flags = run(params, START, np.cumsum([0, *worst]))
            assert not flags.any()
            assert np.abs(velocity).max() <= d.step_max << d.velocity.f
        # The last input is the last response's: v is at its largest.
        assert abs(state.v) * d.v.lsb > 0.99 * d.step_max
        reached = max(reached, h * np.abs(lead).sum() * d.step_max)
    # The range of lead is used to the next power of two.
    assert reached / d.least * 2 ** (d.lead.f + 3) > d.lead.max


def test_the_largest_step_and_a_change_of_bandwidth():
    """A jump of the count acts as a step of `step_max` with a flag; a new bandwidth makes no step at constant speed."""
    d = design("mhz")
    params = params_at(d, d.least)
    state, velocity, flags = run(params, START, [0] * 5 + [1 << (d.count_width - 2)] * 50_000)
    assert flags.tolist() == [0] * 5 + [1] + [0] * 49_999
    assert 0 < np.abs(velocity).max() <= d.step_max << d.velocity.f
    assert velocity[-1] == 0
    state, velocity, _ = run(params, state, state.count + np.arange(1, 50_000))
    for index in (d.most, d.least, 4 * d.least):
        state, velocity, flags = run(params_at(d, index), state, state.count + np.arange(1, 20_000))
        assert (velocity == 1 << d.velocity.f).all()
        assert not flags.any()
    # With the word 0 the velocity is held, and the position runs out of its range.
    _, velocity, flags = run(d.params({WORD: 0}), state, [state.count] * 20_000)
    assert (velocity == 1 << d.velocity.f).all()
    assert flags[-1] == 0b010


def test_a_step_of_speed_is_met_without_overshoot_and_a_constant_acceleration_late():
    axis = axis_at("tracking-loop", 1_000_000)
    d, w = axis.design.estimator, 2 * math.pi * axis.design.gains.bandwidth_hz
    params = d.float_params(axis.design.gains, "u", {})
    time = np.arange(20_000) * 1e-6
    _, velocity, _ = run(params, FLOAT_START, 2 * np.arange(20_000))
    assert (np.diff(velocity) > -1e-12).all()
    assert velocity.max() <= 2 + 1e-9
    # Settled to 1 %: (1 + w t) exp(-w t) = 0.01.
    assert time[np.argmax(velocity > 1.98)] * w == pytest.approx(6.64, rel=0.02)
    # Counts of 2e6 t^2: a velocity of 4 t counts a sample, 2 / w seconds late but for a sample.
    _, velocity, _ = run(params, FLOAT_START, np.round(2e6 * time**2).astype(np.int64))
    late = (4 * time - velocity)[-5000:].mean() / 4
    assert late == pytest.approx(2 / w, rel=0.01)


def test_start_and_restart_make_no_transient():
    d = design("paper")
    rows = [(-777_777, 0, *reset_words(d))] * 50 + [(123_456, 1, *reset_words(d))] * 2 + [(123_456, 0, *reset_words(d))]
    seen = model(d, rows, START)
    assert not seen["velocity"].any()
    assert not seen["saturated"].any()


def test_default_bandwidth_has_half_the_minimax_window_for_delay():
    axis = spec("mhz", "tracking-loop")
    delay = 2 / (2 * math.pi * Gains.default(axis).bandwidth_hz)
    assert delay == pytest.approx(math.sqrt(axis.count_m / axis.acceleration_max_m_per_s2))
    # Below some 14 kHz it is the largest that the words hold.
    slow = axis_at("tracking-loop", 500)
    assert Gains.default(slow).bandwidth_hz == slow.design.estimator.bandwidth_max_hz
    assert slow.design.estimator.bandwidth_max_hz == pytest.approx(500 / (4 * math.pi), rel=2.0**-15)
    # A host sets a bandwidth in Hz.
    host = Axis(axis, floating=True, **{WORD: 300.0})
    other = Axis(axis_at("tracking-loop", 1_000_000, gains=Gains(300.0)), floating=True)
    assert host.params.estimator.h == pytest.approx(other.params.estimator.h)


@pytest.mark.parametrize("bandwidth_hz", [-1.0, math.nan, math.inf, 0.0, 796.0, 1e-12, "1"])
def test_a_bandwidth_that_cannot_be_held_is_refused(bandwidth_hz):
    with pytest.raises((TypeError, ValueError), match=r"^bandwidth_hz must be .*, not "):
        Design(spec("paper", "tracking-loop"), Gains(bandwidth_hz))


@pytest.mark.parametrize("name", AXES)
def test_the_ends_of_the_range_are_accepted_and_beyond_them_it_is_told(name):
    axis, d = spec(name, "tracking-loop"), design(name)
    for bandwidth_hz in (d.bandwidth_min_hz, d.bandwidth_max_hz):
        accepted = Design(axis, Gains(bandwidth_hz))
        assert accepted.velocity.f >= 0
        assert accepted.words[0].to_si(accepted.words[0].reset) == pytest.approx(bandwidth_hz, rel=2.0**-12)
    told = f"^bandwidth_hz must be {d.bandwidth_min_hz:g} to {d.bandwidth_max_hz:g} at these rates, not "
    for bandwidth_hz in (0.99 * d.bandwidth_min_hz, 1.01 * d.bandwidth_max_hz):
        with pytest.raises(ValueError, match=told.replace("+", r"\+")):
            Design(axis, Gains(bandwidth_hz))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("name", [*AXES, "widest"])
def test_int64_holds_every_intermediate(name, share):
    """From the corners of the states, the kernel gives what Python's own integers give, at any design and word."""
    axis = WIDEST if name == "widest" else spec(name, "tracking-loop")
    least, most = (getattr(axis.design.estimator, f"bandwidth_{end}_hz") for end in ("min", "max"))
    d = Design(axis, Gains(least * (most / least) ** share))
    half, top = 1 << (d.count_width - 1), d.words[0].format.max
    for word, lead, v, count in product((0, 1, top), (-1, 1), (-1, 1), (-half, half - 1)):
        params = d.params({WORD: word})
        state = State(1, 0, lead * d.lead.max, v * params.v_max)
        exact = tracking_loop.step.py_func(params, state, seen_count(count), 0)
        assert tracking_loop.step(params, state, seen_count(count), 0) == exact
        # What the kernel passes on must fit, too.
        assert abs(params.h * state.lead) >> d.lead.f - d.operand.f < 1 << 62
        assert abs(exact[0].v) <= params.v_max
        assert abs(exact[0].lead) <= d.lead.max


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
