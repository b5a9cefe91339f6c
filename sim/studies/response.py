"""The response of a velocity estimator to a sine, by its frequency and amplitude: what is called describing function.

The handle moves by A sin(2 pi f t) beside a place in a count. Axis and encoder are the scene's. Sine, cosine and a
constant are fitted to the estimate over whole periods, by least squares. The fitted sine is divided by the exact
velocity. The quotient's magnitude is the *gain*. Its angle is the *lead*, negative for a late estimate. A linear filter
has one response for all amplitudes, but for the quantisation. One that is not linear has another at each. A vibration
at a wall begins with a few counts, and a hit has some hundred.

Starts differ by the place in a count and the phase of the sine: `walls.starts`.

Source for the method: Gelb, Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968.
"""

import cmath
import math
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ...model.runtime.result import Rows, Table, table_of
from ..estimates.motions import Sine
from ..estimates.playback import velocities
from ..estimates.signals import Signal
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls.methods import Curve
from ..walls.starts import start

METHODS = "fdm-1000", "kalman", "levant", "levant-2"
PERIODS, SETTLE_S = 8, 0.15
"""The fewest periods, and the shortest time, before the fit and in it."""
SAMPLES_MAX = 2_000_000
"""The most samples of a run."""
AMPLITUDES = 0.5, 1e5
"""The least and the largest amplitude, counts: a smaller one is seen at some places in a count only."""


@dataclass(frozen=True)
class Responses(Rows):
    """Gains and leads: rows of `respond`, and the name of the scene."""

    scene: str

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        return {"scene": self.scene, **super().report()}

    @property
    def frequencies_hz(self) -> list[float]:
        """The frequencies, in their order."""
        return list(dict.fromkeys(row["frequency_hz"] for row in self.rows))

    def tables(self) -> list[Table]:
        """Return a table with a line for each estimator and amplitude, and two columns for each frequency."""
        heads = ["amplitude (counts)"]
        for each in self.frequencies_hz:
            heads += [f"gain at {each:g} Hz", f"lead at {each:g} Hz (deg)"]
        lines: dict[tuple[str, float], list[str]] = {}
        for row in self.rows:
            mark = "*" if row["flags"] else ""
            cells = [f"{row['gain']:.3f}{mark}", "-" if row["lead_deg"] is None else f"{row['lead_deg']:+.1f}"]
            lines.setdefault((row["label"], row["amplitude_counts"]), []).extend(cells)
        rows = [[name, f"{amplitude:g}", *cells] for (name, amplitude), cells in lines.items()]
        return [table_of(("estimator",), heads, rows)]

    def notes(self) -> list[str]:
        """Return the flags that were raised."""
        raised = dict.fromkeys(name for row in self.rows for name in row["flags"])
        return [f"*: a flag was raised: {', '.join(raised)}"] if raised else []


def seconds_of(frequency_hz: float) -> float:
    """Return the time before the fit, and in it: whole periods."""
    return max(PERIODS, math.ceil(SETTLE_S * frequency_hz)) / frequency_hz


def cases(case: Case, curves: list[Curve]) -> list[Case]:
    """Return the case of every estimator.

    Raises:
        SceneError: if the scene is not valid with one of them.
    """
    found = [case.changed(each.changes, each.label) for each in curves]
    for each in found:
        _ = each.scene.spec
    return found


