"""How accurate a velocity estimator is: known motions at any rate, on any backend, against the exact derivative.

Gains are the estimator's defaults for the signal's own bound C on the acceleration, unless others are given; the bound
on the jerk is the swing's for every signal, unless another is given. `kalman`, whose bound must hold at an impact too,
is told only a bound that is given. The clock is the slowest multiple of the rate with at least 50 MHz and 50 clocks a
sample, enough for every estimator's path. Above 1 MHz the clock is faster than a real part's, so the stamps are finer
too. The row reports the clock.
"""

import math
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ...model.estimators import registry
from ...model.estimators.acceleration import Motions
from ...model.record_axis import GLITCH_CLOCKS
from ...model.runtime.compiled import compiled
from ...model.spec import AxisSpec
from ..recordings.recording import Recording
from ..scene.load import load
from ..world.encoder import Errors, offsets
from . import learning, signals
from .judge import Judge
from .motions import acceleration, velocity
from .playback import outputs as played
from .replay import replay
from .replay_plan import check_length

RATES_HZ = (1_000, 10_000_000)
"""The slowest and the fastest rate that is measured."""
CLOCK_HZ = 50_000_000
CLOCKS = 50
DELAY_MAX_S = 0.1
BOUNDS = "acceleration_max_m_per_s2", "jerk_max_m_per_s3"
"""The bounds of a motion from which default gains follow."""
UNTOLD = ("kalman",)
"""The estimators that know no jerk unless one is given: their bound must hold at an impact too."""
SCENE = "mhz"
"""The scene with the measured device; its encoder is given errors."""
FASTEST = {"controller.speed_max_m_per_s": 0.4}
"""The speed up to which the errors of an encoder must leave edges their order: more than the paper's signal has."""
PHASE = "encoder.phase_error_counts"
LEARNED = "encoder.learned_passes"
"""The training passes from which the map of the encoder's scale is learned: no error, and no key of a scene."""
COARSEN = 16
"""The factor by which a recording's counts are made coarser; the full counts are the reference."""


def outputs(text: str) -> list[tuple[str, str]]:
    """Return the (estimator, output) pairs of `NAME` (all outputs of that estimator) or `NAME:OUTPUT`.

    Raises:
        ValueError: if there is no such estimator or output.
    """
    name, colon, output = text.partition(":")
    design = registry.design_of(name)
    if colon:
        design.choose(output)
    return [(name, chosen) for chosen in ([output] if colon else design.outputs)]


@cache
def _device() -> AxisSpec:
    """Return the axis of the scene."""
    return load(SCENE).spec


def errors_of(encoder: dict[str, Any] | None) -> Errors:
    """Return the errors of an encoder, given as changes of the scene's keys `encoder.KEY`, with `LEARNED` or without.

    A phase error alone may be as large as the order of edges allows, because the axis has no glitch filter; together
    with other errors it has the limits of a scene.

    Raises:
        ValueError: if the errors are not valid.
    """
    encoder = {key: value for key, value in (encoder or {}).items() if key != LEARNED}
    if encoder.keys() <= {PHASE}:
        return Errors(offsets(encoder.get(PHASE, 0.0)))
    return load(SCENE, FASTEST | encoder).encoder.errors


def _said_by_row(encoder: dict[str, Any]) -> dict[str, Any]:
    """Return what a row of `measure` says of its encoder: the phase error, and the others if there are any."""
    others = {key.removeprefix("encoder."): value for key, value in encoder.items() if key != PHASE}
    return {"encoder_phase_error_counts": encoder.get(PHASE, 0.0)} | ({"encoder": others} if others else {})


def encoder_of(row: dict[str, Any]) -> dict[str, Any]:
    """Return the errors of the encoder of a row of `measure`, as its argument."""
    others = {f"encoder.{key}": value for key, value in row.get("encoder", {}).items()}
    phase = row["encoder_phase_error_counts"]
    return others | ({PHASE: phase} if phase else {})


def said_of(encoder: dict[str, Any]) -> str:
    """Return the errors of an encoder in words, such as "edge_error_counts 0.05, seed 3"; empty for none."""
    return ", ".join(f"{key.removeprefix('encoder.')} {value}" for key, value in encoder.items())


