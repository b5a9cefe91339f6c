"""The maps of stable walls that several commands make, by this machine or by the cluster of the options."""

import time
from contextlib import AbstractContextManager
from importlib import import_module
from typing import Any, Self

from ..sim.jobs.job_pool import JobPool, Threads
from ..sim.jobs.store import Store
from ..sim.scene.case import Case
from ..sim.walls import zwidth
from ..sim.walls.grid import grid_of
from ..sim.walls.zwidth import Effort, Map
from .errors import BadInput
from .study import StudyOptions
from .terminal import progress


def _cluster() -> Any:
    """Return the module of clusters; Dask is loaded only if there is one."""
    return import_module("..sim.jobs.cluster", __package__)


def check_cluster(options: StudyOptions) -> None:
    """Raise BadInput if no cluster can be what the options `--workers` and `--scheduler` ask for."""
    if options.scheduler is None:
        return
    cluster = _cluster()
    try:
        cluster.check_address(options.scheduler)
    except cluster.AddressError as error:
        raise BadInput(f"--scheduler {error}") from None
    if options.workers:
        raise BadInput(f"--scheduler {options.scheduler} has workers of its own: give it or --workers, not both")


class Maps:
    """A `zwidth.Mapper` that makes maps as the options say, and records their effort."""

    def __init__(self, options: StudyOptions, backend: str, starts: int):
        check_cluster(options)
        self._options, self._backend, self._starts = options, backend, starts
        self._hits, self._began = 0, time.perf_counter()

    def __call__(self, title: str, cases: list[Case]) -> list[Map]:
        for case in cases:
            grid_of(case.scene)  # raises SceneError before a cluster is started
        maps = self._made(f"{title}, {self._backend}", cases)
        self._hits += sum(a_map.hits for a_map in maps)
        return maps

    def _pool(self, jobs: int) -> AbstractContextManager[JobPool]:
        """Return a context with who does so many jobs at a time."""
        options = self._options
        return _cluster().connected(options.scheduler) if options.scheduler else Threads(jobs, options.workers)

    def _made(self, title: str, cases: list[Case]) -> list[Map]:
        known = Store("zwidth", self._options.resume)
        with self._pool(len(cases) * self._starts) as pool, progress(title, len(cases)) as advance:
            return zwidth.run(cases, self._backend, known, pool, advance, self._starts)

    def effort(self) -> Effort:
        """Return the effort of the maps so far."""
        return Effort(self._backend, self._hits, time.perf_counter() - self._began)


class MapsOfOneCrew(Maps):
    """A context in which all maps, of so many cases at a time, are made by one pool: for very many maps.

    They have no progress bar of their own.
    """

    def __init__(self, options: StudyOptions, backend: str, starts: int, cases: int):
        super().__init__(options, backend, starts)
        self._known, self._context = Store(options.command, options.resume), self._pool(cases * starts)

    def __enter__(self) -> Self:
        self._joined = self._context.__enter__()
        return self

    def __exit__(self, *exception: Any) -> bool | None:
        return self._context.__exit__(*exception)

    def _made(self, title: str, cases: list[Case]) -> list[Map]:
        return zwidth.run(cases, self._backend, self._known, self._joined, starts=self._starts)
