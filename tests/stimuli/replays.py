"""Synthetic recordings with the ranges of a real drive's, and the reference velocity by an independent method."""

import numpy as np
import pytest
from scipy import signal

from hardwall.sim.recordings.recording import Recording
from stimuli.lengths import LONG
from stimuli.outputs import EVERY_OUTPUT

COARSEN = 16
# About the largest bound of the real recordings. All tests share it, so that every estimator needs only one build.
BOUND = 1e6
KINDS = [("levant", "u"), ("fdm", "u"), ("foaw", "best-fit"), ("levant-edge", "u")]
"""One estimator of each kind: with a few words of state or none, with an array, and from the stamps of edges."""
EVERY = pytest.mark.parametrize(("estimator", "output"), EVERY_OUTPUT if LONG else KINDS)
"""Every estimator, by `make soak`, and else one of each kind: each is a loop of its own to compile."""


def recording(counts, rate_hz=1000.0, start_s=0.0) -> Recording:
    return Recording("made.csv", "counts", np.asarray(counts, np.int64), float(rate_hz), start_s)


def swing(samples=3000, amplitude=700 * COARSEN) -> Recording:
    """Return a sine with the ranges of the recordings of a real drive."""
    return recording(np.floor(amplitude * np.sin(np.pi * np.arange(samples) / 1000)))


def reference_of(recorded: Recording) -> np.ndarray:
    """Return the reference velocity, computed by the filter's polynomials instead of its sections."""
    b, a = signal.butter(4, 40.0, fs=recorded.rate_hz)
    counts = recorded.counts.astype(float)
    central = (np.roll(counts, -1) - np.roll(counts, 1)) / 2
    central[0], central[-1] = counts[1] - counts[0], counts[-1] - counts[-2]
    return signal.filtfilt(b, a, central * recorded.rate_hz)
