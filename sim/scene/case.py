"""A scene as a value: its text and the changes to it, from which any process makes the same scene."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypeVar

from .checks import check_hit
from .errors import SceneError
from .load import parse, read
from .schema import Scene

Key = TypeVar("Key")


@dataclass(frozen=True)
class Case:
    """A scene with changes, to be hit or mapped.

    Attributes:
        label: name of the case in tables, legends and errors.
        source, text: the scene's name or file, and the file's text, because a worker need not have the file.
        changes: changes to the scene, by dotted key; a value of None takes the key out.
    """

    label: str
    source: str
    text: str
    changes: dict[str, Any]

    @classmethod
    def of(cls, source: str, changes: dict[str, Any] | None = None, label: str = "") -> "Case":
        """Return the case of a scene by its name or file, which is read once, here.

        Raises:
            SceneError: if there is no such scene, or it is not valid.
        """
        case = cls(label, source, read(source), changes or {})
        _ = case.scene
        return case

    @property
    def scene(self) -> Scene:
        """The scene with its changes; it is made once a process.

        Raises:
            SceneError: if the scene is not valid.
        """
        try:
            return _scene(_Recipe(self.source, self.text, self.changes))
        except SceneError as error:
            raise SceneError(f"{error} ({self.label})" if self.label else str(error)) from None

    def without_coupling(self, why: str) -> None:
        """Raise SceneError if the scene has a virtual coupling, with the reason why it must not."""
        if self.scene.coupling is not None:
            raise SceneError(f"{self.scene.name}: coupling must be absent: {why}")

    @property
    def variants(self) -> dict[str, "Case"]:
        """The cases, by name, that are hit for this one: itself, without a name. See `worst_variant.WorstCase`."""
        return {"": self}

    def changed(self, changes: dict[str, Any], label: str | None = None) -> "Case":
        """Return the case with more changes, and another label if one is given."""
        return replace(self, changes=self.changes | changes, label=self.label if label is None else label)

    def with_defaults(self, changes: dict[str, Any]) -> "Case":
        """Return the case with more changes, which its own changes override."""
        return replace(self, changes=changes | self.changes)

    def job(self) -> dict[str, Any]:
        """Return the case as keys of a job, from which a worker makes it again."""
        return {"scene": self.source, "text": self.text, "changes": self.changes}

    def hitting(
        self,
        stiffness_n_per_m: float | None = None,
        damping_n_s_per_m: float | None = None,
        start: tuple[float, float] | None = None,
    ) -> Scene:
        """Return the scene for a hit of another wall, or from another start: its place in a count and its phase. Only
        the wall is checked again.

        Raises:
            SceneError: if the wall is not valid.
        """
        scene = self.scene
        own, asked = (
            (scene.wall.stiffness_n_per_m, scene.wall.damping_n_s_per_m),
            (stiffness_n_per_m, damping_n_s_per_m),
        )
        hit = scene.hitting(*(mine if other is None else other for mine, other in zip(own, asked, strict=True)), start)
        try:
            check_hit(hit)
        except ValueError as error:
            raise SceneError(f"{self.source}: {error}") from None
        return hit


@dataclass(frozen=True)
class _Recipe:
    """The source, text and changes of a scene, with a hash, which Python does not have for `changes`."""

    source: str
    text: str
    changes: dict[str, Any]

    def __hash__(self) -> int:
        return hash((self.source, self.text, repr(self.changes)))


@lru_cache(maxsize=1 << 10)
def _scene(recipe: _Recipe) -> Scene:
    return parse(recipe.source, recipe.text, recipe.changes)


def accepted(cases: dict[Key, Case]) -> dict[Key, Case]:
    """Return the valid cases; a case is not valid if, for example, the words for extreme gains do not fit.

    Raises:
        SceneError: if no case is valid.
    """
    possible, refusal = {}, None
    for key, case in cases.items():
        try:
            _ = case.scene
            possible[key] = case
        except SceneError as error:
            refusal = error
    if refusal and not possible:
        raise refusal
    return possible
