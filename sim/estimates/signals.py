"""The test signals of estimators: named motions, their durations, and the times from which errors count."""

import cmath
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..scene.case import Case
from ..walls.hit import run
from . import motions

DEVICE_ACCELERATION = 12.0
"""C of a wall hit, m/s^2: the bound that the founding paper derived from a recorded hit."""
PAPER = motions.DecayingSine(50e-3, 1.0, 1.0)
STEADY_SECONDS = 1.0
TRACK_LEAD_S = 0.1
"""The time at constant speed before a recorded path, in which estimators settle."""
FLICKER = motions.Sweep(0.3e-6, 50.0, 1e-9)


@dataclass(frozen=True)
class Signal:
    """A motion that estimators are judged on.

    Attributes:
        name: its name on the command line.
        motion: one of the motions of `motions`.
        seconds: duration.
        judged_from_s: time from which errors count.
        acceleration_max_m_per_s2: C, from which an estimator gets its gains.
        turns_apart_s: a time in which the motion turns at most once.
        delay_max_s: the largest delay that is searched for; less than half a period of a periodic motion.
    """

    name: str
    motion: tuple
    seconds: float
    judged_from_s: float
    acceleration_max_m_per_s2: float
    turns_apart_s: float = 1e-3
    delay_max_s: float = 0.1

    @property
    def jerk_max_m_per_s3(self) -> float:
        """The bound on the jerk between impacts, which some gains follow from: the swing's, for every motion."""
        return swing_jerk_m_per_s3()


def paper() -> Signal:
    """Return 50 exp(-t) sin(2 pi t) mm over 5 s, judged from 1 s on; C is its largest acceleration."""
    # The motion is the imaginary part of A exp(p t); its second derivative is largest where the third first vanishes.
    p = complex(-PAPER.decay_per_s, math.tau * PAPER.frequency_hz)
    at = (-3 * cmath.phase(p)) % math.pi / p.imag
    largest = abs((PAPER.amplitude_m * p**2 * cmath.exp(p * at)).imag)
    return Signal("paper", PAPER, 5.0, 1.0, largest)


@cache
def swing_jerk_m_per_s3() -> float:
    """Return the largest jerk of the paper's signal."""
    p = complex(-PAPER.decay_per_s, math.tau * PAPER.frequency_hz)
    # It is at the start, or where the fourth derivative first vanishes.
    at = (-4 * cmath.phase(p)) % math.pi / p.imag
    return max(abs((PAPER.amplitude_m * p**3 * cmath.exp(p * time)).imag) for time in (0.0, at))


def steady(speed_mm_per_s: float) -> Signal:
    """Return a motion at constant speed, judged over at least ten counts.

    A speed of whole counts in a whole number of samples makes the count lock to the samples.
    """
    seconds = max(STEADY_SECONDS, 20e-3 / speed_mm_per_s)
    path = motions.Steady(speed_mm_per_s * 1e-3, 0.3e-6)
    return Signal(f"steady:{speed_mm_per_s:g}", path, seconds, seconds / 2, DEVICE_ACCELERATION)


def sweep() -> Signal:
    """Return a sine of 0.1 mm from 0.5 to 50 Hz in 5 s."""
    path = motions.Sweep(1e-4, 0.5, math.log(100) / 5)
    return Signal("sweep", path, 5.0, 1.0, DEVICE_ACCELERATION)


def stop() -> Signal:
    """Return a motion at 5 mm/s, braked at 1 m/s^2; judged from 0.1 s after it stops: the estimate should be zero."""
    return Signal("stop", motions.Stop(5e-3, 0.5, 1.0), 1.105, 0.605, DEVICE_ACCELERATION)


def flicker() -> Signal:
    """Return a tremor of 0.3 um and 50 Hz about an edge: the count flickers, with the handle nearly at rest."""
    return Signal("flicker", FLICKER, 1.0, 0.5, DEVICE_ACCELERATION, delay_max_s=8e-3)


@cache
def hit() -> Signal:
    """Return the handle's true motion in the first contact of a closed-loop hit of a 10 kN/m wall at 1 MHz.

    The impact is included. C is the largest acceleration of the path.
    """
    wall = {"wall.stiffness_n_per_m": 10e3, "wall.damping_n_s_per_m": 20.0}
    scene = Case.of("mhz", wall | {"controller.output": "u1"}).scene
    detail = run(scene, "float", traces=True).detail
    path = motions.Track(TRACK_LEAD_S, 1 / scene.spec.sample_hz, detail.position_m, detail.velocity_m_per_s)
    length = (len(detail.time_s) - 1) / scene.spec.sample_hz
    x, v, h = detail.position_m, detail.velocity_m_per_s, 1 / scene.spec.sample_hz
    # The second derivative of a cubic is largest at an end of its piece.
    rise = np.diff(x)
    ends = 6 * rise - h * (4 * v[:-1] + 2 * v[1:]), 6 * rise - h * (2 * v[:-1] + 4 * v[1:])
    largest = float(max(np.abs(end).max() for end in ends)) / h**2
    return Signal("hit", path, TRACK_LEAD_S + length, TRACK_LEAD_S, largest, 1e-4)


SIGNALS: dict[str, Callable[[], Signal]] = {
    "paper": paper,
    "sweep": sweep,
    "stop": stop,
    "flicker": flicker,
    "hit": hit,
}
SPEEDS_MM_PER_S = (0.01, 1000.0)


def load(name: str) -> Signal:
    """Return a signal by its name: one of `SIGNALS`, or `steady:SPEED` in mm/s.

    Raises:
        ValueError: if there is no such signal, or its speed is outside `SPEEDS_MM_PER_S`.
    """
    if name in SIGNALS:
        return SIGNALS[name]()
    low, high = SPEEDS_MM_PER_S
    if match := re.fullmatch(r"steady:([0-9.e+-]+)", name):
        try:
            speed = float(match[1])
        except ValueError:
            speed = math.nan
        if low <= speed <= high:
            return steady(speed)
    raise ValueError(
        f"signal must be one of {', '.join(SIGNALS)}, or steady:{low:g} to steady:{high:g} (mm/s), not {name!r}"
    )
