"""Cases: scenes with changes, that maps of stable walls are made of, and their grids.

What studies of maps share is here too: a grid that a region ends on, and only cases that can be.
"""

from dataclasses import dataclass
from typing import Any, TypeVar

from ..jobs import store
from ..scene.load import parse
from ..scene.schema import Scene, SceneError
from .boundary import Grid

Key = TypeVar("Key")


@dataclass(frozen=True)
class Case:
    """What a map is of.

    Attributes:
        label: in tables and legends.
        scene, text: the scene's name or file, and what is in it: the file need not be where the worker runs.
        changes: of the scene, by dotted key.
    """

    label: str
    scene: str
    text: str
    changes: dict[str, Any]

    @property
    def parsed(self) -> Scene:
        """The scene, changed.

        Raises:
            SceneError: if it cannot be.
        """
        try:
            return parse(self.scene, self.text, self.changes)
        except SceneError as error:
            raise SceneError(f"{error} ({self.label})") from None

    def job(self, backend: str) -> dict[str, Any]:
        """Return the arguments of `verdict` but for the wall."""
        keys = {"scene": self.scene, "text": self.text, "changes": self.changes}
        return keys | {"sources": store.sources(), "backend": backend}


ROOM = 3.0
"""The grid of a study goes so much farther than the scene's, in K and in B: some of the paper's regions leave that."""


def grid_of(scene: Scene) -> Grid:
    """Return the steps of a scene's maps.

    Raises:
        SceneError: if it has no section `zwidth`.
    """
    if scene.zwidth is None:
        raise SceneError(f"{scene.name}: zwidth is missing: a map needs its steps")
    return Grid(**scene.zwidth.model_dump())


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
