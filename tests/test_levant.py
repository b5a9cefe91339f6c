"""Levant's differentiator: RTL against model, model against exact rationals, fixed point against the real algorithm."""

import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from estimator_bench import follow, model
from specs import spec

from bench import CAMPAIGN, SAMPLES, Bench, parameters, rng, simulate
from hardwall.hdl.levant import Estimator
from hardwall.model import levant
from hardwall.model.estimators import estimate
from hardwall.model.levant import START
from hardwall.model.quadrature import seen_count

NAMES = ("levant_lambda", "levant_alpha", "levant_output")


def design(name: str) -> levant.Design:
    return spec(name).design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def words(name: str, **changed: int) -> dict[str, int]:
    return {word.name: changed.get(word.name, word.reset) for word in design(name).words}


def stimulus(name: str, samples: int):
    """Yield rows that visit the track, its saturations, the wrap of the count and the ends of the gains."""
    d, random = design(name), rng()
    half, fast = 1 << (d.count_width - 1), d.velocity.max >> d.velocity.f
    reset = [words(name)[n] for n in NAMES[:2]]
    top = [d.lambda_.max, d.alpha.max]
    # Nominal gains follow a smooth motion, through the wrap of the count.
    t = np.arange(samples // 4)
    smooth = np.floor(half * (1 + 0.5 * np.sin(t * min(1, fast / half) / 2)) + random.random(len(t))).astype(np.int64)
    for count in smooth.tolist():
        yield count, 0, *reset, 0
    # The worst signs for overflow: full swings of the count at the largest gains, held until everything saturates.
    for period in (1, 2, 3, 7, 50):
        for k in range(samples // 50):
            yield (-half, half // 2 - 1, half - 1)[k // period % 3], 0, *top, k & 1
    # A ramp faster than the velocity format, long enough for alpha alone to carry u1 to its end.
    for k in range(d.velocity.max // top[1] + 50):
        yield -k * (fast + 1), 0, *top, 0
    # A walk with jumps, gains anywhere, restarts.
    count = 0
    for _ in range(samples - samples // 4 - samples // 10):
        count += int(
            random.integers(-half, half) if random.random() < 0.01 else random.integers(-2 * fast, 2 * fast + 1)
        )
        gains = reset if random.random() < 0.5 else [int(random.integers(0, m + 1)) for m in top]
        yield count, int(random.random() < 0.002), *gains, int(random.integers(0, 2))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    expected = await follow(dut, make(name), stimulus(name, SAMPLES), START)
    # The campaign is worth its name only if it reached both saturations, and the quiet track too.
    assert 0 in expected["saturated"]
    assert np.bitwise_or.reduce(expected["saturated"]) == 0b11


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    name = parameters()["name"]
    bench = Bench(dut, make(name))
    await bench.reset()
    reset = words(name)
    await bench.transact("strobe", "valid", count=0, **reset)
    await bench.transact("strobe", "valid", count=1, **reset)
    assert bench.reader("velocity")() != 0
    await bench.reset()
    await bench.transact("strobe", "valid", count=-1, **reset)
    assert bench.reader("velocity")() == 0


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: levant.Design, rows):
    """The module's equations in exact rationals, rounded only where it says so, on the unwrapped position."""
    lsb = Fraction(1, 2**d.velocity.f)
    v_max, e_max = d.velocity.max * lsb, d.error.max * lsb
    modulus, half = 2**d.count_width, 2 ** (d.count_width - 1)
    last = position = x = u1 = None
    for count, restart, lambda_word, alpha_word, output in rows:
        lam, alpha = Fraction(lambda_word, 2**d.lambda_.f), alpha_word * lsb
        if x is None or restart:
            position, x, u1 = 0, Fraction(0), Fraction(0)
        else:
            position += (count - last + half) % modulus - half
        last = count
        e = max(-e_max, min(e_max, x - position))
        flags = int(e != x - position)
        # The root down to its LSB, and half of it added back.
        scale = 2**d.root.f
        root = Fraction(math.isqrt(math.floor(abs(e) * scale**2)), scale) + Fraction(1, 2 * scale)
        step = math.floor(lam * root / lsb + Fraction(1, 2)) * lsb
        sign = (e > 0) - (e < 0)
        far_u, far_u1 = u1 - sign * step, u1 - sign * alpha
        u, u1 = (max(-v_max, min(v_max, v)) for v in (far_u, far_u1))
        x = position + e + u
        yield (u1 if output else u) / lsb, flags | (u != far_u or u1 != far_u1) << 1


@pytest.mark.parametrize("name", ["paper", "proposed", "mhz", "narrow"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    half = 1 << (d.count_width - 1)
    rows = [((c + half) % (2 * half) - half, *rest) for c, *rest in stimulus(name, 20_000)]
    seen = model(d, rows, START)
    for k, (velocity, flags) in enumerate(oracle(d, rows)):
        assert (velocity, flags) == (seen["velocity"][k], seen["saturated"][k]), f"sample {k}: {rows[k]}"


@pytest.mark.parametrize("name", ["paper", "proposed", "mhz"])
def test_rounding_is_a_small_change_of_position(name):
    """Every u follows exactly, without rounding, from an error changed by no more than the derived eta."""
    d, axis = design(name), spec(name)
    lam = words(name)["levant_lambda"] * d.lambda_.lsb
    delta = lam * 2.0 ** -(d.root.f + 1) + 2.0 ** -(d.velocity.f + 1)
    t = np.arange(20_000) / axis.sample_hz
    counts = np.floor(0.01 / axis.count_m * np.sin(2 * np.pi * 4 * t)).astype(np.int64)
    params, state = d.params(words(name)), START
    largest = 0.0
    for count in counts.tolist():
        moved = count - state.count if state.running else 0
        e = (state.lead - (moved << d.velocity.f)) * d.velocity.lsb
        u1 = state.u1 * d.velocity.lsb
        state, velocity, flags = estimate(params, state, seen_count(count), 0)
        assert flags == 0
        if e:
            exact_e = ((u1 - velocity * d.velocity.lsb) / lam) ** 2
            eta = abs(exact_e - abs(e))
            assert eta <= 2 * math.sqrt(abs(e)) * delta / lam + (delta / lam) ** 2 + 1e-9
            if abs(e) <= 1:
                largest = max(largest, eta)
    # The bound is no luxury: a good part of the budget is used.
    assert levant.POSITION_BUDGET / 8 < largest <= levant.POSITION_BUDGET + (delta / lam) ** 2


def test_start_makes_no_transient():
    params = design("paper").params(words("paper"))
    state = START
    for _ in range(100):
        state, velocity, flags = estimate(params, state, seen_count(-777_777), 0)
        assert (velocity, flags, state.u1, state.lead) == (0, 0, 0, 0)


@pytest.mark.parametrize(
    ("gains", "named"),
    [
        ({"lambda_sqrt_m_per_s": -1.0, "alpha_m_per_s2": 1.0}, "lambda_sqrt_m_per_s"),
        ({"lambda_sqrt_m_per_s": 1.0, "alpha_m_per_s2": math.nan}, "alpha_m_per_s2"),
        ({"lambda_sqrt_m_per_s": 1e9, "alpha_m_per_s2": 1.0}, "lambda_sqrt_m_per_s must be .* to .*, not"),
        ({"lambda_sqrt_m_per_s": 1.0, "alpha_m_per_s2": 1e12}, "alpha_m_per_s2 must be .* to .*, not"),
        ({"lambda_sqrt_m_per_s": 1.0, "alpha_m_per_s2": 1e-12}, "alpha_m_per_s2 must be .* to .*, not"),
        ({"lambda_sqrt_m_per_s": 1e-12, "alpha_m_per_s2": 1.0}, "lambda_sqrt_m_per_s must be .* to .*, not"),
    ],
)
def test_gains_that_cannot_be_held_are_refused(gains, named):
    with pytest.raises(ValueError, match=f"^{named}"):
        levant.Design(spec("paper"), levant.Gains(**gains))


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
