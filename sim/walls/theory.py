"""The largest stiffness in theory: two bounds for passivity, and the exact boundary of the linear loop.

- Colgate and Schenkel: let a wall of K and B be sampled every T, with its force d periods late. It is passive on a
  rigid handle under this condition at every angle a = w T: b > K T / 2 sin((d + 1/2) a) / sin(a / 2) - B cos((d + 1)
  a). For d = 0 this is b > K T / 2 + |B|. The condition is theirs for a plain difference at the force's rate; a
  fractional d lies between its neighbours.
- Abbott and Okamura: with B = 0, position quantised to q and Coulomb friction f_c, passive if also K <= 2 f_c / q.
- Linear: in contact, without sticking friction, limits, quantisation and a carrier's pulses, the loop with a linear
  estimator is linear and periodic with the force's update. It is stable while every eigenvalue of the state's change
  over a period is within the unit circle. Nothing else is left out: the zero-order hold, the clocks from strobe to
  drive, the clocks of the decoder, and the estimator; amplifier, motor and its shunt, cable and hand.

The first two are for a rigid handle. A passive wall is stable with any hand, so these bounds lie below the linear
boundary without a hand.
"""

import math

import numpy as np
import scipy

from ...model.encoder.quadrature import latency
from ..scene.build import device_of
from ..scene.schema import Scene
from ..world.device import Device, equations

LINEAR = ("fdm", "butterworth")
"""Estimators with a known exact boundary."""
ANGLES = np.linspace(1e-5, np.pi, 20_001)
SEARCHED_N_PER_M = np.geomspace(1.0, 1e8, 100)
"""The stiffnesses among which the first unstable one is searched for."""


def delay_s(scene: Scene) -> float:
    """Return the time (s) from a position to the force that follows from it, by decoder, force path and amplifier."""
    clocks = latency(scene.glitch_clocks) + scene.spec.design.latency_to_drive
    return clocks / scene.spec.clock_hz + scene.delay_samples / scene.spec.sample_hz


def colgate_schenkel_n_per_m(scene: Scene, damping_n_s_per_m: float) -> float:
    """Return the largest stiffness that is passive with a wall's damping, N/m; 0 if no stiffness is."""
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


def held(scene: Scene, frequency_hz: float) -> complex:
    """Return the factor by which a force at a frequency is late and held when it acts: the zero-order hold's and all
    delays'."""
    period_s = 1 / scene.controller.actuation_hz
    late_s = delay_s(scene) + period_s / 2
    return complex(np.exp(-2j * np.pi * frequency_hz * late_s) * np.sinc(frequency_hz * period_s))


def impedance_n_per_m(scene: Scene, frequency_hz: float, exact: bool = False) -> complex:
    """Return the stiffness and damping that a scene's wall renders to a handle in sinusoidal motion: K_r + j w B_r,
    N/m.

    The commanded K + j w B, its damper behind the estimator, and all of it late and held. Counts are as fine as can be.

    Args:
        scene: the scene.
        frequency_hz: frequency of the motion, below half of the force's rate.
        exact: whether to take the exact velocity in place of the estimator's.

    Raises:
        ValueError: if the estimator is not linear, and the velocity is not exact.
    """
    velocity = 2j * np.pi * frequency_hz
    if not exact:
        numerator, denominator = _transfer(scene)
        z = np.exp(velocity / scene.spec.sample_hz)
        velocity = np.polyval(numerator, z) / np.polyval(denominator, z)
    wall = scene.wall
    return (wall.stiffness_n_per_m + wall.damping_n_s_per_m * complex(velocity)) * held(scene, frequency_hz)


