"""The bounds of a recorded motion, given or taken from its counts.

A bound that is not given comes from the counts:

- travel: the span of the counts, rounded up to a power of two, at most the span of a 32-bit count;
- speed: the largest change in a sample and one count more, rounded up to a power of two;
- acceleration: the largest second difference over T samples, |c(k + T) - 2 c(k) + c(k - T)| / T^2. T is the shortest of
  1, 2, 4, ... at which the difference reaches `ENOUGH` counts. Rounded counts add an error of at most two counts. So
  the bound is at most ENOUGH / (ENOUGH - 2) times the largest acceleration, and at least (ENOUGH - 2) / ENOUGH times
  the largest mean over T. If no T reaches `ENOUGH`, the bound is the largest difference less two counts: so much is
  certain.

For hardware, give the bounds: an axis does not know its future motion.
"""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from .arithmetic.fixed import bits_for
from .checks import NUMBERS, FieldError, check_number, check_range, integers
from .requirements import EDGE_ERROR_COUNTS

ENOUGH = 16
"""Counts of a second difference from which an acceleration is known."""
TRAVEL_MAX = 2.0**29
"""The travel, in counts, of an axis with a 32-bit count."""
ACCELERATION_RANGE = 2.0**48
"""The largest ratio of travel or speed to C, in counts and samples, at which no estimator's words exceed int64."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The bounds of a motion, in a unit of the user's choice (the unit of `count`) and seconds.

    Attributes:
        count: size of one x4 count.
        acceleration_max: bound on the acceleration, unit/s^2; sets default gains.
        speed_max: largest speed, unit/s.
        travel: length of the travel, unit. The count wraps at four times this length in either direction, without a
            fault.
        jerk_max: bound on the jerk between impacts, unit/s^3; None for one that follows from the acceleration. It sets
            default gains of `edge-kalman`, `count-kalman` and the Levants of order 2 and 3; if it is given, of
            `kalman` too. For all but the filters of edges it has to hold at an impact.
        edge_error: RMS error of single edges, counts; sets default gains of `edge-kalman` and `count-kalman`.

    Raises:
        TypeError: if a bound is not a number.
        ValueError: if a bound is not within `checks.NUMBERS`.
    """

    count: float = 1.0
    acceleration_max: float
    speed_max: float
    travel: float
    jerk_max: float | None = None
    edge_error: float = EDGE_ERROR_COUNTS

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (name == "jerk_max" and value is None):
                check_number(name, value)
                check_range(name, value, *NUMBERS)

    @classmethod
    def of(
        cls, counts: np.ndarray, sample_hz: float, count: float = 1.0, **given: Any
    ) -> tuple[Self, dict[str, float]]:
        """Return the bounds of a record; and, by name, the bounds taken from the counts.

        Args:
            counts: integers, shape (..., samples) with two samples or more; one set of bounds for all lanes.
            sample_hz: sample rate, Hz.
            count: size of one count.
            given: bounds by name; None counts as not given.

        Raises:
            TypeError: if a bound is not a number, or the counts are not integers.
            ValueError: if a name is no bound, a bound is not within `checks.NUMBERS`, or there are too few samples.
        """
        counts = integers("counts", counts)
        if counts.ndim == 0 or counts.shape[-1] < 2 or not counts.size:
            raise ValueError(f"counts must have two samples or more, not the shape {counts.shape}")
        check_number("count", count)
        check_range("count", count, *NUMBERS)
        given = {name: value for name, value in given.items() if value is not None}
        if wrong := given.keys() - {field.name for field in fields(cls)}:
            raise FieldError(min(wrong), f"is no bound; bounds are {', '.join(field.name for field in fields(cls))}")
        travel, speed = ranges(counts)
        found = {
            "acceleration_max": max(acceleration_of(counts), least_acceleration(counts)) * count * sample_hz**2,
            "speed_max": speed * count * sample_hz,
            "travel": travel * count,
        }
        taken = {name: value for name, value in found.items() if name not in given}
        return cls(count=count, **taken, **given), taken


def ranges(counts: np.ndarray) -> tuple[float, float]:
    """Return the travel (counts) and the speed (counts a sample) of records of counts, as powers of two."""
    span = int(counts.max()) - int(counts.min())
    fastest = int(np.abs(np.diff(counts)).max())
    return min(2.0 ** bits_for(max(span, 1)), TRAVEL_MAX), 2.0 ** bits_for(fastest + 1)


def least_acceleration(counts: np.ndarray) -> float:
    """Return the least bound on the acceleration (counts a sample^2) that records of counts can give."""
    return max(2 / counts.shape[-1] ** 2, max(ranges(counts)) / ACCELERATION_RANGE)


def acceleration_of(counts: np.ndarray) -> float:
    """Return the largest acceleration (counts a sample^2) in records of counts of shape (..., samples)."""
    apart, largest = 1, 0.0
    while 2 * apart < counts.shape[-1]:
        middle = counts[..., apart:-apart]
        most = int(np.abs(counts[..., 2 * apart :] - 2 * middle + counts[..., : -2 * apart]).max())
        if most >= ENOUGH:
            return most / apart**2
        largest = max(largest, (most - 2) / apart**2)
        apart *= 2
    return largest
