"""The sources of compiled code: their digest is the key under which the code is kept.

Compiled code contains every kernel that it calls and all their constants, from any file. So the key of the project's
own kernels is the content of all its sources. If code from elsewhere takes part, for instance a force law in a user's
own module, the key includes that module and all its imports.

A source counts as it was when its kernels were defined. If a file of the project is edited while a process still
imports it, no key describes the running code. That process then neither stores nor uses kept code.
"""

import ast
import functools
import hashlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
import numpy as np
from numba import types

from .build_folder import shown_path, warn_once

TREE = Path(__file__).absolute().parents[2]
ROOMS = ("model", "sim")
TOOLS = (numba, llvmlite, np)
KNOWN = {*(tool.__name__ for tool in TOOLS), *sys.stdlib_module_names} - {"__main__"}
"""The packages whose versions are in the project's key."""
NOWHERE = ""
"""The name, in place of a module's, for a source that no file has."""
_chosen: dict[type, set[str]] = {}
"""The modules of the kernels that a class chooses: see `chooses`."""
_seen: dict[Path, bytes] = {}
"""The digest of every source outside the project, as it was when its kernels were defined, or else when first used."""
_changed: set[Path] = set()
"""The sources that were edited after this process had begun to use them."""


@functools.cache
def _read(path: Path, _modified_ns: int, _size: int) -> tuple[bytes, bytes]:
    content = path.read_bytes()
    return content, hashlib.sha256(content).digest()


def _source(path: Path) -> tuple[bytes, bytes]:
    """Return the content of a source and its digest; the file is read again only if it has been written."""
    status = path.stat()
    return _read(path, status.st_mtime_ns, status.st_size)


@functools.cache
def _tree() -> dict[Path, bytes]:
    """Return the digest of every source of the project that kernels may come from, as it is at the first call."""
    return {path: _source(path)[1] for room in ROOMS for path in sorted((TREE / room).rglob("*.py"))}


def _digest(sources: dict[Path, bytes], *others: str) -> str:
    digest = hashlib.sha256("\0".join(others).encode())
    for path, content in sources.items():
        name = path.relative_to(TREE) if path.is_relative_to(TREE) else path
        digest.update(os.fsencode(name) + b"\0" + content)
    return digest.hexdigest()[:16]


@functools.cache
def project_key() -> str:
    """Return a digest of the project's sources, of the versions of the compiler, and of the compiler's settings."""
    versions = [sys.version, *(f"{tool.__name__} {tool.__version__}" for tool in TOOLS)]
    settings = [f"{name}={value}" for name, value in sorted(os.environ.items()) if name.startswith("NUMBA_")]
    return _digest(_tree(), *versions, *settings)


@functools.cache
def imported(content: bytes, package: str) -> tuple[str, ...]:
    """Return the names of all modules that a source imports, of their packages, and of the names imported from them."""
    found = []
    for node in ast.walk(ast.parse(content)):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            relative = "." * node.level + (node.module or "")
            base = importlib.util.resolve_name(relative, package)
            found += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    parts = [name.split(".") for name in found]
    return tuple(".".join(each[: count + 1]) for each in parts for count in range(len(each)))


def _file(module: ModuleType | None) -> Path | None:
    """Return the file of a module; None for what has none, as the prompt of an interactive session."""
    file = getattr(module, "__file__", None)
    return Path(file).absolute() if file else None


def is_in_its_file(function: Callable) -> bool:
    """Return whether the source of a function is in the file of its module."""
    return Path(function.__code__.co_filename).absolute() == _file(sys.modules.get(function.__module__))


def _outside(name: str) -> dict[Path, bytes]:
    """Return the digest of a module's source and of the sources outside the project that it imports, directly or not.

    Of an installed package, other than the module's own, its version stands for its content.
    """
    top, found, waiting, seen = name.partition(".")[0], {}, [name], set()
    while waiting:
        name = waiting.pop()
        module, first = sys.modules.get(name), name.partition(".")[0]
        path = _file(module)
        if name in seen or module is None or path is None or path in _tree() or first in KNOWN:
            continue
        seen.add(name)
        if first != top and {"site-packages", "dist-packages"} & set(path.parts):
            found[Path(first)] = str(getattr(sys.modules[first], "__version__", "")).encode()
            continue
        found[path] = _source(path)[1]
        if path.suffix == ".py":
            waiting += imported(_source(path)[0], module.__package__ or "")
    return dict(sorted(found.items()))


def note(name: str) -> None:
    """Take note of a module that defines a kernel, as its source is now."""
    path = _file(sys.modules.get(name))
    # What cannot be read or parsed has no key: see `key_of`.
    with suppress(OSError, SyntaxError, ImportError):
        if path in _tree():
            if _source(path)[1] != _tree()[path]:
                _changed.add(path)
        elif path:
            _seen.update({**_outside(name), **_seen, path: _source(path)[1]})


def chooses(kind: type, kernel: Callable) -> None:
    """Register that a class chooses a kernel: the kernel is then part of the code compiled for that class."""
    function = getattr(kernel, "py_func", kernel)
    _chosen.setdefault(kind, set()).add(function.__module__ if is_in_its_file(function) else NOWHERE)


def _modules(kind: Any) -> Iterator[str]:
    """Yield the module of every class within a type of Numba, and of every kernel that these classes choose."""
    if isinstance(kind, types.Dispatcher):
        yield kind.dispatcher.py_func.__module__
    elif isinstance(kind, types.Type):
        yield from _modules(kind.key)
    elif isinstance(kind, tuple):
        for part in kind:
            yield from _modules(part)
    elif isinstance(kind, type):
        yield kind.__module__
        yield from _chosen.get(kind, ())


def key_of(module: str, signature: Iterable[Any]) -> str | None:
    """Return the key of the code of a kernel of a module for arguments of these types; None if nothing describes it."""
    names = {module, *_modules(tuple(signature))}
    outside = {name for name in names if name.partition(".")[0] not in KNOWN}
    try:
        sources = {path: content for name in sorted(outside) for path, content in _outside(name).items()}
    except (OSError, SyntaxError, ImportError):
        return None
    _changed.update(path for path, content in sources.items() if _seen.setdefault(path, content) != content)
    if _changed:
        warn_once(
            "changed", f"{shown_path(min(_changed))} changed while this process ran: its compiled code is not kept"
        )
    if _changed or not all(_file(sys.modules.get(name)) for name in outside):
        return None
    return _digest(sources, project_key()) if sources else project_key()
