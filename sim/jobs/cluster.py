"""Workers for many independent runs: a Dask cluster of this machine's cores, or a cluster that already runs."""

import logging
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

from distributed import Client, Future, LocalCluster, Worker
from distributed.client import FutureCancelledError
from distributed.scheduler import KilledWorker

from .parallel import Interrupted

TIMEOUT_S = 10


def dask_setup(worker: Worker) -> None:
    """Leave interrupts to the waiting process; Dask calls this function in every worker of a local cluster."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def result_of(future: Future) -> dict:
    """Return the result of a job.

    Raises:
        RuntimeError: if the cluster could not run the job; the message is one line.
        Exception: the exception that the job itself raised.
    """
    try:
        return future.result()
    except (KilledWorker, FutureCancelledError, ModuleNotFoundError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RuntimeError(f"the Dask cluster could not run a hit: {reason}") from None


@contextmanager
def client(jobs: int, workers: int | None = None, scheduler: str | None = None) -> Iterator[Client | None]:
    """Provide a client of a cluster, or None if this process does all the work.

    Args:
        jobs: number of jobs at a time; more workers than jobs would have nothing to do.
        workers: processes of a cluster that lasts as long as the context; None for one a core.
        scheduler: address of a cluster to use instead, e.g. tcp://10.0.0.7:8786. Its workers need this project.

    Raises:
        RuntimeError: if no cluster answers at that address, or it has no workers.
        Interrupted: if the user interrupts; the workers are ended.
    """
    # This process only waits, so an interrupt may be raised in it; compiled code would not survive one.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        if scheduler is not None:
            try:
                connected = Client(scheduler, timeout=TIMEOUT_S)
            except (OSError, ValueError) as error:
                raise RuntimeError(f"no Dask scheduler answers at {scheduler}: {error or 'timed out'}") from None
            with connected:
                try:
                    connected.wait_for_workers(1, TIMEOUT_S)
                except TimeoutError:
                    raise RuntimeError(f"the Dask scheduler at {scheduler} has no workers") from None
                yield connected
            return
        workers = min(workers or os.cpu_count() or 1, jobs)
        if workers == 1:
            # Compiled code runs in this process: an interrupt ends it, and the store has the results so far.
            signal.signal(signal.SIGINT, before)
            yield None
            return
        options = {"threads_per_worker": 1, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
        # No memory limit: a hit needs little, but on many cores a worker's share is less than Python itself needs.
        options |= {"preload": [__name__], "memory_limit": 0}
        with LocalCluster(n_workers=workers, **options) as local, Client(local) as connected:
            yield connected
    except KeyboardInterrupt:
        raise Interrupted("interrupted; --resume goes on from here") from None
    finally:
        signal.signal(signal.SIGINT, before)
