"""The line through a window of positions is NumPy's, however the positions come."""

import os
import subprocess
import sys

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


@pytest.mark.parametrize("cuts", [(1,), (250,), (499,), (100, 130, 400)])
def test_joined_windows_are_one(cuts):
    positions = -2e-3 + 3e-9 * np.arange(500) + RNG.normal(0, 1e-6, 500)
    whole, (joined, *others) = of(positions), map(of, np.split(positions, cuts))
    for other in others:
        joined = joined.joined(other)
    assert (joined.samples, joined.added) == (500, 500)
    for name in ("mean_m", "drift_m", "rms_m"):
        assert getattr(joined, name) == pytest.approx(getattr(whole, name), rel=1e-9)


def test_a_handle_at_rest_or_in_steady_motion_is_on_its_line():
    rest = of(np.full(1000, 1.23456789e-3), 300)
    assert (rest.rms_m, rest.drift_m, rest.mean_m) == (0.0, 0.0, 1.23456789e-3)
    assert of(1e-3 + 1e-9 * np.arange(20_000)).rms_m < 1e-11
    single = of(np.array([4e-6]))
    assert (single.mean_m, single.drift_m, single.rms_m) == (4e-6, 0.0, 0.0)


SUMS = """
import numpy as np
from hardwall.sim.walls.window import Room, Window
window, values = Window(200_000, Room()), np.random.default_rng(1).normal(0, 1, 200_000)
for piece in np.split(values, [65_536, 131_072]):
    window.add(piece)
print(window.mean_m.hex(), window.drift_m.hex(), window.rms_m.hex())
"""


def test_no_digit_depends_on_the_number_of_threads():
    """BLAS has as many as there are cores, unless it is told, and adds their parts."""
    found = set()
    for threads in ("1", "2"):
        environ = os.environ | {"OPENBLAS_NUM_THREADS": threads}
        found.add(subprocess.run([sys.executable, "-c", SUMS], env=environ, capture_output=True, check=True).stdout)
    assert len(found) == 1
