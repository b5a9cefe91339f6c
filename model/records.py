"""A velocity in one call: records of counts, or of edges with their times, through an estimator of the hardware."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .axis.axis import Axis
from .counter import check_bits, cure, unwrapped
from .edge_times import clocks_of, samples_of, since_first
from .encoder.level import level
from .motion import Motion
from .record_axis import DECODER_CLOCKS, axis_of
from .record_time import RecordTime
from .stamped import run
from .velocity_estimator import VelocityEstimator, check_of_counts, is_floating, output_of

CLOCK_HZ, CLOCKS = 100e6, 1 << 16
"""The lowest rate of the stamping clock, Hz, unless a sample would then have more clocks than this number."""
CLOCK_RANGE = 1e-6, 2.0**48
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
    and takes some time to settle. `VelocityEstimator` takes a record in pieces.

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
        settings: further bounds (`speed_max`, unit/s; `travel`, unit; see `motion.Motion`). `count_bits`: the width of
            a counter that wraps. `gains`: the estimator's gains. Others are run-time words by name, in seconds and the
            unit of `count`. A word may be an array with a value for each lane: it is broadcast against the other axes.

    Returns:
        float64 in the shape of the counts; if words are arrays, in the shape to which both broadcast.

    Warns:
        RecordWarning: if bounds come from the record, because a velocity then depends on later counts too; and if a
            flag was raised. The message gives the bounds.

    Raises:
        TypeError: if an argument is of the wrong type.
        ValueError: if a name is unknown, a value is out of range, or there are fewer than two samples.
    """
    array = np.moveaxis(checks.integers("counts", counts), axis, -1)
    if array.shape[-1] < 2:
        raise ValueError(f"counts must have two samples or more along axis {axis}, not {array.shape[-1]}")
    if not array.size:
        return np.zeros(np.shape(counts))
    is_floating(backend)
    check_of_counts(estimator)
    output_of(estimator, output)
    bits = settings.pop("count_bits", None)
    check_bits(bits)
    whole = unwrapped(array, bits)
    motion, found = _motion(whole, sample_hz, count, acceleration_max, settings)
    taken = VelocityEstimator(sample_hz, estimator, motion, output, backend, **settings)
    made = taken(np.moveaxis(whole, -1, axis), axis)
    _tell(found, taken.flags, cure(int(np.abs(np.diff(whole)).max())))
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
    """Return the velocity at `sample_hz` from the times of an encoder's edges, as the hardware estimates it.

    If two edges are more than a second and more than 1024 samples apart, the velocity may read 0 between them, as in
    hardware.

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
    floating, output = is_floating(backend), output_of(estimator, output)
    array = checks.integers("counts", counts)
    since, unsure_s = since_first(times_s, array)
    time = RecordTime(sample_hz)
    clock_hz, gains = settings.pop("clock_hz", None), settings.pop("gains", None)
    if clock_hz is None:
        clock_hz = max(min(CLOCK_HZ, CLOCKS * sample_hz), 1 / np.diff(since).min())
    checks.check_number("clock_hz", clock_hz)
    checks.check_range("clock_hz", clock_hz, *CLOCK_RANGE)
    sampled = samples_of(since, array, sample_hz, unsure_s)
    motion, found = _motion(sampled, sample_hz, count, acceleration_max, settings)
    spec = axis_of(motion, time, estimator, gains, clock_hz / sample_hz)
    design, timing = spec.design.estimator, spec.design.timing
    words = time.words(word for word in design.words if word.name != design.output_word())
    axis = Axis(spec, floating, **time.settings(words, settings), **design.choose(output))
    clocks = clocks_of(since, sample_hz * spec.clocks_per_sample, unsure_s)
    # The count at a strobe is the count DECODER_CLOCKS before it. The record starts at the strobe of sample 0.
    first = timing.strobe - DECODER_CLOCKS
    record = run(axis, first + clocks[1:], level(array[1:] - array[0]), len(sampled), int(level(0)))
    _tell(found, spec.design.flag_names(int(record.flags[-1])))
    lsb = 1.0 if floating else design.velocity.lsb
    return record.velocity[1:] * (lsb * count * sample_hz)


def _motion(
    counts: np.ndarray, sample_hz: float, count: float, acceleration_max: float | None, settings: dict[str, Any]
) -> tuple[Motion, dict[str, float]]:
    """Return the bounds of a record, from the settings or else from the counts; and by name those from the counts."""
    RecordTime(sample_hz)
    given = {name: settings.pop(name, None) for name in BOUNDS}
    return Motion.of(counts, sample_hz, count, acceleration_max=acceleration_max, **given)


def _tell(found: dict[str, float], flags: list[str], hint: str = "") -> None:
    """Warn the caller's caller of bounds that come from the record, and of flags."""
    if found:
        said = ", ".join(f"{name}={value:.6g}" for name, value in found.items())
        warnings.warn(f"{said}: taken from the record, because not given{hint}", RecordWarning, stacklevel=3)
    if flags:
        cures = "; a larger speed_max may help" if "velocity_saturated" in flags else ""
        warnings.warn(f"raised flags: {', '.join(flags)}{cures}{hint}", RecordWarning, stacklevel=3)
