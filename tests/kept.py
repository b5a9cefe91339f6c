"""What the tasks that sign the hardware off have found, kept: a run that was ended goes on where it was.

A finding has the digest of all that it comes from, and is of no use any more where any of this has changed.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

from hardwall.model.build_folder import build_dir


def digest_of(*parts: object) -> str:
    """Return a digest of parts whose `repr` says all of them."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _file(task: str, name: str) -> Path:
    return build_dir() / task / f"{name.replace('/', '-')}.json"


def kept_of(task: str, name: str, digest: str) -> Any:
    """Return what a task has kept under a name; None if it is nothing, or not of this digest."""
    try:
        kept = json.loads(_file(task, name).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    return kept["found"] if kept["digest"] == digest else None


def keep(task: str, name: str, digest: str, found: Any) -> None:
    """Keep what a task has found in a file, which people may read, too.

    Args:
        task: the name of the task.
        name: what was looked at.
        digest: of all that the finding comes from.
        found: the finding, of what JSON has.
    """
    file = _file(task, name)
    file.parent.mkdir(parents=True, exist_ok=True)
    # A run that is ended meanwhile leaves no half of it.
    unfinished = file.with_suffix(".new")
    unfinished.write_text(json.dumps({"digest": digest, "found": found}, indent=1) + "\n", encoding="utf-8")
    unfinished.replace(file)
