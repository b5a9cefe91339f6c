"""Workers for many independent runs: a Dask cluster of this machine's cores, or one that runs already."""

import logging
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

from distributed import Client, LocalCluster

from .parallel import Interrupted

TIMEOUT_S = 10


@contextmanager
def client(workers: int | None = None, scheduler: str | None = None) -> Iterator[Client | None]:
    """Give a client of a cluster; None where one process does it all.

    Args:
        workers: processes of a cluster that lasts as long; None for one a core.
        scheduler: address of a cluster in place of that, e.g. tcp://10.0.0.7:8786. Its workers need this project, the
            same version of it, and the scene's file where it is here.

    Raises:
        RuntimeError: if no cluster answers there.
        Interrupted: by the user; the workers are ended.
    """
    # This process only waits, so that here an interrupt may be raised: compiled code would not survive it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        if scheduler:
            try:
                connected = Client(scheduler, timeout=TIMEOUT_S)
            except (OSError, ValueError) as error:
                raise RuntimeError(f"no Dask scheduler answers at {scheduler}: {error or 'timed out'}") from None
            with connected:
                yield connected
            return
        workers = workers or os.cpu_count() or 1
        if workers == 1:
            # Here compiled code runs: an interrupt ends the process, and the store has what was done.
            signal.signal(signal.SIGINT, before)
            yield None
            return
        options = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
        with LocalCluster(n_workers=workers, **options) as local, Client(local) as connected:
            yield connected
    except KeyboardInterrupt:
        raise Interrupted("interrupted; --resume goes on from here") from None
    finally:
        signal.signal(signal.SIGINT, before)
