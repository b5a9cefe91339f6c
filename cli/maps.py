"""The maker of maps of stable walls, as the options say: with threads of this machine, or on a Dask cluster."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial

from ..sim.jobs.job_pool import pool_of
from ..sim.jobs.store import Store
from ..sim.walls.mapping import Mapper
from .errors import BadInput
from .study import StudyOptions
from .terminal import progress


def mapper_of(options: StudyOptions, backend: str, starts: int) -> Mapper:
    """Return the maker of maps; raise BadInput if the options describe no possible cluster."""
    _check_cluster(options)
    pool_for = partial(pool_of, workers=options.workers, scheduler=options.scheduler)
    return Mapper(backend, starts, Store("zwidth", options.resume), pool_for, progress)


@contextmanager
def mapper_of_one_pool(options: StudyOptions, backend: str, starts: int, cases: int) -> Iterator[Mapper]:
    """Provide what makes very many maps, of so many cases at a time, without progress bars of their own; the pool stays
    the same.

    Raises:
        BadInput: if no cluster can be what the options ask for.
    """
    _check_cluster(options)
    with pool_of(cases * starts, options.workers, options.scheduler) as pool:
        known = Store(options.command, options.resume)
        yield Mapper(backend, starts, known, lambda _: nullcontext(pool), lambda *_: nullcontext())


def _check_cluster(options: StudyOptions) -> None:
    """Raise BadInput if the options `--workers` and `--scheduler` describe no possible cluster."""
    if options.scheduler is None:
        return
    from ..sim.jobs import cluster  # noqa: PLC0415  (Dask is loaded only if there is a cluster)

    try:
        cluster.check_address(options.scheduler)
    except cluster.AddressError as error:
        raise BadInput(f"--scheduler {error}") from None
    if options.workers:
        raise BadInput(f"--scheduler {options.scheduler} has workers of its own: give it or --workers, not both")
