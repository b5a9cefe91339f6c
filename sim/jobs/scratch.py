"""Temporary folders for builds: beside the place of the finished files, and never left there for good."""

import fcntl
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from ...model.runtime.termination import undone

PREFIX = "building-"


@contextmanager
def scratch(parent: Path) -> Iterator[Path]:
    """Provide a temporary folder in `parent`, which is made if missing; remove the folders left there by ended
    processes.

    The process holds a lock on the folder's file `lock`. The system releases it when the process ends, even by SIGKILL.
    So the next process knows the left-over folders.
    """
    parent.mkdir(parents=True, exist_ok=True)
    for folder in parent.glob(f"{PREFIX}*"):
        lock = _locked(folder)
        if lock:
            with lock:
                shutil.rmtree(folder, ignore_errors=True)
    folder, lock = _new(parent)
    with lock, undone(lambda: shutil.rmtree(folder, ignore_errors=True)):
        yield folder


def _new(parent: Path) -> tuple[Path, TextIO]:
    """Return a new folder and its lock."""
    while True:
        folder = Path(tempfile.mkdtemp(dir=parent, prefix=PREFIX))
        lock = _locked(folder)
        if lock:
            return folder, lock
        # Another process took the new folder for one that is left over, and removes it.


def _locked(folder: Path) -> TextIO | None:
    """Return the lock of a folder; None if another process has it, or the folder is gone."""
    try:
        lock = (folder / "lock").open("a", encoding="ascii")
    except (FileNotFoundError, NotADirectoryError):
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.close()
        return None
    if (folder / "lock").exists():
        return lock
    lock.close()
    return None
