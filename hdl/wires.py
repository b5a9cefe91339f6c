"""Ports of components by their names, which here alone become signals.

The designs of the model list a host's words and pulses, and the status that it reads. The model knows no signals. A
port has the name of its signal. So a design and two joined components have the same names.
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
    """Return the ports of a component by name: all, or the named ones in this order."""
    return {name: port(component, name) for name in (component.signature.members if names is None else names)}


def names_of(words: Iterable[Register | Word]) -> list[str]:
    """Return the names of words or registers; their ports have the same names."""
    return [word.name for word in words]


def given(component: Component, values: Mapping[str, ValueLike]) -> list:
    """Return the assignments of values to the ports of their names."""
    return [port(component, name).eq(value) for name, value in values.items()]
