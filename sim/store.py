"""Results that took time, kept on disk as they come: an interrupted run loses none, and its repetition none again.

A store is a file of one JSON line a result, found by its key. It belongs to the exact sources of this project and the
versions of its arithmetic: any change begins a new one.
"""

import hashlib
import json
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ..model.compiled import build_dir

ROOMS = ("model", "hdl", "sim")
SUFFIXES = (".py", ".cpp", ".toml")


@cache
def _sources() -> str:
    """Return a digest of every source and of the versions of what computes."""
    digest = hashlib.sha256()
    root = Path(__file__).absolute().parent.parent
    for path in sorted(path for room in ROOMS for path in (root / room).rglob("*") if path.suffix in SUFFIXES):
        digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes())
    for library in ("numpy", "numba", "scipy"):
        digest.update(version(library).encode() + b"\0")
    return digest.hexdigest()[:16]


class Store:
    """Results of one kind.

    Args:
        kind: names the file.
    """

    def __init__(self, kind: str):
        self.path = build_dir() / "results" / f"{kind}-{_sources()}.jsonl"
        self._known: dict[str, Any] = {}
        text = self.path.read_text(encoding="utf-8") if self.path.exists() else ""
        # A run that was killed while it wrote leaves a piece of a line: it is no result, and the next begins after it.
        self._torn = text[-1:] not in ("", "\n")
        for line in text.splitlines():
            try:
                key, result = json.loads(line)
            except ValueError:
                continue
            self._known[key] = result

    @staticmethod
    def _key(job: dict) -> str:
        return json.dumps(job, sort_keys=True)

    def get(self, job: dict) -> Any | None:
        """Return the result of a job, or None if there is none."""
        return self._known.get(self._key(job))

    def put(self, job: dict, result: Any) -> None:
        """Keep the result of a job."""
        self._known[self._key(job)] = result
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write("\n" * self._torn + json.dumps([self._key(job), result]) + "\n")
        self._torn = False
