"""The exact boundary of the linear loop with a virtual coupling: handle, axis and tool, over a period of both rates.

As `theory.Loop`, with the tool of `loop.coupled` in contact with its wall. The state has six numbers more: the tool's
position and velocity, those of the surface that the axis has, and those of the next one. Neither the rounding of the
surface to counts nor that of its velocity is in it.
"""

import math

import numpy as np

from ..scene.build import tool_of
from ..scene.schema import Scene
from .theory import Loop


class CoupledLoop(Loop):
    """The linear loop of a scene with a section `coupling`, its tool in contact.

    Raises:
        ValueError: if the estimator is not linear.
    """

    def __init__(self, scene: Scene):
        super().__init__(scene)
        self._tool, self._apart = tool_of(scene, "float"), scene.spec.samples_per_actuation
        self._whole = self._n_state + 6
        self._rest = np.eye(self._whole)
        self._rest[: self._n_state, : self._n_state] = self._after

    def radius(self, stiffness_n_per_m: float, damping_n_s_per_m: float) -> float:
        """Return the largest magnitude of the eigenvalues of a period; below 1 the loop is stable.

        Args:
            stiffness_n_per_m, damping_n_s_per_m: the wall that the tool touches.
        """
        change = np.eye(self._whole)
        for k in range(math.lcm(self._tool.period, self._apart)):
            change = self._rest @ self._taken(k, stiffness_n_per_m, damping_n_s_per_m) @ change
        return float(np.abs(np.linalg.eigvals(change)).max())

    def _taken(self, k: int, stiffness_n_per_m: float, damping_n_s_per_m: float) -> np.ndarray:
        """Return the matrix of sample k of a period, by axis and host."""
        tool, own = self._tool, self._own
        taken = np.eye(self._whole)
        taken[: self._n_state, : self._n_state] = self._sampled()
        tool_m, tool_m_per_s, surface_m, surface_m_per_s, next_m, next_m_per_s = np.eye(self._whole)[self._n_state :]
        handle, velocity = np.zeros((2, self._whole))
        handle[: len(self._seen)] = self._seen
        velocity[own] = self._c
        velocity += self._d * handle
        if k % self._apart == 0:
            taken[self._drive] = -tool.stiffness_n_per_m * (handle - surface_m)
            taken[self._drive] -= tool.damping_n_s_per_m * (velocity - surface_m_per_s)
        phase, seconds = k % tool.period, tool.period_s
        if phase == 0:
            coupled = tool.stiffness_n_per_m * (handle - tool_m) + tool.damping_n_s_per_m * velocity
            impulse = tool.mass_kg * tool_m_per_s + seconds * (coupled - stiffness_n_per_m * tool_m)
            damping = tool.damping_n_s_per_m + damping_n_s_per_m
            stiffness = tool.stiffness_n_per_m + stiffness_n_per_m
            next_m_per_s = impulse / (tool.mass_kg + seconds * (damping + seconds * stiffness))
            next_m = tool_m + seconds * next_m_per_s
            taken[self._n_state : self._n_state + 2] = next_m, next_m_per_s
            next_m = next_m + tool.ahead_s * next_m_per_s
            taken[self._n_state + 4 :] = next_m, next_m_per_s
        if phase + 1 == tool.latency:
            taken[self._n_state + 2 : self._n_state + 4] = next_m, next_m_per_s
        return taken


def loop_of(scene: Scene) -> Loop:
    """Return the linear loop of a scene.

    Raises:
        ValueError: if the estimator is not linear.
    """
    return Loop(scene) if scene.coupling is None else CoupledLoop(scene)
