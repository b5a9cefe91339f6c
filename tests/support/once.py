"""What several workers need and one of them makes."""

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest


def once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return a folder of this run of the tests, filled by whichever worker asks for it first.

    Args:
        factory: pytest's temporary folders.
        name: the folder's name.
        make: fills an empty folder; if it fails, the next one who asks tries again.
    """
    base = factory.getbasetemp()
    # The workers' folders are side by side; a run of its own inside a worker has another name.
    common = base.parent if base.name == f"popen-{os.environ.get('PYTEST_XDIST_WORKER')}" else base
    made = common / f"once-{name}"
    with (common / f"once-{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.exists():
            new = factory.mktemp(name)
            make(new)
            new.rename(made)
    return made
