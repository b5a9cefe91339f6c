"""Records of a run's samples, for pictures and traces."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...model.compiled import compiled
from ...model.spec import AxisSpec


class Extremes(NamedTuple):
    """The least and the largest value from each kept sample up to the next one.

    Every tenth sample of a small cycle of two, as of a differentiator at rest, shows one side of it only.
    """

    error_least_m_per_s: np.ndarray  # of the estimate minus the true velocity
    error_largest_m_per_s: np.ndarray
    force_least_n: np.ndarray
    force_largest_n: np.ndarray


class Record(NamedTuple):
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


def overview(spec: AxisSpec, number: type, samples: int, points: int) -> Record:
    """Return an empty record for about `points` of all samples of a run, with estimates of the type `number`."""
    stride = max(1, samples // points)
    room = samples // stride + 1
    return _new(spec, number, -np.inf, stride, room, Extremes(*(np.zeros(room) for _ in Extremes._fields)))


def detail(spec: AxisSpec, number: type, trigger_m: float, room: int) -> Record:
    """Return an empty record for every sample from `trigger_m` on, with estimates of the type `number`."""
    return _new(spec, number, trigger_m, 1, room, None)


def _new(spec: AxisSpec, number: type, trigger_m: float, stride: int, room: int, extremes: Extremes | None) -> Record:
    """Return an empty record for `room` samples."""
    lsb = 1.0 if number is np.float64 else spec.design.estimator.velocity.lsb
    return Record(
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


def trace_of(record: Record, spec: AxisSpec) -> Trace:
    """Return the samples of a record in SI units; an `Overview` if it has extremes."""
    kept = slice(0, record.mark[0])
    extremes = record.extremes._asdict() if record.extremes else {}
    return (Overview if extremes else Trace)(
        time_s=record.sample[kept] / spec.sample_hz,
        position_m=record.position_m[kept],
        velocity_m_per_s=record.velocity_m_per_s[kept],
        estimate_m_per_s=record.estimate[kept] * record.velocity_lsb_m_per_s,
        force_n=record.force_n[kept],
        **{name: values[kept] for name, values in extremes.items()},
    )


@compiled
def keep(record, k, motion, velocity, drive):
    """Keep sample k if it is due, or else what is extreme in it."""
    if record is None:
        return
    if record.mark[1] < 0 and motion.position_m >= record.trigger_m:
        record.mark[1] = k
    kept, since = record.mark[0], record.mark[1]
    if since < 0:
        return
    due = (k - since) % record.stride == 0 and kept < len(record.sample)
    if due:
        record.sample[kept] = k
        record.position_m[kept] = motion.position_m
        record.velocity_m_per_s[kept] = motion.velocity_m_per_s
        record.estimate[kept] = velocity
        record.force_n[kept] = drive * record.force_lsb_n
        record.mark[0] = kept + 1
    error = velocity * record.velocity_lsb_m_per_s - motion.velocity_m_per_s
    _widen(record.extremes, record.mark[0] - 1, due, error, drive * record.force_lsb_n)


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
