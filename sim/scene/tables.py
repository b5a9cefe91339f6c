"""The tables `[[axis]]` of a scene: the keys of each axis, which replace the keys of the common sections.

[wall]
stiffness_n_per_m = 10e3        # of every axis that has none of its own
damping_n_s_per_m = 20.0

[[axis]]
name = "thumb"
wall.stiffness_n_per_m = 2e3
"""

import copy
import re
from collections.abc import Iterator
from typing import Any

from ...model.axes.axis import AXES_MAX
from ...model.checks import shown
from .errors import SceneError
from .load import AXIS, content_of_scene, made, parse, put, read
from .schema import Scene
from .sentences import stranger
from .several import ABSENT, AxesScene, AxisScene, shared

NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")

Content = dict[str, Any]
"""The content of a scene's file, by section and key."""


def load_any(scene: str, changes: dict[str, Any] | None = None) -> Scene | AxesScene:
    """Return the scene of a name, or in a file, of one axis or of several, with some keys changed.

    Args:
        scene: one of `load.names()`, or the path of a TOML file.
        changes: values by dotted key, as of `load.load`; of several axes they hold for every one of them, whatever its
            table says, and `axis.NAME.SECTION.KEY` for that one.

    Raises:
        SceneError: if the scene is not valid; the message is one line that names the axis, too.
    """
    text = read(scene)
    if AXIS not in content_of_scene(scene, text):
        return parse(scene, text, changes)
    return parse_axes(scene, text, changes)


def parse_axes(scene: str, text: str, changes: dict[str, Any] | None = None) -> AxesScene:
    """Return the scene of several axes of a text, with some keys changed, as `load_any` does.

    Raises:
        SceneError: as in `load_any`.
    """
    content = content_of_scene(scene, text)
    tables = _tables(scene, content.pop(AXIS))
    for section in content:
        wrong = stranger((section,))
        if wrong or section in ABSENT:
            raise SceneError(f"{scene}: {wrong or f'{section} must be absent beside [[axis]]: {ABSENT[section]}'}")
    _change(scene, content, tables, changes or {})
    merged = {name: _merged(content, table) for name, table in tables.items()}
    first = next(iter(merged))
    plain = {key: value for key, value in merged[first].items() if key != "controller"}
    only = {"controller": content["controller"]} if "controller" in content else {}

    def axis(name: str, own: Content, **place: Any) -> AxisScene:
        try:
            return made(scene, own, lambda given: AxisScene(axis=name, axes=len(tables), **place, **given))
        except SceneError as error:
            raise SceneError(_with_the_axis(str(error), scene, name, content, tables[name])) from None

    base = axis(first, plain | only, number=0)
    axes = (axis(name, own, number=number, base=base) for number, (name, own) in enumerate(merged.items()))
    return AxesScene(base.name, tuple(axes))


def _tables(scene: str, given: Any) -> dict[str, Content]:
    """Return the tables of the axes by name, without their names."""
    if not isinstance(given, list) or not all(isinstance(table, dict) for table in given):
        raise SceneError(f"{scene}: axis must be tables, each under [[axis]], not {shown(given)}")
    if not 1 <= len(given) <= AXES_MAX:
        raise SceneError(f"{scene}: axis must be 1 to {AXES_MAX} tables, not {len(given)}")
    tables: dict[str, Content] = {}
    for number, table in enumerate(given, 1):
        name = table.get("name")
        if not isinstance(name, str) or not NAME.fullmatch(name):
            raise SceneError(
                f"{scene}: name of axis number {number} must be 1 to 40 letters, digits, - and _, not {shown(name)}"
            )
        if name in tables:
            raise SceneError(f"{scene}: name of axis number {number} must be another than those before, not {name!r}")
        tables[name] = {key: value for key, value in table.items() if key != "name"}
        for key in _keys(tables[name]):
            _check_own(scene, name, key)
    return tables


def _keys(table: Content, before: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the keys of a table, and of the tables in it, by their parts."""
    for key, value in table.items():
        if isinstance(value, dict) and value:
            yield from _keys(value, (*before, key))
        else:
            yield (*before, key)


def _check_own(scene: str, name: str, key: tuple[str, ...]) -> None:
    """Raise SceneError if a key is none of a scene, or is not an axis's own."""
    wrong = stranger(key)
    if wrong is None and shared(key):
        wrong = f"{'.'.join(key)} is shared by all axes, and stands in the sections at the top alone"
        if key[0] in ABSENT:
            wrong = f"{key[0]} must be absent: {ABSENT[key[0]]}"
    if wrong:
        raise SceneError(f"{scene}: axis {name}: {wrong}")


def _change(scene: str, content: Content, tables: dict[str, Content], changes: dict[str, Any]) -> None:
    """Apply changes: a change of a single axis goes into its table, any other replaces the keys of all tables."""
    of_all = {key: value for key, value in changes.items() if key.split(".")[0] != AXIS}
    for key, value in of_all.items():
        parts = key.split(".")
        if parts[0] in ABSENT and value is not None:
            raise SceneError(f"{scene}: {parts[0]} must be absent beside [[axis]]: {ABSENT[parts[0]]}")
        put(content, scene, key, value)
        for table in tables.values():
            _take_out(table, parts)
    for key in [key for key in changes if key not in of_all]:
        name, _, own = key.removeprefix(AXIS).removeprefix(".").partition(".")
        if name not in tables:
            raise SceneError(f"{scene}: {shown(key)} names no axis of this scene: its axes are {', '.join(tables)}")
        if not own:
            raise SceneError(f"{scene}: {shown(key)} must be followed by a key of a scene")
        _check_own(scene, name, tuple(own.split(".")))
        put(tables[name], scene, own, changes[key])


def _take_out(table: Content, parts: list[str]) -> None:
    """Take a key, by its parts, out of a table that may not have it."""
    *sections, last = parts
    for section in sections:
        table = table.get(section, {})
        if not isinstance(table, dict):
            return
    table.pop(last, None)


def _merged(content: Content, table: Content) -> Content:
    """Return the keys common to all axes, with a table's own keys in their places."""
    result = copy.deepcopy(content)
    for key, value in table.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merged(result[key], value) if both else copy.deepcopy(value)
    return result


def _with_the_axis(message: str, scene: str, name: str, content: Content, table: Content) -> str:
    """Return a message that names the axis, unless it is about a key common to all axes."""
    said = message.removeprefix(f"{scene}: ")
    parts = re.match(r"[\w.]*", said)[0].split(".")
    of_all = _within(content, parts) and not _within(table, parts)
    return message if of_all or shared(parts) else f"{scene}: axis {name}: {said}"


def _within(content: Content, parts: list[str]) -> bool:
    """Return whether a key, by its parts, is in a content."""
    for part in parts:
        if not isinstance(content, dict) or part not in content:
            return False
        content = content[part]
    return True
