"""Replay of recorded counts through a velocity estimator, on any backend, compared with a reference that is not causal.

With `coarsen` = N the estimator sees counts // N, and everything that is reported is in recorded counts and true
seconds, whatever N is. The floor puts coarse counts (N - 1) / 2 recorded counts too low on average; the offset is
constant, so it adds no velocity. `replay_axis` describes the axis, and `replay_plan` what is derived and checked before
a run.

A capture of edges has real stamps: where the counts go through pins, its own edges do (`captured`). An estimate is
judged after the first second; of a capture, which may be shorter, at most its first quarter is left out.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ...model.estimators.acceleration import Motions
from ...model.record_time import RecordTime
from ...model.runtime.result import Summary
from ...model.runtime.whole_file import whole_file
from ...model.spec import AxisSpec
from ...model.velocity_estimator import units_of
from ..loop.backends import is_exact
from ..recordings.recording import Recording
from .captured import run_edges
from .outputs import scaled
from .replay_axis import needs_pins, run
from .replay_plan import DERIVED, check_names, first_judged, plan
from .settings import Settings, in_counts


@dataclass(frozen=True, eq=False)
class Replay(Summary):
    """The result of a replay; arrays have the recording's length, and are in recorded counts and seconds.

    Attributes:
        coarsen: divisor of the counts that the estimator saw (floor division).
        acceleration_max_counts_per_s2: the bound C that set the gains.
        gains: the gains by name, with their units.
        clock_hz: clock of the axis and of its pins; without meaning if the counts do not go through pins.
        velocity_counts_per_s: the estimate.
        acceleration_counts_per_s2: the estimator's acceleration; None if it has none.
        difference_counts_per_s: the plain finite difference of the same counts.
        reference_counts_per_s: the zero-phase derivative of the recorded counts.
        flags: names of the sticky flags that are set at the end.
        velocity_sha256: digest of the velocity words of all samples, little-endian int64; None for `float`.
        seconds: wall time of the estimator's run, without compiling and building.
    """

    recording: Recording
    coarsen: int
    estimator: str
    output: str
    backend: str
    spec: AxisSpec
    acceleration_max_counts_per_s2: float
    gains: dict[str, float]
    reference_hz: float
    velocity_counts_per_s: np.ndarray
    acceleration_counts_per_s2: np.ndarray | None
    difference_counts_per_s: np.ndarray
    reference_counts_per_s: np.ndarray
    flags: list[str]
    velocity_sha256: str | None
    seconds: float

    @property
    def clock_hz(self) -> float:
        return self.spec.clocks_per_sample * self.recording.rate_hz

    @property
    def judged_from(self) -> int:
        """The number of the first sample that is judged."""
        return first_judged(self.recording)

    @property
    def by_edges(self) -> bool:
        """Whether the estimator saw the edges of a capture, with their stamps."""
        return self.recording.edges is not None and needs_pins(self.estimator, self.backend)

    def _rms(self, velocity: np.ndarray) -> float | None:
        error = (velocity - self.reference_counts_per_s)[self.judged_from :]
        return float(np.sqrt(np.mean(error**2))) if len(error) else None

    @cached_property
    def rms_counts_per_s(self) -> float | None:
        """The RMS error of the estimate against the reference, after the first second; None for a shorter recording.

        With a `coarsen` of 1 the reference comes from the same counts that the estimator saw.
        """
        return self._rms(self.velocity_counts_per_s)

    @cached_property
    def rms_fdm_counts_per_s(self) -> float | None:
        """The RMS error of the finite difference against the reference, likewise."""
        return self._rms(self.difference_counts_per_s)

    def report(self) -> dict:
        """Return the summary that the command line prints, units in the keys; all counts are recorded counts."""
        samples = len(self.velocity_counts_per_s)
        return {
            "file": self.recording.file,
            "column": self.recording.column,
            "rate_hz": self.recording.rate_hz,
            "samples": samples,
            "coarsen": self.coarsen,
            "estimator": self.estimator,
            "output": self.output,
            "backend": self.backend,
            "acceleration_max_counts_per_s2": self.acceleration_max_counts_per_s2,
            "gains": self.gains,
            "clock_hz": self.clock_hz if self.backend == "rtl" or self.by_edges else None,
            "reference_hz": self.reference_hz,
            "rms_counts_per_s": self.rms_counts_per_s,
            "rms_fdm_counts_per_s": self.rms_fdm_counts_per_s,
            "max_abs_counts_per_s": float(np.abs(self.velocity_counts_per_s).max()),
            "flags": self.flags,
            "velocity_sha256": self.velocity_sha256,
            "seconds": self.seconds,
            "samples_per_s": samples / self.seconds,
        }

    def notes(self) -> list[str]:
        """Return whether the estimator is worse than the plain difference on this recording."""
        own, plain = self.rms_counts_per_s, self.rms_fdm_counts_per_s
        if own is None or own <= plain:
            return []
        return [
            f"{self.estimator} is worse than the plain difference on this recording: its RMS error is {own:.4g} "
            f"counts/s, that of the difference {plain:.4g} counts/s"
        ]

    def save(self, path: str | Path) -> None:
        """Write time, recorded count, velocity, acceleration if there is one, and reference of every sample as CSV.

        Raises:
            OSError: if the file cannot be written.
        """
        columns = {
            "time_s": (self.recording.time_s, "%.9f"),
            "count": (self.recording.counts, "%d"),
            "velocity_counts_per_s": (self.velocity_counts_per_s, "%.12g"),
            "acceleration_counts_per_s2": (self.acceleration_counts_per_s2, "%.12g"),
            "reference_counts_per_s": (self.reference_counts_per_s, "%.12g"),
        }
        columns = {name: column for name, column in columns.items() if column[0] is not None}
        line = ",".join(form for _, form in columns.values()) + "\n"
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
            file.write(",".join(columns) + "\n")
            file.writelines(
                line % row for row in zip(*(values.tolist() for values, _ in columns.values()), strict=True)
            )


def replay(
    recording: Recording,
    estimator: str = "levant",
    output: str | None = None,
    backend: str = "fixed",
    coarsen: int = 1,
    acceleration_max_counts_per_s2: float | None = None,
    progress: Callable[[int], None] | None = None,
    settings: Settings = DERIVED,
) -> Replay:
    """Put a recording through an estimator.

    Args:
        recording: the recording, from `recordings.load`.
        estimator: name of the estimator.
        output: name of its output; None for its first.
        backend: one of `backends.BACKENDS`.
        coarsen: divide the counts by this (floor division).
        acceleration_max_counts_per_s2: the bound C that sets the gains; None to derive it from the recording.
        progress: function called with the number of samples done.
        settings: gains and bounds that do not follow from C.

    Raises:
        ReplayError: in one line: the fault, and the accepted values.
        RuntimeError: if the RTL could not be built.
    """
    output = check_names(estimator, output, backend)
    rate = recording.rate_hz
    planned = plan(recording, estimator, backend, coarsen, acceleration_max_counts_per_s2, settings)
    counts, cutoff, reference, bound, spec, edges = planned
    if edges is None:
        made, flags, seconds = run(spec, counts, backend, output, progress)
    else:
        made, flags, seconds = run_edges(spec, edges, rate, len(counts), backend, output, progress)

    true = scaled(made, units_of(spec.design.estimator, not is_exact(backend), coarsen, rate))
    return Replay(
        recording=recording,
        coarsen=coarsen,
        estimator=estimator,
        output=output,
        backend=backend,
        spec=spec,
        acceleration_max_counts_per_s2=float(bound),
        gains=_gains(spec, rate),
        reference_hz=float(cutoff),
        velocity_counts_per_s=true.velocity,
        acceleration_counts_per_s2=true.acceleration if isinstance(true, Motions) else None,
        difference_counts_per_s=np.diff(counts, prepend=counts[0]) * (coarsen * rate),
        reference_counts_per_s=reference,
        flags=spec.design.flag_names(flags),
        velocity_sha256=hashlib.sha256(made.velocity.astype("<i8").tobytes()).hexdigest()
        if is_exact(backend)
        else None,
        seconds=seconds,
    )


def _gains(spec: AxisSpec, rate_hz: float) -> dict[str, float]:
    """Return the gains of an axis by name, in counts and true seconds."""
    return {in_counts(name): value for name, value in RecordTime(rate_hz).named(spec.design.gains).items()}
