"""The command line as a process of its own, with all that it starts, for signals to end."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hardwall.model.runtime.termination import CODES

HARDWALL = Path(sys.executable).with_name("hardwall")
PATIENCE_S = 300.0
"""The limit of every wait: only a test that fails takes so long."""


@contextmanager
def started(*command: object, **environ: str) -> Iterator[subprocess.Popen]:
    """Start a command in a session of its own, all of which is killed at the end of the context."""
    tests = Path(__file__).absolute().parents[1]
    # What is printed is buffered, as it is for users.
    settings = os.environ | {"PYTHONPATH": str(tests), "PYTHONUNBUFFERED": ""} | environ
    out, words = subprocess.PIPE, list(map(str, command))
    with subprocess.Popen(words, env=settings, stdout=out, stderr=out, text=True, start_new_session=True) as process:
        try:
            yield process
        finally:
            for member in session(process):
                # One member's end may be that of others.
                with suppress(ProcessLookupError):
                    os.kill(member, signal.SIGKILL)


def ended(process: subprocess.Popen) -> tuple[int, str, str]:
    """Wait for the end of a process; return its exit code, stdout and stderr."""
    out, err = process.communicate(timeout=PATIENCE_S)
    return process.returncode, out, err


def ended_by(number: str, process: subprocess.Popen) -> tuple[str, str, str]:
    """Wait until a signal, by its name, has ended a process; check its exit code and the last line on its stderr.

    Returns:
        What was left of stdout, the lines of stderr before the last, and what the last says is kept; the latter two are
        empty for a signal that is not handled.
    """
    code, out, err = ended(process)
    way = signal.Signals[number]
    if way not in CODES:
        assert code == -way, err
        return out, "", ""
    expected, word = CODES[way]
    *before, last = err.splitlines(keepends=True)
    assert code == expected, err
    assert last.startswith(f"hardwall: error: {word}"), err
    return out, "".join(before), last.removeprefix(f"hardwall: error: {word}").removesuffix("\n")


def session(process: subprocess.Popen) -> list[int]:
    """Return the processes that live in the session of a process, itself included."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state = (folder / "stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()[0]
            if os.getsid(int(folder.name)) == process.pid and state not in "ZX":
                found.append(int(folder.name))
        except (OSError, IndexError):
            continue  # it has ended meanwhile
    return found


def stored(build: Path) -> list[str]:
    """Return the results that processes have stored in a folder for generated files, as lines of JSON.

    A result is counted after it was stored, so of two that are here one is counted for sure.
    """
    return [line for file in build.glob("results/*.jsonl") for line in file.read_text().split("\n") if line]


def wait_until(happens: Callable[[], object]) -> None:
    """Wait until a function returns something true."""
    deadline = time.monotonic() + PATIENCE_S
    while not happens():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)


def line(process: subprocess.Popen) -> str:
    """Return the next line that a process writes on stdout; fail if it writes no more."""
    text = process.stdout.readline()
    assert text, ended(process)
    return text.rstrip("\n")
