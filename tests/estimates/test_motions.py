"""Known motions: velocities are derivatives, and edges are where the path passes them, at every clock."""

import math

import numpy as np
import pytest

from hardwall.sim.estimates import motions
from hardwall.sim.world.encoder import Encoder, level, locate, offsets

CLOCK_HZ = 1e6
SECONDS = 0.03
_T = np.linspace(0, SECONDS, 301)
MOTIONS = {
    "decaying": motions.DecayingSine(2e-3, 30.0, 97.3),
    "steady": motions.Steady(-0.7213, 0.31416e-6),
    "sine": motions.Sine(3e-4, 2e-4, 61.3, 1.7e-3),
    "sweep": motions.Sweep(1e-4, 20.0, 80.0),
    "stop": motions.Stop(0.2013, 0.0101, 19.7),
    "track": motions.Track(0.00507, 1e-4, 1e-3 * np.sin(297.31 * _T), 0.29731 * np.cos(297.31 * _T)),
}


def positions(path, times) -> np.ndarray:
    return np.array([motions.position(path, t) for t in times])


@pytest.mark.parametrize("name", MOTIONS)
def test_velocity_is_the_derivative_of_position(name):
    path, h = MOTIONS[name], 1e-6
    times = np.linspace(1e-3, SECONDS - 1e-3, 400) + 1e-5 / 3
    central = (positions(path, times + h) - positions(path, times - h)) / (2 * h)
    exact = np.array([motions.velocity(path, t) for t in times])
    # The third derivative is below 1e6 m/s^3 in each of these; float64 adds its rounding.
    assert np.abs(central - exact).max() < 1e6 * h**2 / 6 + 1e-18 / h + 1e-8


@pytest.mark.parametrize("name", MOTIONS)
def test_acceleration_is_the_derivative_of_velocity(name):
    path, h = MOTIONS[name], 1e-7
    times = np.linspace(1e-3, SECONDS - 1e-3, 400) + 1e-5 / 3
    after, before = (np.array([motions.velocity(path, t + by) for t in times]) for by in (h, -h))
    exact = np.array([motions.acceleration(path, t) for t in times])
    # No time is within h of a knot of the track, or of the ends of the braking.
    assert np.abs((after - before) / (2 * h) - exact).max() < 1e-6 * np.abs(exact).max() + 1e-16 / h
    assert np.abs(exact).max() > 1 or name == "steady"


def test_a_track_is_exact_for_a_cubic():
    def cubic(t):
        return 1e-3 * (t - 40 * t**2 + 900 * t**3), 1e-3 * (1 - 80 * t + 2700 * t**2)

    knots = np.linspace(0, 0.02, 11)
    path = motions.Track(0.0, knots[1], *cubic(knots))
    times = np.linspace(0, 0.02, 97)
    assert np.abs(positions(path, times) - cubic(times)[0]).max() < 1e-15
    assert np.abs(np.array([motions.velocity(path, t) for t in times]) - cubic(times)[1]).max() < 1e-12
    bent = np.array([motions.acceleration(path, t) for t in times[:-1]])
    assert np.abs(bent - 1e-3 * (5400 * times[:-1] - 80)).max() < 1e-9
    # The track continues beyond its ends.
    assert motions.acceleration(path, -0.1) == motions.acceleration(path, 0.1) == 0
    assert motions.position(path, -0.1) == pytest.approx(-1e-4, rel=1e-12)
    assert motions.velocity(path, 0.1) == pytest.approx(cubic(0.02)[1], rel=1e-12)


@pytest.mark.parametrize("errors", [(0.0, 0.0), (0.25, 0.1)])
@pytest.mark.parametrize("name", MOTIONS)
def test_the_pins_show_the_cell_at_every_clock(name, errors):
    """A register at the pins holds, after clock n, the level of the cell of the position at time n / clock_hz."""
    path, encoder = MOTIONS[name], Encoder(1e-6, CLOCK_HZ, offsets(*errors))
    found = motions.encoded(path, encoder, SECONDS, 2e-4, 7)
    clocks = np.arange(1, int(SECONDS * CLOCK_HZ))
    cells = np.array([locate(encoder, motions.position(path, n / CLOCK_HZ)).number for n in clocks])
    assert found.start_cell == locate(encoder, motions.position(path, 0.0)).number
    assert found.start_level == level(found.start_cell)
    edges = found.edges
    levels = np.concatenate([[found.start_level], edges.levels])
    shown = levels[np.searchsorted(edges.clocks - 7, clocks, side="right")]
    assert (np.diff(edges.clocks) >= 0).all()
    wrong = np.flatnonzero(shown != [level(cell) for cell in cells])
    assert wrong.tolist() == []
    assert len(edges.clocks) >= np.abs(np.diff(cells)).sum() > 30


def test_edges_do_not_depend_on_the_step():
    path, encoder = MOTIONS["decaying"], Encoder(1e-6, 50e6)
    fine, coarse = (motions.encoded(path, encoder, SECONDS, step, 0) for step in (1e-5, 3e-3))
    assert (fine.edges.clocks == coarse.edges.clocks).all()
    assert (fine.edges.levels == coarse.edges.levels).all()


def test_more_edges_than_room_at_first():
    found = motions.encoded(motions.Steady(1.0, 0.3e-6), Encoder(1e-6, 50e6), 0.2, 1e-3, 0)
    assert len(found.edges.clocks) == 200_000
    assert found.edges.clocks.tolist()[:2] == [math.ceil(0.7e-6 * 50e6), math.ceil(1.7e-6 * 50e6)]
