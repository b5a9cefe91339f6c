"""A velocity in one call: records of counts, or of edges with their times, through an estimator of the hardware."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .axis.axis import Axis
from .encoder.level import level
from .motion import Motion
from .record_axis import DECODER_CLOCKS, axis_of
from .record_time import RecordTime
from .stamped import run
from .velocity_estimator import VelocityEstimator, chosen

CLOCK_HZ, CLOCKS = 100e6, 1 << 16
"""The clock that stamps edges is at least so fast, but for what it has in a sample beyond so many clocks."""
BOUNDS = "acceleration_max", "speed_max", "travel", "jerk_max", "edge_error"


class RecordWarning(UserWarning):
    """What a velocity rests on beside its arguments: bounds from the record, or words that saturated."""


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

    Causal: a velocity uses the counts up to its sample. `VelocityEstimator` takes a record in pieces.

    Args:
        counts: integers, shape (..., samples), with two samples or more along `axis`; other axes are independent.
        sample_hz: sample rate, Hz, `record_time.RATES`; it need not be whole.
        estimator: name of an estimator that needs only counts: see `estimators.registry`.
        count: size of a count; the result is in its unit per second. 1 gives counts/s.
        acceleration_max: bound on the acceleration, unit/s^2, from which default gains follow. None: from the record.
        output: the estimator's output; None for its first.
        backend: `fixed` for the hardware's words, `float` for the same algorithm in float64 with unrounded gains.
        axis: the axis of time.
        settings: further bounds (`speed_max`, unit/s; `travel`, unit; see `motion.Motion`), the estimator's `gains`,
            and run-time words by name, in seconds and the unit of `count`. A word may be an array: it is broadcast
            against the other axes, a value a lane.

    Returns:
        float64, the shape of the counts; where words are arrays, the shape to which both broadcast.

    Warns:
        RecordWarning: with the bounds that come from the record, for they make a velocity depend on later counts; and
            if a word saturated.

    Raises:
        TypeError: if an argument is of the wrong type.
        ValueError: if a name is unknown, a value is out of range, or there are fewer than two samples.
    """
    array = checks.integers("counts", counts)
    if array.ndim == 0 or not -array.ndim <= axis < array.ndim or array.shape[axis] < 2 or not array.size:
        raise ValueError(f"counts must have two samples or more along axis {axis!r}, not the shape {array.shape}")
    chosen(estimator, output, backend)
    moved = np.moveaxis(array, axis, -1)
    motion = _motion(moved.reshape(-1, moved.shape[-1]), sample_hz, count, acceleration_max, settings)
    taken = VelocityEstimator(sample_hz, estimator, motion, output, backend, **settings)
    made = taken(array, axis)
    _tell_flags(taken.flags)
    return made


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
    """Return the velocity at a rate of its own, from an encoder's edges and their times, as the hardware estimates it.

    Args:
        times_s: s, shape (edges,), increasing: the start of the record, and the time of every edge.
        counts: integers of the same shape: the count at the start, and behind every edge. An edge changes it by 1.
        sample_hz: rate of the velocities, Hz.
        estimator: name of an estimator, by stamps of edges or not: see `estimators.registry`.
        count, acceleration_max, output, backend: as of `velocity`.
        settings: as of `velocity`, and `clock_hz`, the least rate of the clock that stamps edges, Hz. Without it,
            the clock tells the closest edges apart, and is 100 MHz, or 65 536 clocks a sample if that is less.

    Returns:
        float64, shape (samples,): the velocity at times_s[0] + k / sample_hz, from k = 1 to the last edge. An edge at
        the time of a sample counts for it. Times are rounded up to the clock.

    Warns, Raises:
        As `velocity`; ValueError also if times do not increase, a count changes by another number than 1, or edges
        come faster than the clock.
    """
    output, time = chosen(estimator, output, backend), RecordTime(sample_hz)
    times, array = _edges(times_s, counts)
    least = max(min(CLOCK_HZ, CLOCKS * sample_hz), 1 / np.diff(times).min())
    clock_hz, gains = settings.pop("clock_hz", least), settings.pop("gains", None)
    checks.check_number("clock_hz", clock_hz)
    sampled = _sampled(times, array, sample_hz)
    motion = _motion(sampled[None], sample_hz, count, acceleration_max, settings)
    spec = axis_of(motion, time, estimator, gains, clock_hz / sample_hz)
    design, timing = spec.design.estimator, spec.design.timing
    words = {word.name: word for word in design.words if word.name != design.output_word()}
    _, scaled = time.encode(words, settings)
    clocks = _clocks(times, sample_hz * spec.clocks_per_sample)
    # The count at a strobe is that of DECODER_CLOCKS before it; the record starts at the strobe of sample 0.
    first = timing.strobe - DECODER_CLOCKS
    record = run(
        Axis(spec, backend == "float", **scaled, **design.choose(output)),
        first + clocks[1:],
        level(array[1:] - array[0]),
        len(sampled),
        int(level(0)),
    )
    _tell_flags(spec.design.flag_names(int(record.flags[-1])))
    lsb = 1.0 if backend == "float" else design.velocity.lsb
    return record.velocity[1:] * (lsb * count * sample_hz)


