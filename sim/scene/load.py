"""Reading of scenes: a TOML file, with some of its keys changed, becomes a checked `Scene`.

Every error is one line: the file, the key and the accepted values.
"""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from ...model.checks import shown
from ...model.runtime.regular_file import content_of
from .checks import check
from .errors import SceneError
from .schema import Scene
from .sentences import sentence, stranger

FOLDER = Path(__file__).with_name("builtin")
WALL = {("wall", "stiffness_n_per_m"), ("wall", "damping_n_s_per_m")}
"""The keys of the wall, which the controller limits."""
BYTES_MAX = 10**6
"""The largest file of a scene."""

AXIS = "axis"
"""The key of a scene's tables of several axes: see `tables`."""

AnyScene = TypeVar("AnyScene", bound=Scene)


def names() -> list[str]:
    """Return the names of the scenes that come with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(scene: str, changes: dict[str, Any] | None = None) -> Scene:
    """Return the scene of a name, or in a file, with some keys changed.

    Args:
        scene: one of `names()`, or the path of a TOML file.
        changes: values by dotted key, e.g. `{"handle.mass_kg": 0.5}`; a value of None takes the key out.

    Raises:
        SceneError: if the scene is not valid; the message is one line: the fault, its place, and the accepted values.
    """
    return parse(scene, read(scene), changes)


def read(scene: str) -> str:
    """Return the text of the scene of a name, or in a file.

    Raises:
        SceneError: if there is no such scene.
    """
    try:
        if not scene.endswith(".toml") and scene not in names():
            raise FileNotFoundError
        return content_of(_path(scene), BYTES_MAX).decode("utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"scene must be one of {', '.join(names())}, or a .toml file, not {shown(scene)}") from None
    except UnicodeDecodeError:
        raise SceneError(f"scene must be a .toml file of UTF-8 text, not {shown(scene)}") from None
    except OSError as error:
        raise SceneError(f"scene must be a readable .toml file, not {shown(scene)}: {error.strerror}") from None


def _path(scene: str) -> Path:
    return Path(scene) if scene.endswith(".toml") else FOLDER / f"{scene}.toml"


def parse(scene: str, text: str, changes: dict[str, Any] | None = None) -> Scene:
    """Return the scene of a text, with some keys changed: `load` without reading `scene`, which messages still name.

    Raises:
        SceneError: as in `load`.
    """
    content = content_of_scene(scene, text)
    if AXIS in content:
        raise SceneError(
            f"{scene}: has several axes, [[axis]], which `hardwall hit` takes; this takes scenes of one axis"
        )
    for key, value in (changes or {}).items():
        put(content, scene, key, value)
    return made(scene, content, lambda given: Scene(**given))


def content_of_scene(scene: str, text: str) -> dict[str, Any]:
    """Return what the text of a scene says, by section and key.

    Raises:
        SceneError: if it is not TOML, or has a name.
    """
    try:
        content = toml_of(text)
    except ValueError as error:
        raise SceneError(f"{scene}: must be a readable TOML file: {error}") from None
    if "name" in content:
        raise SceneError(f"{scene}: name is not a key of a scene: the name of the file is the scene's name")
    return content


def made(scene: str, content: dict[str, Any], make: Callable[[dict[str, Any]], AnyScene]) -> AnyScene:
    """Return the checked scene that `make` makes of a name and a content.

    Raises:
        SceneError: if the scene is not valid.
    """
    content = {**content, "name": _path(scene).stem}
    try:
        result = make(content)
        check(result)
    except ValidationError as error:
        # A misspelt key also makes a key missing; the message about the misspelling says more.
        worst = min(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
        raise SceneError(f"{scene}: {_of_the_wall(content, error, make) or sentence(worst)}") from None
    except ValueError as error:
        raise SceneError(f"{scene}: {error}") from None
    return result


def _of_the_wall(content: dict[str, Any], error: ValidationError, make: Callable) -> str | None:
    """Return the fault of a wall, by the range of the scene's controller, which is narrower than the range of the keys.

    None if something else is wrong with the scene, or the wall is none of numbers.
    """
    given = {problem["loc"]: problem["input"] for problem in error.errors()}
    if not given.keys() <= WALL or not all(type(value) in (int, float) for value in given.values()):
        return None
    given = {key: value for (_, key), value in given.items()}
    try:
        other = make(content | {"wall": content["wall"] | dict.fromkeys(given, 0.0)})
        check(other)
        check(other.model_copy(update={"wall": other.wall.model_copy(update=given)}))
    except ValueError as refusal:
        return str(refusal)
    return None


def put(content: dict[str, Any], scene: str, key: str, value: Any) -> None:
    """Change a dotted key of a scene's content; a value of None takes it out."""
    *sections, last = key.split(".")
    wrong = stranger((*sections, last))
    if wrong:
        raise SceneError(f"{scene}: {wrong}")
    place = content
    for section in sections:
        place = place.setdefault(section, {})
        if not isinstance(place, dict):
            raise SceneError(f"{scene}: {section} must be a section, not {shown(place)}")
    place.pop(last, None)
    if value is not None:
        place[last] = value


def toml_of(text: str) -> dict[str, Any]:
    """Return the content of TOML text.

    Raises:
        ValueError: if it is not TOML, or has longer integers or a deeper nesting than Python reads; in one line.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except ValueError as error:
        raise ValueError(str(error).splitlines()[0]) from None
