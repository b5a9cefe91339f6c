"""The grids of maps of stable walls: a scene's own, and one that a region ends on."""

from typing import Any

from ..scene.errors import SceneError
from ..scene.schema import Scene
from .boundary import Grid

WIDER = 3.0
"""The grid of a study goes so much farther than the scene's, in K and in B: some of the paper's regions leave that."""


def grid_of(scene: Scene) -> Grid:
    """Return the steps of a scene's maps.

    Raises:
        SceneError: if it has no section `zwidth`.
    """
    if scene.zwidth is None:
        raise SceneError(f"{scene.name}: zwidth is missing: a map needs its steps")
    return Grid(**scene.zwidth.model_dump())


def wider_grid(scene: Scene, coarser: float) -> dict[str, Any]:
    """Return changes of a scene, by dotted key: a larger grid of so much longer steps, on a controller made for it.

    Raises:
        SceneError: if it has no section `zwidth`.
    """
    grid = grid_of(scene)
    stiffness, damping = WIDER * grid.stiffness_to_n_per_m, WIDER * grid.damping_to_n_s_per_m
    return {
        "zwidth.stiffness_step_n_per_m": coarser * grid.stiffness_step_n_per_m,
        "zwidth.stiffness_to_n_per_m": stiffness,
        "zwidth.damping_step_n_s_per_m": coarser * grid.damping_step_n_s_per_m,
        "zwidth.damping_to_n_s_per_m": damping,
        "controller.stiffness_max_n_per_m": max(stiffness, scene.controller.stiffness_max_n_per_m),
        "controller.damping_max_n_s_per_m": max(damping, scene.controller.damping_max_n_s_per_m),
    }
