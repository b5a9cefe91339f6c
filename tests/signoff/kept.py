"""What the tasks that sign the hardware off have found, kept in `findings/`: a run asks only what has changed.

A finding has the digest of all that it comes from, and is of no use any more where any of this has changed. The files
are a part of the project, as its evidence; `make mutate AGAIN=1`, and so on, finds all of it anew.
"""

import fcntl
import hashlib
import json
import os
import re
from pathlib import Path
from typing import Any

from hardwall.model.runtime.build_folder import build_dir

OURS = Path(__file__).with_name("findings")
AGAIN = bool(os.environ.get("HARDWALL_AGAIN"))
USUAL = {"HARDWALL_SEED": "1", "HARDWALL_SAMPLES": None, "HARDWALL_MUTANTS": None}
"""The variables with which a task may look at something else, as they are for the project's findings."""


def digest_of(*parts: object) -> str:
    """Return a digest of parts whose `repr` says all of them."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


class Findings:
    """The findings of a task, in a folder of files that people may read, too: a file for each block.

    A name is that of a block, or that of a block and what was asked of it with a colon between.

    Args:
        folder: the folder, which need not be there; None to keep nothing.
        again: whether to find anew what is there.
    """

    def __init__(self, folder: Path | None = None, again: bool = False):
        self._folder, self._found_before = folder, not again

    def of(self, name: str, digest: str) -> Any:
        """Return what is kept under a name; None if it is nothing, or not of this digest."""
        if self._folder is None or not self._found_before:
            return None
        kept = read(self._file(name)).get(name)
        return kept["found"] if kept and kept["digest"] == digest else None

    def keep(self, name: str, digest: str, found: Any) -> None:
        """Keep a finding, of what JSON has, under the name of what was looked at."""
        if self._folder is None:
            return
        file = self._file(name)
        file.parent.mkdir(parents=True, exist_ok=True)
        folder = os.open(self._folder, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            every = {**read(file), name: {"digest": digest, "found": found}}
            # A run that is ended meanwhile leaves no half of it.
            unfinished = file.with_suffix(".new")
            unfinished.write_text(json.dumps(every, indent=1, sort_keys=True) + "\n", encoding="utf-8")
            unfinished.replace(file)
        finally:
            os.close(folder)

    def every(self) -> dict[str, dict[str, Any]]:
        """Return the digest and the finding of every name, in their order."""
        files = self._folder.rglob("*.json") if self._folder else ()
        return dict(sorted(entry for file in files for entry in read(file).items()))

    def _file(self, name: str) -> Path:
        words = re.findall(r"\w+", name.partition(": ")[0])
        return self._folder / f"{'-'.join(words)}.json"


def read(file: Path) -> dict[str, dict[str, Any]]:
    """Return what a file of findings has; nothing if it is not there."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}


def findings_of(task: str) -> Findings:
    """Return the findings of a task: the project's, or with other seeds and lengths those in the build folder."""
    others = any(os.environ.get(name, usual) != usual for name, usual in USUAL.items())
    return Findings((build_dir() / "findings" if others else OURS) / task, AGAIN)
