"""A velocity in one call, alone or with the acceleration: records of counts, or of edges, through an estimator."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .counter import check_span, cure, modulus_of, unwrapped
from .edge_times import check_edges, samples_of, since, times_of
from .edge_velocity_estimator import EdgeVelocityEstimator, default_clock_hz
from .motion import Motion
from .record_time import RecordTime
from .velocity_estimator import VelocityEstimator, check_accelerated, check_of_counts, is_floating, output_of

BOUNDS = "speed_max", "travel", "jerk_max", "edge_error"
"""The bounds of a motion that are settings."""


class RecordWarning(UserWarning):
    """A velocity depends on more than the arguments: on bounds taken from the record, or on a value that raised a
    flag."""


def velocity(
    counts: ArrayLike,
    sample_hz: float,
    estimator: str = "kalman",
    count: float = 1.0,
    acceleration_max: float | None = None,
    output: str | None = None,
    backend: str = "fixed",
    axis: int = -1,
    **settings: Any,
) -> np.ndarray:
    """Return the velocity at every sample of an encoder's counts, as the hardware estimates it.

        velocity(counts, 10e3, count=1e-6)               # m/s, of counts of 1 um at 10 kHz

    Causal, if the bounds are given: a velocity then depends on the counts up to its sample. An estimator starts at 0
    and takes some time to settle. `VelocityEstimator` takes a record in pieces. `velocity_and_acceleration` has the
    acceleration, too.

    Args:
        counts: integers, shape (..., samples), with two samples or more along `axis`; other axes are lanes of one
            motion, with the same bounds.
        sample_hz: sample rate, Hz, `record_time.RATES`; it need not be whole.
        estimator: name of an estimator that needs only counts: see `estimators.registry`.
        count: size of a count; the result is in its unit per second. 1 gives counts/s.
        acceleration_max: bound on the acceleration, unit/s^2, from which default gains follow. None: taken from the
            record.
        output: the estimator's output; None for its first.
        backend: `fixed` for the hardware's words, `float` for the same algorithm in float64 with unrounded gains.
        axis: the axis of time.
        settings: bounds (`speed_max`, unit/s; `travel`, unit; see `motion.Motion`). `count_bits` or `count_modulus`:
            the range of a counter that wraps. `gains`: the estimator's gains. Others are run-time words, in seconds and
            the unit of `count`, or arrays of them with a value a lane, broadcast against the other axes.

    Returns:
        float64 in the shape of the counts; if words are arrays, in the shape to which both broadcast.

    Warns:
        RecordWarning: if bounds come from the record, because a velocity then depends on later counts too; and if a
            flag was raised. The message gives the bounds.

    Raises:
        TypeError: if an argument is of the wrong type.
        ValueError: if a name is unknown, a value is out of range, or there are fewer than two samples.
    """
    how = {"count": count, "acceleration_max": acceleration_max, "output": output, "backend": backend, "axis": axis}
    return _of_counts(False, counts, sample_hz, estimator, how | settings)[0]


def velocity_and_acceleration(
    counts: ArrayLike, sample_hz: float, estimator: str = "kalman", **settings: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity and the acceleration at every sample of an encoder's counts, as the hardware estimates them.

        v, a = velocity_and_acceleration(counts, 10e3, count=1e-6)        # m/s and m/s^2

    Args:
        counts, sample_hz: as of `velocity`.
        estimator: name of an estimator that has an acceleration and needs only counts.
        settings: the other arguments of `velocity`, and its settings.

    Returns:
        Two arrays in the shape that `velocity` returns, in the unit of `count` per second, and per second squared. Both
        belong to the same moments.

    Warns, Raises:
        As `velocity`; ValueError also if the estimator has no acceleration, with those that have.
    """
    check_accelerated(estimator)
    velocities, accelerations = _of_counts(True, counts, sample_hz, estimator, settings)
    return velocities, accelerations


def velocity_of_edges(
    times_s: ArrayLike,
    counts: ArrayLike,
    sample_hz: float,
    estimator: str = "edge-kalman",
    count: float = 1.0,
    acceleration_max: float | None = None,
    output: str | None = None,
    backend: str = "fixed",
    **settings: Any,
) -> np.ndarray:
    """Return the velocity at `sample_hz` from the times of an encoder's edges, as the hardware estimates it.

    Edges that are more than a second apart, and more than 1024 samples, may read as standstill, as in hardware.
    `EdgeVelocityEstimator` takes a record in pieces. `velocity_and_acceleration_of_edges` has the acceleration, too.

    Args:
        times_s: s, shape (edges,), increasing: the start of the record, and the time of every edge. Integers (whole
            seconds) and `datetime64` keep a resolution that float64 loses far from 0.
        counts: integers of the same shape: the count at the start, and after every edge. An edge changes it by 1.
        sample_hz: rate of the velocities, Hz; at most `edge_times.SAMPLES_MAX` samples.
        estimator: name of an estimator, see `estimators.registry`; one that needs edges or one that needs only counts.
        count, acceleration_max, output, backend: as of `velocity`.
        settings: as of `velocity`, but words are numbers. `clock_hz`: the least rate of the clock that stamps edges,
            Hz. None: 100 MHz, or 65 536 clocks a sample if that is slower, but fast enough to tell the closest edges
            apart.

    Returns:
        float64, shape (samples,): the velocity at times_s[0] + k / sample_hz, from k = 1 to the last edge. An edge at
        the time of a sample counts for it. Times are rounded up to the clock.

    Warns, Raises:
        As `velocity`; ValueError also if times do not increase, a count changes by another number than 1, or edges
        come faster than the clock.
    """
    how = {"count": count, "acceleration_max": acceleration_max, "output": output, "backend": backend}
    return _of_edges(False, times_s, counts, sample_hz, estimator, how | settings)[0]


