"""The exact boundary of the linear loop with a virtual coupling: handle, axis and tool, over a period of both rates.

As `theory.Loop`, with the tool of `loop.coupled` in contact with its wall. The state has six more numbers: position and
velocity of the tool, of the axis's present surface, and of the next surface. The rounding of the surface's position and
velocity is left out.
"""

import math
from itertools import groupby

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
        # A period as turns of one force update each: runs of turns that are alike, by the kinds of their samples.
        samples = range(math.lcm(self._tool.period, self._apart))
        turns = zip(*[map(self._kind, samples)] * self._apart, strict=True)
        self._runs = [(turn, len(list(alike))) for turn, alike in groupby(turns)]

    def radius(self, stiffness_n_per_m: float, damping_n_s_per_m: float) -> float:
        """Return the largest magnitude of the eigenvalues of a period; below 1 the loop is stable.

        Args:
            stiffness_n_per_m, damping_n_s_per_m: the wall that the tool touches.
        """
        wall, change = (stiffness_n_per_m, damping_n_s_per_m), np.eye(self._whole)
        for turn, times in self._runs:
            one = np.eye(self._whole)
            for kind in turn:
                one = self._rest @ self._taken(kind, *wall) @ one
            change = np.linalg.matrix_power(one, times) @ change
        return float(np.abs(np.linalg.eigvals(change)).max())

    def _kind(self, k: int) -> tuple[bool, bool, bool]:
        """Return whether sample k changes the force, is taken by the host, and is the last before the surface moves."""
        phase = k % self._tool.period
        return k % self._apart == 0, phase == 0, phase + 1 == self._tool.latency

    def _taken(self, kind: tuple[bool, bool, bool], stiffness_n_per_m: float, damping_n_s_per_m: float) -> np.ndarray:
        """Return the matrix of a sample of a kind, by axis and host."""
        tool, own, (forces, taken_by_host, last) = self._tool, self._own, kind
        taken = np.eye(self._whole)
        taken[: self._n_state, : self._n_state] = self._sampled()
        tool_m, tool_m_per_s, surface_m, surface_m_per_s, next_m, next_m_per_s = np.eye(self._whole)[self._n_state :]
        handle, velocity = np.zeros((2, self._whole))
        handle[: len(self._seen)] = self._seen
        velocity[own] = self._c
        velocity += self._d * handle
        if forces:
            taken[self._drive] = -tool.stiffness_n_per_m * (handle - surface_m)
            taken[self._drive] -= tool.damping_n_s_per_m * (velocity - surface_m_per_s)
        if taken_by_host:
            seconds = tool.period_s
            coupled = tool.stiffness_n_per_m * (handle - tool_m) + tool.damping_n_s_per_m * velocity
            impulse = tool.mass_kg * tool_m_per_s + seconds * (coupled - stiffness_n_per_m * tool_m)
            damping = tool.damping_n_s_per_m + damping_n_s_per_m
            stiffness = tool.stiffness_n_per_m + stiffness_n_per_m
            next_m_per_s = impulse / (tool.mass_kg + seconds * (damping + seconds * stiffness))
            next_m = tool_m + seconds * next_m_per_s
            taken[self._n_state : self._n_state + 2] = next_m, next_m_per_s
            next_m = next_m + tool.ahead_s * next_m_per_s
            taken[self._n_state + 4 :] = next_m, next_m_per_s
        if last:
            taken[self._n_state + 2 : self._n_state + 4] = next_m, next_m_per_s
        return taken


def loop_of(scene: Scene) -> Loop:
    """Return the linear loop of a scene.

    Raises:
        ValueError: if the estimator is not linear.
    """
    return Loop(scene) if scene.coupling is None else CoupledLoop(scene)
