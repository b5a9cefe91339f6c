"""Polynomials of a leg: sure statements are true, and a passage is where NumPy finds it."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from hardwall.sim.world.polynomials import (
    FIRST,
    NEVER,
    UNSURE,
    at,
    leaves,
    measure,
    root,
    shorten,
    stays,
    value,
)


def series_of(coefficients):
    table = np.zeros((FIRST + len(coefficients), 2))
    table[FIRST:, 1] = coefficients
    measure(table)
    return table


def test_values_and_halves():
    rng = np.random.default_rng(1)
    for _ in range(200):
        polynomial = Polynomial(rng.normal(size=8))
        series, time = series_of(polynomial.coef), float(rng.uniform())
        assert value(series, 1, time) == pytest.approx(
            (polynomial(time), polynomial.deriv()(time)), rel=1e-12, abs=1e-13
        )
        assert at(series, 1, 1.0) == pytest.approx(polynomial(1.0), rel=1e-12, abs=1e-13)
        assert at(series, 0, time) == 0.0
        shorten(series, 0.5)
        assert at(series, 1, 1.0) == pytest.approx(polynomial(0.5), rel=1e-12, abs=1e-13)
        shorten(series, 0.6)
        assert at(series, 1, 1.0) == pytest.approx(polynomial(0.3), rel=1e-12, abs=1e-13)


def test_what_is_sure_is_so_and_the_rest_is_found():
    rng = np.random.default_rng(2)
    times, said = np.linspace(0, 1, 400), {NEVER: 0, UNSURE: 0, "found": 0}
    for _ in range(3000):
        polynomial = Polynomial(rng.normal(size=6) * 0.5 ** np.arange(6) * [1, 1, *[rng.uniform(0, 1)] * 4])
        series, values = series_of(polynomial.coef), polynomial(times)
        low, high = sorted(rng.normal(size=2) * 1.5)
        inside, one_way = stays(series, 1, low, high)
        if inside:
            assert ((low <= values) & (values < high)).all()
        if one_way:
            steps = np.diff(values)
            assert (steps > 0).all() or (steps < 0).all()
        left = leaves(series, 1, low, high, False)
        if left == NEVER:
            assert inside or low <= values[-1] < high
        elif left != UNSURE and low <= values[0] < high:
            said["found"] += 1
            bound = low if values[-1] < low else high
            passages = [
                x.real for x in (polynomial - bound).roots() if abs(x.imag) < 1e-9 and -1e-9 < x.real < 1 + 1e-9
            ]
            assert left == pytest.approx(min(passages), abs=1e-9)
            assert root(series, 1, bound, 0.0) == left
        if left in said:
            said[left] += 1
        assert leaves(series, 1, low, high, True) != UNSURE
    assert min(said.values()) > 100, said


@pytest.mark.parametrize("side", [1, -1])
def test_a_start_that_a_rounding_put_outside_does_not_hide_the_way_through(side):
    """A range that is crossed is left at its far side; a motion that turns back at once leaves at once."""
    outside = -np.nextafter(1.0, 2.0)
    for slope, left in ((4.0, 0.5), (-1.0, 0.0)):
        series = series_of(side * np.array([outside, slope, 0.0]))
        assert leaves(series, 1, -1.0, 1.0, True) == pytest.approx(left, abs=1e-12)
