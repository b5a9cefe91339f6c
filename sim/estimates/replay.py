"""Replay of recorded counts through a velocity estimator, on any backend, compared with a reference that is not causal.

With `coarsen` = N the estimator sees counts // N, and everything that is reported is in recorded counts and true
seconds, whatever N is. The floor puts coarse counts (N - 1) / 2 recorded counts too low on average; the offset is
constant, so it adds no velocity. The axis is described in `replay_axis`.

The bound C on the acceleration, from which an estimator gets its gains, is computed by `reference` unless it is given.
A recording that hardly accelerates gets a C that moves one count over its whole length, which the counts cannot
distinguish from no acceleration, or the least C that the words can hold with its travel and speed
(`replay_axis.ACCELERATION_RANGE`). A change too fast for the pins at a clock of `CLOCK_MAX_HZ` is an error.

A capture of edges has real stamps: where the counts go through pins, its own edges do (`captured`). An estimate is
judged after the first second; of a capture, which may be shorter, at most its first quarter is left out.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...model.checks import NUMBERS, shown
from ...model.encoder.quadrature_speed import max_edge_rate
from ...model.estimators import registry
from ...model.runtime.result import Summary
from ...model.runtime.whole_file import whole_file
from ...model.spec import AxisSpec
from ..loop.backends import BACKENDS, is_exact
from ..recordings.recording import EdgeRecord, Recording
from .captured import CLOCK_MAX_HZ, closest_s, coarse, position_counts, run_edges, with_clock
from .reference import REFERENCE_HZ, SETTLE_S, acceleration_bound, judged_from, zero_phase_velocity
from .replay_axis import SECOND, axis_spec, least_bound, needs_pins, run
from .settings import Settings, applied, in_counts, power_of
from .through_pins import GLITCH_CLOCKS

COARSEN_MAX = (1 << 31) - 1
EDGES_MAX = 1 << 24
"""The most edges in a sample that go through the pins: all of them are in memory."""


DERIVED = Settings()
"""The settings that all follow from C."""


class ReplayError(ValueError):
    """A replay that is refused: one line with what is wrong and what is accepted."""


class ArgumentError(ReplayError):
    """An argument of `replay` that is refused: the message begins with its name.

    Attributes:
        argument: the name of the argument.
        said: the message behind it.
    """

    def __init__(self, argument: str, said: str):
        super().__init__(f"{argument} {said}")
        self.argument, self.said = argument, said


@dataclass(frozen=True, eq=False)
class Replay(Summary):
    """The result of a replay; arrays have the recording's length, and are in recorded counts and seconds.

    Attributes:
        coarsen: divisor of the counts that the estimator saw (floor division).
        acceleration_max_counts_per_s2: the bound C that set the gains.
        gains: the gains by name, with their units.
        clock_hz: clock of the axis: that of its pins, without meaning where the counts do not go through pins.
        velocity_counts_per_s: the estimate.
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
        return _judged_from(self.recording)

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
        """Write time, recorded count, velocity and reference of every sample as CSV.

        Raises:
            OSError: if the file cannot be written.
        """
        columns = {
            "time_s": (self.recording.time_s, "%.9f"),
            "count": (self.recording.counts, "%d"),
            "velocity_counts_per_s": (self.velocity_counts_per_s, "%.12g"),
            "reference_counts_per_s": (self.reference_counts_per_s, "%.12g"),
        }
        line = ",".join(form for _, form in columns.values()) + "\n"
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
            file.write(",".join(columns) + "\n")
            file.writelines(
                line % row for row in zip(*(values.tolist() for values, _ in columns.values()), strict=True)
            )


def _one_of(name: str, value: object, accepted: tuple[str, ...], of: str = "") -> None:
    if value not in accepted:
        raise ArgumentError(name, f"{of}must be one of {', '.join(accepted)}, not {shown(value)}")


