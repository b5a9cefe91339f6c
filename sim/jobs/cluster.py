"""Jobs on the workers of a Dask cluster that runs already, perhaps on many machines.

Whatever becomes of a cluster is a RuntimeError of one line: the logs of Dask are silenced.
"""

import asyncio
import logging
import os
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import CancelledError
from concurrent.futures import Future as Answer
from contextlib import contextmanager
from typing import Any

from distributed import Client, Future, as_completed
from distributed.comm.addressing import parse_address, parse_host_port
from distributed.core import rpc
from distributed.scheduler import KilledWorker
from distributed.security import Security

from ...model.checks import shown

TIMEOUT_S = 8.0
"""The time for a scheduler to answer, and the time for it to have a worker then."""
PATIENCE_S = 30.0
"""The time that a cluster may be without a worker in the middle of the work."""
POLL_S = 1.0
SCHEMES = ("tcp", "tls")
HOST_MAX = 253
"""The most characters of a host's name."""
LOST = "the connection to the Dask scheduler is lost"
SILENT = ("asyncio", "distributed", "tornado")
"""The loggers of Dask and of what it is made of."""


class AddressError(ValueError):
    """A text cannot be the address of a scheduler; the message says what is accepted."""


def check_address(text: str) -> None:
    """Raise AddressError if a text cannot be the address of a Dask scheduler."""
    try:
        scheme, place = parse_address(text)
        host, port = parse_host_port(place)
        # Python's own look-up would refuse such a host much later, as if no scheduler answered.
        named = host.isprintable() and " " not in host and len(host.encode("idna").rstrip(b".")) <= HOST_MAX
    except ValueError:
        scheme, host, port, named = "", "", 0, False
    if scheme not in SCHEMES or not host or not named or not 0 < port < 1 << 16:
        raise AddressError(f"must be an address such as tcp://10.0.0.7:8786, not {shown(text)}")


def result_of(future: Future) -> dict:
    """Return the result of a job.

    Raises:
        RuntimeError: if the cluster could not run the job; the message is one line.
        Exception: the exception that the job itself raised.
    """
    try:
        return future.result()
    except CancelledError:
        # Nobody else cancels a job: the reason that Dask gives depends on how far the job had come.
        raise RuntimeError(LOST) from None
    except KilledWorker:
        raise RuntimeError("the Dask cluster could not run a hit: its workers end while they run it") from None
    except ModuleNotFoundError as error:
        raise RuntimeError(f"the Dask cluster could not run a hit: a worker has no module {error.name}") from None


class Cluster:
    """A `job_pool.JobPool` of the workers of a Dask cluster, which need this project."""

    def __init__(self, client: Client):
        self._client, self._queue = client, as_completed()
        self._tags: dict[str, Hashable] = {}

    def give(self, tag: Hashable, function: Callable[..., Any], job: dict) -> None:
        """Have `function(**job)` called: see `job_pool.JobPool`."""
        # Every job is a call of its own, even if another one is equal.
        try:
            future = self._client.submit(function, **job, pure=False)
        except Exception:
            if self._client.status == "running":
                raise
            raise RuntimeError(LOST) from None
        self._tags[future.key] = tag
        self._queue.add(future)

    def take(self) -> tuple[Any, Any]:
        """Return the tag and the result of a job that is done: see `job_pool.JobPool`."""
        future = next(self._queue)
        return self._tags.pop(future.key), result_of(future)


@contextmanager
def connected(scheduler: str) -> Iterator[Cluster]:
    """Provide the workers of a cluster that runs already.

    Args:
        scheduler: the address of its scheduler, e.g. tcp://10.0.0.7:8786.

    Raises:
        AddressError: if the address cannot be one.
        RuntimeError: if no cluster answers at that address, or it has no workers.
    """
    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] in SILENT:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    check_address(scheduler)
    _check_scheduler(scheduler)
    try:
        client = Client(scheduler, timeout=TIMEOUT_S)
    except (OSError, ValueError) as error:
        raise RuntimeError(f"no Dask scheduler answers at {scheduler}: {_why(error)}") from None
    with client:
        try:
            client.wait_for_workers(1, TIMEOUT_S)
        except TimeoutError:
            raise RuntimeError(f"the Dask scheduler at {scheduler} has no workers") from None
        with _watched(client, scheduler):
            yield Cluster(client)


@contextmanager
def _watched(client: Client, scheduler: str) -> Iterator[None]:
    """Cancel all jobs when a cluster has had no worker for `PATIENCE_S`: Dask itself waits for ever.

    Raises:
        RuntimeError: if that happens.
    """
    over, deserted = threading.Event(), threading.Event()

    def watch() -> None:
        peopled = time.monotonic()
        while not over.wait(POLL_S):
            now = time.monotonic()
            if client.scheduler_info().get("workers"):
                peopled = now
            elif now - peopled > PATIENCE_S:
                deserted.set()
                client.cancel([Future(key, client) for key in list(client.futures)])
                return

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    except RuntimeError:
        if deserted.is_set():
            message = f"the Dask cluster at {scheduler} has had no worker for {PATIENCE_S:g} s"
            raise RuntimeError(message) from None
        raise
    finally:
        over.set()
        watcher.join(POLL_S)


def _check_scheduler(address: str) -> None:
    """Raise RuntimeError if no Dask scheduler answers at an address within `TIMEOUT_S`.

    A Dask client waits for ever on a peer that accepts the connection and sends nothing. The answer of a peer of
    another kind may break the client in any way. So the question is put by a thread that is left to itself when its
    time is over.
    """
    answer: Answer = Answer()

    def ask() -> None:
        try:
            answer.set_result(asyncio.run(_kind_of(address)))
        except BaseException as error:
            answer.set_exception(error)

    threading.Thread(target=ask, daemon=True).start()
    try:
        kind = answer.result(TIMEOUT_S)
    except Exception as error:
        raise RuntimeError(f"no Dask scheduler answers at {address}: {_why(error)}") from None
    if kind != "Scheduler":
        raise RuntimeError(f"no Dask scheduler answers at {address}: the server there is no scheduler")


def _why(error: BaseException) -> str:
    """Return why nobody answers: the system's own reason where there is one, for Dask wraps it into sentences."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno and cause.errno > 0:
            return os.strerror(cause.errno)
        cause = cause.__cause__
    if isinstance(error, OSError):
        return "timed out"
    return " ".join(str(error).split()) or type(error).__name__


async def _kind_of(address: str) -> str | None:
    """Return the kind that a Dask server says it is."""
    secrets = Security().get_connection_args("client")
    async with rpc(address, timeout=TIMEOUT_S, connection_args=secrets) as server:
        return (await server.identity()).get("type")
