"""The common way to run a study: its shared options as one value, and the output of its result."""

import functools
import inspect
import json
import logging
import os
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ..jobs import ending, parallel
from ..jobs.result import Result
from ..jobs.store import Store
from ..pictures import SUFFIXES
from .errors import one_line
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
        workers, scheduler: number of threads for the jobs, or the Dask cluster that runs them.
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
            output_file(self.plot, "--plot", SUFFIXES)

    def changes(self, **options: Any) -> dict[str, Any]:
        """Return the changes of a scene, including those of a command's other options: see `changes_of`."""
        return changes_of(self.set_, **options)

    def results(self, title: str, function: Callable[..., Any], jobs: list[dict], store: Store) -> list[Any]:
        """Return the result of every job, and show a progress bar meanwhile."""
        with progress(title, len(jobs)) as advance:
            return parallel.run(function, jobs, store, self.workers, advance)

    def finish(self, result: Result, files: dict[str, tuple[Path, Callable[[Path], object]]] | None = None) -> None:
        """Print a result, write files of it, and draw it; whichever of these fails, the others are done.

        Args:
            result: the result.
            files: paths, and functions that write the files there, by what the files are.

        Raises:
            Exception: what failed; see `_do_all`.
        """
        steps = [partial(self._print, result), *(partial(_write, what, *file) for what, file in (files or {}).items())]
        if self.plot:
            # The picture is the last, because it takes longest.
            steps.append(partial(self._draw, result, self.plot))
        _do_all(steps)

    def _print(self, result: Result) -> None:
        if self.as_json:
            print(_json_of(result.report()))
        else:
            for table in result.tables():
                show(table)
            for note in result.notes():
                log.print(note)
        # Whatever happens to the files, the result is out.
        sys.stdout.flush()

    def _draw(self, result: Result, path: Path) -> None:
        """Draw a result, which may have several pictures, and so several files."""
        _make_folder_of(path)
        for each in _picture("style").save_all(_picture(self.study).draw(result), path):
            _say("picture", each)


def _json_of(report: dict[str, Any]) -> str:
    """Return a report as JSON.

    Raises:
        RuntimeError: if a number of it is infinite or NaN, which JSON does not have.
    """
    try:
        return json.dumps(report, allow_nan=False)
    except ValueError as error:
        raise RuntimeError(f"the result cannot be printed as JSON: {error}") from None


def _write(what: str, path: Path, write: Callable[[Path], object]) -> None:
    _make_folder_of(path)
    write(path)
    _say(what, path)


def _make_folder_of(path: Path) -> None:
    """Make the folder of a file, or of the one that a link leads to."""
    try:
        Path(os.path.realpath(path)).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"{path}: cannot be written ({error.strerror})") from None


def _say(what: str, path: Path) -> None:
    log.print(one_line(f"{what}: {path}"), soft_wrap=True)


def _do_all(steps: Iterable[Callable[[], None]]) -> None:
    """Do every step, whichever of them fails.

    Raises:
        Exception: the one that failed, or the first that must not fail.
        RuntimeError: if several failed; the message names them all.
    """
    failures = []
    for step in steps:
        try:
            step()
        except Exception as error:
            failures.append(error)
    faults = [failure for failure in failures if not isinstance(failure, OSError | RuntimeError)]
    if faults or len(failures) == 1:
        raise (faults or failures)[0]
    if failures:
        raise RuntimeError("; ".join(filter(None, map(str, failures))))


def _picture(name: str) -> Any:
    """Return a module of pictures; Matplotlib is loaded only if something is drawn."""
    # Pictures go to files, whatever draws the user's windows. What Matplotlib says of its own settings and folders is
    # not about the picture, and would stand between the lines of this program.
    os.environ["MPLBACKEND"] = "agg"
    logging.getLogger("matplotlib").setLevel(logging.CRITICAL)
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
            if "resume" in shared:
                ending.go_on_by("--resume goes on from there")
            options = StudyOptions(study=name, **{field.name: given.pop(field.name) for field in known})
            function(options, **given)

        own = list(inspect.signature(function).parameters.values())[1:]
        kind = inspect.Parameter.KEYWORD_ONLY
        added = [inspect.Parameter(field.name, kind, default=field.default, annotation=field.type) for field in known]
        command.__signature__ = inspect.Signature([parameter.replace(kind=kind) for parameter in own] + added)
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in own + added}
        return command

    return command_of
