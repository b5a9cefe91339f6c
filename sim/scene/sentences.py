"""The faults of a scene, in words."""

import difflib
import types
import typing
from typing import Any

from pydantic import BaseModel

from ...model.checks import shown
from ...model.runtime.accepted import accepted
from .schema import Scene


def sections_of(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """Return the sections of a scene, or of a section, by name."""
    kinds = {name: (field.annotation, *typing.get_args(field.annotation)) for name, field in model.model_fields.items()}
    return {
        name: kind
        for name, several in kinds.items()
        for kind in several
        if isinstance(kind, type) and issubclass(kind, BaseModel)
    }


def listed(kind: Any) -> type[BaseModel] | None:
    """Return the section that every entry of a type of lists is; None for other types."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is list and isinstance(inner[0], type) and issubclass(inner[0], BaseModel):
        return inner[0]
    if origin in (typing.Annotated, typing.Union, types.UnionType):
        found = (listed(each) for each in inner[: 1 if origin is typing.Annotated else None])
        return next((section for section in found if section), None)
    return None


def written(key: tuple[str | int, ...]) -> str:
    """Return a key from its parts; numbers are places in lists, as in `encoder.cycles[0].edges`."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key).removeprefix(".")


def stranger(key: tuple[str | int, ...]) -> str | None:
    """Return the sentence on an unknown key of a scene, by its parts; None for a known key."""
    section: type[BaseModel] | None = Scene
    for depth, part in enumerate(key):
        if isinstance(part, int):
            continue
        known = {name: field for name, field in section.model_fields.items() if (depth, name) != (0, "name")}
        if part not in known:
            near = difflib.get_close_matches(part, known, 1)
            other = f"; did you mean {near[0]}?" if near else f"; its section has {', '.join(known) or 'no keys'}"
            return f"{written(key[: depth + 1])} is not a key of a scene{other}"
        if depth + 1 < len(key):
            inner = sections_of(section) if isinstance(key[depth + 1], str) else {part: listed(known[part].annotation)}
            section = inner.get(part)
            if section is None:
                return f"{written(key)} is not a key of a scene: {written(key[: depth + 1])} is no section"
    return None


def sentence(error: dict[str, Any]) -> str:
    """Return one pydantic error as 'KEY must be ..., not VALUE'."""
    if error["type"] == "extra_forbidden":
        return stranger(error["loc"]) or f"{written(error['loc'])} is not a key of a scene"
    section, parts, kind, marks = Scene, [], None, ()
    for part in error["loc"]:
        if isinstance(part, int) and (entry := listed(kind)):
            parts.append(part)
            section, kind, marks = entry, entry, ()
            continue
        if part not in section.model_fields:
            break  # what follows is inside of a value
        parts.append(part)
        field, inner = section.model_fields[part], sections_of(section)
        kind, marks = field.annotation, tuple(field.metadata)
        section = inner.get(part, BaseModel)
    key = written(tuple(parts))
    if error["type"] == "missing":
        return f"{key} is missing"
    return f"{key} must be {accepted(kind, marks)}, not {shown(error['input'])}"
