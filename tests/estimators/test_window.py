"""The windowed difference: RTL against model, model against exact rationals, and the error it guarantees."""

import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.window import Estimator
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators import window
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, rng, simulate
from hardwall.testing.estimators import follow, model, reset_words
from stimuli.lengths import some_of
from stimuli.papers_signal import RATES, axis_at, piece
from stimuli.seeded import seeded
from stimuli.specs import spec

WINDOWS = {"mhz": None, "narrow": None, "paper": 3.0}
"""Windows in s, or None for the default; 3 s at 10 kHz are more samples than the memory holds."""


def design(name: str) -> window.Design:
    axis, seconds = spec(name, "window"), WINDOWS[name]
    return window.Design(axis, window.Gains(seconds) if seconds else window.Gains.default(axis))


def make(name: str) -> Estimator:
    return Estimator(design(name))


def stimulus(name: str, samples: int):
    """Yield (count, restart, length): smooth motion, the worst signs, every length, wraps, jumps, restarts."""
    d, random = design(name), seeded()
    half, fast, top = 1 << (d.count_width - 1), d.history.change.max, d.history.age_max
    (reset,) = reset_words(d)
    pace = min(1, fast / half) / 2
    for k in range(samples // 4):
        yield math.floor(half * (1 + 0.5 * math.sin(k * pace)) + random.random()), 0, reset
    # The largest speeds and larger ones, in both directions, for longer than any short window; and a standstill.
    count = 0
    for way in (fast, -fast, fast + 1, -fast - 1, 0, 1, -1):
        for k in range(samples // 28):
            count += way
            yield count, 0, (top, reset, 1, 0)[k // 7 % 4]
    for _ in range(samples - samples // 4 - samples // 28 * 7):
        count += random.randrange(-half, half) if random.random() < 0.01 else random.randint(-fast - 1, fast + 1)
        length = random.randint(0, top) if random.random() < 0.5 else reset
        yield count, int(random.random() < 0.002), length


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    samples = SAMPLES if parameters()["name"] == "mhz" else SAMPLES // 10
    expected = await follow(dut, component, stimulus(parameters()["name"], samples), component.design.start())
    assert set(expected["saturated"].tolist()) == {0, 1}
    assert expected["velocity"].max() > 0 > expected["velocity"].min()


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    component = make(**parameters())
    bench, (length,) = Bench(dut, component), reset_words(component.design)
    await bench.reset()
    for count in range(3 * component.design.history.every):
        await bench.transact("strobe", "valid", seen__count=count, window_length=length)
    assert bench.reader("velocity")() != 0
    await bench.reset()
    for _ in range(component.design.history.every + 1):
        await bench.transact("strobe", "valid", seen__count=-1, window_length=length)
        assert bench.reader("velocity")() == 0


@pytest.mark.parametrize("name", some_of(WINDOWS, 0, 1))
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: window.Design, rows):
    """Yield the outputs of the module's equations on lists of plain integers and exact rationals."""
    half, most, every = 1 << (d.count_width - 1), d.history.change.max, d.history.every
    positions, last, velocity = [], None, 0
    for count, restart, length in rows:
        limited = 0
        if restart or last is None:
            positions = [0]
        else:
            moved = (count - last + half) % (2 * half) - half
            positions.append(positions[-1] + max(-most, min(moved, most)))
            limited = int(abs(moved) > most)
        last = count
        k, n = len(positions) - 1, max(length, 1) * every
        if k % every == 0:
            change = positions[k] - (positions[k - n] if k > n else 0)
            velocity = int(Fraction(change << d.velocity.f, n))
        yield velocity, limited


@pytest.mark.parametrize("name", WINDOWS)
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    half = 1 << (d.count_width - 1)
    rows = [((c + half) % (2 * half) - half, *rest) for c, *rest in stimulus(name, 40_000)]
    seen = model(d, rows, d.start())
    assert list(oracle(d, rows)) == list(zip(seen["velocity"].tolist(), seen["saturated"].tolist(), strict=True))


@pytest.mark.parametrize("rate_hz", RATES)
def test_fixed_point_costs_less_than_an_lsb_and_a_hundredth_of_the_error(rate_hz):
    axis, (counts, exact) = axis_at("window", rate_hz), piece(rate_hz)
    floating, fixed = (Axis(axis, floating).run(counts).velocity_m_per_s for floating in (True, False))
    lsb = axis.design.estimator.velocity.lsb * axis.velocity_unit_m_per_s
    assert np.abs(fixed - floating).max() < lsb * (1 + 1e-9)
    judged = slice(len(counts) // 5, None)
    error, rounding = floating[judged] - exact[judged], fixed[judged] - floating[judged]
    assert np.sqrt(np.mean(rounding**2)) <= 0.01 * np.sqrt(np.mean(error**2))


@pytest.mark.parametrize("rate_hz", RATES)
def test_the_error_is_within_the_guaranteed_bound(rate_hz):
    """The bound holds on the paper's signal, and on the parabola that attains it except for the rounding of counts."""
    axis, (counts, exact) = axis_at("window", rate_hz), piece(rate_hz)
    d, c = axis.design.estimator, axis.acceleration_max_m_per_s2 / axis.count_m / rate_hz**2
    (word,) = d.words
    n = word.reset * d.history.every
    bound = c * (n / 2 + d.history.every - 1) + 2 * window.EPS_COUNTS / n + d.velocity.lsb
    velocity = Axis(axis).run(counts).velocity * d.velocity.lsb
    assert np.abs(velocity - exact / axis.velocity_unit_m_per_s)[n:].max() <= bound
    # The parabola lasts as long as the speed is within its range, and at most 20 windows.
    k = np.arange(int(min(axis.speed_max_counts_per_sample / c, 20 * n)) + 1)
    parabola = np.floor(c * k**2 / 2).astype(np.int64)
    error = np.abs(Axis(axis).run(parabola).velocity * d.velocity.lsb - c * k)[n:].max()
    assert c * n / 2 <= error <= bound
    # The default window is the minimax one, so no other length promises a smaller error; the bound is its minimum.
    lengths = np.array([max(n - 1, 1), n, n + 1])
    promised = c * lengths / 2 + 2 * window.EPS_COUNTS / lengths
    if d.history.every == 1:
        assert promised.argmin() == min(n - 1, 1) or promised[1] <= promised.min() * (1 + 1 / n**2)
    if n > 50:
        assert promised[1] == pytest.approx(2 * math.sqrt(c * window.EPS_COUNTS), rel=1e-3)


def test_standing_still_is_exactly_zero_after_the_window_and_not_before():
    d = design("mhz")
    (n,) = reset_words(d)
    velocity = model(d, [(count, 0, n) for count in [0, 1] + [1] * (n + 5)], d.start())["velocity"]
    assert velocity[0] == 0
    assert (velocity[1 : n + 1] >= 1 << window.ROUNDING_BITS).all()
    assert (velocity[n + 1 :] == 0).all()


def test_a_start_or_restart_in_motion_rises_from_zero_without_a_transient():
    d = design("mhz")
    (n,) = reset_words(d)
    rows = [(100_000 + k, int(k == 3 * n), n) for k in range(5 * n)]
    velocity = model(d, rows, d.start())["velocity"] * d.velocity.lsb
    for first in (0, 3 * n):
        rise = velocity[first : first + n + 1]
        assert rise[0] == 0
        assert (np.diff(rise) > 0).all()
        assert rise[-1] == 1
    assert (velocity[n : 3 * n] == 1).all()


def test_nothing_drifts_in_long_runs_at_the_ends():
    """The fastest motion, past every wrap of count and position, and the slowest: the window forgets any sum."""
    axis = spec("mhz", "window")
    d, n = axis.design.estimator, axis.design.estimator.history.longest
    k = np.arange(2_000_000)
    for speed in (d.history.change.max, -d.history.change.max):
        record = Axis(axis).run(k * speed)
        assert (record.velocity[n:] == speed << d.velocity.f).all()
        assert record.design.flag_names(int(record.flags[-1])) == ["count_wrapped"]
    slow = Axis(axis).run(k // 1000).velocity
    one = (1 << d.velocity.f) // n
    assert set(slow.tolist()) == {0, one}
    assert abs(slow[1000:].mean() * n / (1 << d.velocity.f) - n / 1000) < 1e-2


@pytest.mark.parametrize(
    ("seconds", "named"),
    [
        (-1.0, "window_s must be 1e-30 to 1e\\+30, not -1.0"),
        (math.inf, "window_s must be 1e-30 to 1e\\+30, not inf"),
        (1e9, "window_s must be more than 0 and at most .* at these rates, not"),
    ],
)
def test_gains_that_cannot_be_held_are_refused(seconds, named):
    with pytest.raises(ValueError, match=f"^{named}"):
        window.Design(spec("paper"), window.Gains(seconds))


def test_the_length_at_run_time_is_that_of_the_design():
    axis = spec("mhz", "window")
    t = np.arange(20_000)
    counts = (3000 * np.sin(t / 3000)).astype(np.int64)
    given = Axis(axis, window_length=100e-6).run(counts)
    designed = model(design("mhz"), [(count, 0, 100) for count in counts.tolist()], design("mhz").start())
    assert given.velocity.tolist() == designed["velocity"].tolist()
    floating = Axis(axis, floating=True, window_length=100e-6).run(counts).velocity
    assert np.abs(floating - given.velocity * axis.design.estimator.velocity.lsb).max() < 2.0**-10


def test_lanes_are_independent():
    axis = spec("mhz", "window")
    counts = np.cumsum(rng().integers(-1, 3, (2, 5000)), axis=1)
    both = Axis(axis).run(counts).velocity
    for lane in range(2):
        assert both[lane].tolist() == Axis(axis).run(counts[lane]).velocity.tolist()


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