def check(case: Case, frequencies_hz: list[float], amplitudes: list[float]) -> None:
    """Raise ValueError, in one line with the accepted range, if a scene's axis cannot follow a sine, or it takes long.

    Args:
        case: the scene.
        frequencies_hz, amplitudes: those that are asked for, Hz and counts.
    """
    spec = case.scene.spec
    for frequency in frequencies_hz:
        if frequency > spec.sample_hz / 4:
            most = spec.sample_hz / 4
            raise ValueError(
                f"--frequencies must be at most a quarter of the sample rate, {most:g} Hz, not {frequency:g}"
            )
        if 2 * seconds_of(frequency) * spec.sample_hz > SAMPLES_MAX:
            least = 2 * PERIODS * spec.sample_hz / SAMPLES_MAX
            raise ValueError(f"--frequencies must be at least {least:g} Hz at this rate, not {frequency:g}")
    largest_hz = max(frequencies_hz)
    most = spec.speed_max_m_per_s / spec.count_m / (math.tau * largest_hz)
    if max(amplitudes) > most:
        raise ValueError(
            f"--amplitudes must be at most {math.floor(most)} counts at {largest_hz:g} Hz, where the axis is at its "
            f"largest speed, not {max(amplitudes):g}"
        )


def jobs(
    every: list[Case], frequencies_hz: list[float], amplitudes: list[float], starts: int, backend: str
) -> list[dict[str, Any]]:
    """Return the arguments of `respond` for every case, amplitude and frequency."""
    return [
        case.job()
        | {"label": case.label, "frequency_hz": hz, "amplitude_counts": counts, "starts": starts, "backend": backend}
        for case, counts, hz in product(every, amplitudes, frequencies_hz)
    ]


def respond(
    scene: str,
    text: str,
    changes: dict[str, Any],
    label: str,
    frequency_hz: float,
    amplitude_counts: float,
    starts: int,
    backend: str,
) -> dict[str, Any]:
    """Return the response of the estimator of a scene to one sine, units in the keys.

    Args:
        scene, text, changes, label: the case: see `Case`.
        frequency_hz, amplitude_counts: the sine.
        starts: number of starts.
        backend: one of `backends.BACKENDS`.

    Returns:
        label, estimator, output, sample_hz, frequency_hz, amplitude_counts: what was moved.
        gain, lead_deg: of the mean over the starts; no lead where the gain is 0.
        gain_from, gain_to: the least and the largest gain of a start.
        flags: names of the flags that were raised.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    own = Case(label, scene, text, changes).scene
    count_m, every, raised = own.encoder.count_m, [], 0
    for number in range(starts):
        place, phase = start(number)
        motion = Sine(place * count_m, amplitude_counts * count_m, frequency_hz, phase / frequency_hz)
        quotient, flags = response(own, backend, motion)
        every.append(quotient)
        raised |= flags
    mean = sum(every) / starts
    return {
        "label": label,
        "estimator": own.controller.estimator,
        "output": own.estimator_output,
        "sample_hz": own.spec.sample_hz,
        "frequency_hz": frequency_hz,
        "amplitude_counts": amplitude_counts,
        "gain": abs(mean),
        "lead_deg": math.degrees(cmath.phase(mean)) if mean else None,
        "gain_from": min(map(abs, every)),
        "gain_to": max(map(abs, every)),
        "flags": own.spec.design.flag_names(raised),
    }


def response(scene: Scene, backend: str, motion: Sine) -> tuple[complex, int]:
    """Return the fitted sine divided by the velocity, and the flags of the run."""
    spec, seconds = scene.spec, seconds_of(motion.frequency_hz)
    # In a quarter of a period it turns once at most.
    known = Signal("sine", motion, 2 * seconds, seconds, spec.acceleration_max_m_per_s2, 0.25 / motion.frequency_hz)
    chunks = [*velocities(known, spec, scene.estimator_output, backend, *scene.encoder.errors)]
    estimate = np.concatenate([chunk for _, chunk, _ in chunks])
    first = math.ceil(seconds * spec.sample_hz)
    angles = math.tau * motion.frequency_hz * (np.arange(first, len(estimate)) / spec.sample_hz + motion.since_s)
    basis = np.stack([np.cos(angles), np.sin(angles), np.ones(len(angles))], axis=1)
    cosine, sine, _ = np.linalg.lstsq(basis, estimate[first:])[0].tolist()
    peak_m_per_s = math.tau * motion.frequency_hz * motion.amplitude_m
    return complex(cosine, -sine) / peak_m_per_s, chunks[-1][2]
