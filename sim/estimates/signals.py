"""The signals that estimators are judged on: motions with names, how long they last, and from when they count."""

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
"""C of a wall hit, m/s^2: the bound that the founding paper took from a recorded hit."""
PAPER = motions.DecayingSine(50e-3, 1.0, 1.0)
STEADY_SECONDS = 1.0
TRACK_LEAD_S = 0.1
"""How long a recorded path is led up to at constant speed, so that estimators have settled."""
FLICKER = motions.Sweep(0.3e-6, 50.0, 1e-9)


@dataclass(frozen=True)
class Signal:
    """A motion to judge on.

    Attributes:
        name: as on the command line.
        motion: one of `motion`'s.
        seconds: length.
        judged_from_s: errors count from then on.
        acceleration_max_m_per_s2: C that an estimator gets its gains from.
        turns_apart_s: the motion turns at most once in so long.
        delay_max_s: no delay is looked for beyond; less than half a period of what is periodic.
    """

    name: str
    motion: tuple
    seconds: float
    judged_from_s: float
    acceleration_max_m_per_s2: float
    turns_apart_s: float = 1e-3
    delay_max_s: float = 0.1


def paper() -> Signal:
    """50 exp(-t) sin(2 pi t) mm, 5 s, judged from 1 s on; C is its largest acceleration."""
    # f is the imaginary part of A exp(p t); its second derivative is largest where the third first vanishes.
    p = complex(-PAPER.decay_per_s, math.tau * PAPER.frequency_hz)
    at = (-3 * cmath.phase(p)) % math.pi / p.imag
    largest = abs((PAPER.amplitude_m * p**2 * cmath.exp(p * at)).imag)
    return Signal("paper", PAPER, 5.0, 1.0, largest)


def steady(speed_mm_per_s: float) -> Signal:
    """Constant speed, ten counts of it or more judged. A speed of whole counts in so many samples locks to them."""
    seconds = max(STEADY_SECONDS, 20e-3 / speed_mm_per_s)
    path = motions.Steady(speed_mm_per_s * 1e-3, 0.3e-6)
    return Signal(f"steady:{speed_mm_per_s:g}", path, seconds, seconds / 2, DEVICE_ACCELERATION)


def sweep() -> Signal:
    """A sine of 0.1 mm from 0.5 to 50 Hz in 5 s."""
    path = motions.Sweep(1e-4, 0.5, math.log(100) / 5)
    return Signal("sweep", path, 5.0, 1.0, DEVICE_ACCELERATION)


def stop() -> Signal:
    """5 mm/s, braked at 1 m/s^2 to rest; judged from 0.1 s after that: nothing should be left."""
    return Signal("stop", motions.Stop(5e-3, 0.5, 1.0), 1.105, 0.605, DEVICE_ACCELERATION)


def flicker() -> Signal:
    """At rest but for a tremor of 0.3 um and 50 Hz, about an edge: the count flickers."""
    return Signal("flicker", FLICKER, 1.0, 0.5, DEVICE_ACCELERATION, delay_max_s=8e-3)


@cache
def hit() -> Signal:
    """The first contact of a closed-loop hit of a 10 kN/m wall at 1 MHz, impact included, as the handle truly moved.

    C is the largest acceleration on the way.
    """
    wall = {"wall.stiffness_n_per_m": 10e3, "wall.damping_n_s_per_m": 20.0}
    scene = Case.of("mhz", wall | {"controller.output": "u1"}).scene
    detail = run(scene, "float", traces=True).detail
    path = motions.Track(TRACK_LEAD_S, 1 / scene.spec.sample_hz, detail.position_m, detail.velocity_m_per_s)
    length = (len(detail.time_s) - 1) / scene.spec.sample_hz
    x, v, h = detail.position_m, detail.velocity_m_per_s, 1 / scene.spec.sample_hz
    # The cubic's second derivative is largest at an end of a piece.
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
    """Return the signal of that name: one of `SIGNALS`, or `steady:SPEED` in mm/s.

    Raises:
        ValueError: for another name, or a speed out of `SPEEDS_MM_PER_S`.
    """
    if name in SIGNALS:
        return SIGNALS[name]()
    low, high = SPEEDS_MM_PER_S
    if found := re.fullmatch(r"steady:([0-9.e+-]+)", name):
        try:
            speed = float(found[1])
        except ValueError:
            speed = math.nan
        if low <= speed <= high:
            return steady(speed)
    raise ValueError(
        f"signal must be one of {', '.join(SIGNALS)}, or steady:{low:g} to steady:{high:g} (mm/s), not {name!r}"
    )
