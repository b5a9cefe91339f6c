"""The line through a window of positions is NumPy's, however the positions come."""

import numpy as np
import pytest

from hardwall.sim.walls.window import Room, Window

RNG = np.random.default_rng(5)


def of(positions: np.ndarray, *cuts: int) -> Window:
    window = Window(len(positions), Room())
    for piece in np.split(positions, cuts):
        window.add(piece)
    return window


@pytest.mark.parametrize("cuts", [(), (1,), (0, 7, 7, 400)])
def test_mean_drift_and_rms_are_those_of_a_fitted_line(cuts):
    at = np.arange(500)
    positions = 3e-3 + 2e-9 * at + RNG.normal(0, 1e-6, 500)
    fitted = np.polynomial.Polynomial.fit(at, positions, 1)
    window = of(positions, *cuts)
    assert window.mean_m == pytest.approx(positions.mean(), rel=1e-12)
    assert window.drift_m == pytest.approx(fitted.convert().coef[1], rel=1e-9)
    assert window.rms_m == pytest.approx(np.sqrt(np.mean((positions - fitted(at)) ** 2)), rel=1e-9)


def test_a_handle_at_rest_or_in_steady_motion_is_on_its_line():
    rest = of(np.full(1000, 1.23456789e-3), 300)
    assert (rest.rms_m, rest.drift_m, rest.mean_m) == (0.0, 0.0, 1.23456789e-3)
    assert of(1e-3 + 1e-9 * np.arange(20_000)).rms_m < 1e-11
    single = of(np.array([4e-6]))
    assert (single.mean_m, single.drift_m, single.rms_m) == (4e-6, 0.0, 0.0)
