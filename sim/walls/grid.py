"""The grids of maps of stable walls: a scene's own grid, and a wider grid on which a region ends."""

from typing import Any

from ..scene.errors import SceneError
from ..scene.schema import Scene
from .boundary import Grid

WIDER = 3.0
"""The factor, in K and in B, from the scene's grid to a study's: some of the paper's regions leave the scene's grid."""


LIMITS = {
    "stiffness_to_n_per_m": "stiffness_max_n_per_m",
    "damping_to_n_s_per_m": "damping_max_n_s_per_m",
}
"""The key of the controller that limits the end of a grid. Only a map asks for it: one hit has no grid."""


def _written(scene: Scene) -> Grid:
    if scene.zwidth is None:
        raise SceneError(f"{scene.name}: zwidth is missing: a map needs its steps")
    return Grid(**scene.zwidth.model_dump())


def grid_of(scene: Scene) -> Grid:
    """Return the grid of a scene's maps.

    Raises:
        SceneError: if it has no section `zwidth`, or one that ends beyond the largest gains of the axis.
    """
    grid = _written(scene)
    for key, limit in LIMITS.items():
        value, most = getattr(grid, key), getattr(scene.controller, limit)
        if value > most and scene.coupling is None:
            raise SceneError(f"{scene.name}: zwidth.{key} must be at most controller.{limit}, {most:g}, not {value!r}")
    return grid


def wider_grid(scene: Scene, coarser: float) -> dict[str, Any]:
    """Return changes of a scene, by dotted key: a wider grid with steps `coarser` times as long, and limits for it.

    Raises:
        SceneError: if it has no section `zwidth`.
    """
    grid = _written(scene)
    stiffness, damping = WIDER * grid.stiffness_to_n_per_m, WIDER * grid.damping_to_n_s_per_m
    # The largest gains of an axis with a coupling are the coupling's, which a wider map leaves as they are.
    limits = {
        "controller.stiffness_max_n_per_m": max(stiffness, scene.controller.stiffness_max_n_per_m),
        "controller.damping_max_n_s_per_m": max(damping, scene.controller.damping_max_n_s_per_m),
    }
    return (limits if scene.coupling is None else {}) | {
        "zwidth.stiffness_step_n_per_m": coarser * grid.stiffness_step_n_per_m,
        "zwidth.stiffness_to_n_per_m": stiffness,
        "zwidth.damping_step_n_s_per_m": coarser * grid.damping_step_n_s_per_m,
        "zwidth.damping_to_n_s_per_m": damping,
    }