def _transfer(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the estimator as numerator and denominator in z, of one length, from position (m) to velocity (m/s).

    Raises:
        ValueError: if the estimator is not linear.
    """
    name, rate = scene.controller.estimator, float(scene.spec.sample_hz)
    if name not in LINEAR:
        raise ValueError(f"estimator must be one of {', '.join(LINEAR)} for a linear loop, not {name!r}")
    numerator, denominator = np.array([rate, -rate]), np.array([1.0, 0.0])
    if name == "butterworth":
        b, a = scipy.signal.butter(2, scene.spec.design.gains.cutoff_hz, fs=rate)
        numerator, denominator = np.convolve(numerator, b), np.convolve(denominator, a)
    return numerator, denominator


def _estimator(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the estimator as (A, B, C, D) from position (m) to velocity (m/s), one step a sample.

    Raises:
        ValueError: if the estimator is not linear.
    """
    a, b, c, d = scipy.signal.tf2ss(*_transfer(scene))
    return a, b[:, 0], c[0], float(d[0, 0])


def _device(scene: Scene) -> Device:
    """Return the scene's device, also for a rigid handle."""
    return device_of(scene) or Device(scene.handle.mass_kg, scene.handle.viscous_n_s_per_m)


class Loop:
    """The linear loop of a scene in contact, over one update period of the force.

    The state is taken at the instant that the count of a sample stands for. It holds the device's state (`plant`), the
    command to it (N), the current drive (N), and the drives on their way through the amplifier. It also holds the
    estimator's state.

    Raises:
        ValueError: if the estimator is not linear.
    """

    def __init__(self, scene: Scene):
        self._a, self._b, self._c, self._d = _estimator(scene)
        device = equations(_device(scene))
        n, spec = len(device.rates), scene.spec
        # A force that comes later than the next sample is as late as an amplifier makes it, and by a part of a sample.
        decoder, per_sample = latency(scene.glitch_clocks), spec.clocks_per_sample
        late = (decoder + spec.design.latency_to_drive - 1) // per_sample
        delay = scene.delay_samples + late
        self._seen = np.array(device.seen[:n])
        command, self._drive = n, n + 1
        self._n_state = n + 2 + delay + len(self._a)
        self._own = slice(n + 2 + delay, self._n_state)
        # Constant forces move the equilibrium, and do not affect its stability.
        rates = np.zeros((n + 1, n + 1))
        rates[:n] = np.delete(device.rates, n, axis=1)
        seen_s = decoder / spec.clock_hz
        until_drive_s = (spec.design.latency_to_drive - late * per_sample) / spec.clock_hz
        early, rest, applied = (np.eye(self._n_state) for _ in range(3))
        early[: n + 1, : n + 1] = scipy.linalg.expm(rates * (seen_s + until_drive_s))
        rest[: n + 1, : n + 1] = scipy.linalg.expm(rates * (1 / spec.sample_hz - seen_s - until_drive_s))
        applied[command] = 0
        if delay:
            # The oldest drive leaves the amplifier, and the new drive enters it.
            first = n + 2
            applied[command, first] = 1
            applied[first : first + delay] = 0
            applied[range(first, first + delay - 1), range(first + 1, first + delay)] = 1
            applied[first + delay - 1, self._drive] = 1
        else:
            applied[command, self._drive] = 1
        self._after = rest @ applied @ early
        later = np.linalg.matrix_power(self._after @ self._sampled(), spec.samples_per_actuation - 1)
        self._after_first = later @ self._after

    def _sampled(self) -> np.ndarray:
        """Return the matrix of the estimator's update at a sample."""
        sampled = np.eye(self._n_state)
        sampled[self._own, self._own] = self._a
        sampled[self._own, : len(self._seen)] = np.outer(self._b, self._seen)
        return sampled

    def radius(self, stiffness_n_per_m: float, damping_n_s_per_m: float) -> float:
        """Return the largest magnitude of the eigenvalues of a period; below 1 the loop is stable."""
        updated = self._sampled()
        updated[self._drive] = 0
        updated[self._drive, : len(self._seen)] = -(stiffness_n_per_m + damping_n_s_per_m * self._d) * self._seen
        updated[self._drive, self._own] = -damping_n_s_per_m * self._c
        return float(np.abs(np.linalg.eigvals(self._after_first @ updated)).max())


def linear_limit_n_per_m(loop: Loop, damping_n_s_per_m: float) -> float:
    """Return the stiffness (N/m) at which the linear loop with a wall's damping first becomes unstable.

    Args:
        loop: the loop of a scene, without its sticking friction and quantisation.
        damping_n_s_per_m: damping of the wall.

    Returns:
        That stiffness, refined between two neighbours of a search. Stable islands above it, and unstable islands
        between two neighbours, are not searched for. It is 0 if even the least is unstable, infinite if no unstable one
        is found.
    """
    stable = SEARCHED_N_PER_M[0]
    for stiffness in SEARCHED_N_PER_M:
        if loop.radius(stiffness, damping_n_s_per_m) >= 1:
            if stiffness == stable:
                return 0.0
            return scipy.optimize.brentq(lambda k: loop.radius(k, damping_n_s_per_m) - 1, stable, stiffness, rtol=1e-9)
        stable = stiffness
    return math.inf
