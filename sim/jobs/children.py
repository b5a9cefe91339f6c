"""Child processes that end with this process, for whatever reason it ends, and their own children with them.

The children are in a process group led by a guard: a shell that waits for the end of a pipe from this process. The
system closes the pipe when this process ends, even by SIGKILL, and the guard kills the group, with itself. Since a
group contains the children of its members, all that a build starts ends with it.

This holds on every POSIX system, for processes that stay in their group. The only exception is a SIGKILL of a guard
together with this process.
"""

import os
import signal
import subprocess
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from ...model.runtime.termination import undone

GUARD = ("/bin/sh", "-c", "trap '' HUP INT TERM; read line; kill -KILL 0")

_living: dict["Group", int] = {}
"""The existing groups, each with the identity of the thread that began it."""


class Group:
    """A context with a process group: the end of the context, or of this process, kills the whole group.

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
        _living[self] = threading.get_ident()
        return self

    def __exit__(self, *exception: Any) -> None:
        _living.pop(self)
        self._undone.__exit__(*exception)
        self._guard.wait()
        self._guard.stdin.close()

    def kill(self) -> None:
        """Kill all processes of the group."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.number, signal.SIGKILL)


def kill_those_of(threads: set[int]) -> None:
    """Kill the groups that threads, by their identity, have at this moment."""
    for group, thread in list(_living.items()):
        if thread in threads:
            group.kill()


def run(command: Sequence[str], **options: Any) -> subprocess.CompletedProcess:
    """Run a command to its end, in a group of its own and without input; see `subprocess.run` for the options."""
    with Group() as group:
        return subprocess.run(command, stdin=subprocess.DEVNULL, check=False, process_group=group.number, **options)
