"""Ports of components by their names, which here alone become signals.

A host's words and pulses, and the status that it reads, are listed by the designs of the model, which knows no signals.
A port has the name of what it carries, so names are what a design and two components that are joined have in common.
"""

from collections.abc import Iterable, Mapping

from amaranth.hdl import Value, ValueLike
from amaranth.lib.wiring import Component

from hardwall.model.register import Register
from hardwall.model.words import Word


def port(component: Component, name: str) -> Value:
    """Return a port of a component."""
    return getattr(component, name)


def ports(component: Component, names: Iterable[str] | None = None) -> dict[str, Value]:
    """Return the ports of a component by name: all of them, or those of some names, in their order."""
    return {name: port(component, name) for name in (component.signature.members if names is None else names)}


def names_of(words: Iterable[Register | Word]) -> list[str]:
    """Return the names of words or registers, which are those of their ports."""
    return [word.name for word in words]


def given(component: Component, values: Mapping[str, ValueLike]) -> list:
    """Return the assignments of values to the ports of their names."""
    return [port(component, name).eq(value) for name, value in values.items()]
