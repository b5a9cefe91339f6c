"""Records of a run's samples, for pictures and traces."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...model.compiled import compiled
from ...model.spec import AxisSpec


class Record(NamedTuple):
    """Arrays that keep every `stride`-th sample, from when the handle first passes `trigger_m` until they are full."""

    trigger_m: float
    stride: int
    force_lsb_n: float
    mark: np.ndarray  # int64: samples kept, and the sample at which keeping began, -1 for not yet
    sample: np.ndarray  # int64
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray
    estimate: np.ndarray  # words, or float counts a sample
    force_n: np.ndarray


@dataclass(frozen=True)
class Trace:
    """Samples that a run kept; arrays of one length.

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


def new(spec: AxisSpec, number: type, trigger_m: float, stride: int, room: int) -> Record:
    """Return an empty record for `room` samples, with estimates of the type `number`."""
    position, velocity, force = (np.zeros(room) for _ in range(3))
    mark, sample = np.array([0, -1]), np.zeros(room, np.int64)
    return Record(
        trigger_m, stride, spec.force_resolution_n, mark, sample, position, velocity, np.zeros(room, number), force
    )


def trace_of(record: Record, spec: AxisSpec) -> Trace:
    """Return the samples of a record in SI units."""
    lsb = 1.0 if record.estimate.dtype == np.float64 else spec.design.estimator.velocity.lsb
    kept = slice(0, record.mark[0])
    return Trace(
        time_s=record.sample[kept] / spec.sample_hz,
        position_m=record.position_m[kept],
        velocity_m_per_s=record.velocity_m_per_s[kept],
        estimate_m_per_s=record.estimate[kept] * (lsb * spec.velocity_unit_m_per_s),
        force_n=record.force_n[kept],
    )


@compiled
def keep(record, k, motion, velocity, drive):
    """Keep sample k if it is due."""
    if record is None:
        return
    if record.mark[1] < 0 and motion.position_m >= record.trigger_m:
        record.mark[1] = k
    kept, since = record.mark[0], record.mark[1]
    if since >= 0 and (k - since) % record.stride == 0 and kept < len(record.sample):
        record.sample[kept] = k
        record.position_m[kept] = motion.position_m
        record.velocity_m_per_s[kept] = motion.velocity_m_per_s
        record.estimate[kept] = velocity
        record.force_n[kept] = drive * record.force_lsb_n
        record.mark[0] = kept + 1
