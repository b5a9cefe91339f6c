"""Folders named by a user: written completely or not at all, and never over another's files.

A folder of this module has the list of `whole_folder.py`, which identifies it. It may be replaced while it has no other
files, and the listed files are unchanged.
"""

import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ...model.runtime.termination import undone
from .whole_folder import LIST, is_as_listed, listed_in, seal


def foreign(folder: Path) -> str | None:
    """Return the name of what keeps a folder from being replaced; None if nothing does.

    It is a file in the place of the folder, an entry that is not in its list, or a changed file.

    Raises:
        OSError: if the folder cannot be read.
    """
    if not folder.exists():
        return None
    if not folder.is_dir():
        return folder.name
    listed = listed_in(folder)
    for path in sorted(folder.iterdir()):
        ours = bool(listed) if path.name == LIST else path.name in listed and is_as_listed(path, listed[path.name])
        if not ours:
            return path.name
    return None


def write_folder(folder: Path, make: Callable[[Path], None]) -> None:
    """Replace a folder by a new one with the content from `make`, if it may be replaced.

    It is made beside its place. A link to a folder stays one.

    Args:
        folder: the folder; `foreign` of it is None. The folders above it are made.
        make: a function that fills an empty folder with files.

    Raises:
        OSError: if the folder cannot be written.
        Exception: what `make` raises; the folder is then as it was.
    """
    place = Path(os.path.realpath(folder))
    place.parent.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(dir=place.parent, prefix=f".{place.name}-"))
    with undone(lambda: shutil.rmtree(work, ignore_errors=True)):
        made = work / "made"
        made.mkdir()
        make(made)
        seal(made)
        with suppress(FileNotFoundError):
            place.rename(work / "before")
        try:
            made.rename(place)
        except OSError:
            with suppress(FileNotFoundError):
                (work / "before").rename(place)
            raise
