"""The least-squares slope: RTL against model, model against exact rationals and numpy.polyfit, its guaranteed error."""

import math
from fractions import Fraction
from itertools import pairwise

import cocotb
import numpy as np
import pytest
from filters import equals, rms

from hardwall.hdl.estimators.least_squares import Estimator
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators import least_squares, window
from hardwall.model.estimators.least_squares import Gains, minimax_window_s, numbers, weights
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, rng, simulate
from hardwall.testing.estimators import follow, model
from stimuli.lengths import some_of
from stimuli.papers_signal import axis_at, piece
from stimuli.seeded import seeded
from stimuli.specs import MHZ, spec

FITS = {
    "mhz": None,
    "narrow": Gains(3, 4, 6e-6),
    "paper": Gains(2, 6, 3.0),
    "wide": Gains(3, 32, 40e-3),
}
"""Axes and their gains, or None for the default: a Taylor expansion, more samples than the memory holds, and the
widest sums."""
PUBLISHED = {
    (1, 2): "1 -1",
    (2, 3): "3/2 -2 1/2",
    (3, 4): "11/6 -3 3/2 -1/3",
    (1, 4): "3/10 1/10 -1/10 -3/10",
    (1, 5): "1/5 1/10 0 -1/10 -1/5",
    (2, 5): "27/35 -13/70 -4/7 -27/70 13/35",
}
"""Weights by order and points: backward differences of any table, and slopes at the end of a fit, worked by hand."""


def design(name: str) -> least_squares.Design:
    axis = spec(name, "least-squares")
    return least_squares.Design(axis, FITS[name] or Gains.default(axis))


def make(name: str) -> Estimator:
    return Estimator(design(name))


