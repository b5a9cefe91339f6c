"""The common way to run a study: its shared options as one value, and the output of its result."""

import functools
import inspect
import json
from collections.abc import Callable
from dataclasses import dataclass, fields
from importlib import import_module
from typing import Any

from ..jobs import parallel
from ..jobs.result import Result
from ..jobs.store import Store
from .options import (
    JsonOption,
    PlotOption,
    ResumeOption,
    SchedulerOption,
    SetOption,
    WorkersOption,
    changes_of,
    output_file,
)
from .terminal import log, progress, show


@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """The options that studies share; an option that a command lacks has its default.

    Attributes:
        study: name of the command and of its picture module.
        workers, scheduler: number of processes for the jobs, or the Dask cluster that runs them.
        resume: whether results of an earlier run are used.
        set_: changes of the scene, as they were given.
        plot: file of the picture.
        as_json: whether the result is printed as JSON.
    """

    study: str
    workers: WorkersOption = None
    scheduler: SchedulerOption = None
    resume: ResumeOption = False
    set_: SetOption = None
    plot: PlotOption = None
    as_json: JsonOption = False

    def __post_init__(self):
        # A picture that cannot be written is reported before anything long begins.
        if self.plot:
            output_file(self.plot, "--plot", _picture("style").SUFFIXES)

    def changes(self, **options: Any) -> dict[str, Any]:
        """Return the changes of a scene, including those of a command's other options: see `changes_of`."""
        return changes_of(self.set_, **options)

    def results(self, title: str, function: Callable[..., Any], jobs: list[dict], store: Store) -> list[Any]:
        """Return the result of every job, and show a progress bar meanwhile."""
        with progress(title, len(jobs)) as advance:
            return parallel.run(function, jobs, store, self.workers, advance)

    def finish(self, result: Result) -> None:
        """Print a result, then draw it: the result is printed even if drawing fails."""
        if self.as_json:
            print(json.dumps(result.report()))
        else:
            for table in result.tables():
                show(table)
            for note in result.notes():
                log.print(note)
        if self.plot:
            for written in _picture("style").save_all(_picture(self.study).draw(result), self.plot):
                log.print(f"picture: {written}")


def _picture(name: str) -> Any:
    """Return a module of pictures; Matplotlib is loaded only if something is drawn."""
    return import_module(f"...pictures.{name}", __name__)


SHARED = {field.name: field for field in fields(StudyOptions) if field.name != "study"}


def study(*shared: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that makes a command of a function whose first argument is a `StudyOptions`.

    Args:
        shared: names of the shared options that the command has, besides `as_json`, which all commands have.
    """

    def command_of(function: Callable[..., None]) -> Callable[..., None]:
        name = function.__module__.rpartition(".")[2]
        known = [field for key, field in SHARED.items() if key in shared or key == "as_json"]

        @functools.wraps(function)
        def command(**given: Any) -> None:
            options = StudyOptions(study=name, **{field.name: given.pop(field.name) for field in known})
            function(options, **given)

        own = list(inspect.signature(function).parameters.values())[1:]
        kind = inspect.Parameter.KEYWORD_ONLY
        added = [inspect.Parameter(field.name, kind, default=field.default, annotation=field.type) for field in known]
        command.__signature__ = inspect.Signature([parameter.replace(kind=kind) for parameter in own] + added)
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in own + added}
        return command

    return command_of
