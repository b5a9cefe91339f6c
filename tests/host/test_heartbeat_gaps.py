"""One lost frame costs no trip, whatever else is asked: the time between two beats is measured at the board."""

import pytest

from support.beat_gaps import SCENES, WATCHDOG_S, gaps_s

EARLY_S = 1e-3
"""By so much the watchdog may trip early."""


@pytest.mark.parametrize("scene", [scene for scene in SCENES.values() if scene.reads])
def test_behind_a_bridge_a_lost_frame_trips_nothing(scene):
    """Of some losses, for the machine may be busy in one."""
    assert min(gaps_s(scene, slower=4.0, losses=3)) < WATCHDOG_S - EARLY_S