def stimulus(name: str, samples: int):
    """Yield (count, restart): smooth motion, the worst signs, standstill, wraps, jumps, restarts."""
    d, random = design(name), seeded()
    half, fast = 1 << (d.count_width - 1), d.history.change.max
    pace = min(1, fast / half) / 2
    for k in range(samples // 4):
        yield math.floor(half * (1 + 0.5 * math.sin(k * pace)) + random.random()), 0
    count = 0
    # The signs of the weights of changes, over again: the largest velocities of either sign, and partial sums beside.
    signs = worst(d, order(name)).tolist()
    for way in (fast, -fast, 0, fast + 1, -fast - 1, 1):
        for k in range(samples // 24):
            count += way * signs[k % len(signs)] if abs(way) == fast else way
            yield count, 0
    for _ in range(samples // 2):
        count += random.randrange(-half, half) if random.random() < 0.01 else random.randint(-fast - 1, fast + 1)
        yield count, int(random.random() < 0.002)


def order(name: str) -> int:
    return int(FITS[name].order) if FITS[name] else 1


def worst(d: least_squares.Design, degree: int) -> np.ndarray:
    """Return the signs of the changes, a sample at a time, that lead to the largest velocity."""
    partial = np.cumsum([float(weight) for weight in weights(degree, d.taps + 1)])[:-1]
    return np.repeat(np.sign(partial)[::-1].astype(np.int64), period(d))


def period(d: least_squares.Design) -> int:
    """Return T, samples."""
    return d.spacing * d.history.every


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    # The window of the paper's axis has more samples than the short campaigns.
    samples = SAMPLES // {"mhz": 4, "paper": 1}.get(parameters()["name"], 10)
    expected = await follow(dut, component, stimulus(parameters()["name"], samples), component.design.start())
    assert set(expected["saturated"].tolist()) == {0, 1}
    assert expected["velocity"].max() > 0 > expected["velocity"].min()


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    component = make(**parameters())
    bench = Bench(dut, component)
    await bench.reset()
    every = component.design.history.every
    for count in range(3 * every):
        await bench.transact("strobe", "valid", seen__count=count)
    assert bench.reader("velocity")() != 0
    await bench.reset()
    for _ in range(2 * every + 1):
        await bench.transact("strobe", "valid", seen__count=-1)
        assert bench.reader("velocity")() == 0


@pytest.mark.parametrize("name", some_of(FITS, 0, 1))
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: least_squares.Design, degree: int, rows):
    """Yield the outputs of the module's equations on lists of plain integers and exact rationals."""
    half, most, every = 1 << (d.count_width - 1), d.history.change.max, d.history.every
    of_counts, spacing = weights(degree, d.taps + 1), d.spacing * every
    positions, last, velocity = [], None, 0
    for count, restart in rows:
        limited = 0
        if restart or last is None:
            positions = [0]
        else:
            moved = (count - last + half) % (2 * half) - half
            positions.append(positions[-1] + max(-most, min(moved, most)))
            limited = int(abs(moved) > most)
        last, k = count, len(positions) - 1
        if k % every == 0:
            seen = [positions[max(k - place * spacing, 0)] for place in range(d.taps + 1)]
            slope = sum(weight * position for weight, position in zip(of_counts, seen, strict=True)) / spacing
            velocity = int(slope * 2**d.velocity.f)
        yield velocity, limited


@pytest.mark.parametrize("name", FITS)
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    samples = 40_000 if name == "paper" else 4_000
    equals(lambda _, rows: oracle(d, order(name), rows), d, stimulus(name, samples), d.start())


@pytest.mark.parametrize(("of", "fractions"), PUBLISHED.items())
def test_weights_are_those_that_are_published(of, fractions):
    assert weights(*of) == tuple(Fraction(text) for text in fractions.split())


@pytest.mark.parametrize("points", [2, 3, 4, 5, 8, 16, 31, 32])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_weights_are_those_of_least_squares(degree, points):
    """They are exact on every polynomial of the degree, and a polynomial of that degree: no others are both."""
    if points <= degree:
        return
    exact = weights(degree, points)
    for power in range(degree + 1):
        assert sum(weight * Fraction(-place) ** power for place, weight in enumerate(exact)) == (power == 1)
    differences = list(exact)
    for _ in range(degree + 1):
        differences = [after - before for before, after in pairwise(differences)]
    assert not any(differences)
    # The slope of what numpy fits to one count among zeros, at the newest place, is that count's weight.
    fitted = np.polyfit(-np.arange(points), np.eye(points), degree)
    assert fitted[-2] == pytest.approx([float(weight) for weight in exact], abs=1e-12)


def test_a_fit_of_numpy_gives_the_velocity():
    """On random counts, at many windows: the slope of numpy's polynomial but for an LSB."""
    axis = spec("wide", "least-squares")
    for degree, points in ((1, 16), (2, 9), (3, 32)):
        d = least_squares.Design(axis, Gains(degree, points, 5e-3))
        counts = np.cumsum(rng().integers(-1000, 1001, 400))
        velocity = model(d, [(count, 0) for count in counts.tolist()], d.start())["velocity"] * d.velocity.lsb
        places = -np.arange(d.taps + 1) * period(d)
        for k in range(-places[-1], 400):
            fitted = np.polyder(np.polyfit(places, counts[k + places] - counts[k], degree))[-1]
            assert abs(velocity[k] - fitted) < d.velocity.lsb * (1 + 1e-6)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_polynomial_of_the_degree_reads_exactly(degree):
    d = least_squares.Design(spec("wide", "least-squares"), Gains(degree, 12, 2e-3))
    k, full = np.arange(-30, 31), d.taps * period(d)
    velocity = model(d, [(count, 0) for count in (k**degree).tolist()], d.start())["velocity"]
    assert (velocity == degree * k ** (degree - 1) << d.velocity.f)[full:].all()


@pytest.mark.parametrize("name", FITS)
def test_no_input_overflows(name):
    """The worst input takes the velocity's range to the next power of two, and sums fit int64."""
    d = design(name)
    running = sum(abs(value) * age for age, value in enumerate(d.coefficients, 1))
    assert d.largest_sum == running * d.history.change.max * period(d) < 1 << least_squares.SUM_BITS
    assert d.divisor << d.fraction < 1 << 62
    assert d.gain * d.history.change.max < 2 ** (d.velocity.i - 1) <= 2 * (d.gain * d.history.change.max + 1)
    half = 1 << (d.count_width - 1)
    counts = np.cumsum([0, *(worst(d, order(name)) * d.history.change.max)])
    seen = model(d, [(count, 0) for count in ((counts + half) % (2 * half) - half).tolist()], d.start())
    assert not seen["saturated"].any()
    assert seen["velocity"][-1] == int(d.gain * d.history.change.max * 2**d.velocity.f)


@pytest.mark.parametrize("rate_hz", [1_000, 100_000])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_error_is_within_the_guaranteed_bound_and_rounding_costs_less_than_an_lsb(degree, rate_hz):
    """On the paper's signal, and on the parabola by which order 1 attains the bound but for the rounding of counts."""
    given, (counts, exact) = axis_at("least-squares", rate_hz), piece(rate_hz)
    gains = Gains(degree, 12, minimax_window_s(given, degree, 12))
    axis = axis_at("least-squares", rate_hz, gains=gains)
    d, c = axis.design.estimator, axis.acceleration_max_m_per_s2 / axis.count_m / rate_hz**2
    n, own = d.taps * period(d), numbers(degree, d.taps + 1)
    bound = own.of_acceleration * c * n + own.noise * window.EPS_COUNTS / n + d.velocity.lsb
    fixed, floating = Axis(axis).run(counts).velocity * d.velocity.lsb, Axis(axis, floating=True).run(counts).velocity
    assert np.abs(fixed - floating).max() < d.velocity.lsb * (1 + 1e-6)
    error = floating - exact / axis.velocity_unit_m_per_s
    assert np.abs(error)[n:].max() <= bound
    assert rms((fixed - floating)[n:]) <= 0.01 * rms(error[n:])
    if degree == 1:
        k = np.arange(int(min(axis.speed_max_counts_per_sample / c, 20 * n)) + 1)
        parabola = np.floor(c * k**2 / 2).astype(np.int64)
        assert 0.99 * c * n / 2 <= np.abs(Axis(axis).run(parabola).velocity * d.velocity.lsb - c * k)[n:].max() <= bound


def test_the_numbers_are_those_of_the_module_and_their_window_the_least():
    line, parabola, cubic = (numbers(degree, 16) for degree in (1, 2, 3))
    assert [round(own.noise * own.of_acceleration, 1) for own in (line, parabola, cubic)] == [1.4, 3.9, 7.8]
    assert [round(numbers(1, points).rms, 2) for points in (2, 16)] == [0.41, 0.23]
    assert numbers(1, 2)[:2] == (2, pytest.approx(0.5))
    assert all(numbers(1, points).of_acceleration == pytest.approx(0.5) for points in range(2, 33))
    # At a constant jerk j a parabola through three points is off by j T^2 / 3, T half of the window.
    assert numbers(2, 3).of_jerk == pytest.approx(1 / 12, rel=1e-5)
    # Order 1 guarantees the most, whatever the points.
    worst = max(numbers(1, points).noise for points in range(2, 33)) / 2
    assert worst < min(math.prod(numbers(2, points)[:2]) for points in range(3, 33))
    axis = spec("mhz", "least-squares")
    for degree in (1, 2, 3):
        own, c = numbers(degree, 16), axis.acceleration_max_m_per_s2 / axis.count_m
        seconds = minimax_window_s(axis, degree, 16) * np.array([0.99, 1.0, 1.01])
        assert (own.of_acceleration * c * seconds + own.noise * window.EPS_COUNTS / seconds).argmin() == 1


def test_two_points_are_the_plain_difference_over_the_minimax_window():
    axis = spec("mhz", "least-squares")
    d = least_squares.Design(axis, Gains(1, 2, minimax_window_s(axis, 1, 2)))
    plain = window.Design(axis, window.Gains.default(axis))
    counts = np.cumsum(rng().integers(-3, 4, 3000)).tolist()
    (length,) = (word.reset for word in plain.words)
    assert d.spacing == length
    seen = model(d, [(count, 0) for count in counts], d.start())
    same = model(plain, [(count, 0, length) for count in counts], plain.start())
    assert (d.velocity, seen["velocity"].tolist()) == (plain.velocity, same["velocity"].tolist())


def test_standing_is_exactly_zero_and_a_start_in_motion_overshoots_by_no_more_than_the_gain():
    for degree in (1, 2, 3):
        d = least_squares.Design(spec("mhz", "least-squares"), Gains(degree, 16, 300e-6))
        n = d.taps * period(d)
        counts = [7] * (n + 5) + list(range(8, 8 + 2 * n)) + [8 + 2 * n] * (n + 5)
        rows = [(count, int(k == n + 5 + 2 * n)) for k, count in enumerate(counts)]
        velocity = model(d, rows, d.start())["velocity"]
        one = 1 << d.velocity.f
        assert not velocity[: n + 5].any()
        assert (velocity[2 * n + 5 : 3 * n + 5] == one).all()
        assert not velocity[3 * n + 5 :].any()
        assert velocity.max() <= d.gain * one
        assert (velocity.max() > one) == (degree > 1)


def test_the_default_is_a_line_through_as_many_points_as_there_are_clocks():
    axis = spec("mhz", "least-squares")
    assert Gains.default(axis) == Gains(1, 16, minimax_window_s(axis, 1, 16))
    slow = AxisSpec(**MHZ | {"clock_hz": 26_000_000}, estimator="least-squares")
    assert 2 < slow.design.gains.points < 16
    assert slow.design.estimator.latency == slow.clocks_per_sample


@pytest.mark.parametrize(
    ("gains", "named"),
    [
        ((1, 8, -1.0), "window_s must be 1e-30 to 1e\\+30, not -1.0"),
        ((1, 8, math.nan), "window_s must be .*, not nan"),
        ((4, 8, 1e-3), "order must be a whole number of 1 to 3, not 4"),
        ((1.5, 8, 1e-3), "order must be a whole number of 1 to 3, not 1.5"),
        ((2, 2, 1e-3), "points must be a whole number of 3 to 32, not 2"),
        ((1, 33, 1e-3), "points must be a whole number of 2 to 32, not 33"),
        ((1, "8", 1e-3), "points must be a number, not '8'"),
        ((1, 2, 1e9), "window_s must be more than 0 and at most .* at these rates, not"),
        ((3, 32, 1e6), "window_s must be more than 0 and at most .* with these points, not"),
    ],
)
def test_gains_that_cannot_be_held_are_refused(gains, named):
    with pytest.raises((TypeError, ValueError), match=f"^{named}"):
        least_squares.Design(spec("paper", "least-squares"), Gains(*gains))


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
