"""Independent jobs on several processes; every result is kept as soon as it arrives."""

import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from . import children
from .store import Store


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
        Exception: the exception of the first job that fails; the results of the others so far are kept, and the
            workers are ended.
        RuntimeError: if a worker is killed.
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
        _on_processes(function, missing, workers, keep)
    return [store.get(job) for job in jobs]


def _on_processes(
    function: Callable[..., Any], jobs: list[dict], workers: int, keep: Callable[[dict, Any], None]
) -> None:
    """Call `keep(job, function(**job))` for every job, as the results of the workers arrive."""
    # The workers are spawned, because a fork would copy a process that has threads.
    settings = {"mp_context": multiprocessing.get_context("spawn"), "initializer": children.join}
    with children.Group() as group, ProcessPoolExecutor(workers, initargs=(group.number,), **settings) as pool:
        try:
            with children.quiet_children():
                futures: dict[Future, dict] = {pool.submit(function, **job): job for job in jobs}
            for future in as_completed(futures):
                keep(futures[future], future.result())
        except BaseException as error:
            # The pool waits for its workers, who may be in the middle of long jobs.
            pool.shutdown(wait=False, cancel_futures=True)
            group.kill()
            if isinstance(error, BrokenProcessPool):
                raise RuntimeError("a worker process was killed, perhaps for lack of memory") from None
            raise
