"""Recorded counts through a velocity estimator, on any backend, and held against a reference that is not causal.

The axis of a replay has units of its own, which make one piece of hardware serve any recording: the metre of its
`AxisSpec` is a *recorded count* and its second is `SECOND` *sample periods* (so long that no clock stamp of an edge
wraps meanwhile). With `coarsen` = N the axis sees counts // N, so
its count is N recorded counts, and everything that is reported is in recorded counts and true seconds, whatever N is.
The floor puts coarse counts (N - 1) / 2 recorded counts too low on average: constant, so no velocity comes of it.

What the axis must cover follows from the recording, each range rounded up to a power of two:

- travel: the span of the recording (at most what a 32-bit count has; beyond, the count wraps, which is no fault);
- speed: the largest change in a sample, and one count more;
- clock, in periods a sample: enough for the force path, and for the fastest change through the decoder
  (`quadrature.max_edge_rate`); what a clock of `CLOCK_MAX_HZ` does not let through is an error on `rtl`.

The bound C on the acceleration, from which an estimator gets its gains, is that of `reference`. It can be given
instead. A recording that hardly accelerates gets a C that moves one count over its whole length, which counts cannot
tell from none, or the least that words hold beside its travel and speed (`ACCELERATION_RANGE`).

`float` and `fixed` take the counts as they are; `rtl`, and any estimator that uses the stamps of edges, gets them
`through_pins`.
"""

import hashlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...model import axis, quadrature, stamped
from ...model.arithmetic.fixed import bits_for
from ...model.estimators import registry
from ...model.spec import AxisSpec
from ..jobs.result import Summary
from ..jobs.whole_file import whole_file
from ..world.encoder import level
from .recording import Recording
from .reference import REFERENCE_HZ, SETTLE_S, acceleration_bound, judged_from, zero_phase_velocity
from .through_pins import DECODER_CLOCKS, GLITCH_CLOCKS, run_pins

BACKENDS = ("float", "fixed", "rtl")
SECOND = 1 << 10
TRAVEL_MAX = 2.0**29
"""Of an axis with a 32-bit count."""
CLOCK_MAX_HZ = 100e6
"""Fastest clock of a replay: more counts a second are a fault of the recording, not a motion."""
ACCELERATION_RANGE = 2.0**48
"""The largest ratio of travel or speed to C, in counts and samples, at which no estimator's words exceed int64."""


class ReplayError(ValueError):
    """A replay that cannot be: one line with what is wrong and what is accepted."""


@dataclass(frozen=True, eq=False)
class Replay(Summary):
    """What an estimator made of a recording; arrays of the recording's length, in recorded counts and seconds.

    Attributes:
        coarsen: counts were floor-divided by this before the estimator saw them; None: not, and nothing is judged.
        acceleration_max_counts_per_s2: the bound C that set the gains.
        gains: by name, with their units.
        clock_hz: of the axis; its pins' clock on `rtl`, and nothing to the other backends.
        velocity_counts_per_s: the estimate.
        difference_counts_per_s: the plain finite difference of the same counts.
        reference_counts_per_s: the zero-phase derivative of the recorded counts.
        flags: sticky flags that are up at the end.
        velocity_sha256: of the velocity words of all samples, little-endian int64; None for `float`.
        seconds: wall time of the estimator's run, compiling and building apart.
    """

    recording: Recording
    coarsen: int | None
    estimator: str
    output: str
    backend: str
    spec: AxisSpec
    acceleration_max_counts_per_s2: float
    gains: dict[str, float]
    reference_hz: float
    velocity_counts_per_s: np.ndarray
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
        """Number of the first sample that is judged."""
        return judged_from(self.recording.rate_hz)

    def _rms(self, velocity: np.ndarray) -> float | None:
        error = (velocity - self.reference_counts_per_s)[self.judged_from :]
        return float(np.sqrt(np.mean(error**2))) if len(error) else None

    @cached_property
    def error_rms_counts_per_s(self) -> float | None:
        """RMS of the estimate's error against the reference, after the first second; None for a shorter recording.

        Without `coarsen` the reference is that of the very counts that the estimator saw.
        """
        return self._rms(self.velocity_counts_per_s)

    @cached_property
    def error_rms_fdm_counts_per_s(self) -> float | None:
        """The same of the finite difference."""
        return self._rms(self.difference_counts_per_s)

    @property
    def rms_counts_per_s(self) -> float | None:
        """The estimate's error where it was judged: None without `coarsen`."""
        return None if self.coarsen is None else self.error_rms_counts_per_s

    @property
    def rms_fdm_counts_per_s(self) -> float | None:
        """The same of the finite difference."""
        return None if self.coarsen is None else self.error_rms_fdm_counts_per_s

    def report(self) -> dict:
        """Return the summary that the command line prints, units in the keys; counts are recorded counts."""
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
            "clock_hz": self.clock_hz if self.backend == "rtl" else None,
            "reference_hz": self.reference_hz,
            "rms_counts_per_s": self.rms_counts_per_s,
            "rms_fdm_counts_per_s": self.rms_fdm_counts_per_s,
            "error_rms_counts_per_s": self.error_rms_counts_per_s,
            "error_rms_fdm_counts_per_s": self.error_rms_fdm_counts_per_s,
            "max_abs_counts_per_s": float(np.abs(self.velocity_counts_per_s).max()),
            "flags": self.flags,
            "velocity_sha256": self.velocity_sha256,
            "seconds": self.seconds,
            "samples_per_s": samples / self.seconds,
        }

    def save(self, path: str | Path) -> None:
        """Write time, recorded count and velocity of each sample as CSV, and the reference if there is `coarsen`.

        Raises:
            OSError: if the file cannot be written.
        """
        columns = {
            "time_s": (self.recording.time_s, "%.9f"),
            "count": (self.recording.counts, "%d"),
            "velocity_counts_per_s": (self.velocity_counts_per_s, "%.12g"),
        }
        if self.coarsen is not None:
            columns["reference_counts_per_s"] = self.reference_counts_per_s, "%.12g"
        line = ",".join(form for _, form in columns.values()) + "\n"
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
            file.write(",".join(columns) + "\n")
            file.writelines(
                line % row for row in zip(*(values.tolist() for values, _ in columns.values()), strict=True)
            )


