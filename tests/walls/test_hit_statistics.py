"""What is said of a wall, from invented positions: every verdict, its windows, and the paper's own protocol."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardwall.sim.scene.load import load
from hardwall.sim.walls.hit_statistics import ENOUGH, Tally
from stimuli.lengths import LONG

# A window has 50 samples: the first one is from 100 to 150, and the one before it from 50 on.
PROTOCOL = {
    "controller.sample_hz": 1000, "controller.actuation_hz": 1000, "protocol.settle_s": 0.1, "protocol.mean_s": 0.01,
    "protocol.measure_s": 0.05, "protocol.longest_s": 0.32, "protocol.threshold_mm": 1e-3, "amplifier": None,
}  # fmt: skip
LITERAL = PROTOCOL | {"protocol.verdict": "literal"}
WINDOW = 50
BUZZ = np.tile([1.0, -1.0], 250) * 1e-6
"""An RMS of 1 um, the threshold, about any line that a window has."""


def judged(positions: np.ndarray, changes: dict = PROTOCOL, piece: int = 7) -> tuple[Tally, int]:
    """Return the tally of positions, piece by piece until the verdict, and the end of the piece."""
    tally, end = Tally(load("seed-2011", changes), True), 0
    while tally.verdict is None:
        first, end = end, min(end + piece, tally.window_end)
        tally.add(first, positions[first:end], np.zeros(end - first, np.int64))
    return tally, end


def falling(part: float) -> np.ndarray:
    """Return a buzz of which every window has that part of the one before, 10 um in the one before the mark."""
    return 10 * BUZZ * part ** ((np.arange(len(BUZZ)) - WINDOW) // WINDOW)


@pytest.mark.parametrize(
    ("positions", "verdict", "end"),
    [
        (1.01 * BUZZ, "unstable", 150),
        (0.99 * BUZZ, "stable", 150),
        (falling(0.91), "unstable", 150),
        (falling(0.89), "undecided", 300),
        (falling(0.5), "stable", 300),
        (falling(0.4), "stable", 250),
        (falling(1.5), "unstable", 150),
    ],
)
def test_the_windows_give_the_verdict(positions, verdict, end):
    tally, at = judged(5e-3 + positions)
    assert (tally.verdict, at) == (verdict, end)


def test_what_falls_and_then_goes_on_is_unstable():
    positions = falling(0.5)
    positions[200:] = positions[150:200].tolist() * 6
    tally, end = judged(positions)
    assert (tally.verdict, end) == ("unstable", 250)
    assert tally.rms_m == pytest.approx(np.sqrt(np.mean(positions[200:250] ** 2)), rel=1e-2)


def bouncing(flight: float, keeps: float, wait: int = 0) -> np.ndarray:
    """Return the positions (m) of a handle that comes to a wall in a straight line and bounces, every ms.

    Args:
        flight: samples of the first flight.
        keeps: the part of a flight that the next one lasts.
        wait: samples before the wall is met.
    """
    flights = flight * keeps ** np.arange(700)
    ends, time = np.cumsum(flights), np.arange(12_000.0) - wait
    number = np.minimum(np.searchsorted(ends, time, "right"), len(flights) - 1)
    left = np.clip(ends[number] - time, 0, flights[number])
    return np.where(time < 0, 1e-7 * time, -2e-6 * left * (flights[number] - left))


LONG_LOOK = PROTOCOL | {"protocol.longest_s": 11.9}


@settings(max_examples=100 if LONG else 40)
@given(st.floats(4, 300), st.floats(0.3, 0.97), st.integers(0, 300))
def test_a_handle_whose_bounces_get_lower_is_never_unstable(flight, keeps, wait):
    """However few of them a window has, and also where one is on its way to the wall."""
    positions = bouncing(flight, keeps, wait)
    assert judged(positions, LONG_LOOK)[0].verdict == "stable"
    assert judged(positions)[0].verdict in ("stable", "undecided")


@given(st.floats(4, 300), st.integers(0, 99))
def test_bounces_that_stay_as_high_are_unstable_once_there_are_enough(flight, wait):
    positions = bouncing(flight, 1.0, wait)
    tally, end = judged(positions, LONG_LOOK)
    assert tally.verdict == "unstable"
    swings = 2 * (end - wait) / flight
    assert swings >= 2 * ENOUGH
    # Beyond these there are the part of a swing and of a window at each end, and the window before the mark.
    assert end <= max(wait + flight, 100) + (ENOUGH + 2) * flight + 5 * WINDOW


def test_a_handle_that_has_moved_away_or_creeps_is_stable_and_that_is_said():
    """The paper's protocol calls it unstable; its square is made of the three parts."""
    positions = 5e-3 + 0.5 * BUZZ + 2e-8 * np.maximum(np.arange(len(BUZZ)) - 100, 0)
    positions[:100] -= 30e-6
    tally, _ = judged(positions)
    assert tally.verdict == "stable"
    slope = np.polynomial.Polynomial.fit(np.arange(WINDOW), positions[100:150], 1).convert().coef[1]
    assert tally.drift_m_per_s == pytest.approx(slope * 1000, rel=1e-9)
    assert slope > 1e-8
    assert tally.offset_m == pytest.approx(30e-6 + 24.5 * 2e-8, rel=1e-6)
    assert tally.mean_m == pytest.approx(positions[100:150].mean(), rel=1e-12)
    literal, _ = judged(positions, LITERAL)
    assert literal.verdict == "unstable"
    assert literal.mean_m == pytest.approx(positions[90:100].mean(), rel=1e-12)
    spread = (tally.drift_m_per_s / 1000) ** 2 * (WINDOW**2 - 1) / 12
    assert literal.rms_m**2 == pytest.approx(tally.rms_m**2 + tally.offset_m**2 + spread, rel=1e-9)


