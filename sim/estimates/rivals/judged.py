"""The errors of rivals: the same motions, edges, samples and truth as `estimates.accuracy` has for this project's own.

A recording of counts has no stamps: as there, the edges are spread evenly over each sample. A capture has its own.
"""

import json
import math
from functools import lru_cache
from typing import Any

import numpy as np

from ...recordings.recording import Recording
from ...world.encoder import Encoder
from .. import signals
from ..accuracy import COARSEN, DELAY_MAX_S, axis_spec, errors_of, exact_velocity
from ..captured import coarse
from ..judge import Judge
from ..motions import encoded
from ..replay import replay
from ..replay_plan import first_judged, plan
from ..settings import Settings as ReplaySettings
from .known import ACCELERATIONS, LOOP, RIVALS, Settings
from .pico import UNIFORM
from .rival import Seen, estimates, seen_of

STEP_S = 1e-6
"""Half the time over which the true acceleration is the change of the exact velocity."""


@lru_cache(maxsize=16)
def _seen(signal: str, sample_hz: int, encoder: str) -> tuple[Seen, float]:
    """Return the edges of a signal, and the size of a count (m); the encoder's errors are JSON."""
    known, errors = signals.load(signal), errors_of(json.loads(encoder))
    spec = axis_spec("fdm", sample_hz, known.acceleration_max_m_per_s2)
    scale = Encoder(spec.count_m, float(spec.clock_hz), *errors)
    found = encoded(known.motion, scale, known.seconds, known.turns_apart_s, 0)
    return seen_of(found, float(spec.clock_hz)), spec.count_m


def _estimated(rival: tuple, seen: Seen, sample_hz: float, period_s: float, samples: int) -> np.ndarray:
    """Return the velocities (counts/s) of a rival that is read in every period, of at least a sample."""
    out = np.zeros(samples)
    estimates(rival, seen, float(sample_hz), max(1, round(period_s * sample_hz)), out)
    return out


def measure(name: str, settings: Settings, signal: str, sample_hz: int, encoder: dict[str, Any] | None) -> dict:
    """Return the errors of a rival on a known motion, units in the keys.

    Args:
        name: one of `known.RIVALS`.
        settings: its settings.
        signal: name of the signal, as for `signals.load`.
        sample_hz: sample rate at which the estimate is judged.
        encoder: errors of the encoder, as for `accuracy.errors_of`.

    Raises:
        ValueError: if the encoder's errors or the signal are not valid.
    """
    known, (seen, count_m) = signals.load(signal), _seen(signal, sample_hz, json.dumps(encoder, sort_keys=True))
    rival = RIVALS[name].make(settings, errors_of(encoder).offsets)
    samples, begin = int(known.seconds * sample_hz), math.ceil(known.judged_from_s * sample_hz)
    estimate = _estimated(rival, seen, sample_hz, settings["period_s"], samples)[begin:] * count_m
    times_s = np.arange(begin, samples) / sample_hz
    judge = Judge(len(estimate), sample_hz)
    judge.add(0, estimate, exact_velocity(known.motion, times_s))
    delay_s = judge.delay_s(lambda at_s: exact_velocity(known.motion, at_s + begin / sample_hz), known.delay_max_s)
    return {"rms_mm_s": judge.rms * 1e3, "max_mm_s": judge.largest * 1e3, "delay_s": delay_s}


def measure_acceleration(name: str, signal: str, sample_hz: int, encoder: dict[str, Any] | None) -> dict:
    """Return the RMS error of a rival's acceleration on a known motion, and the RMS of the true one; see `measure`.

    Raises:
        ValueError: as `measure` does.
    """
    known, (seen, count_m) = signals.load(signal), _seen(signal, sample_hz, json.dumps(encoder, sort_keys=True))
    samples, begin = int(known.seconds * sample_hz), math.ceil(known.judged_from_s * sample_hz)
    estimate = _estimated(ACCELERATIONS[name], seen, sample_hz, 0.0, samples)[begin:] * count_m
    times_s = np.arange(begin, samples) / sample_hz
    change = exact_velocity(known.motion, times_s + STEP_S) - exact_velocity(known.motion, times_s - STEP_S)
    exact = change / (2 * STEP_S)
    error, of_signal = (float(np.sqrt(np.mean(each**2))) * 1e3 for each in (estimate - exact, exact))
    return {"rms_mm_s2": error, "signal_rms_mm_s2": of_signal}


def spread(counts: np.ndarray, rate_hz: float) -> Seen:
    """Return the edges of sampled counts, evenly over each sample; the first count is the start."""
    changes = np.diff(counts)
    many = np.abs(changes)
    sample = np.repeat(np.arange(len(changes)), many)
    rank = np.arange(len(sample)) - np.repeat(np.cumsum(many) - many, many)
    times_s = (sample + (2 * rank + 1) / (2 * many[sample])) / rate_hz
    numbers = counts[0] + np.cumsum(np.repeat(np.sign(changes), many))
    return Seen(int(counts[0]), times_s, numbers)


def measure_recording(recorded: Recording, name: str, settings: Settings, backend: str) -> dict:
    """Return the errors of a rival on a recording with coarser counts, in recorded counts, units in the keys.

    Args:
        recorded: the recording, long enough to be judged.
        name: one of `known.PROJECTS`.
        settings: its settings.
        backend: of the loop, which is an estimator of this project.

    Raises:
        ReplayError: in one line: the fault, and the accepted values.
        RuntimeError: if the RTL could not be built.
    """
    if name == LOOP:
        result = replay(recorded, LOOP, None, backend, COARSEN, settings=ReplaySettings(gains=settings))
        return _judged(recorded, result.velocity_counts_per_s, result.reference_counts_per_s)
    planned, rate = plan(recorded, "fdm", "float", COARSEN), recorded.rate_hz
    rival, seen = RIVALS[name].make(settings, UNIFORM), spread(planned.counts, rate)
    if recorded.edges is not None:
        edges = coarse(recorded.edges, COARSEN)
        seen = Seen(edges.start, edges.ticks / edges.tick_hz, edges.counts)
    estimate = _estimated(rival, seen, rate, settings["period_s"], len(planned.counts))
    return _judged(recorded, estimate * COARSEN, planned.reference_counts_per_s)


def _judged(recorded: Recording, estimate: np.ndarray, exact: np.ndarray) -> dict:
    """Return the errors of an estimate of a recording (counts/s)."""
    rate, begin = recorded.rate_hz, first_judged(recorded)
    judge = Judge(len(estimate) - begin, rate)
    judge.add(0, estimate[begin:], exact[begin:])
    times_s = np.arange(len(exact) - begin) / rate
    delay_s = judge.delay_s(lambda at_s: np.interp(at_s, times_s, exact[begin:]), DELAY_MAX_S)
    return {"rms_counts_s": judge.rms, "max_counts_s": judge.largest, "delay_s": delay_s}
