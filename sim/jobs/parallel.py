"""Independent jobs on several processes; every result is kept as soon as it arrives."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from typing import Any

from .store import Store


class Interrupted(RuntimeError):
    """The user interrupted the run; the results so far are kept."""


def _alone() -> None:
    """Make a worker the leader of its own process group, which the parent ends as a whole, and ignore interrupts."""
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end(worker: multiprocessing.Process) -> None:
    """End a worker and all processes that it has started."""
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
    """Return `function(**job)` for every job, in the order of the jobs; results in the store are not computed again.

    Args:
        function: a module-level function with JSON values in and out, because other processes call it.
        jobs: keyword arguments of the calls.
        store: the store of the results.
        workers: number of processes; None for one a core. With 1, everything runs in this process.
        progress: called with the number of jobs done.

    Raises:
        Exception: the exception of the first job that fails; the results of the others so far are kept.
        Interrupted: if the user interrupts; the workers are ended.
    """
    jobs = list(jobs)
    missing = [job for index, job in enumerate(jobs) if job not in store and job not in jobs[:index]]
    done = len(jobs) - len(missing)

    def keep(job: dict, result: Any) -> None:
        nonlocal done
        store.put(job, result)
        done += 1
        if progress:
            progress(done)

    workers = min(workers or os.cpu_count() or 1, len(missing))
    if workers <= 1:
        for job in missing:
            keep(job, function(**job))
    else:
        # The workers are spawned, because a fork would copy a process that has threads.
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context, initializer=_alone) as pool:
            futures = {pool.submit(function, **job): job for job in missing}
            # This process only waits, so an interrupt may be raised in it; compiled code would not survive one.
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
