"""What studies of maps share: a grid that a region ends on, and only cases that can be."""

from collections.abc import Callable
from typing import Any, TypeVar

from .scene import Scene, SceneError
from .zwidth import Case, Map, grid_of

Key = TypeVar("Key")
Mapping = Callable[[str, list[Case]], list[Map]]
"""What makes the map of each case; the text is for the one who waits."""

ROOM = 3.0
"""The grid of a study goes so much farther than the scene's, in K and in B: some of the paper's regions leave that."""


def room(scene: Scene, coarser: float) -> dict[str, Any]:
    """Return changes of a scene, by dotted key: a larger grid of so much longer steps, on a controller made for it.

    Raises:
        SceneError: if it has no section `zwidth`.
    """
    grid = grid_of(scene)
    stiffness, damping = ROOM * grid.stiffness_to_n_per_m, ROOM * grid.damping_to_n_s_per_m
    return {
        "zwidth.stiffness_step_n_per_m": coarser * grid.stiffness_step_n_per_m,
        "zwidth.stiffness_to_n_per_m": stiffness,
        "zwidth.damping_step_n_s_per_m": coarser * grid.damping_step_n_s_per_m,
        "zwidth.damping_to_n_s_per_m": damping,
        "controller.stiffness_max_n_per_m": max(stiffness, scene.controller.stiffness_max_n_per_m),
        "controller.damping_max_n_s_per_m": max(damping, scene.controller.damping_max_n_s_per_m),
    }


def accepted(cases: dict[Key, Case]) -> dict[Key, Case]:
    """Return the cases that can be: words for extreme gains may not fit.

    Raises:
        SceneError: if none can.
    """
    possible, refusal = {}, None
    for key, case in cases.items():
        try:
            _ = case.parsed
            possible[key] = case
        except SceneError as error:
            refusal = error
    if refusal and not possible:
        raise refusal
    return possible
