"""Adaptive windowing: RTL against model, model against the published algorithm in exact rationals."""

import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.foaw import Estimator
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators import foaw
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, rng, simulate
from hardwall.testing.estimators import follow, model, reset_words
from stimuli.lengths import some_of
from stimuli.papers_signal import RATES, axis_at, piece
from stimuli.seeded import seeded
from stimuli.specs import spec

WINDOWS = {"mhz": None, "narrow": 750e-6, "paper": 3.0}
"""Windows in s, or None for the default; 750 us have an odd number of samples from tap to tap, and 3 s at 10 kHz are
more samples than the memory holds."""


def design(name: str) -> foaw.Design:
    axis, seconds = spec(name, "foaw"), WINDOWS[name]
    return foaw.Design(axis, foaw.Gains(1.0, seconds) if seconds else foaw.Gains.default(axis))


def make(name: str) -> Estimator:
    return Estimator(design(name))


def stimulus(name: str, samples: int):
    """Yield (count, restart, output, band, window): lines and parabolas, the worst signs, extreme words, wraps."""
    d, random = design(name), seeded()
    half, fast = 1 << (d.count_width - 1), d.history.change.max
    _, reset_band, reset_window = reset_words(d)
    # Parabolas: windows of every length, through the wrap of the count.
    reach = d.spacing * d.history.every * foaw.TAPS
    t = np.arange(samples // 4)
    bends = half + 40 * reach / foaw.TAPS * np.sin(t / reach * 3) + fast * t / 8
    for k, count in enumerate(np.floor(bends).astype(np.int64).tolist()):
        yield count, 0, k >> 3 & 1, reset_band, reset_window
    # The largest speeds and larger ones, in both directions, also one after the other within a window; and standstill.
    count = 0
    for way in (fast, -fast, fast + 1, -fast - 1, 0, 1, -1):
        for k in range(samples // 28):
            count += way
            yield count, 0, k & 1, (0, reset_band, foaw.BAND.max)[k // 2 % 3], (15, reset_window, 1, 0)[k // 7 % 4]
    # A whole window of the largest speed, where it takes longer than that; the sums are the largest then.
    for _ in range(reach + d.spacing if samples // 28 < reach < samples else 0):
        count += fast
        yield count, 0, 1, foaw.BAND.max, 15
    for k in range(samples // 8):
        count += fast if k // max(reach // 5, 1) % 2 else -fast
        yield count, 0, k & 1, foaw.BAND.max, reset_window
    # A count that was left for one sample, alone in the window: where that is a tap's, limits are met exactly.
    for k in range(samples // 8):
        yield count - (k % (reach + 1) == 0), 0, k & 1, reset_band, reset_window
    for _ in range(samples - samples // 4 - samples // 28 * 7 - samples // 8 * 2):
        count += random.randrange(-half, half) if random.random() < 0.01 else random.randint(-1, 1)
        given = random.random() < 0.3
        band = random.randint(0, foaw.BAND.max) if given else reset_band
        window = random.randrange(16) if given else reset_window
        yield count, int(random.random() < 0.002), random.randrange(2), band, window


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    samples = SAMPLES // 10 if parameters()["name"] == "narrow" else SAMPLES
    expected = await follow(dut, component, stimulus(parameters()["name"], samples), component.design.start())
    assert set(expected["saturated"].tolist()) == {0, 1}
    assert expected["velocity"].max() > 0 > expected["velocity"].min()


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    component = make(**parameters())
    bench, d = Bench(dut, component), component.design
    words = {word.name: word.reset for word in d.words}
    tap = d.spacing * d.history.every
    await bench.reset()
    for count in range(2 * tap):
        await bench.transact("strobe", "valid", seen__count=count, **words)
    assert bench.reader("velocity")() != 0
    await bench.reset()
    for _ in range(tap + 1):
        await bench.transact("strobe", "valid", seen__count=-1, **words)
        assert bench.reader("velocity")() == 0


@pytest.mark.parametrize("name", some_of(WINDOWS, 0, 1))
def test_rtl(name):
    simulate(__file__, make, name=name)


def published(positions: list[int], k: int, tap: int, band: int, longest: int, best: bool):
    """Return (slope in counts a tap, window) by the published algorithm, which checks every sample at every step.

    The band is in quarter counts. Distances from the line through the ends of n taps are n times as large, thus whole.
    """
    at = [positions[k - i * tap] if k > i * tap else 0 for i in range(longest + 1)]
    window = 1
    for n in range(2, longest + 1):
        if any(4 * abs(i * at[n] + (n - i) * at[0] - n * at[i]) > n * band for i in range(n + 1)):
            break
        window = n
    if not best:
        return Fraction(at[0] - at[window], window), window
    # The distances of the taps from the window's middle, twice as large.
    moment = sum((window - 2 * i) * at[i] for i in range(window + 1))
    return Fraction(2 * moment, sum((window - 2 * i) ** 2 for i in range(window + 1))), window


def oracle(d: foaw.Design, rows):
    """Yield velocity, flag and window of every row, from lists of plain integers."""
    half, most, every = 1 << (d.count_width - 1), d.history.change.max, d.history.every
    tap = d.spacing * every
    positions, last, velocity, window = [], None, 0, 1
    for count, restart, output, band, longest in rows:
        limited = 0
        if restart or last is None:
            positions = [0]
        else:
            moved = (count - last + half) % (2 * half) - half
            positions.append(positions[-1] + max(-most, min(moved, most)))
            limited = int(abs(moved) > most)
        last = count
        k = len(positions) - 1
        if k % every == 0:
            most_taps = min(max(longest, 1), foaw.TAPS)
            slope, window = published(positions, k, tap, band, most_taps, bool(output))
            velocity = int(slope / tap * 2**d.velocity.f)
        yield velocity, limited, window


@pytest.mark.parametrize("name", WINDOWS)
def test_model_is_the_published_algorithm(name):
    d = design(name)
    half = 1 << (d.count_width - 1)
    rows = [((c + half) % (2 * half) - half, *rest) for c, *rest in stimulus(name, 12_000)]
    seen = model(d, rows, d.start())
    windows = set()
    for k, (velocity, flags, window) in enumerate(oracle(d, rows)):
        assert (velocity, flags) == (seen["velocity"][k], seen["saturated"][k]), f"sample {k}: {rows[k]}"
        windows.add(window)
    if name == "mhz":
        assert windows == set(range(1, foaw.TAPS + 1))


@pytest.mark.parametrize("output", [0, 1])
@pytest.mark.parametrize("rate_hz", RATES)
def test_fixed_point_costs_less_than_an_lsb_and_a_hundredth_of_the_error(rate_hz, output):
    axis, (counts, exact) = axis_at("foaw", rate_hz), piece(rate_hz)
    floating, fixed = (Axis(axis, way, foaw_output=output).run(counts).velocity_m_per_s for way in (True, False))
    lsb = axis.design.estimator.velocity.lsb * axis.velocity_unit_m_per_s
    assert np.abs(fixed - floating).max() < lsb * (1 + 1e-9)
    judged = slice(len(counts) // 5, None)
    error, rounding = floating[judged] - exact[judged], fixed[judged] - floating[judged]
    assert np.sqrt(np.mean(rounding**2)) <= 0.01 * np.sqrt(np.mean(error**2))


def test_a_uniform_motion_keeps_the_whole_window_with_a_band_of_one_count_and_no_less():
    d, random = design("mhz"), rng()
    _, band, longest = reset_words(d)
    n, kept = d.spacing * foaw.TAPS, {band: 0, band - 1: 0}
    for _ in range(50):
        speed, start = random.uniform(-1, 1, 2)
        counts = np.floor(start + speed * np.arange(n + 1)).astype(np.int64).tolist()
        for quarters in kept:
            velocity = model(d, [(count, 0, 0, quarters, longest) for count in counts], d.start())["velocity"][-1]
            kept[quarters] += velocity == int(Fraction(counts[-1] - counts[0] << d.velocity.f, n))
    assert band == 1 << foaw.BAND.f
    assert kept[band] == 50
    assert kept[band - 1] < 50


@pytest.mark.parametrize("output", [0, 1])
def test_standing_still_is_exactly_zero_after_the_window(output):
    d = design("mhz")
    _, *words = reset_words(d)
    n = d.spacing * foaw.TAPS
    rows = [(count, 0, output, *words) for count in [0, 1] + [1] * (n + 5)]
    velocity = model(d, rows, d.start())["velocity"]
    assert velocity[0] == 0
    assert velocity[1] > 0
    assert (velocity[n + 1 :] == 0).all()


@pytest.mark.parametrize("output", [0, 1])
def test_a_start_or_restart_in_motion_never_overshoots(output):
    d = design("mhz")
    _, *words = reset_words(d)
    n = d.spacing * foaw.TAPS
    rows = [(100_000 + k, int(k == 3 * n), output, *words) for k in range(5 * n)]
    velocity = model(d, rows, d.start())["velocity"] * d.velocity.lsb
    for first in (0, 3 * n):
        assert velocity[first] == 0
        assert (velocity[first : first + n] >= 0).all()
        assert velocity[first : first + n].max() <= 1
        # After a tap, D_1 = T, so D_n >= n (T - d) for a window that passes, and so D_i >= i (T - 2 d) for the taps
        # within. In the best fit, the weights of a tap's distance i add up to 1, those above zero to less than 1.5.
        least = 1 - (3 if output else 1) * foaw.BAND_COUNTS / d.spacing - d.velocity.lsb
        assert (velocity[first + d.spacing : first + 2 * n] >= least).all()


@pytest.mark.parametrize("output", [0, 1])
def test_nothing_drifts_in_long_runs_at_the_ends(output):
    axis = spec("mhz", "foaw")
    d, k = axis.design.estimator, np.arange(1_000_000)
    n = d.spacing * foaw.TAPS
    for speed in (d.history.change.max, -d.history.change.max):
        record = Axis(axis, foaw_output=output).run(k * speed)
        assert (record.velocity[n:] == speed << d.velocity.f).all()
        assert record.design.flag_names(int(record.flags[-1])) == ["count_wrapped"]
    # One count in many windows: every count appears once and is then forgotten.
    slow = Axis(axis, foaw_output=output).run(k // 5000).velocity
    assert slow.min() == 0
    assert (slow.reshape(-1, 5000)[:, n:] == 0).all()
    assert (slow.reshape(-1, 5000)[1:, 0] > 0).all()


@pytest.mark.parametrize(
    ("gains", "named"),
    [
        ((-0.1, 1e-3), "band_counts must be 0 to 15.75, not -0.1"),
        ((16.0, 1e-3), "band_counts must be 0 to 15.75, not 16.0"),
        ((1.0, 0.0), "window_s must be 1e-30 to 1e\\+30, not 0.0"),
        ((1.0, math.nan), "window_s must be 1e-30 to 1e\\+30, not nan"),
        ((1.0, 1e9), "window_s must be more than 0 and at most .* at these rates, not"),
    ],
)
def test_gains_that_cannot_be_held_are_refused(gains, named):
    with pytest.raises(ValueError, match=f"^{named}"):
        foaw.Design(spec("paper"), foaw.Gains(*gains))


def test_words_at_run_time_reach_both_algorithms():
    axis = spec("mhz", "foaw")
    counts = (3000 * np.sin(np.arange(20_000) / 3000)).astype(np.int64)
    lsb, runs = axis.design.estimator.velocity.lsb, []
    for si in ({}, {"foaw_band": 2e-6}, {"foaw_window": 200e-6}):
        floating, fixed = (Axis(axis, way, **si).run(counts).velocity for way in (True, False))
        assert np.abs(floating - fixed * lsb).max() < lsb * (1 + 1e-9)
        runs.append(fixed.tolist())
    assert runs[0] != runs[1] != runs[2] != runs[0]


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
