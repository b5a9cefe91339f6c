"""Levant's differentiator: RTL against model, model against exact integers, fixed point against the real algorithm."""

import math

import levants
import numpy as np
import pytest

from hardwall.hdl.estimators.levant import Estimator
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import levant
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant import START
from hardwall.testing import simulate
from hardwall.testing.estimators import model
from stimuli.lengths import some_of
from stimuli.specs import spec


def design(name: str) -> levant.Design:
    return spec(name).design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def words(name: str, **changed: int) -> dict[str, int]:
    return {word.name: changed.get(word.name, word.reset) for word in design(name).words}


follows_model, reset_mid_stream_starts_afresh = levants.campaign(make, START, fewer=())


@pytest.mark.parametrize("name", some_of(["paper", "mhz", "narrow"], 1, 2))
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: levant.Design, rows):
    """Yield the outputs of the module's equations in exact integers, rounded as documented, on unwrapped positions.

    All but lambda and the root is in LSBs of the velocity.
    """
    one, (v_min, v_max), e_max = 2**d.velocity.f, (d.velocity.min, d.velocity.max), d.error.max
    modulus, half = 2**d.count_width, 2 ** (d.count_width - 1)
    last = position = x = u1 = None
    for count, restart, lam, alpha, output in rows:
        if x is None or restart:
            position = x = u1 = 0
        else:
            position += ((count - last + half) % modulus - half) * one
        last = count
        e = max(-e_max, min(e_max, x - position))
        flags = int(e != x - position)
        # The root is rounded down to its LSB, and half an LSB is added back.
        scale = 2**d.root.f
        twice_root = 2 * math.isqrt(abs(e) * scale**2 // one) + 1
        step = levants.half_up(lam * twice_root * one, 2**d.lambda_.f * 2 * scale)
        sign = (e > 0) - (e < 0)
        far_u, far_u1 = u1 - sign * step, u1 - sign * alpha
        u, u1 = (max(v_min, min(v_max, v)) for v in (far_u, far_u1))
        x = position + e + u
        yield (u1 if output else u), flags | (u != far_u or u1 != far_u1) << 1


@pytest.mark.parametrize("name", ["paper", "proposed", "mhz", "narrow"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    rows = levants.wrapped(d, levants.stimulus(d, 20_000))
    seen = model(d, rows, START)
    for k, (velocity, flags) in enumerate(oracle(d, rows)):
        assert (velocity, flags) == (seen["velocity"][k], seen["saturated"][k]), f"sample {k}: {rows[k]}"


@pytest.mark.parametrize("name", ["paper", "proposed", "mhz"])
def test_rounding_is_a_small_change_of_position(name):
    """Every u is the unrounded output for an error changed by no more than the derived eta."""
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
    # The bound is needed: a good part of the budget is used.
    assert levant.POSITION_BUDGET / 8 < largest <= levant.POSITION_BUDGET + (delta / lam) ** 2


def test_start_makes_no_transient():
    params = design("paper").params(words("paper"))
    state = START
    for _ in range(100):
        state, velocity, flags = estimate(params, state, seen_count(-777_777), 0)
        assert (velocity, flags, state.u1, state.lead) == (0, 0, 0, 0)
