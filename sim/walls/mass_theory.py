"""Which virtual mass is stable in theory: a rigid handle in a wall, with the exact velocity and acceleration.

The handle has the mass m and the viscous friction b. Its force is updated every T, as

    F = -(K x + B v + M a)

with position, velocity and acceleration of the sample, and acts d T later. Between two updates the force is constant.
So the acceleration of a sample is the one of the force that acted just before it: it is late, even with d = 0. The loop
is linear, and stable while every eigenvalue of a period is within the unit circle.

Without a wall, M a alone is left: a period multiplies the acceleration by -M / m, so any M below m is stable.
"""

import numpy as np
import scipy

from ..scene.schema import Scene
from .theory import delay_s

SHARES = np.linspace(-0.995, 0.995, 399)
"""The virtual masses that are tried, as shares of the handle's mass."""
WITHIN = 1e-9
"""How far an eigenvalue may be outside the circle by rounding."""


def _moved(mass_kg: float, viscous_n_s_per_m: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return what a time makes of (position, velocity), and what a constant force (N) adds."""
    rates = np.array([[0.0, 1.0, 0.0], [0.0, -viscous_n_s_per_m / mass_kg, 1.0 / mass_kg], [0.0, 0.0, 0.0]])
    change = scipy.linalg.expm(rates * seconds)
    return change[:2, :2], change[:2, 2]


def period(scene: Scene, stiffness_n_per_m: float, damping_n_s_per_m: float, mass_kg: float) -> np.ndarray:
    """Return the change of the state in a period of the force.

    The state is position and velocity at a sample, and the forces that are on their way, the newest first. The last of
    them acts just before the sample.
    """
    handle, period_s = scene.handle, 1 / scene.controller.actuation_hz
    whole, part = divmod(delay_s(scene) / period_s, 1.0)
    states = 3 + int(whole)
    last = states - 1
    command = np.zeros(states)
    command[:2] = -stiffness_n_per_m, -damping_n_s_per_m + mass_kg * handle.viscous_n_s_per_m / handle.mass_kg
    command[last] -= mass_kg / handle.mass_kg
    begins, ends = (_moved(handle.mass_kg, handle.viscous_n_s_per_m, share * period_s) for share in (part, 1 - part))
    change = np.zeros((states, states))
    # The force of before acts for a part of the period, then the next one, which may be the new command.
    change[:2, :2] = ends[0] @ begins[0]
    change[:2, last] += ends[0] @ begins[1]
    following = command if last == 2 else np.eye(states)[last - 1]
    change[:2] += np.outer(ends[1], following)
    change[2] = command
    change[3:] += np.eye(states)[2:last]
    return change


def is_stable(scene: Scene, stiffness_n_per_m: float, damping_n_s_per_m: float, mass_kg: float) -> bool:
    """Return whether the loop with a virtual mass is stable."""
    change = period(scene, stiffness_n_per_m, damping_n_s_per_m, mass_kg)
    return bool(np.abs(np.linalg.eigvals(change)).max() <= 1 + WITHIN)


def stable_shares(scene: Scene, stiffness_n_per_m: float, damping_n_s_per_m: float) -> tuple[float, float] | None:
    """Return the least and the largest stable virtual mass, as shares of the handle's; None if none is stable.

    All in between are stable, too.
    """
    stable = [is_stable(scene, stiffness_n_per_m, damping_n_s_per_m, share * scene.handle.mass_kg) for share in SHARES]
    if not any(stable):
        return None
    edges = np.flatnonzero(np.diff(np.concatenate([[0], stable, [0]])))
    first, behind = max(edges.reshape(-1, 2).tolist(), key=lambda run: run[1] - run[0])
    return float(SHARES[first]), float(SHARES[behind - 1])
