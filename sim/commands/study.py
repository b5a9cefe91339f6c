"""One way to run a study: the options that studies share as one value, and one end for all of their results."""

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
    """The options that studies share; those that a command has not are as they are here.

    Attributes:
        study: the command's name, which its picture has too.
        workers, scheduler: processes for its jobs; or the Dask cluster that runs them.
        resume: whether results of an earlier run are known.
        set_: changes of the scene, as they were given.
        plot: the picture's file.
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
        # What cannot be drawn is said before anything long begins.
        if self.plot:
            output_file(self.plot, "--plot", _picture("style").SUFFIXES)

    def changes(self, **options: Any) -> dict[str, Any]:
        """Return the changes of a scene, those of a command's other options among them: see `changes_of`."""
        return changes_of(self.set_, **options)

    def results(self, title: str, function: Callable[..., Any], jobs: list[dict], store: Store) -> list[Any]:
        """Return the result of each job, with a bar of what is done."""
        with progress(title, len(jobs)) as advance:
            return parallel.run(function, jobs, store, self.workers, advance)

    def finish(self, result: Result) -> None:
        """Print a result, and draw it: whatever becomes of the picture, what was computed is out."""
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
    """Return a module of pictures: Matplotlib is loaded only where something is drawn."""
    return import_module(f"...pictures.{name}", __name__)


SHARED = {each.name: each for each in fields(StudyOptions) if each.name != "study"}


def study(*shared: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a command of a function whose first argument is a `StudyOptions`.

    Args:
        shared: names of the options that it has of these, beside `as_json`, which all have.
    """

    def command_of(function: Callable[..., None]) -> Callable[..., None]:
        name = function.__module__.rpartition(".")[2]
        taken = [each for key, each in SHARED.items() if key in shared or key == "as_json"]

        @functools.wraps(function)
        def command(**given: Any) -> None:
            options = StudyOptions(study=name, **{each.name: given.pop(each.name) for each in taken})
            function(options, **given)

        own = list(inspect.signature(function).parameters.values())[1:]
        kind = inspect.Parameter.KEYWORD_ONLY
        added = [inspect.Parameter(each.name, kind, default=each.default, annotation=each.type) for each in taken]
        command.__signature__ = inspect.Signature([each.replace(kind=kind) for each in own] + added)
        command.__annotations__ = {each.name: each.annotation for each in own + added}
        return command

    return command_of