@pytest.mark.parametrize(
    ("from_m", "drift_m_per_s", "verdict"),
    [
        # The last window of the longest hit ends at 0.3 s, and 150 mm is as far as the device travels.
        (0.0, 0.49, "stable"),
        (0.0, 0.51, "unstable"),
        (0.0, -0.51, "unstable"),
        (0.149, 0.0, "stable"),
        (0.151, 0.0, "unstable"),
        (-0.151, 0.0, "unstable"),
    ],
)
def test_a_handle_that_the_wall_does_not_hold_is_unstable_however_straight_its_way(from_m, drift_m_per_s, verdict):
    middle = 0.125  # s, of the window from 100 to 150 ms
    positions = from_m + drift_m_per_s * (np.arange(len(BUZZ)) * 1e-3 - middle)
    tally, end = judged(positions)
    assert (tally.verdict, end) == (verdict, 150)
    assert tally.rms_m < 1e-9


def test_pieces_do_not_matter():
    for changes in (PROTOCOL, LITERAL):
        ways = [judged(5e-3 + falling(0.6), changes, piece) for piece in (1, 7, 50, 400)]
        assert len({(tally.verdict, end) for tally, end in ways}) == 1
        assert all(tally.rms_m == pytest.approx(ways[0][0].rms_m, rel=1e-9) for tally, _ in ways)
    whole = Tally(load("seed-2011", PROTOCOL), True)
    whole.add(0, 0.5 * BUZZ[:150], np.zeros(150, np.int64))
    assert whole.verdict == "stable"


def test_a_handle_is_still_since_its_last_change():
    tally = Tally(load("seed-2011", PROTOCOL), False)
    for first, positions, since in ((0, [1, 2, 2], 1), (3, [2, 2], 1), (5, [3, 3, 2], 7), (8, [2], 7)):
        tally.add(first, np.array(positions) * 1e-3, np.zeros(len(positions)))
        assert tally.still_from == since
    tally.rest()
    assert (tally.verdict, tally.rms_m, tally.mean_m, tally.offset_m, tally.drift_m_per_s) == ("stable", 0, 2e-3, 0, 0)
    tally.add(9, np.array([0.2]), np.zeros(1))
    tally.rest()
    assert (tally.verdict, tally.mean_m) == ("unstable", 0.2), "it rests beyond the device's travel"
