"""Recordings of real encoders as people keep them, each read by one call; they are not part of the project."""

import math

import numpy as np
import pytest

from hardwall.sim.recordings.load import load
from hardwall.sim.recordings.recording import Reading

RADIANS_OF_40000 = Reading(unit="rad", count=math.tau / 40000)


def test_the_log_of_a_small_robot_has_times_in_milliseconds(recordings):
    found = load(recordings / "micromouse_encoders5.csv", "leftEncoder")
    assert (found.rate_hz, found.start_s, len(found.counts)) == (200.0, 65.605, 856)
    assert (found.counts[0], found.counts[-1]) == (28187, 16027)
    assert "times in column time (ms), 200 Hz" in found.notes


@pytest.mark.parametrize("column", ["theta", "alpha"])
def test_the_angles_of_a_servo_are_counts(recordings, column):
    path = recordings / "qube_servo.csv"
    found = load(path, column, reading=Reading(unit="rad", count=math.tau / 2048))
    table = np.genfromtxt(path, delimiter=",", names=True)[column]
    assert (found.counts == np.rint(table * 2048 / math.tau)).all()
    assert found.rate_hz == 500.0


def test_a_pendulum_is_the_same_in_both_its_files(recordings):
    counts = load(recordings / "em2_pendulum_10khz.csv", "counts")
    angles = load(recordings / "pendulum_single.mat", "Theta1", reading=RADIANS_OF_40000)
    assert (counts.counts == angles.counts).all()
    assert counts.rate_hz == angles.rate_hz == 10_000.0
    assert (counts.start_s, angles.start_s) == (0.0, 60.0)


def test_the_session_of_a_logic_analyser_is_decoded(recordings):
    found = load(recordings / "rotary-ramp.sr", rate_hz=10_000.0)
    assert len(found.edges.ticks) == 12732
    assert (np.diff(found.edges.counts) == 1).all()
    assert (found.edges.ticks[0], found.edges.tick_hz) == (3760, 1e6)
    assert found.notes[0] == "sigrok session, A 0, B 1"
