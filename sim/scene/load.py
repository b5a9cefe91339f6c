"""Reading of scenes: a TOML file, with some of its keys changed, becomes a checked `Scene`.

Every error is one line that names the file, the key and what is accepted.
"""

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from .checks import check, sentence
from .errors import SceneError
from .schema import Scene

FOLDER = Path(__file__).with_name("builtin")


def names() -> list[str]:
    """Return the names of the scenes that come with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(scene: str, changes: dict[str, Any] | None = None) -> Scene:
    """Return the scene of a name, or in a file, with some keys changed.

    Args:
        scene: one of `names()`, or the path of a TOML file.
        changes: values by dotted key, e.g. `{"handle.mass_kg": 0.5}`; a value of None takes the key out.

    Raises:
        SceneError: if the scene is not valid; the message is one line on what is wrong, where, and what is accepted.
    """
    return parse(scene, read(scene), changes)


def read(scene: str) -> str:
    """Return the text of the scene of a name, or in a file.

    Raises:
        SceneError: if there is no such scene.
    """
    try:
        return _path(scene).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(f"scene must be one of {', '.join(names())}, or a .toml file, not {scene!r}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{scene}: not a readable TOML file: {str(error).splitlines()[0]}") from None


def _path(scene: str) -> Path:
    return Path(scene) if scene.endswith(".toml") else FOLDER / f"{scene}.toml"


def parse(scene: str, text: str, changes: dict[str, Any] | None = None) -> Scene:
    """Return the scene of a text, with some keys changed: `load` without reading `scene`, which messages still name.

    Raises:
        SceneError: as in `load`.
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{scene}: not a readable TOML file: {str(error).splitlines()[0]}") from None
    for key, value in (changes or {}).items():
        *sections, last = key.split(".")
        place = content
        for section in sections:
            place = place.setdefault(section, {})
            if not isinstance(place, dict):
                raise SceneError(f"{scene}: {key} is not a key of a scene")
        place.pop(last, None)
        if value is not None:
            place[last] = value
    try:
        result = Scene(name=_path(scene).stem, **{key: value for key, value in content.items() if key != "name"})
        check(result)
    except ValidationError as error:
        # A misspelt key also makes a key missing; the message about the misspelling says more.
        worst = min(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
        raise SceneError(f"{scene}: {sentence(worst, Scene)}") from None
    except ValueError as error:
        raise SceneError(f"{scene}: {error}") from None
    return result
