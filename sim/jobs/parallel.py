"""Independent jobs on several processes, their results kept as they come."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from typing import Any

from .store import Store


class Interrupted(RuntimeError):
    """The user wants no more; what was done is kept."""


def _alone() -> None:
    """Make a worker the head of its own group, which the parent ends as a whole; leave interrupts to the parent."""
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end(worker: multiprocessing.Process) -> None:
    """End a worker, and what it has started."""
    with suppress(ProcessLookupError):
        os.killpg(worker.pid, signal.SIGKILL)
    worker.kill()


def run(
    function: Callable[..., Any],
    jobs: Iterable[dict],
    store: Store,
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Any]:
    """Return `function(**job)` for each job, in the order of the jobs; what the store has is not computed again.

    Args:
        function: of a module, with JSON values in and out: it is called in other processes.
        jobs: its keyword arguments.
        store: where results are kept.
        workers: processes; None for one a core. With 1, everything runs in this process.
        progress: called with the number of jobs done.

    Raises:
        Exception: of the first job that fails; what others gave until then is kept.
        Interrupted: by the user; the workers are ended.
    """
    jobs = list(jobs)
    left = [job for index, job in enumerate(jobs) if job not in store and job not in jobs[:index]]
    done = len(jobs) - len(left)

    def keep(job: dict, result: Any) -> None:
        nonlocal done
        store.put(job, result)
        done += 1
        if progress:
            progress(done)

    workers = min(workers or os.cpu_count() or 1, len(left))
    if workers <= 1:
        for job in left:
            keep(job, function(**job))
    else:
        # Spawned: a fork would copy a process that has threads.
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context, initializer=_alone) as pool:
            futures = {pool.submit(function, **job): job for job in left}
            # This process only waits, so that here an interrupt may be raised: compiled code would not survive it.
            before = signal.signal(signal.SIGINT, signal.default_int_handler)
            try:
                for future in as_completed(futures):
                    keep(futures[future], future.result())
            except BaseException as error:
                alive = multiprocessing.active_children()
                pool.shutdown(wait=False, cancel_futures=True)
                for worker in alive:
                    _end(worker)
                if isinstance(error, KeyboardInterrupt):
                    raise Interrupted("interrupted") from None
                raise
            finally:
                signal.signal(signal.SIGINT, before)
    return [store.get(job) for job in jobs]
