"""The record of a run's samples, for pictures and traces."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled
from ...model.spec import AxisSpec


class Extremes(NamedTuple):
    """The least and the largest value from each kept sample up to the next one.

    Every tenth sample of a small cycle of two, as of a differentiator at rest, shows one side of it only.
    """

    error_least_m_per_s: np.ndarray  # of the estimate minus the true velocity
    error_largest_m_per_s: np.ndarray
    force_least_n: np.ndarray
    force_largest_n: np.ndarray


class Kept(NamedTuple):
    """Arrays that keep every `stride`-th sample, from when the handle first passes `trigger_m` until they are full."""

    trigger_m: float
    stride: int
    velocity_lsb_m_per_s: float
    force_lsb_n: float
    mark: np.ndarray  # int64: samples kept, and the sample at which keeping began, -1 for not yet
    sample: np.ndarray  # int64
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray
    estimate: np.ndarray  # words, or float counts a sample
    force_n: np.ndarray
    extremes: Extremes | None  # None if every sample is kept


@dataclass(frozen=True)
class Trace:
    """Consecutive samples that a run kept; arrays of one length.

    Attributes:
        time_s: time of each sample.
        position_m, velocity_m_per_s: the handle's true position and velocity.
        estimate_m_per_s: the estimator's output.
        force_n: force of the wall on the handle, by the drive after the sample.
    """

    time_s: np.ndarray
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray
    estimate_m_per_s: np.ndarray
    force_n: np.ndarray


@dataclass(frozen=True)
class Overview(Trace):
    """Samples at equal distances, and what happens between them; arrays of one length.

    Attributes:
        error_least_m_per_s, error_largest_m_per_s: the ends of the estimate's error from each sample up to the next.
        force_least_n, force_largest_n: the ends of the force, likewise.
    """

    error_least_m_per_s: np.ndarray
    error_largest_m_per_s: np.ndarray
    force_least_n: np.ndarray
    force_largest_n: np.ndarray


def overview(spec: AxisSpec, number: type, samples: int, points: int) -> Kept:
    """Return empty arrays for about `points` of all samples of a run, with estimates of the type `number`."""
    stride = max(1, samples // points)
    room = samples // stride + 1
    return _new(spec, number, -np.inf, stride, room, Extremes(*(np.zeros(room) for _ in Extremes._fields)))


def detail(spec: AxisSpec, number: type, trigger_m: float, room: int) -> Kept:
    """Return empty arrays for every sample from `trigger_m` on, with estimates of the type `number`."""
    return _new(spec, number, trigger_m, 1, room, None)


def _new(spec: AxisSpec, number: type, trigger_m: float, stride: int, room: int, extremes: Extremes | None) -> Kept:
    """Return empty arrays for `room` samples."""
    lsb = 1.0 if number is np.float64 else spec.design.estimator.velocity.lsb
    return Kept(
        trigger_m=trigger_m,
        stride=stride,
        velocity_lsb_m_per_s=lsb * spec.velocity_unit_m_per_s,
        force_lsb_n=spec.force_resolution_n,
        mark=np.array([0, -1]),
        sample=np.zeros(room, np.int64),
        position_m=np.zeros(room),
        velocity_m_per_s=np.zeros(room),
        estimate=np.zeros(room, number),
        force_n=np.zeros(room),
        extremes=extremes,
    )


def trace_of(kept: Kept, spec: AxisSpec) -> Trace:
    """Return the samples that were kept, in SI units; an `Overview` if there are extremes."""
    filled = slice(0, kept.mark[0])
    extremes = kept.extremes._asdict() if kept.extremes else {}
    return (Overview if extremes else Trace)(
        time_s=kept.sample[filled] / spec.sample_hz,
        position_m=kept.position_m[filled],
        velocity_m_per_s=kept.velocity_m_per_s[filled],
        estimate_m_per_s=kept.estimate[filled] * kept.velocity_lsb_m_per_s,
        force_n=kept.force_n[filled],
        **{name: values[filled] for name, values in extremes.items()},
    )


@compiled
def keep(kept, k, motion, velocity, drive):
    """Keep sample k if it is due, or else what is extreme in it."""
    if kept is None:
        return
    if kept.mark[1] < 0 and motion.position_m >= kept.trigger_m:
        kept.mark[1] = k
    count, since = kept.mark[0], kept.mark[1]
    if since < 0:
        return
    due = (k - since) % kept.stride == 0 and count < len(kept.sample)
    if due:
        kept.sample[count] = k
        kept.position_m[count] = motion.position_m
        kept.velocity_m_per_s[count] = motion.velocity_m_per_s
        kept.estimate[count] = velocity
        kept.force_n[count] = drive * kept.force_lsb_n
        kept.mark[0] = count + 1
    error = velocity * kept.velocity_lsb_m_per_s - motion.velocity_m_per_s
    _widen(kept.extremes, kept.mark[0] - 1, due, error, drive * kept.force_lsb_n)


@compiled
def _widen(extremes, row, begins, error_m_per_s, force_n):
    """Widen a row of extremes to the values of another sample, or begin it with them."""
    if extremes is None:
        return
    if begins or error_m_per_s < extremes.error_least_m_per_s[row]:
        extremes.error_least_m_per_s[row] = error_m_per_s
    if begins or error_m_per_s > extremes.error_largest_m_per_s[row]:
        extremes.error_largest_m_per_s[row] = error_m_per_s
    if begins or force_n < extremes.force_least_n[row]:
        extremes.force_least_n[row] = force_n
    if begins or force_n > extremes.force_largest_n[row]:
        extremes.force_largest_n[row] = force_n
