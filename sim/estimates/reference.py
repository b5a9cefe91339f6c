"""The reference velocity that estimates are compared with, and the bound on the acceleration derived from it.

The reference is the central difference of the recorded counts, through a 4th-order Butterworth filter forward and
backward, so it has no delay. The cutoff is `REFERENCE_HZ`, or a quarter of the sample rate where that is less.

The bound C on the acceleration is the largest |derivative| of the reference velocity over the samples that are judged,
rounded up to two digits. A designer would know it of the motion; an estimator could not know it at the time.
"""

import math

import numpy as np
import scipy

REFERENCE_HZ = 40.0
REFERENCE_ORDER = 4
SETTLE_S = 1.0
"""The time from which estimates are judged; before it, an estimator is still settling."""


def judged_from(rate_hz: float) -> int:
    """Return the number of the first sample that is judged."""
    return math.ceil(SETTLE_S * rate_hz)


def zero_phase_velocity(counts: np.ndarray, rate_hz: float, cutoff_hz: float) -> np.ndarray:
    """Return the derivative (counts/s) of the counts, low-pass filtered forward and backward."""
    sections = scipy.signal.butter(REFERENCE_ORDER, cutoff_hz, fs=rate_hz, output="sos")
    derivative = np.gradient((counts - counts[0]).astype(np.float64)) * rate_hz
    # The usual extension at the ends is three times the filter's length, if there are enough samples.
    extension = min(3 * (2 * len(sections) + 1), len(counts) - 1)
    return scipy.signal.sosfiltfilt(sections, derivative, padlen=extension)


def acceleration_bound(velocity: np.ndarray, rate_hz: float, first: int) -> float:
    """Return the largest |derivative| of a velocity from a sample on, rounded up to two digits.

    Args:
        velocity: the velocity of every sample.
        rate_hz: the sample rate.
        first: number of the first sample that is judged; if there is none, all samples count.
    """
    acceleration = np.gradient(velocity) * rate_hz
    largest = float(np.abs(acceleration[first:] if len(velocity) > first else acceleration).max())
    if largest == 0:
        return 0.0
    exponent = math.floor(math.log10(largest)) - 1
    return float(f"{math.ceil(largest / 10.0**exponent)}e{exponent}")
