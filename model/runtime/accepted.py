"""The accepted values of an annotated type, in words: for a key of a scene, and for an option of the command line."""

import types
import typing
from typing import Any


def accepted(kind: Any, marks: tuple = ()) -> str:
    """Return the accepted values of a type in words, with its annotated limits."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return accepted(inner[0], kind.__metadata__ + tuple(marks))
    if origin in (typing.Union, types.UnionType):
        return ", or ".join(accepted(one, marks) for one in inner if one is not types.NoneType)
    if origin is typing.Literal:
        return f"one of {', '.join(map(str, inner))}"
    if origin is list:
        least, most = (_limits(marks)[name] for name in ("min_length", "max_length"))
        return f"a list of {least if least == most else f'{least} to {most}'}, each {accepted(inner[0])}"
    if kind in (int, float):
        noun, limits = "a whole number" if kind is int else "a number", _limits(marks)
        return f"{noun} of {plain(limits['ge'])} to {plain(limits['le'])}" if limits else noun
    return {bool: "true or false", str: "a name"}.get(kind, "a section")


def plain(number: float) -> str:
    """Return a limit in few digits, if these are all."""
    return f"{number:g}" if float(f"{number:g}") == number else str(number)


def _limits(marks: tuple) -> dict[str, Any]:
    """Return the limits among what a type is annotated with, the last and narrowest of each kind."""
    several = [mark for data in marks for mark in (getattr(data, "metadata", None) or [data])]
    names = ("ge", "le", "min_length", "max_length")
    return {name: getattr(mark, name) for mark in several for name in names if hasattr(mark, name)}
