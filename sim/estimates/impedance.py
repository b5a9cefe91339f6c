"""The stiffness and damping that a wall renders to a handle in sinusoidal motion inside it, by frequency.

With x = c + A sin wt, the push is projected on both parts of the motion over a window of whole periods:

    push = mean + K_r A sin wt + B_r A w cos wt + rest

The push is a constant from one change of the drive to the next, so its integrals are exact. The window is a whole
number of the force's periods, too: then what is left of the sampling, at sums and differences of both frequencies,
adds nothing to the projection.

Counts are the only other thing that does. The count of a sample is below the place by up to a count. As a place, this
error has at most a component of q at w. Where every sample changes the drive, a linear estimator's loop treats this
component like A. So K_r + j w B_r is then wrong by at most q / A of its magnitude, and by the words' rounding.
"""

import math
from collections.abc import Iterable

import numpy as np

from ..scene.case import Case
from ..scene.schema import Scene
from ..walls.starts import Start, start
from . import moved_handle
from .motions import Sine
from .moved_handle import Answer

SETTLE_S = 0.1
"""The time in which the estimators settle."""
LEAST_S = 0.1
"""The least length of a window."""
STEP_S = 1e-3
"""The longest time in which edges are looked for at once; the handle turns at most once in a quarter of a period."""
CENTRE = 2.0
"""The depth about which the handle moves, in amplitudes."""
SAMPLES_MAX, EDGES_MAX = 1 << 25, 1 << 22
"""The most samples and edges of a run, which take a few hundred megabytes."""


def samples_of(scene: Scene, frequency_hz: int) -> tuple[int, int]:
    """Return the numbers of the first sample of the window and of the first one behind it."""
    spec = scene.spec
    common_hz = math.gcd(frequency_hz, spec.actuation_hz)
    window = math.ceil(LEAST_S * common_hz) * spec.sample_hz // common_hz
    first = math.ceil(SETTLE_S * spec.sample_hz) + scene.delay_samples
    return first, first + window


def check(scene: Scene, frequency_hz: int, amplitude_m: float) -> None:
    """Raise MotionError if a handle cannot be moved so."""
    controller = scene.controller
    samples = samples_of(scene, frequency_hz)[1]
    edges = 4 * amplitude_m / scene.encoder.count_m * frequency_hz * samples / controller.sample_hz
    moved_handle.check(
        f"an amplitude of {amplitude_m * 1e3:g} mm at {frequency_hz} Hz",
        ("a way", amplitude_m, scene.encoder.count_m, controller.travel_m / 4, "m"),
        ("a speed", math.tau * frequency_hz * amplitude_m, 0, controller.speed_max_m_per_s, "m/s"),
        ("a run", samples, 1, SAMPLES_MAX, "samples"),
        ("a run", edges, 0, EDGES_MAX, "edges"),
    )


def path(scene: Scene, frequency_hz: int, amplitude_m: float, from_: Start) -> Sine:
    """Return the motion from a start: where in a count it is centred, and where in the force's period it begins."""
    centre_m = CENTRE * amplitude_m + from_.counts * scene.encoder.count_m
    return Sine(centre_m, amplitude_m, float(frequency_hz), from_.periods / scene.controller.actuation_hz)


def projected(push: Answer, motion: Sine, window: tuple[int, int]) -> tuple[complex, float]:
    """Return (K_r + j w B_r in N/m, RMS of the rest in N) over the samples of a window, from its first one on."""
    first, behind = window
    forces_n, omega = push.push_n[first:behind], math.tau * motion.frequency_hz
    middles_s = push.first_s + push.step_s * (np.arange(first, behind) + 0.5) + motion.since_s
    # A step is multiplied by the mean of sine and cosine over its length, rather than by their values in its middle.
    turned = np.exp(-1j * (omega * middles_s)) * np.sinc(motion.frequency_hz * push.step_s)
    mean_n = float(np.mean(forces_n))
    wave_n = complex(2j * np.mean((forces_n - mean_n) * turned))
    rest = float(np.mean(np.square(forces_n - mean_n))) - abs(wave_n) ** 2 / 2
    return wave_n / motion.amplitude_m, math.sqrt(max(rest, 0.0))


def measure(
    scene: str, text: str, changes: dict, backend: str, frequency_hz: int, amplitude_m: float, starts: int
) -> dict:
    """Return what the wall of a case renders at a frequency, from so many starts.

    Args:
        scene, text, changes: the case, as `Case.job` has it.
        backend: one of `backends.BACKENDS`.
        frequency_hz, amplitude_m: the motion.
        starts: number of starts.

    Returns:
        stiffness_n_per_m, damping_n_s_per_m: lists of K_r and B_r, by start.
        rest_n: list of the RMS of what is neither spring nor damper, nor constant.
        flags: names of the flags that were raised.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    known = Case("", scene, text, changes).scene
    window = samples_of(known, frequency_hz)
    impedances, rests, flags = [], [], set()
    for number in range(starts):
        motion = path(known, frequency_hz, amplitude_m, start(number))
        push = moved_handle.answer(known, motion, window[1], min(STEP_S, 0.25 / frequency_hz), backend)
        impedance, rest_n = projected(push, motion, window)
        impedances.append(impedance)
        rests.append(rest_n)
        flags |= set(push.flags)
    return {
        "stiffness_n_per_m": [each.real for each in impedances],
        "damping_n_s_per_m": [each.imag / (math.tau * frequency_hz) for each in impedances],
        "rest_n": rests,
        "flags": in_order(known, flags),
    }


def in_order(scene: Scene, flags: Iterable[str]) -> list[str]:
    """Return names of flags in the order of the axis."""
    return [flag for flag in scene.spec.design.flags if flag in flags]