def _edges(times_s: ArrayLike, counts: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return the times and counts of edges as float64 and int64."""
    array, times = checks.integers("counts", counts), np.asarray(times_s)
    if times.dtype.kind not in "fiu":
        raise TypeError(f"times_s must be numbers, not {times.dtype}")
    times = times.astype(np.float64)
    if times.ndim != 1 or times.shape != array.shape or len(times) < 2:
        raise ValueError(
            f"times_s and counts must have one shape (edges,) of 2 or more, not {times.shape} and {array.shape}"
        )
    if (wrong := np.flatnonzero(~np.isfinite(times))).size:
        raise ValueError(f"times_s must be finite, not {times[wrong[0]]} at element {wrong[0]}")
    if (wrong := np.flatnonzero(np.diff(times) <= 0)).size:
        raise ValueError(
            f"times_s must increase, not from {times[wrong[0]]:g} to {times[wrong[0] + 1]:g} at element {wrong[0] + 1}"
        )
    steps = np.diff(array)
    if (wrong := np.flatnonzero(np.abs(steps) != 1)).size:
        raise ValueError(f"counts must change by 1 at an edge, not by {steps[wrong[0]]} at element {wrong[0] + 1}")
    return times, array


def _sampled(times: np.ndarray, counts: np.ndarray, sample_hz: float) -> np.ndarray:
    """Return the counts at the samples, from the start to the last edge."""
    lasts = times[-1] - times[0]
    samples = int(np.floor(lasts * sample_hz))
    if samples < 1:
        raise ValueError(f"times_s must last a sample of {1 / sample_hz:g} s or more, not {lasts:g} s")
    at = times[0] + np.arange(samples + 1) / sample_hz
    return counts[np.searchsorted(times, at, side="right") - 1]


def _clocks(times: np.ndarray, clock_hz: float) -> np.ndarray:
    """Return the clocks of edges, int64: their times since the first, rounded up."""
    clocks = np.ceil((times - times[0]) * clock_hz)
    if (close := np.flatnonzero(np.diff(clocks) < 1)).size:
        raise ValueError(
            f"times_s must be a clock of {1 / clock_hz:g} s apart or more, not "
            f"{times[close[0] + 1] - times[close[0]]:g} s at element {close[0] + 1}; clock_hz gives a faster clock"
        )
    return clocks.astype(np.int64)


def _motion(
    counts: np.ndarray, sample_hz: float, count: float, acceleration_max: float | None, settings: dict[str, Any]
) -> Motion:
    """Return the bounds for a record, taken out of the settings or from the counts; warn of the latter."""
    RecordTime(sample_hz)
    given = {name: settings.pop(name, None) for name in BOUNDS[1:]}
    motion, found = Motion.of(counts, sample_hz, count, acceleration_max=acceleration_max, **given)
    if found:
        said = ", ".join(f"{name}={value:.6g}" for name, value in found.items())
        warnings.warn(f"{said}: from the record, because not given", RecordWarning, stacklevel=3)
    return motion


def _tell_flags(flags: list[str]) -> None:
    if flags:
        warnings.warn(
            f"{', '.join(flags)}: larger bounds (speed_max, acceleration_max) may help", RecordWarning, stacklevel=3
        )
