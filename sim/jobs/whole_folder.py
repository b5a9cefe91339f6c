"""Folders that are made whole, and checked before they are used: built hardware, netlists, placements.

A list of the digests of all files, in the form of the tool sha256sum, is the last file to be written. If a folder's
files differ from its list, perhaps after a power cut, it counts as absent and is made again.
"""

import atexit
import fcntl
import functools
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ...model.runtime.build_folder import not_kept
from ...model.runtime.termination import undone
from .scratch import scratch

LIST = "SHA256SUMS"


def whole_folder(folder: Path, make: Callable[[Path], None]) -> Path:
    """Return a folder with the content that `make` gives it; make it first if it is missing or not whole.

    It is made elsewhere and moved into place, so that an interrupted process, or two at once, leave nothing broken
    behind. Where it cannot be written, this process has it in a folder of its own.

    Args:
        folder: the folder. Its name tells its content from every other.
        make: a function that fills an empty folder.

    Raises:
        Exception: what `make` raises; nothing is left of the folder.
    """
    own = _own_folder() / folder.parent.name / folder.name
    for known in (folder, own):
        if _is_whole(known):
            return known
    with ExitStack() as stack:
        try:
            work = stack.enter_context(scratch(folder.parent))
        except OSError as error:
            not_kept(folder.parent, error)
            folder = own
            work = stack.enter_context(scratch(folder.parent))
        made = work / folder.name
        made.mkdir()
        make(made)
        seal(made)
        with _locked(folder.parent):
            # Another process may have been first, and may use what it made.
            if not _is_whole(folder):
                if folder.exists():
                    folder.rename(work / "not whole")
                made.rename(folder)
    return folder


def keep_log(path: Path, text: str) -> Path:
    """Write the log of a failure to `path`, or where that cannot be, among temporary files; return where it is."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError:
        path = Path(tempfile.mkdtemp(prefix="hardwall-")) / path.name
        path.write_text(text, encoding="utf-8")
    return path


@functools.cache
def _own_folder() -> Path:
    """Return a folder that lasts as long as this process; it is not made before something is written there."""
    path = Path(tempfile.gettempdir()) / f"hardwall-{os.getpid()}-{os.urandom(8).hex()}"
    removed = undone(functools.partial(shutil.rmtree, path, ignore_errors=True))
    removed.__enter__()
    atexit.register(removed.__exit__, None, None, None)
    return path


def seal(folder: Path) -> None:
    """Write the list of a folder's files."""
    listed = [f"{_digest(path)}  {path.relative_to(folder)}\n" for path in sorted(folder.rglob("*")) if path.is_file()]
    (folder / LIST).write_text("".join(listed), encoding="utf-8")


def _is_whole(folder: Path) -> bool:
    """Return whether a folder has a list, and the files of the list are what it says."""
    listed = listed_in(folder)
    return bool(listed) and all(is_as_listed(folder / name, digest) for name, digest in listed.items())


def listed_in(folder: Path) -> dict[str, str]:
    """Return the digests of a folder's list by the names of its files; nothing where there is no list."""
    try:
        lines = (folder / LIST).read_text(encoding="utf-8").splitlines()
        return {name: digest for digest, name in (line.split("  ", 1) for line in lines)}
    except (OSError, ValueError):
        return {}


def is_as_listed(path: Path, digest: str) -> bool:
    """Return whether a file can be read and has a digest."""
    try:
        return _digest(path) == digest
    except (OSError, ValueError):
        return False


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which ends with the process at the latest.

    Some file systems of networks have no locks: two processes that repair the same there may disturb each other.
    """
    place = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(place, fcntl.LOCK_EX)
        yield
    finally:
        os.close(place)