def _power_of_two(value: float) -> float:
    """Return the least power of two that is no less than `value`."""
    return 2.0 ** bits_for(value)


def _ranges(counts: np.ndarray) -> tuple[float, float]:
    """Return the travel, counts, and the speed, counts a sample, of the axis for a recording."""
    span = int(counts.max()) - int(counts.min())
    fastest = int(np.abs(np.diff(counts)).max())
    return min(_power_of_two(max(span, 1)), TRAVEL_MAX), _power_of_two(fastest + 1)


def _least_bound(counts: np.ndarray) -> float:
    """Return the least C that is taken from a recording, counts a sample^2."""
    return max(2 / len(counts) ** 2, max(_ranges(counts)) / ACCELERATION_RANGE)


def axis_spec(counts: np.ndarray, count: int, acceleration_max: float, estimator: str) -> AxisSpec:
    """Return the axis for a recording, in units of its own; the module says how it follows.

    Args:
        counts: as the axis sees them, each `count` recorded counts.
        acceleration_max: C, recorded counts a sample^2.
    """
    fastest = int(np.abs(np.diff(counts)).max())
    travel, speed = _ranges(counts)
    # The wall and the output stage are there and do nothing: any ranges do.
    spec = AxisSpec(
        clock_hz=SECOND << 16,
        sample_hz=SECOND,
        actuation_hz=SECOND,
        count_m=float(count),
        travel_m=travel * count,
        speed_max_m_per_s=speed * count * SECOND,
        acceleration_max_m_per_s2=acceleration_max * SECOND**2,
        force_max_n=1.0,
        force_resolution_n=1.0,
        stiffness_max_n_per_m=1.0 / count,
        damping_max_n_s_per_m=1.0 / count / SECOND,
        estimator=estimator,
    )
    # The edges of an interval begin before its strobe, and must not reach into the force path of the one before.
    path = spec.design.latency_to_drive + DECODER_CLOCKS
    clocks = max(path, fastest / quadrature.max_edge_rate(1.0, GLITCH_CLOCKS))
    return replace(spec, clock_hz=int(_power_of_two(clocks)) * SECOND)


def needs_pins(estimator: str, backend: str) -> bool:
    """Return whether the counts go through pins: into hardware, or to be stamped."""
    return backend == "rtl" or registry.design_of(estimator).uses_stamps()


