"""The maps of stable walls that several commands make, on a cluster chosen by the options."""

import time
from contextlib import AbstractContextManager

from distributed import Client

from ..jobs import cluster
from ..jobs.store import Store
from ..scene.case import Case
from ..walls import zwidth
from ..walls.grid import grid_of
from ..walls.zwidth import Effort, Map
from .errors import BadInput
from .study import StudyOptions
from .terminal import progress


def check_cluster(options: StudyOptions) -> None:
    """Raise BadInput if no cluster can be what the options `--workers` and `--scheduler` ask for."""
    if options.scheduler is None:
        return
    try:
        cluster.check_address(options.scheduler)
    except cluster.AddressError as error:
        raise BadInput(f"--scheduler {error}") from None
    if options.workers:
        raise BadInput(f"--scheduler {options.scheduler} has workers of its own: give it or --workers, not both")


def cluster_for(options: StudyOptions, jobs: int) -> AbstractContextManager[Client | None]:
    """Return `cluster.client` for the options `--workers` and `--scheduler`."""
    check_cluster(options)
    return cluster.client(jobs, options.workers, options.scheduler)


class Maps:
    """A `zwidth.Mapping` that makes maps as the options say, and records their effort."""

    def __init__(self, options: StudyOptions, backend: str):
        check_cluster(options)
        self._options, self._backend = options, backend
        self._hits, self._began = 0, time.perf_counter()

    def __call__(self, title: str, cases: list[Case]) -> list[Map]:
        for case in cases:
            grid_of(case.scene)  # raises SceneError before a cluster is started
        maps = self._made(f"{title}, {self._backend}", cases)
        self._hits += sum(a_map.hits for a_map in maps)
        return maps

    def _made(self, title: str, cases: list[Case]) -> list[Map]:
        known = Store("zwidth", self._options.resume)
        with cluster_for(self._options, len(cases)) as client, progress(title, len(cases)) as advance:
            return zwidth.run(cases, self._backend, known, client, advance)

    def effort(self) -> Effort:
        """Return the effort of the maps so far."""
        return Effort(self._backend, self._hits, time.perf_counter() - self._began)


class MapsOnOneCluster(Maps):
    """Maps on a cluster that runs already, without a progress bar of their own: for very many maps."""

    def __init__(self, options: StudyOptions, backend: str, known: Store, client: Client | None):
        super().__init__(options, backend)
        self._known, self._client = known, client

    def _made(self, title: str, cases: list[Case]) -> list[Map]:
        return zwidth.run(cases, self._backend, self._known, self._client)
