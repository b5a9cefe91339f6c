"""Implicit Euler: RTL against model, model against exact integers, the closed form against what it solves."""

import math

import levants
import numpy as np
import pytest

from hardwall.hdl.estimators.levant_implicit import Estimator
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import levant, levant_implicit
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant import FLOAT_START, POSITION_BUDGET, START
from hardwall.testing import rng, simulate
from hardwall.testing.estimators import model
from stimuli.lengths import some_of
from stimuli.specs import spec

NAME = "levant-implicit"


def design(name: str) -> levant_implicit.Design:
    return spec(name, NAME).design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


follows_model, reset_mid_stream_starts_afresh = levants.campaign(make, START)


@pytest.mark.parametrize("name", some_of(["mhz", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    scale, one, unit = 2**d.root.f, 2**d.velocity.f, 2**d.lambda_.f

    def step(lam, alpha, b, first):
        near = min(abs(b), alpha)
        beyond = abs(b) - near
        twice_root = 2 * math.isqrt(beyond * scale**2 // one + (lam * scale) ** 2 // (2 * unit) ** 2) + 1
        full = levants.half_up(lam * twice_root * one, unit * 2 * scale) - levants.half_up(lam**2 * one, 2 * unit**2)
        return near, max(min(full, beyond), 0)

    rows = levants.wrapped(d, levants.stimulus(d, 20_000))
    seen = model(d, rows, START)
    for k, (velocity, flags) in enumerate(levants.oracle_run(d, rows, step)):
        assert (velocity, flags) == (seen["velocity"][k], seen["saturated"][k]), f"sample {k}: {rows[k]}"


def test_the_closed_form_solves_the_generalised_equation():
    """Every b has a solution e+ and a selection S of the set-valued sign, for z and gains exact in float64."""
    random = rng()
    for _ in range(2000):
        lam, alpha = (float(2.0 ** random.integers(-6, 6)) for _ in range(2))
        z = float(random.integers(0, 200)) / 16
        size = alpha * float(random.integers(0, 17)) / 16 if z == 0 else alpha + lam * z + z**2
        b = float(random.choice([-1, 1])) * size
        params = levant_implicit.FloatParams(levant.FloatParams(lam, alpha, 0, 40))
        # The start is e+ + u1 = b with the count at rest and u1 = 0.
        state, u, _ = estimate(params, FLOAT_START._replace(running=1, lead=b), seen_count(0), 0)
        after, selection, g = state.lead - state.u1, -state.u1 / alpha, state.u1 - u
        assert abs(selection) <= 1
        assert math.isclose(after, math.copysign(z**2, b), rel_tol=1e-12, abs_tol=1e-12 * size)
        assert math.isclose(g, math.copysign(lam * z, b), rel_tol=1e-12, abs_tol=1e-12 * size)
        assert z == 0 or selection == math.copysign(1, b)


@pytest.mark.parametrize("name", ["paper", "mhz"])
def test_rounding_is_a_small_change_of_position(name):
    """Every u is the unrounded output for a `beyond` changed by no more than the derived eta."""
    d, axis = design(name), spec(name, NAME)
    lam, alpha = d.lambda_.to_real(d.words[0].reset), d.alpha.to_real(d.words[1].reset)
    delta = lam * 2.0 ** -(d.root.f + 1) + 2 * 2.0 ** -(d.velocity.f + 1)
    floor = 4.0**-d.root.f
    t = np.arange(20_000) / axis.sample_hz
    counts = np.floor(0.01 / axis.count_m * np.sin(2 * np.pi * 4 * t)).astype(np.int64)
    largest = 0.0
    for sign, size, step in levants.displacements(axis, counts):
        beyond, g = max(size - alpha, 0.0), -sign * step
        eta = abs((g / lam) ** 2 + g - beyond)
        slope = 2 * math.sqrt(beyond + lam**2 / 4)
        assert eta <= slope * delta / lam + (delta / lam) ** 2 + floor + 1e-9
        if beyond <= 1:
            largest = max(largest, eta)
    # The bound is needed: a good part of the budget is used.
    assert POSITION_BUDGET / 8 < largest <= POSITION_BUDGET + (delta / lam) ** 2 + floor
