"""Independent jobs side by side; every result is kept as soon as it arrives."""

from collections.abc import Callable, Iterable
from typing import Any

from .job_pool import Threads
from .store import Store

Run = Callable[[str, Callable[..., Any], list[dict]], list[Any]]
"""The runner of a study's jobs: it takes a title, the function, and each job's arguments, and returns the results."""


def run(
    function: Callable[..., Any],
    jobs: Iterable[dict],
    store: Store,
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Any]:
    """Return `function(**job)` for every job, in the order of the jobs; results in the store are not computed again.

    Args:
        function: a function with JSON values in and out.
        jobs: keyword arguments of the calls.
        store: the store of the results.
        workers: number of threads; None for one a core.
        progress: called with the number of jobs done.

    Raises:
        Exception: the exception of the first job that fails; the results of the others so far are kept.
    """
    jobs = list(jobs)
    missing = [job for index, job in enumerate(jobs) if job not in store and job not in jobs[:index]]
    with Threads(len(missing), workers) as pool:
        for number, job in enumerate(missing):
            pool.give(number, function, job)
        for done in range(len(jobs) - len(missing) + 1, len(jobs) + 1):
            number, result = pool.take()
            store.put(missing[number], result)
            if progress:
                progress(done)
    return [store.get(job) for job in jobs]
