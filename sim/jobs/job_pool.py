"""Jobs side by side: results come as they are ready, and whoever takes them may give more jobs."""

import os
import threading
import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from queue import SimpleQueue
from typing import Any, Protocol, Self

from . import children

POLL_S = 0.05
"""The time between two looks whether the jobs that are to end have ended."""


class JobPool(Protocol):
    """Who does jobs: the threads of this process, or the workers of a cluster."""

    def give(self, tag: Hashable, function: Callable[..., Any], job: dict) -> None:
        """Have `function(**job)` called; its result comes with the tag."""

    def take(self) -> tuple[Any, Any]:
        """Return the tag and the result of a job that is done; wait for one if none is.

        Raises:
            Exception: the exception that the job raised.
        """


class Threads:
    """A context in which threads of this process do jobs.

    Compiled kernels and the tools that a job waits for run side by side; the Python between them does not. If the
    context is left by an exception, no other job begins. The tools of the jobs under way are killed, also tools that
    they start from then on, and their kernels are waited for.

    Args:
        jobs: the most jobs at a time.
        workers: number of threads; None for one a core.
    """

    def __init__(self, jobs: int, workers: int | None = None):
        self._identities: set[int] = set()
        self._done: SimpleQueue[tuple[Any, Future]] = SimpleQueue()
        self._pool = ThreadPoolExecutor(max(1, min(workers or os.cpu_count() or 1, jobs)), initializer=self._join)

    def _join(self) -> None:
        self._identities.add(threading.get_ident())

    def give(self, tag: Hashable, function: Callable[..., Any], job: dict) -> None:
        """Have `function(**job)` called: see `JobPool`."""
        self._pool.submit(function, **job).add_done_callback(lambda future: self._done.put((tag, future)))

    def take(self) -> tuple[Any, Any]:
        """Return the tag and the result of a job that is done: see `JobPool`."""
        tag, future = self._done.get()
        return tag, future.result()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, *exception: Any) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        while kind and self._identities & {thread.ident for thread in threading.enumerate()}:
            children.kill_those_of(self._identities)
            time.sleep(POLL_S)
        self._pool.shutdown()


def pool_of(jobs: int, workers: int | None = None, scheduler: str | None = None) -> AbstractContextManager[JobPool]:
    """Return a context with who does so many jobs at a time: threads of this process, or the workers of a cluster.

    Args:
        jobs: the most jobs at a time.
        workers: number of threads; None for one a core.
        scheduler: the address of a cluster's scheduler: see `cluster.connected`; None for threads.
    """
    if scheduler is None:
        return Threads(jobs, workers)
    from .cluster import connected  # noqa: PLC0415  (Dask is loaded only if there is a cluster)

    return connected(scheduler)
