"""The plan of a replay: the checks of its arguments, the reference, the bound C and the axis, before anything is run.

The bound C on the acceleration, from which an estimator gets its gains, is computed by `reference` unless it is given.
A recording that hardly accelerates gets a C that moves one count over its whole length: the counts cannot distinguish
this from no acceleration. Or it gets the least C that the words can hold with its travel and speed
(`model.motion.ACCELERATION_RANGE`), if that is larger. A change too fast for the pins at a clock of `CLOCK_MAX_HZ` is
an error.
"""

from typing import NamedTuple

import numpy as np

from ...model.checks import NUMBERS, shown
from ...model.encoder.quadrature_speed import max_edge_rate
from ...model.estimators import registry
from ...model.motion import least_acceleration
from ...model.record_axis import GLITCH_CLOCKS
from ...model.record_time import RecordTime
from ...model.spec import AxisSpec
from ..loop.backends import BACKENDS
from ..recordings.recording import EdgeRecord, Recording
from .captured import CLOCK_MAX_HZ, closest_s, coarse, position_counts, with_clock
from .reference import REFERENCE_HZ, SETTLE_S, acceleration_bound, judged_from, zero_phase_velocity
from .replay_axis import axis_spec, needs_pins
from .settings import Settings, applied

COARSEN_MAX = (1 << 31) - 1
EDGES_MAX = 1 << 24
"""The most edges in a sample that go through the pins: all of them are in memory."""


DERIVED = Settings()
"""The settings that all follow from C."""


class ReplayError(ValueError):
    """A replay is refused. The message is one line: the fault, and the accepted values."""


class ArgumentError(ReplayError):
    """An argument of `replay` that is refused: the message begins with its name.

    Attributes:
        argument: the name of the argument.
        said: the message behind it.
    """

    def __init__(self, argument: str, said: str):
        super().__init__(f"{argument} {said}")
        self.argument, self.said = argument, said


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


def check_names(estimator: str, output: str | None, backend: str) -> str:
    """Return the name of the output, the estimator's first for None; raise ReplayError if a name is unknown."""
    _one_of("estimator", estimator, tuple(registry.ESTIMATORS))
    outputs = registry.design_of(estimator).outputs
    output = outputs[0] if output is None else output
    _one_of("output", output, outputs, f"of {estimator} ")
    _one_of("backend", backend, BACKENDS)
    return output


def first_judged(recording: Recording) -> int:
    """Return the number of the first sample that is judged."""
    first = judged_from(recording.rate_hz)
    return first if recording.edges is None else min(first, len(recording.counts) // 4)


def check_length(recording: Recording) -> None:
    """Raise ReplayError if no sample of a recording is judged."""
    if len(recording.counts) <= first_judged(recording):
        raise ReplayError(
            f"{recording.file}: must be longer than {SETTLE_S:g} s, after which the estimate is judged, "
            f"not {len(recording.counts)} samples at {recording.rate_hz:g} Hz"
        )


def _check_numbers(recording: Recording, coarsen: object, bound: float | None) -> None:
    """Raise ReplayError if a recording cannot be replayed with these numbers."""
    rate = recording.rate_hz
    if isinstance(coarsen, bool) or not (isinstance(coarsen, int) and 1 <= coarsen <= COARSEN_MAX):
        raise ArgumentError("coarsen", f"must be a whole number of 1 to {COARSEN_MAX}, not {shown(coarsen)}")
    least, most = (RecordTime(rate).from_axis(number, 2) for number in NUMBERS)
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
    """The values derived from a recording before its counts are run.

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
    """Return the plan of a replay; arguments as of `replay`.

    Raises:
        ReplayError: in one line: the fault, and the accepted values.
    """
    rate, given = recording.rate_hz, acceleration_max_counts_per_s2
    time = RecordTime(rate)
    cutoff = min(REFERENCE_HZ, rate / 4)
    _check_numbers(recording, coarsen, given)
    counts = _counts_for(recording, coarsen, estimator, backend)
    whole, edges = recording.edges, None
    position = recording.counts if whole is None else position_counts(whole, rate, len(counts))
    reference = zero_phase_velocity(position, rate, cutoff)
    bound = given
    if bound is None:
        largest = acceleration_bound(reference, rate, first_judged(recording))
        bound = max(largest, least_acceleration(counts) * coarsen * rate**2)
    try:
        spec = axis_spec(counts, coarsen, bound / rate**2, estimator, time)
    except ValueError as error:
        raise _unfit(recording, estimator, bound, given is not None, error) from None
    try:
        spec = applied(spec, settings, time)
    except ValueError as error:
        raise ArgumentError("settings", f"must give an axis ({time.said}): {error}") from None
    if whole is not None and needs_pins(estimator, backend):
        edges = coarse(whole, coarsen)
        try:
            spec = with_clock(spec, edges, rate)
        except ValueError as error:
            raise ReplayError(
                f"{recording.file}, column {recording.column}: {estimator} cannot take this capture at {rate:g} Hz, "
                f"for a sample has too many ticks of the capture ({time.said}: {error}): give a higher rate (--rate)"
            ) from None
    return Plan(counts, cutoff, reference, bound, spec, edges)


def _unfit(recording: Recording, estimator: str, bound: float, given: bool, error: ValueError) -> ReplayError:
    """Return the error of a bound C from which no gains follow."""
    why = f"{RecordTime(recording.rate_hz).said}: {error}"
    if given:
        said = f"must give gains that fit this recording ({why}), not {bound!r}"
        return ArgumentError("acceleration_max_counts_per_s2", said)
    return ReplayError(
        f"{recording.file}, column {recording.column}: {estimator} cannot take this recording, for no gains "
        f"fit its acceleration of {bound:g} counts/s^2 ({why})"
    )