def axis_spec(
    estimator: str,
    sample_hz: int,
    acceleration_max_m_per_s2: float,
    gains: dict[str, float] | None = None,
    bits_dropped: int = 0,
    jerk_max_m_per_s3: float | None = None,
) -> AxisSpec:
    """Return the specification of the axis: the device of the scene `mhz` at another rate, unfiltered.

    Raises:
        ValueError: if there is no such axis; the message names the field.
    """
    return replace(
        _device(),
        clock_hz=sample_hz * max(-(-CLOCK_HZ // sample_hz), CLOCKS),
        sample_hz=sample_hz,
        actuation_hz=sample_hz,
        glitch_clocks=GLITCH_CLOCKS,
        acceleration_max_m_per_s2=acceleration_max_m_per_s2,
        jerk_max_m_per_s3=jerk_max_m_per_s3,
        estimator=estimator,
        gains=gains and registry.design_of(estimator).gains_class(**gains),
        estimator_bits_dropped=bits_dropped,
    )


def spec_of(job: dict) -> AxisSpec:
    """Return the specification of the axis that `measure` would measure for these arguments.

    Raises:
        ValueError: if there is no such axis; the message names the field.
    """
    known = signals.load(job["signal"])
    given = job.get("bounds") or {}
    name, rate = job["estimator"], job["sample_hz"]
    bound, jerk = (given.get(key, getattr(known, key)) for key in BOUNDS)
    if name in UNTOLD:
        jerk = given.get("jerk_max_m_per_s3")
    encoder = job.get("encoder") or {}
    if LEARNED in encoder:
        learning.check(encoder[LEARNED], name, job.get("backend", "float"))
    try:
        return axis_spec(name, rate, bound, job.get("gains"), job.get("bits_dropped", 0), jerk)
    except ValueError as error:
        raise ValueError(f"{name} at {rate} Hz with C {bound:g} m/s^2: {error}") from None


@compiled
def _velocities(motion, times, out):
    """Fill `out` with the exact velocities (m/s) at the times (s)."""
    for i in range(len(out)):
        out[i] = velocity(motion, times[i])


@compiled
def _accelerations(motion, times, out):
    """Fill `out` with the exact accelerations (m/s^2) at the times (s)."""
    for i in range(len(out)):
        out[i] = acceleration(motion, times[i])


def exact_velocity(motion, times: np.ndarray) -> np.ndarray:
    """Return the exact velocities (m/s) of a motion at the given times (s)."""
    out = np.empty(len(times))
    _velocities(motion, times, out)
    return out


def exact_acceleration(motion, times: np.ndarray) -> np.ndarray:
    """Return the exact accelerations (m/s^2) of a motion at the given times (s)."""
    out = np.empty(len(times))
    _accelerations(motion, times, out)
    return out


@dataclass(frozen=True)
class Judged:
    """The errors of an estimate of a signal.

    Attributes:
        velocity: the judge of the velocity.
        acceleration: the judge of the acceleration; None if there is none.
        still: the judge of an acceleration that is always 0, whose error is the true acceleration.
        flags: all flags that were raised.
    """

    velocity: Judge
    acceleration: Judge | None
    still: Judge
    flags: int

    def said_by_row(self) -> dict[str, float | None]:
        """Return what a row of `measure` says of the acceleration: None where there is none."""
        own, still = self.acceleration, self.still
        return {
            "acceleration_rms_mm_s2": own and own.rms * 1e3,
            "true_acceleration_rms_mm_s2": own and still.rms * 1e3,
        }


def measure(
    estimator: str,
    output: str,
    signal: str,
    sample_hz: int,
    backend: str = "float",
    encoder: dict[str, Any] | None = None,
    bounds: dict[str, float] | None = None,
    gains: dict[str, float] | None = None,
    bits_dropped: int = 0,
) -> dict:
    """Return one row of measurements, units in the keys; `judge` defines the figures.

    Args:
        estimator, output: names of the estimator and of its output.
        signal: name of the signal, as for `signals.load`.
        sample_hz: sample rate of the estimator.
        backend: `float`, `fixed` or `rtl`.
        encoder: errors of the encoder, as for `errors_of`, and `LEARNED` for a map of its scale; None for none.
        bounds: bounds for the default gains, some of `BOUNDS`; the signal's own where they are not given.
        gains: gains to use instead, by the names of the estimator's `Gains`.
        bits_dropped: number of fraction bits taken from the estimator's words.

    Raises:
        ValueError: if there is no such axis, or no map for it; the message names the field.
        RuntimeError: if the RTL could not be built.
    """
    known = signals.load(signal)
    job = {"estimator": estimator, "signal": signal, "sample_hz": sample_hz, "backend": backend, "encoder": encoder}
    job |= {"bounds": bounds, "gains": gains, "bits_dropped": bits_dropped}
    spec = spec_of(job)
    begin = math.ceil(known.judged_from_s * sample_hz)
    found = judged(known, spec, output, backend, encoder)
    judge = found.velocity
    return {
        "estimator": estimator,
        "output": output,
        "backend": backend,
        "sample_hz": sample_hz,
        "signal": signal,
        "rms_mm_s": judge.rms * 1e3,
        "max_mm_s": judge.largest * 1e3,
        "delay_s": judge.delay_s(
            lambda times: exact_velocity(known.motion, times + begin / sample_hz), known.delay_max_s
        ),
        "chatter_mm_s": judge.chatter * 1e3,
        **found.said_by_row(),
        "clock_hz": spec.clock_hz,
        "velocity_bits": spec.design.estimator.velocity.width,
        **_said_by_row(encoder or {}),
        "acceleration_max_mm_s2": spec.acceleration_max_m_per_s2 * 1e3,
        "jerk_max_mm_s3": spec.jerk_bound_m_per_s3 * 1e3 if estimator not in UNTOLD or spec.jerk_max_m_per_s3 else None,
        "gains": asdict(spec.design.gains),
        "flags": spec.design.flag_names(found.flags),
    }


def judged(
    known: signals.Signal, spec: AxisSpec, output: str, backend: str, encoder: dict[str, Any] | None = None
) -> Judged:
    """Return the errors of an estimate of a signal, from the time on that the signal is judged from, and all flags.

    Args:
        known: the signal.
        spec: the axis.
        output, backend, encoder: as for `measure`.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    sample_hz, errors, scale = spec.sample_hz, errors_of(encoder), None
    if encoder and LEARNED in encoder:
        passes = learning.Passes(encoder.get("encoder.seed", 1), encoder[LEARNED])
        scale = learning.learned(spec, errors, passes, floating=backend == "float")
    begin = math.ceil(known.judged_from_s * sample_hz)
    samples, both, raised = int(known.seconds * sample_hz), False, 0
    of_velocity, of_acceleration, still = (Judge(samples - begin, sample_hz) for _ in range(3))
    for first, made, flags in played(known, spec, output, backend, *errors, learned=scale):
        raised |= flags
        estimate = made.velocity[max(begin - first, 0) :]
        since = first + len(made.velocity) - len(estimate)
        times = np.arange(since, since + len(estimate)) / sample_hz
        of_velocity.add(since - begin, estimate, exact_velocity(known.motion, times))
        if isinstance(made, Motions):
            both, exact = True, exact_acceleration(known.motion, times)
            of_acceleration.add(since - begin, made.acceleration[max(begin - first, 0) :], exact)
            still.add(since - begin, np.zeros(len(exact)), exact)
    return Judged(of_velocity, of_acceleration if both else None, still, raised)


def measure_recording(recorded: Recording, estimator: str, output: str, backend: str = "float") -> dict:
    """Return one row of a recording at its own rate, its counts `COARSEN` times coarser, in recorded counts.

    The file does not give the size of a count in mm, so the keys of the figures end in `_counts_s`. The reference is
    the zero-phase derivative of the full counts. A recording of counts has no clock stamps, so edges are spread evenly
    over each sample; a capture has its own edges.

    Args:
        recorded: the recording.
        estimator, output, backend: as for `measure`.

    Raises:
        ReplayError: in one line: the fault, and the accepted values.
        RuntimeError: if the RTL could not be built.
    """
    check_length(recorded)
    result = replay(recorded, estimator, output, backend, coarsen=COARSEN)
    rate, begin = result.recording.rate_hz, result.judged_from
    estimate, exact = result.velocity_counts_per_s[begin:], result.reference_counts_per_s[begin:]
    judge = Judge(len(estimate), rate)
    judge.add(0, estimate, exact)
    times = np.arange(len(exact)) / rate
    return {
        "estimator": estimator,
        "output": output,
        "backend": backend,
        "sample_hz": rate,
        "signal": f"{recorded.file}:{recorded.column}",
        "rms_counts_s": judge.rms,
        "max_counts_s": judge.largest,
        "delay_s": judge.delay_s(lambda at_s: np.interp(at_s, times, exact), DELAY_MAX_S),
        "chatter_counts_s": judge.chatter,
        "acceleration_max_counts_s2": result.acceleration_max_counts_per_s2,
        "gains": result.gains,
        "flags": result.flags,
    }
