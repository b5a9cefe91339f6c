"""FDM and Butterworth low pass: RTL against model, model against exact rationals and scipy, word lengths as derived."""

import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from filters import SECONDS, equals, impulse, norms, rms, run, starts_afresh
from scipy.signal import butter, sosfilt

from hardwall.hdl.estimators.butterworth import Estimator
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators import butterworth
from hardwall.model.estimators.butterworth import CUTOFF_MAX, FLOAT_START, START, Design, Gains, State, coefficients
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, rng, simulate
from hardwall.testing.estimators import follow, model, reset_words
from stimuli.lengths import some_of
from stimuli.papers_signal import RATES, axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import spec


def design(name: str) -> Design:
    return spec(name, "butterworth").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def words(d: Design, cutoff_hz: float) -> dict[str, int]:
    si = d.words_for(cutoff_hz)
    return {word.name: word.from_si(si[word.name]) for word in d.words}


def stimulus(name: str, samples: int):
    """Yield rows that visit a track, full swings, the wrap of the count, every exponent and the ends of the words."""
    d, random = design(name), seeded()
    half = 1 << (d.count_width - 1)
    top = [word.format.max for word in d.words]
    lowest, highest = (list(words(d, hz).values()) for hz in (d.cutoff_min_hz, d.cutoff_max_hz))
    reset = reset_words(d)
    # A standstill at any count, from the first sample on.
    for _ in range(20):
        yield half - 1, 0, *reset
    # A smooth motion through the wrap of the count.
    turn = min(1.0, d.step_max / half) / 2
    for k in range(samples // 4):
        count = math.floor(half * (1 + 0.5 * math.sin(k * turn)) + random.random())
        yield count, 0, *reset
    # Full swings, the worst case for overflow at some cutoff; at the ends of the cutoff and of the words.
    for period in (1, 2, 3, 7, 50):
        for chosen in (reset, lowest, highest, top, [0, *top[1:]], [top[0], 0, 0]):
            for k in range(samples // 200):
                yield (-half, half // 2 - 1, half - 1)[k // period % 3], 0, *chosen
    # A random walk with jumps and restarts, with words that belong to a cutoff and words that belong to none.
    count, chosen = 0, reset
    for _ in range(samples // 2):
        jump = random.random() < 0.01
        count += random.randrange(-half, half) if jump else random.randint(-d.step_max, d.step_max)
        if random.random() < 0.02:
            cutoff = d.cutoff_max_hz * (d.cutoff_min_hz / d.cutoff_max_hz) ** random.random()
            anything = [random.randint(0, most) for most in top]
            chosen = anything if random.random() < 0.2 else list(words(d, cutoff).values())
        yield count, int(random.random() < 0.002), *chosen


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    samples = SAMPLES if name == "mhz" else SAMPLES // 5
    expected = await follow(dut, make(name), stimulus(name, samples), START)
    # The campaign must reach every saturation, and the quiet track too.
    assert {0b000, 0b001, 0b010, 0b011, 0b100, 0b111} <= set(expected["saturated"].tolist())


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    d = design(**parameters())
    await starts_afresh(dut, make(**parameters()), words(d, d.cutoff_max_hz))


@pytest.mark.parametrize("name", some_of(["mhz", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: Design, rows):
    """Yield the outputs of the module's equations in exact rationals, rounded only where the module documents it."""
    fine, coarse, out = (Fraction(1, 2**fmt.f) for fmt in (d.state, d.operand, d.velocity))
    most, modulus, half = d.velocity.max * out, 2**d.count_width, 2 ** (d.count_width - 1)
    last = d1 = d2 = w = y = None
    for count, restart, frequency, damping, exponent in rows:
        scale = 2**15 * 16 ** min(exponent, d.exponent_max)
        gamma, beta = Fraction(frequency, scale), Fraction(damping, scale)
        if last is None or restart:
            last, d1, d2, w, y = count, 0, 0, Fraction(0), Fraction(0)
        moved = (count - last + half) % modulus - half
        step = max(-d.step_max, min(d.step_max, moved))
        x = Fraction(step + 2 * d1 + d2, 4)
        far_w = w + gamma * (x - y // coarse * coarse) // fine * fine - beta * (w // coarse * coarse) // fine * fine
        w = max(-most, min(most, far_w))
        far_y = y + gamma * (w // coarse * coarse) // fine * fine
        y = max(-most, min(most, far_y))
        last, d1, d2 = count, step, d1
        unstable = 2 * beta + gamma >= 4 or 2 * beta + 3 * gamma >= 6
        yield math.floor(y / out + Fraction(1, 2)), (step != moved) | (w != far_w or y != far_y) << 1 | unstable << 2


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    equals(oracle, design(name), stimulus(name, 8_000), START)


@pytest.mark.parametrize("sample_hz", RATES)
@pytest.mark.parametrize("ratio", [30.0, None, 0.1, CUTOFF_MAX], ids=["30 Hz", "default", "0.1 fs", "0.4 fs"])
def test_the_algorithm_is_scipys(sample_hz, ratio):
    """Both filter a random walk of the count, from rest."""
    gains = None if ratio is None else Gains(ratio if ratio > 1 else ratio * sample_hz)
    axis = axis_at("butterworth", sample_hz, gains=gains)
    steps = rng().integers(-1, 2, 20_000)
    seen = Axis(axis, floating=True).run(np.cumsum(steps)).velocity
    cutoff = axis.design.gains.cutoff_hz
    expected = sosfilt(butter(2, cutoff, fs=sample_hz, output="sos"), [0, *steps[1:]])
    # SciPy's direct form rounds numbers of the size 1/gamma^2 in float64, as the module says; 8 covers its operations.
    gamma = coefficients(cutoff / sample_hz)[0]
    assert np.abs(seen - expected).max() <= 8 * 2.0**-53 * max(gamma**-2, 1) * max(np.abs(expected).max(), 1) + 1e-14


def system(gamma: float, beta: float):
    """Return the matrix of the states (w, y), and the columns by which the input x and the errors enter them."""
    a = np.array([[1 - beta, -gamma], [gamma * (1 - beta), 1 - gamma**2]])
    in_w, in_y = np.array([1, gamma]), np.array([0, 1])
    return a, gamma * in_w, in_w, in_y


def rounding(gamma: float, beta: float):
    """Return the norms at y of an operand LSB and of an accumulator LSB, with the worst error of every floor."""
    a, x, in_w, in_y = system(gamma, beta)
    samples = int(40 / gamma) + 200
    # An error of the operand w enters y at once, and enters w a sample later, times beta.
    shared = gamma + norms(a, gamma * a @ in_y - beta * in_w, samples)[1]
    # The floors of push and drag have opposite signs.
    return shared + norms(a, x, samples)[1], norms(a, in_w, samples)[1] + norms(a, in_y, samples)[1]


CUTOFFS = np.concatenate([np.geomspace(3e-6, CUTOFF_MAX, 40), np.linspace(0.1, CUTOFF_MAX, 40)])


def test_the_norms_are_those_of_the_module():
    largest = np.zeros(3)
    for ratio in CUTOFFS:
        gamma, beta = coefficients(ratio)
        a, x, *_ = system(gamma, beta)
        response = impulse(a, x, int(40 / gamma) + 200)
        blurred = np.abs([np.convolve(state, [0.25, 0.5, 0.25]) for state in response]).sum(1)
        operand, product = rounding(gamma, beta)
        largest = np.maximum(largest, [blurred.max(), operand, product / max(1 / gamma, 2)])
    bounds = np.array([butterworth.STATE_NORM, butterworth.OPERAND_NORM, butterworth.PRODUCT_NORM])
    assert (largest <= bounds).all()
    assert (largest > 0.95 * bounds).all()
    # Their purpose: all errors together are less than half an LSB, for 2**reach >= max(1/gamma, 2).
    assert (bounds[1] + bounds[2]) * 2.0**-butterworth.GUARD_BITS < 0.5


@pytest.mark.parametrize("cutoff", ["30 Hz", "default", "0.4 fs"])
@pytest.mark.parametrize("sample_hz", RATES)
def test_fixed_is_float_within_the_derived_bound(sample_hz, cutoff):
    """On the paper's signal, rounding is within its norms; with coefficients' errors it is within 1 % of the error."""
    gains = {"30 Hz": Gains(30.0), "default": None, "0.4 fs": Gains(CUTOFF_MAX * sample_hz)}[cutoff]
    axis = axis_at("butterworth", sample_hz, gains=gains)
    d = axis.design.estimator
    counts, truth = swing(sample_hz, SECONDS[sample_hz])
    held = Axis(axis)
    fixed = held.run(counts)
    exact = Axis(axis, floating=True).run(counts)
    rounded = {word.name: word.to_si(held.words[word.name]) for word in d.words}
    params = d.float_params(axis.design.gains, "u", rounded)
    _, as_rounded, _ = run(params, FLOAT_START, counts)

    operand, product = rounding(params.gamma, params.beta)
    bound = operand * d.operand.lsb + product * d.state.lsb + d.velocity.lsb / 2
    assert np.abs(fixed.velocity * d.velocity.lsb - as_rounded).max() <= bound
    assert not fixed.flags.any()
    judged = slice(len(counts) // 5, None)
    own = rms((exact.velocity_m_per_s - truth)[judged])
    assert rms((fixed.velocity_m_per_s - exact.velocity_m_per_s)[judged]) <= 0.01 * own


@pytest.mark.parametrize("floating", [False, True])
def test_figure_2_at_its_crossing(floating):
    axis = axis_at("butterworth", 10_000, gains=Gains(1e3))
    counts, truth = swing(10_000, 5.0)
    error = (Axis(axis, floating=floating).run(counts).velocity_m_per_s - truth)[10_000:]
    assert rms(error) == pytest.approx(0.621e-3, rel=0.01)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_every_state_settles_to_the_exact_speed(name):
    """No limit cycle and no dead zone remains in the velocity, from any state and at any cutoff."""
    d, random = design(name), rng()
    for cutoff in np.geomspace(d.cutoff_min_hz, d.cutoff_max_hz, 8):
        params = d.params(words(d, cutoff))
        gamma = coefficients(cutoff / d._sample_hz)[0]
        settled = int(60 / min(gamma, 1)) + 1000
        for n in (0, 1, -d.step_max):
            w, y = random.integers(-params.state_max, params.state_max + 1, 2).tolist()
            state, _, _ = run(params, State(1, 0, d.step_max, -d.step_max, w, y), n * np.arange(1, settled))
            state, velocity, flags = run(params, state, state.count + n * np.arange(1, 1001))
            assert (velocity == n << d.velocity.f).all()
            assert not flags.any()


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_no_input_overflows(name):
    """The worst input for a state, the signs of its impulse response, at the ends of the cutoff and between."""
    d = design(name)
    reached = 0.0
    for cutoff in (d.cutoff_min_hz, 0.1 * d.cutoff_max_hz, d.cutoff_max_hz):
        params = d.params(words(d, cutoff))
        gamma, beta = coefficients(cutoff / d._sample_hz)
        a, x, *_ = system(gamma, beta)
        for response in impulse(a, x, int(20 / gamma) + 100):
            worst = np.sign(np.convolve(response, [0.25, 0.5, 0.25]))[::-1].astype(np.int64)
            state, _, flags = run(params, START, np.cumsum([0, *(d.step_max * worst)]))
            assert not flags.any()
            reached = max(reached, abs(state.w), abs(state.y))
    # The range of the states is used.
    assert reached > 0.97 * butterworth.STATE_NORM * d.step_max * 2**d.state.f


def test_the_largest_step_and_a_change_of_cutoff():
    """A jump of the count acts as a step of `step_max` with a flag; a new cutoff makes no step at constant speed."""
    d = design("mhz")
    params = d.params(words(d, d.cutoff_max_hz))
    state, velocity, flags = run(params, START, [0] * 5 + [1 << (d.count_width - 2)] * 50_000)
    assert flags.tolist() == [0] * 5 + [1] + [0] * 49_999
    assert np.abs(velocity).max() <= d.step_max << d.velocity.f
    assert velocity[-1] == 0
    state, velocity, _ = run(params, state, state.count + np.arange(1, 1000))
    for cutoff in (30.0, 1e5, d.cutoff_min_hz):
        state, velocity, flags = run(d.params(words(d, cutoff)), state, state.count + np.arange(1, 20_000))
        assert (velocity == 1 << d.velocity.f).all()
        assert not flags.any()


def test_start_and_restart_make_no_transient():
    d = design("paper")
    rows = [(-777_777, 0, *reset_words(d))] * 50 + [(123_456, 1, *reset_words(d))] * 2 + [(123_456, 0, *reset_words(d))]
    seen = model(d, rows, START)
    assert not seen["velocity"].any()
    assert not seen["saturated"].any()


def test_default_cutoff_has_half_the_minimax_window_for_delay():
    axis = spec("mhz", "butterworth")
    delay = math.sqrt(2) / (2 * math.pi * Gains.default(axis).cutoff_hz)
    assert delay == pytest.approx(math.sqrt(axis.count_m / axis.acceleration_max_m_per_s2))
    assert Gains.default(axis_at("butterworth", 500)).cutoff_hz == 200
    # A host sets a cutoff and reads it back.
    host = Axis(axis, floating=True, **axis.design.estimator.words_for(30.0))
    other = Axis(axis_at("butterworth", 1_000_000, gains=Gains(30.0)), floating=True)
    assert host.params.estimator[:2] == pytest.approx(other.params.estimator[:2])


@pytest.mark.parametrize("cutoff", [-1.0, math.nan, math.inf, 0.0, 4001.0, 1e-12, "1"])
def test_a_cutoff_that_cannot_be_held_is_refused(cutoff):
    with pytest.raises((TypeError, ValueError), match=r"^cutoff_hz must be .*, not "):
        Design(spec("paper", "butterworth"), Gains(cutoff))
    if isinstance(cutoff, float):
        with pytest.raises(ValueError, match=r"^cutoff_hz must be .* to .*, not "):
            design("paper").words_for(cutoff)


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
