"""Fits of sines: known sines are found, and differentiated exactly."""

import numpy as np
import pytest

from hardwall.sim.studies.sines import Sines, fit
from hardwall.testing import SEED

TIMES = np.linspace(0, 1, 401)


def known(*terms: tuple[float, float, float]) -> Sines:
    """Return a sum of the terms (rad/s, sine, cosine)."""
    return Sines(*np.array(terms).T)


@pytest.mark.parametrize(
    "truth",
    [
        known((20.0, 1.0, 0.5)),
        known((5.0, 3.0, 0.0), (40.0, 0.5, -0.5), (90.0, 0.1, 0.2)),
        known(*((7.0 * 1.7**n, 1.0 / (1 + n), (-1) ** n / (1 + n)) for n in range(7))),
    ],
    ids=["one", "three", "seven"],
)
def test_sines_are_found_again(truth):
    found = fit(TIMES, truth.derivative(TIMES), len(truth.rad_per_s))
    assert found.rad_per_s == pytest.approx(truth.rad_per_s, rel=1e-5)
    for order in range(3):
        exact = truth.derivative(TIMES, order)
        assert np.abs(found.derivative(TIMES, order) - exact).max() <= 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_differences(order):
    truth, step = known((30.0, 1.0, -2.0), (11.0, 0.5, 0.1)), 1e-4
    before, after = truth.derivative(TIMES - step / 2, order - 1), truth.derivative(TIMES + step / 2, order - 1)
    exact = truth.derivative(TIMES, order)
    assert np.abs((after - before) / step - exact).max() <= 1e-5 * np.abs(exact).max()


def test_more_sines_leave_less():
    values = np.maximum(TIMES - 0.5, 0) ** 2
    left = [np.abs(fit(TIMES, values, count).derivative(TIMES) - values).max() for count in (1, 3, 7)]
    assert left[0] > left[1] > left[2]


@pytest.mark.parametrize(
    "values",
    [np.maximum(TIMES - 0.5, 0) ** 2, np.exp(-8 * TIMES) * np.sin(60 * TIMES)],
    ids=["kink", "decay"],
)
def test_the_last_bit_of_a_record_changes_nothing(values):
    found = fit(TIMES, values)
    # Sines that cancel are a million times the record, and which of them there are is chosen by the last bit.
    assert np.abs([found.sine, found.cosine]).max() <= 4 * np.abs(values).max()
    largest = np.abs(found.derivative(TIMES, 2)).max()
    signs = np.where(np.random.default_rng(SEED).random(TIMES.size) < 0.5, -1, 1)
    other = fit(TIMES, values * (1 + np.finfo(float).eps * signs))
    assert np.abs(other.derivative(TIMES, 2)).max() == pytest.approx(largest, rel=1e-5)


def test_a_record_too_short_is_refused():
    with pytest.raises(ValueError, match=r"^values must be at least 28 for 7 sines, not 20$"):
        fit(TIMES[:20], TIMES[:20])