def run(
    spec: AxisSpec,
    counts: np.ndarray,
    backend: str,
    output: str,
    progress: Callable[[int], None] | None = None,
) -> tuple[np.ndarray, int, float]:
    """Return what an axis makes of a record of counts: (velocity words, or float counts a sample; flags; seconds).

    Args:
        spec: the axis, with clocks enough in a sample for the largest change.
        counts: int64, as the axis sees them.
        backend: one of `BACKENDS`.
        output: the estimator's output.
        progress: called with the number of samples done.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    choice = spec.design.estimator.choose(output)
    if backend == "rtl":
        from ..rtl.library import (  # noqa: PLC0415  (the other backends need neither Amaranth nor a C++ compiler)
            Hardware,
        )

        words = spec.design.encode(encoder_glitch_clocks=GLITCH_CLOCKS, **choice)
        with Hardware(spec, words, int(level(0)), short=True) as hardware:
            return run_pins(hardware.controller, hardware.start, spec, counts, progress)
    model = axis.Axis(spec, floating=backend == "float", **choice)
    if needs_pins(spec.estimator, backend):
        return run_pins(*stamped.controller(model, int(level(0))), spec, counts, progress)
    model.run(counts[:0])  # compiles
    began = time.perf_counter()
    record = model.run(counts)
    seconds = time.perf_counter() - began
    if progress:
        progress(len(counts))
    return record.velocity, int(record.flags[-1]), seconds


def _one_of(name: str, value: object, accepted: tuple[str, ...]) -> None:
    if value not in accepted:
        raise ReplayError(f"{name} must be one of {', '.join(accepted)}, not {value!r}")


def _check_speed(recording: Recording, counts: np.ndarray, count: int) -> None:
    """Raise ReplayError, with the sample, if a change is too fast for the pins."""
    steps = np.abs(np.diff(counts))
    most = quadrature.max_edge_rate(CLOCK_MAX_HZ, GLITCH_CLOCKS) / recording.rate_hz
    if steps.max() > most:
        k = int(np.argmax(steps > most)) + 1
        coarse = "" if count == 1 else f" of {count}"
        raise ReplayError(
            f"{recording.file}, column {recording.column}: on rtl the count must change by at most {int(most)}{coarse} "
            f"in a sample at {recording.rate_hz:g} Hz (a clock of {CLOCK_MAX_HZ / 1e6:g} MHz), "
            f"not by {steps[k - 1]} at sample {k}, {recording.time_s[k]:g} s"
        )


def replay(
    recording: Recording,
    estimator: str = "levant",
    output: str | None = None,
    backend: str = "fixed",
    coarsen: int | None = None,
    acceleration_max_counts_per_s2: float | None = None,
    reference_hz: float | None = None,
    progress: Callable[[int], None] | None = None,
) -> Replay:
    """Put a recording through an estimator.

    Args:
        recording: from `recording.load`.
        estimator: its name.
        output: which of its outputs; None for its first.
        backend: one of `BACKENDS`.
        coarsen: floor-divide the counts by this first, and judge the estimate; 1 judges without coarser counts.
        acceleration_max_counts_per_s2: the bound C that sets the gains; None to take it from the recording.
        reference_hz: cutoff of the reference; None for the usual one.
        progress: called with the number of samples done.

    Raises:
        ReplayError: in one line, what cannot be and what is accepted.
        RuntimeError: if the RTL could not be built.
    """
    _one_of("estimator", estimator, tuple(registry.ESTIMATORS))
    outputs = registry.design_of(estimator).outputs
    output = outputs[0] if output is None else output
    _one_of(f"output of {estimator}", output, outputs)
    _one_of("backend", backend, BACKENDS)
    if coarsen is not None and not (isinstance(coarsen, int) and 1 <= coarsen < 2**31):
        raise ReplayError(f"coarsen must be a whole number of 1 to 2**31 - 1, not {coarsen!r}")
    rate, samples = recording.rate_hz, len(recording.counts)
    if coarsen is not None and samples <= judged_from(rate):
        raise ReplayError(
            f"{recording.file}: with coarsen a recording must be longer than {SETTLE_S:g} s, after which the estimate "
            f"is judged, not {samples} samples at {rate:g} Hz"
        )
    cutoff = min(REFERENCE_HZ, rate / 4) if reference_hz is None else reference_hz
    if not 0 < cutoff < rate / 2:
        raise ReplayError(f"reference_hz must be more than 0 and less than {rate / 2:g}, half the rate, not {cutoff!r}")
    bound = acceleration_max_counts_per_s2
    if bound is not None and not (math.isfinite(bound) and bound > 0):
        raise ReplayError(f"acceleration_max_counts_per_s2 must be finite and more than 0, not {bound!r}")

    count = coarsen or 1
    counts = recording.counts // count
    if needs_pins(estimator, backend):
        _check_speed(recording, counts, count)
    reference = zero_phase_velocity(recording.counts, rate, cutoff)
    if bound is None:
        bound = max(acceleration_bound(reference, rate), _least_bound(counts) * count * rate**2)
    try:
        spec = axis_spec(counts, count, bound / rate**2, estimator)
    except ValueError as error:
        raise ReplayError(
            f"acceleration_max_counts_per_s2 must give gains that fit this recording (as if {SECOND} samples were a "
            f"second: {error}), not {bound!r}"
        ) from None
    velocity, flags, seconds = run(spec, counts, backend, output, progress)

    exact = backend != "float"
    lsb = spec.design.estimator.velocity.lsb if exact else 1.0
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
        velocity_counts_per_s=velocity * (lsb * count * rate),
        difference_counts_per_s=np.diff(counts, prepend=counts[0]) * (count * rate),
        reference_counts_per_s=reference,
        flags=spec.design.flag_names(flags),
        velocity_sha256=hashlib.sha256(velocity.astype("<i8").tobytes()).hexdigest() if exact else None,
        seconds=seconds,
    )


def _gains(spec: AxisSpec, rate_hz: float) -> dict[str, float]:
    """Return the gains of an axis by name, in counts and true seconds."""
    powers = {"_per_s2": 2, "_per_s": 1, "_hz": 1, "_s": -1}  # of one over time, by the ending of the name
    return {
        name.replace("_m_", "_counts_"): value
        * (rate_hz / SECOND) ** next((power for ending, power in powers.items() if name.endswith(ending)), 0)
        for name, value in vars(spec.design.gains).items()
    }