def _check_speed(recording: Recording, counts: np.ndarray, count: int, taker: str) -> None:
    """Raise ReplayError, naming the sample and who takes the counts, if a change is too fast for the pins."""
    steps = np.abs(np.diff(counts))
    most = min(max_edge_rate(CLOCK_MAX_HZ, GLITCH_CLOCKS) / recording.rate_hz, EDGES_MAX)
    if steps.max() > most:
        k = int(np.argmax(steps > most)) + 1
        coarse = "" if count == 1 else f" of {count}"
        raise ReplayError(
            f"{recording.file}, column {recording.column}: {taker} the count must change by at most "
            f"{int(most)}{coarse} in a sample at {recording.rate_hz:g} Hz (a clock of {CLOCK_MAX_HZ / 1e6:g} MHz, "
            f"and {EDGES_MAX} edges), not by {steps[k - 1]} at sample {k}, {recording.time_s[k]:g} s"
        )


def _check_names(estimator: str, output: str | None, backend: str) -> str:
    """Return the name of the output, the estimator's first for None; raise ReplayError if a name is unknown."""
    _one_of("estimator", estimator, tuple(registry.ESTIMATORS))
    outputs = registry.design_of(estimator).outputs
    output = outputs[0] if output is None else output
    _one_of("output", output, outputs, f"of {estimator} ")
    _one_of("backend", backend, BACKENDS)
    return output


