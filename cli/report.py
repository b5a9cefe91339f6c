"""The common way to run a command with a result: its shared options as one value, and the output of the result."""

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
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..model.runtime.result import Result
from .errors import one_line
from .options import JsonOption, PlotOption, output_file
from .terminal import log, show


@dataclass(frozen=True, kw_only=True)
class ReportOptions:
    """The options of the output; an option that a command lacks has its default.

    Attributes:
        command: name of the command and of its picture module.
        plot: file of the picture.
        as_json: whether the result is printed as JSON.
    """

    command: str
    plot: PlotOption = None
    as_json: JsonOption = False

    def __post_init__(self):
        # A picture that cannot be written, or drawn, is reported before anything long begins.
        if self.plot:
            output_file(self.plot, "--plot", _pictures("").suffixes_of(self.command))
            if find_spec("matplotlib") is None:
                raise ModuleNotFoundError("nothing draws", name="matplotlib")

    def finish(self, result: Result, files: dict[str, tuple[Path, Callable[[Path], object]]] | None = None) -> None:
        """Print a result, write files of it, and draw it; whichever of these fails, the others are done.

        Args:
            result: the result.
            files: by a name of each file, its path and the function that writes it.

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
        module = _pictures(f".{self.command}")
        if path.suffix == _pictures("").FILM:
            module.film(result, path)
            paths = [path]
        else:
            paths = _pictures(".style").save_all(module.draw(result), path)
        for each in paths:
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
    """Make the folder of a file, or of a link's target."""
    try:
        Path(os.path.realpath(path)).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"{path}: cannot be written ({error.strerror})") from None


def _say(what: str, path: Path) -> None:
    log.print(one_line(f"{what}: {path}"), soft_wrap=True)


def _do_all(steps: Iterable[Callable[[], None]]) -> None:
    """Do every step, whichever of them fails.

    Raises:
        Exception: if one step fails, its error; if several do, the first one that is no OSError or RuntimeError.
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


def _pictures(name: str) -> Any:
    """Return a module of pictures by `.` and its name, the command's name.

    It is imported only if something is drawn: Matplotlib is slow, and commands of a board have no room `sim`.
    """
    # Pictures go to files, whatever draws the user's windows. What Matplotlib says of its own settings and folders is
    # not about the picture, and would stand between the lines of this program.
    os.environ["MPLBACKEND"] = "agg"
    logging.getLogger("matplotlib").setLevel(logging.CRITICAL)
    return import_module(f"..sim.pictures{name}", __package__)


OUTPUT = {field.name for field in fields(ReportOptions)}


def reports(*wanted: str, kind: type[ReportOptions] = ReportOptions) -> Callable[[Callable[..., None]], Callable]:
    """Return a decorator that makes a command of a function; the function's first argument is its shared options.

    Typer reads options from a signature alone, so the shared ones are added to it: written out, a command would have up
    to six parameters more, only to pass them on.

    Args:
        wanted: names of the shared options of the command; all commands have `as_json`, too.
        kind: the class of that value.
    """

    def command_of(function: Callable[..., None]) -> Callable[..., None]:
        name = function.__module__.rpartition(".")[2]
        known = [field for field in fields(kind) if field.name in (*wanted, "as_json")]
        # What a kind adds stands before the output in the help.
        known.sort(key=lambda field: field.name in OUTPUT)

        @functools.wraps(function)
        def command(**given: Any) -> None:
            function(kind(command=name, **{field.name: given.pop(field.name) for field in known}), **given)

        own = list(inspect.signature(function).parameters.values())[1:]
        keyword = inspect.Parameter.KEYWORD_ONLY
        added = [inspect.Parameter(each.name, keyword, default=each.default, annotation=each.type) for each in known]
        command.__signature__ = inspect.Signature([parameter.replace(kind=keyword) for parameter in own] + added)
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in own + added}
        return command

    return command_of
