"""The statistics of a hit, sample by sample: its mean, its RMS, its largest force and its force words."""

import hashlib
import math

import numpy as np

from ..scene.schema import Scene


class Tally:
    """Mean, RMS, largest force and force words of a run, chunk by chunk.

    Args:
        scene: the scene of the run.
        exact: whether the drives are the hardware's words, which have a digest.

    Attributes:
        largest_drive: the largest magnitude of the drive, force LSB.
        farthest_m: the largest position.
    """

    def __init__(self, scene: Scene, exact: bool):
        spec, protocol = scene.spec, scene.protocol
        self._hopeless = round(protocol.measure_s * spec.sample_hz) * (protocol.threshold_mm * 1e-3) ** 2
        self._settled = round(protocol.settle_s * spec.sample_hz)
        self._mean_from = self._settled - round(protocol.mean_s * spec.sample_hz)
        self._decimation = spec.samples_per_actuation
        self._digest = hashlib.sha256() if exact else None
        self._sum = self._squares = 0.0
        self._measured = 0
        self.largest_drive, self.farthest_m = 0, -math.inf

    @property
    def mean_m(self) -> float:
        """The mean position before the settling mark, over the samples added."""
        return self._sum / (self._settled - self._mean_from)

    @property
    def rms_m(self) -> float:
        """RMS distance from the mean after the settling mark, over the samples added; infinite if there are none."""
        return (self._squares / self._measured) ** 0.5 if self._measured else math.inf

    @property
    def sure_unstable(self) -> bool:
        """Whether the run is unstable whatever its rest: its sum of squares has reached the threshold's limit."""
        return self._squares >= self._hopeless

    @property
    def force_sha256(self) -> str | None:
        """Digest of the drives of all actuations, little-endian int32; None without the hardware's words."""
        return self._digest and self._digest.hexdigest()

    def add(self, first: int, positions: np.ndarray, drives: np.ndarray) -> None:
        """Add samples from number `first` on."""

        def part(start: int, stop: int) -> np.ndarray:
            return positions[max(start - first, 0) : max(stop - first, 0)]

        self._sum += float(part(self._mean_from, self._settled).sum())
        rest = part(self._settled, first + len(positions))
        if len(rest):
            self._squares += float(np.square(rest - self.mean_m).sum())
            self._measured += len(rest)
        self.largest_drive = max(self.largest_drive, float(np.abs(drives).max()))
        self.farthest_m = max(self.farthest_m, float(positions.max()))
        if self._digest:
            self._digest.update(drives[-first % self._decimation :: self._decimation].astype("<i4").tobytes())
