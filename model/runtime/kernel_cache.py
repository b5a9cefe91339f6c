"""Compiled kernels on disk, found by what they compute and checked before they run.

Numba's own cache looks only at the file of the function, not at its callees' files, and runs any bytes it finds. Here a
folder is named after the digest of all sources (see `provenance`). A file of machine code is named after its own
digest, and the index of these files begins with its own digest. What is absent, damaged or of another form is compiled
afresh. A folder that cannot be written is done without, and one line says so.
"""

import hashlib
import pickle
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from . import provenance
from .build_folder import build_dir, not_kept
from .whole_file import whole_file

DIGEST_BYTES = hashlib.sha256().digest_size


class KernelCache(_Cache):  # type: ignore[misc]
    """The compiled variants of one function, each for arguments of certain types.

    Args:
        function: the function.
        options: a name for the options with which it is compiled.
    """

    def __init__(self, function: Callable, options: str):
        provenance.note(function.__module__)
        self._function, self._options = function, options
        # A function made from a text has no source for a digest to follow.
        self._enabled = provenance.is_in_its_file(function)
        name = re.sub(r"[^\w.-]", "", f"{function.__module__}.{function.__qualname__}")
        self._name = f"{name}-{function.__code__.co_firstlineno}"

    @property
    def cache_path(self) -> str:
        """The folder of the variants, as Numba shows it."""
        return str(build_dir() / "numba")

    def enable(self) -> None:
        """Use the cache from now on."""
        self._enabled = True

    def disable(self) -> None:
        """Neither keep nor find anything from now on."""
        self._enabled = False

    def flush(self) -> None:
        """Do nothing: a variant that is compiled again replaces its older form."""

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """Return the variant of a signature; None if there is none that is whole."""
        rtsys.initialize(target_context)
        shelf = self._shelf(sig)
        if shelf is None:
            return None
        payload = shelf.get(self._key(sig, target_context.codegen()))
        return None if payload is None else CompileResult._rebuild(target_context, *payload)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the variant of a signature, unless its code holds addresses of this process."""
        shelf = self._shelf(sig)
        if shelf is None or data.library.has_dynamic_globals or not all(part.can_cache for part in data.lifted):
            return
        try:
            shelf.put(self._key(sig, data.codegen), data._reduce())
        except OSError as error:
            not_kept(shelf.folder, error)

    def _shelf(self, sig: Any) -> "_Shelf | None":
        """Return the place for the variant of a signature; None if its code is not to be kept."""
        key = provenance.key_of(self._function.__module__, sig) if self._enabled else None
        return None if key is None else _Shelf(build_dir() / "numba" / key / self._options, self._name)

    def _key(self, sig: Any, codegen: Any) -> tuple:
        """Return what tells this variant from the others of the function: types, machine, and captured values."""
        captured = tuple(cell.cell_contents for cell in self._function.__closure__ or ())
        return sig, codegen.magic_tuple(), hashlib.sha256(dumps(captured)).hexdigest()


class _Shelf:
    """Pickled objects by their keys: an index, and a file for each object, which has the name of its digest.

    Two processes that write at once may lose an entry of the index, but never get a wrong one.
    """

    def __init__(self, folder: Path, name: str):
        self.folder, self._index = folder, folder / f"{name}.nbi"

    def get(self, key: tuple) -> Any | None:
        """Return the object of a key; None if there is none that is whole."""
        with suppress(OSError):
            path = self._entries().get(key)
            data = (self.folder / path).read_bytes() if path else b""
            if path == _name(data):
                return _loaded(data)
        return None

    def put(self, key: tuple, thing: Any) -> None:
        """Keep the object of a key.

        Raises:
            OSError: if it cannot be written.
        """
        data = dumps(thing)
        self.folder.mkdir(parents=True, exist_ok=True)
        with whole_file(self.folder / _name(data)) as part:
            part.write_bytes(data)
        with whole_file(self._index) as part:
            index = dumps(self._entries() | {key: _name(data)})
            part.write_bytes(hashlib.sha256(index).digest() + index)

    def _entries(self) -> dict[tuple, str]:
        """Return the names of the files by key: of none, if the index is absent or not whole."""
        try:
            data = self._index.read_bytes()
        except OSError:
            return {}
        index = data[DIGEST_BYTES:]
        return (_loaded(index) if data[:DIGEST_BYTES] == hashlib.sha256(index).digest() else None) or {}


def _name(data: bytes) -> str:
    return f"{hashlib.sha256(data).hexdigest()[:32]}.nbc"


def _loaded(data: bytes) -> Any | None:
    """Return the unpickled object; None if its classes have changed."""
    try:
        return pickle.loads(data)
    except (AttributeError, ImportError, TypeError, ValueError, pickle.UnpicklingError):
        return None
