"""What theory says of the largest stiffness: two bounds for passivity, and the exact boundary of the linear loop.

- Colgate and Schenkel: a wall of K and B sampled every T, its force d periods late, is passive on a rigid handle if at
  every angle a = w T, b > K T / 2 sin((d + 1/2) a) / sin(a / 2) - B cos((d + 1) a): for d = 0, b > K T / 2 + |B|. It is
  theirs for a plain difference at the force's rate; a d that is no whole number stands between its neighbours.
- Abbott and Okamura: with B = 0, position quantised to q and Coulomb friction f_c, if also K <= 2 f_c / q.
- Linear: without friction that sticks, limits, quantisation and a carrier's pulses, in contact, the loop with a linear
  estimator is linear and periodic with the force's update. It is stable while every eigenvalue of what a period does to
  the state is within the unit circle. Nothing else is left out: the zero-order hold, the clocks from strobe to drive,
  those of the decoder, the amplifier, motor, cable and hand, and the estimator are all in the matrix.

The first two are for a rigid handle. A passive wall is stable with any hand, so they lie below the third without one.
"""

import numpy as np
from scipy import signal
from scipy.linalg import expm
from scipy.optimize import brentq

from ...model.quadrature import latency
from ..scene.build import device_of
from ..scene.schema import Scene
from ..world.device import Device, equations

LINEAR = ("fdm", "butterworth")
"""Estimators that the exact boundary is known for."""
ANGLES = np.linspace(1e-5, np.pi, 20_001)
SEARCH = 100
"""Stiffnesses, spaced evenly in their logarithm, among which the first unstable one is looked for."""


def delay_s(scene: Scene) -> float:
    """Return the time from a position to the force that follows from it: decoder, force path and amplifier, s."""
    clocks = latency(scene.controller.glitch_clocks) + scene.spec.design.latency_to_drive
    return clocks / scene.spec.clock_hz + scene.delay_samples / scene.spec.sample_hz


def colgate_schenkel_n_per_m(scene: Scene, damping_n_s_per_m: float) -> float:
    """Return the largest stiffness that is passive with a wall's damping, N/m; 0 where none is."""
    period_s = 1 / scene.controller.actuation_hz
    late, angles = delay_s(scene) / period_s, ANGLES
    stiffness_part = period_s / 2 * np.sin((late + 0.5) * angles) / np.sin(angles / 2)
    spare = scene.handle.viscous_n_s_per_m + damping_n_s_per_m * np.cos((late + 1) * angles)
    rises = stiffness_part > 0
    largest = float((spare[rises] / stiffness_part[rises]).min())
    return largest if largest > 0 and (spare[~rises] >= largest * stiffness_part[~rises]).all() else 0.0


def abbott_okamura_n_per_m(scene: Scene) -> float:
    """Return the largest stiffness that is passive without damping on a quantised position, N/m."""
    return min(colgate_schenkel_n_per_m(scene, 0.0), 2 * (scene.handle.coulomb_n or 0.0) / scene.encoder.count_m)


def _estimator(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the estimator as (A, B, C, D) from position (m) to velocity (m/s), one step a sample.

    Raises:
        ValueError: if it is not linear.
    """
    name, rate = scene.controller.estimator, float(scene.spec.sample_hz)
    if name not in LINEAR:
        raise ValueError(f"estimator must be one of {', '.join(LINEAR)} for a linear loop, not {name!r}")
    numerator, denominator = np.array([rate, -rate]), np.array([1.0, 0.0])
    if name == "butterworth":
        b, a = signal.butter(2, scene.spec.design.gains.cutoff_hz, fs=rate)
        numerator, denominator = np.convolve(numerator, b), np.convolve(denominator, a)
    a, b, c, d = signal.tf2ss(numerator, denominator)
    return a, b[:, 0], c[0], float(d[0, 0])


def _device(scene: Scene) -> Device:
    """Return the scene's device, a rigid handle's too."""
    return device_of(scene) or Device(scene.handle.mass_kg, scene.handle.viscous_n_s_per_m)


class Loop:
    """The linear loop of a scene in contact, over one update period of the force.

    The state, at the instant that the count of a sample stands for: the device's own (`device.equations`), the command
    to it (N), the drive (N) in force, those on their way through the amplifier, the estimator's own.

    Raises:
        ValueError: if the estimator is not linear.
    """

    def __init__(self, scene: Scene):
        self._a, self._b, self._c, self._d = _estimator(scene)
        found = equations(_device(scene))
        n, spec, delay = len(found.rates), scene.spec, scene.delay_samples
        self._seen = np.array(found.seen[:n])
        command, self._drive = n, n + 1
        self._n_state = n + 2 + delay + len(self._a)
        self._own = slice(n + 2 + delay, self._n_state)
        # Constant forces move the equilibrium, and not what is stable.
        rates = np.zeros((n + 1, n + 1))
        rates[:n] = np.delete(found.rates, n, axis=1)
        seen_s = latency(scene.controller.glitch_clocks) / spec.clock_hz
        until_drive_s = spec.design.latency_to_drive / spec.clock_hz
        early, late, applied = (np.eye(self._n_state) for _ in range(3))
        early[: n + 1, : n + 1] = expm(rates * (seen_s + until_drive_s))
        late[: n + 1, : n + 1] = expm(rates * (1 / spec.sample_hz - seen_s - until_drive_s))
        applied[command] = 0
        if delay:
            # The oldest leaves, the new one enters.
            first = n + 2
            applied[command, first] = 1
            applied[first : first + delay] = 0
            applied[range(first, first + delay - 1), range(first + 1, first + delay)] = 1
            applied[first + delay - 1, self._drive] = 1
        else:
            applied[command, self._drive] = 1
        after = late @ applied @ early
        self._after_first = np.linalg.matrix_power(after @ self._sampled(), spec.samples_per_actuation - 1) @ after

    def _sampled(self) -> np.ndarray:
        """Return what the estimator makes of a sample."""
        sampled = np.eye(self._n_state)
        sampled[self._own, self._own] = self._a
        sampled[self._own, : len(self._seen)] = np.outer(self._b, self._seen)
        return sampled

    def radius(self, stiffness_n_per_m: float, damping_n_s_per_m: float) -> float:
        """Return the largest magnitude of a period's eigenvalues; below 1 the loop is stable."""
        updated = self._sampled()
        updated[self._drive] = 0
        updated[self._drive, : len(self._seen)] = -(stiffness_n_per_m + damping_n_s_per_m * self._d) * self._seen
        updated[self._drive, self._own] = -damping_n_s_per_m * self._c
        return float(np.abs(np.linalg.eigvals(self._after_first @ updated)).max())


def linear_limit_n_per_m(loop: Loop, damping_n_s_per_m: float, least: float = 1.0, most: float = 1e8) -> float:
    """Return the stiffness (N/m) at which the linear loop with a wall's damping first becomes unstable.

    Args:
        loop: of a scene, whose friction that sticks and whose quantisation are left out.
        damping_n_s_per_m: of the wall.
        least, most: the range that is searched, N/m.

    Returns:
        That stiffness, found between the neighbours of a search: stable islands above it, and unstable ones between two
        neighbours, are not looked for. 0 where even the least is unstable, `most` where none is found.
    """
    found = least
    for stiffness in np.geomspace(least, most, SEARCH):
        if loop.radius(stiffness, damping_n_s_per_m) >= 1:
            if stiffness == least:
                return 0.0
            return brentq(lambda k: loop.radius(k, damping_n_s_per_m) - 1, found, stiffness, rtol=1e-9)
        found = stiffness
    return most
