"""Child processes that end with this process, for whatever reason it ends, and their own children with them.

The children are in a process group that is led by a guard, a shell that waits for the end of a pipe from this process.
The system closes the pipe when this process ends, even by SIGKILL, and the guard kills the group, with itself. Since a
group contains the children of its members, all that a build starts ends with it. A worker that builds has a guard and a
group of its own: when the worker is killed, so is that group.

This holds on every POSIX system, for processes that stay in their group. The one thing that cannot be survived is
SIGKILL of a guard together with this process.
"""

import multiprocessing
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from typing import Any

import psutil

from .ending import undone, undone_by_signal

KILL_S = 1.0
"""The most time that children get to end when they are killed."""
GUARD = ("/bin/sh", "-c", "trap '' HUP INT TERM; read line; kill -KILL 0")


class Group:
    """A context with a process group, all of which is killed at the end of the context or of this process.

    Attributes:
        number: the number of the group, while the context lasts.
    """

    def __enter__(self) -> "Group":
        nowhere = subprocess.DEVNULL
        # The guard is there before the first child, so that no moment is without it.
        self._guard = subprocess.Popen(GUARD, stdin=subprocess.PIPE, stdout=nowhere, stderr=nowhere, process_group=0)
        self.number = self._guard.pid
        self._undone = undone(self.kill)
        self._undone.__enter__()
        return self

    def __exit__(self, *exception: Any) -> None:
        self._undone.__exit__(*exception)
        self._guard.wait()
        self._guard.stdin.close()

    def kill(self) -> None:
        """Kill all processes of the group."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.number, signal.SIGKILL)


def join(number: int) -> None:
    """Put this worker process into a group of its parent; end it if the parent has ended."""
    with suppress(OSError):
        os.setpgid(0, number)
    parent = multiprocessing.parent_process()
    # The guard of a parent that ends from here on kills this process.
    if os.getpgid(0) != number or (parent and not parent.is_alive()):
        os._exit(1)


@contextmanager
def quiet_children() -> Iterator[None]:
    """Keep worker processes that start in the context silent when a signal ends this process.

    Until it has joined its group, a worker hears the SIGINT of a terminal, too; and if this process ends before it has
    told a worker what to do, the worker complains. So workers that this thread starts are deaf to SIGINT, and a signal
    that ends this process kills those that have started.
    """
    # At its start, the tracker of shared semaphores lets the thread hear again. It outlives this process.
    resource_tracker.ensure_running()
    older = set(psutil.Process().children())

    def kill() -> None:
        # Another thread may start one more meanwhile.
        deadline = time.monotonic() + KILL_S
        while (young := _young(older)) and time.monotonic() < deadline:
            for child in young:
                with suppress(psutil.Error):
                    child.kill()
            time.sleep(0.01)

    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with undone_by_signal(kill):
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _young(older: set[psutil.Process]) -> list[psutil.Process]:
    """Return the children of this process that live, without the older ones."""
    found = []
    for child in psutil.Process().children():
        with suppress(psutil.NoSuchProcess):
            if child not in older and child.status() != psutil.STATUS_ZOMBIE:
                found.append(child)
    return found


def run(command: Sequence[str], **options: Any) -> subprocess.CompletedProcess:
    """Run a command to its end, in a group of its own and without input; see `subprocess.run` for the options."""
    with Group() as group:
        return subprocess.run(command, stdin=subprocess.DEVNULL, check=False, process_group=group.number, **options)