def _judged_from(recording: Recording) -> int:
    """Return the number of the first sample that is judged."""
    first = judged_from(recording.rate_hz)
    return first if recording.edges is None else min(first, len(recording.counts) // 4)


def check_length(recording: Recording) -> None:
    """Raise ReplayError if no sample of a recording is judged."""
    if len(recording.counts) <= _judged_from(recording):
        raise ReplayError(
            f"{recording.file}: must be longer than {SETTLE_S:g} s, after which the estimate is judged, "
            f"not {len(recording.counts)} samples at {recording.rate_hz:g} Hz"
        )


def _check_numbers(recording: Recording, coarsen: object, bound: float | None) -> None:
    """Raise ReplayError if a recording cannot be replayed with these numbers."""
    rate = recording.rate_hz
    if isinstance(coarsen, bool) or not (isinstance(coarsen, int) and 1 <= coarsen <= COARSEN_MAX):
        raise ArgumentError("coarsen", f"must be a whole number of 1 to {COARSEN_MAX}, not {shown(coarsen)}")
    least, most = (number * (rate / SECOND) ** 2 for number in NUMBERS)
    if bound is not None and not least <= bound <= most:
        said = f"must be {least:g} to {most:g} counts/s^2 at {rate:g} Hz, not {bound!r}"
        raise ArgumentError("acceleration_max_counts_per_s2", said)


def _counts_for(recording: Recording, count: int, estimator: str, backend: str) -> np.ndarray:
    """Return the counts that the estimator sees; raise ReplayError if they go through pins and change too fast."""
    counts = recording.counts // count
    if recording.edges is not None:
        _check_edges(recording, coarse(recording.edges, count))
    elif needs_pins(estimator, backend):
        _check_speed(recording, counts, count, "on rtl" if backend == "rtl" else f"for {estimator}, which times edges,")
    return counts


def _check_edges(recording: Recording, edges: EdgeRecord) -> None:
    """Raise ReplayError if two edges fall into one clock."""
    if closest_s(edges) * CLOCK_MAX_HZ < 1:
        place = int(np.argmin(np.diff(edges.ticks))) + 1
        raise ReplayError(
            f"{recording.file}, column {recording.column}: edges must be at least {1e9 / CLOCK_MAX_HZ:g} ns apart (a "
            f"clock of {CLOCK_MAX_HZ / 1e6:g} MHz), not {closest_s(edges) * 1e9:g} ns at "
            f"{edges.ticks[place] / edges.tick_hz:g} s: if these are glitches, filter them in the capture"
        )


class Plan(NamedTuple):
    """What is derived from a recording before its counts are run.

    Attributes:
        counts: the counts that the estimator sees.
        reference_hz, reference_counts_per_s: cutoff of the reference, and the reference.
        acceleration_max_counts_per_s2: the bound C that sets the gains.
        spec: the axis.
        edges: the edges that the estimator sees; None where it sees counts.
    """

    counts: np.ndarray
    reference_hz: float
    reference_counts_per_s: np.ndarray
    acceleration_max_counts_per_s2: float
    spec: AxisSpec
    edges: EdgeRecord | None


def plan(
    recording: Recording,
    estimator: str,
    backend: str,
    coarsen: int = 1,
    acceleration_max_counts_per_s2: float | None = None,
    settings: Settings = DERIVED,
) -> Plan:
    """Derive what a replay runs; the arguments are those of `replay`.

    Raises:
        ReplayError: in one line, what is refused and what is accepted.
    """
    rate, given = recording.rate_hz, acceleration_max_counts_per_s2
    cutoff = min(REFERENCE_HZ, rate / 4)
    _check_numbers(recording, coarsen, given)
    counts = _counts_for(recording, coarsen, estimator, backend)
    whole, edges = recording.edges, None
    position = recording.counts if whole is None else position_counts(whole, rate, len(counts))
    reference = zero_phase_velocity(position, rate, cutoff)
    bound = given
    if bound is None:
        bound = max(acceleration_bound(reference, rate), least_bound(counts) * coarsen * rate**2)
    try:
        spec = axis_spec(counts, coarsen, bound / rate**2, estimator)
    except ValueError as error:
        raise _unfit(recording, estimator, bound, given is not None, error) from None
    try:
        spec = applied(spec, settings, rate)
    except ValueError as error:
        raise ArgumentError("settings", f"must give an axis (as if {SECOND} samples were a second): {error}") from None
    if whole is not None and needs_pins(estimator, backend):
        edges = coarse(whole, coarsen)
        spec = with_clock(spec, edges, rate)
    return Plan(counts, cutoff, reference, bound, spec, edges)


def _unfit(recording: Recording, estimator: str, bound: float, given: bool, error: ValueError) -> ReplayError:
    """Return the error of a bound C from which no gains follow."""
    why = f"as if {SECOND} samples were a second: {error}"
    if given:
        said = f"must give gains that fit this recording ({why}), not {bound!r}"
        return ArgumentError("acceleration_max_counts_per_s2", said)
    return ReplayError(
        f"{recording.file}, column {recording.column}: {estimator} cannot take this recording, for no gains "
        f"fit its acceleration of {bound:g} counts/s^2 ({why})"
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
        ReplayError: in one line, what is refused and what is accepted.
        RuntimeError: if the RTL could not be built.
    """
    output = _check_names(estimator, output, backend)
    rate = recording.rate_hz
    planned = plan(recording, estimator, backend, coarsen, acceleration_max_counts_per_s2, settings)
    counts, cutoff, reference, bound, spec, edges = planned
    if edges is None:
        velocity, flags, seconds = run(spec, counts, backend, output, progress)
    else:
        velocity, flags, seconds = run_edges(spec, edges, rate, len(counts), backend, output, progress)

    lsb = spec.design.estimator.velocity.lsb if is_exact(backend) else 1.0
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
        velocity_counts_per_s=velocity * (lsb * coarsen * rate),
        difference_counts_per_s=np.diff(counts, prepend=counts[0]) * (coarsen * rate),
        reference_counts_per_s=reference,
        flags=spec.design.flag_names(flags),
        velocity_sha256=hashlib.sha256(velocity.astype("<i8").tobytes()).hexdigest() if is_exact(backend) else None,
        seconds=seconds,
    )


def _gains(spec: AxisSpec, rate_hz: float) -> dict[str, float]:
    """Return the gains of an axis by name, in counts and true seconds."""
    return {
        in_counts(name): value * (rate_hz / SECOND) ** power_of(name) for name, value in vars(spec.design.gains).items()
    }
