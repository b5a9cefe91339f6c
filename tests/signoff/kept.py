"""What the tasks that sign the hardware off have found, kept in `findings/`: a run asks only what has changed.

A finding has the digest of all that it comes from, and is of no use any more where any of this has changed. The files
are a part of the project, as its evidence; `make mutate AGAIN=1`, and so on, finds all of it anew.
"""

import fcntl
import hashlib
import json
import os
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
    """The findings of a task, in a file that people may read, too: a line for each.

    Args:
        file: the file, which need not be there; None to keep nothing.
        again: whether to find anew what is there.
    """

    def __init__(self, file: Path | None = None, again: bool = False):
        self._file, self._found_before = file, not again

    def of(self, name: str, digest: str) -> Any:
        """Return what is kept under a name; None if it is nothing, or not of this digest."""
        kept = self._read().get(name) if self._found_before else None
        return kept["found"] if kept and kept["digest"] == digest else None

    def keep(self, name: str, digest: str, found: Any) -> None:
        """Keep a finding, of what JSON has, under the name of what was looked at."""
        if self._file is None:
            return
        self._file.parent.mkdir(parents=True, exist_ok=True)
        folder = os.open(self._file.parent, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            every = sorted({**self._read(), name: {"digest": digest, "found": found}}.items())
            lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(each)}" for key, each in every)
            # A run that is ended meanwhile leaves no half of it.
            unfinished = self._file.with_suffix(".new")
            unfinished.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
            unfinished.replace(self._file)
        finally:
            os.close(folder)

    def _read(self) -> dict[str, dict[str, Any]]:
        try:
            return json.loads(self._file.read_text(encoding="utf-8")) if self._file else {}
        except FileNotFoundError:
            return {}


def findings_of(task: str) -> Findings:
    """Return the findings of a task: the project's, or with other seeds and lengths those in the build folder."""
    others = any(os.environ.get(name, usual) != usual for name, usual in USUAL.items())
    return Findings((build_dir() / "findings" if others else OURS) / f"{task}.json", AGAIN)
