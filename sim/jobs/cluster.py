"""Workers for many independent runs: a Dask cluster of this machine's cores, or one that runs already."""

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
    """Leave interrupts to the process that waits: Dask calls this in each worker of a cluster of ours."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def result_of(future: Future) -> dict:
    """Return the result of a job.

    Raises:
        RuntimeError: in a line, if the cluster could not run it.
        Exception: what the job itself raised.
    """
    try:
        return future.result()
    except (KilledWorker, FutureCancelledError, ModuleNotFoundError) as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise RuntimeError(f"the Dask cluster could not run a hit: {said}") from None


@contextmanager
def client(jobs: int, workers: int | None = None, scheduler: str | None = None) -> Iterator[Client | None]:
    """Give a client of a cluster; None where one process does it all.

    Args:
        jobs: how many there are at a time: more workers have nothing to do.
        workers: processes of a cluster that lasts as long; None for one a core.
        scheduler: address of a cluster in place of that, e.g. tcp://10.0.0.7:8786. Its workers need this project.

    Raises:
        RuntimeError: if no cluster answers there, or it has no workers.
        Interrupted: by the user; the workers are ended.
    """
    # This process only waits, so that here an interrupt may be raised: compiled code would not survive it.
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
            # Here compiled code runs: an interrupt ends the process, and the store has what was done.
            signal.signal(signal.SIGINT, before)
            yield None
            return
        options = {"threads_per_worker": 1, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
        # No limit of memory: a hit needs little, and a share of it on many cores less than Python itself.
        options |= {"preload": [__name__], "memory_limit": 0}
        with LocalCluster(n_workers=workers, **options) as local, Client(local) as connected:
            yield connected
    except KeyboardInterrupt:
        raise Interrupted("interrupted; --resume goes on from here") from None
    finally:
        signal.signal(signal.SIGINT, before)