def velocity_and_acceleration_of_edges(
    times_s: ArrayLike, counts: ArrayLike, sample_hz: float, estimator: str = "edge-kalman", **settings: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity and the acceleration at `sample_hz` from the times of an encoder's edges.

    Args:
        times_s, counts, sample_hz: as of `velocity_of_edges`.
        estimator: name of an estimator that has an acceleration.
        settings: the other arguments of `velocity_of_edges`, and its settings.

    Returns:
        Two arrays in the shape that `velocity_of_edges` returns, in the unit of `count` per second, and per second
        squared. Both belong to the same moments.

    Warns, Raises:
        As `velocity_of_edges`; ValueError also if the estimator has no acceleration, with those that have.
    """
    check_accelerated(estimator)
    velocities, accelerations = _of_edges(True, times_s, counts, sample_hz, estimator, settings)
    return velocities, accelerations


def _of_counts(
    both: bool, counts: ArrayLike, sample_hz: float, estimator: str, settings: dict[str, Any]
) -> tuple[np.ndarray, ...]:
    """Return the velocities of a record of counts; with `both` the accelerations, too.

    Args:
        both: whether the accelerations are wanted.
        counts, sample_hz, estimator: as of `velocity`.
        settings: all other arguments of `velocity`, and its settings; those that are not given have its defaults.
    """
    left: dict[str, Any] = {"count": 1.0, "acceleration_max": None, "output": None, "backend": "fixed", "axis": -1}
    left |= settings
    axis, output, backend = left.pop("axis"), left.pop("output"), left.pop("backend")
    array = np.moveaxis(checks.integers("counts", counts), axis, -1)
    if array.shape[-1] < 2:
        raise ValueError(f"counts must have two samples or more along axis {axis}, not {array.shape[-1]}")
    if not array.size:
        return np.zeros(np.shape(counts)), np.zeros(np.shape(counts))
    is_floating(backend)
    check_of_counts(estimator)
    output_of(estimator, output)
    modulus = modulus_of(left.pop("count_bits", None), left.pop("count_modulus", None))
    check_span(array, modulus)
    whole = unwrapped(array, modulus)
    motion, found = _motion(whole, sample_hz, left.pop("count"), left.pop("acceleration_max"), left)
    taken = VelocityEstimator(sample_hz, estimator, motion, output, backend, **left)
    moved = np.moveaxis(whole, -1, axis)
    made = taken.with_acceleration(moved, axis) if both else (taken(moved, axis),)
    _tell(found, taken.flags, cure(int(np.abs(np.diff(whole)).max())))
    return made


def _of_edges(
    both: bool, times_s: ArrayLike, counts: ArrayLike, sample_hz: float, estimator: str, settings: dict[str, Any]
) -> tuple[np.ndarray, ...]:
    """Return the velocities of a record of edges; with `both` the accelerations, too.

    Args:
        both: whether the accelerations are wanted.
        times_s, counts, sample_hz, estimator: as of `velocity_of_edges`.
        settings: all other arguments of `velocity_of_edges`, and its settings; those that are not given have its
            defaults.
    """
    left: dict[str, Any] = {"count": 1.0, "acceleration_max": None, "output": None, "backend": "fixed"} | settings
    output, backend = left.pop("output"), left.pop("backend")
    RecordTime(sample_hz)
    times, array = times_of(times_s), checks.integers("counts", counts)
    if times.ndim != 1 or times.shape != array.shape or len(times) < 2:
        raise ValueError(
            f"times_s and counts must have one shape (edges,) of 2 or more, not {times.shape} and {array.shape}"
        )
    check_edges(times, array)
    passed = since(times[0], times)
    clock_hz, gains = left.pop("clock_hz", None), left.pop("gains", None)
    if clock_hz is None:
        clock_hz = max(default_clock_hz(sample_hz), 1 / np.diff(passed.since_s).min())
    seen = samples_of(passed, array, sample_hz)
    motion, found = _motion(seen, sample_hz, left.pop("count"), left.pop("acceleration_max"), left)
    taken = EdgeVelocityEstimator(sample_hz, estimator, motion, output, backend, gains, clock_hz, **left)
    made = taken.with_acceleration(times, array) if both else (taken(times, array),)
    _tell(found, taken.flags)
    return made


def _motion(
    counts: np.ndarray, sample_hz: float, count: float, acceleration_max: float | None, settings: dict[str, Any]
) -> tuple[Motion, dict[str, float]]:
    """Return the bounds of a record, from the settings or else from the counts; and by name those from the counts."""
    RecordTime(sample_hz)
    given = {name: settings.pop(name, None) for name in BOUNDS}
    return Motion.of(counts, sample_hz, count, acceleration_max=acceleration_max, **given)


def _tell(found: dict[str, float], flags: list[str], hint: str = "") -> None:
    """Warn the user, who is three calls up, of bounds that come from the record, and of flags."""
    if found:
        said = ", ".join(f"{name}={value:.6g}" for name, value in found.items())
        warnings.warn(f"{said}: taken from the record, because not given{hint}", RecordWarning, stacklevel=4)
    if flags:
        cures = "; a larger speed_max may help" if "velocity_saturated" in flags else ""
        warnings.warn(f"raised flags: {', '.join(flags)}{cures}{hint}", RecordWarning, stacklevel=4)
