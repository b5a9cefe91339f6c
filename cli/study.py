"""The common way to run a study: who computes its jobs, and what an interrupted run has left."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..model.runtime import termination
from ..sim.jobs import parallel
from ..sim.jobs.store import Store
from .options import ResumeOption, SchedulerOption, SetOption, WorkersOption
from .report import ReportOptions, reports
from .scenes import changes_of
from .terminal import progress


@dataclass(frozen=True, kw_only=True)
class StudyOptions(ReportOptions):
    """The options that studies share; an option that a command lacks has its default.

    Attributes:
        workers, scheduler: number of threads for the jobs, or the Dask cluster that runs them.
        resume: whether results of an earlier run are used.
        set_: changes of the scene, as they were given.
    """

    workers: WorkersOption = None
    scheduler: SchedulerOption = None
    resume: ResumeOption = False
    set_: SetOption = None

    def changes(self, **options: Any) -> dict[str, Any]:
        """Return the changes of a scene, including the ones by a command's other options: see `changes_of`."""
        return changes_of(self.set_, **options)

    def results(self, title: str, function: Callable[..., Any], jobs: list[dict], store: Store) -> list[Any]:
        """Return the result of every job, and show a progress bar meanwhile."""
        with progress(title, len(jobs)) as advance:
            return parallel.run(function, jobs, store, self.workers, advance)


def study(
    *wanted: str, kind: type[StudyOptions] = StudyOptions
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that makes a command of a function; its first argument is a `StudyOptions`: see `reports`."""

    def command_of(function: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(function)
        def begun(options: StudyOptions, **given: Any) -> None:
            if "resume" in wanted:
                termination.go_on_by("--resume goes on from there")
            function(options, **given)

        return reports(*wanted, kind=kind)(begun)

    return command_of
